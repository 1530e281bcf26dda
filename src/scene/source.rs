//! Where a scene was loaded from: format, generator, and digests of the files that were read.

use glam::{DMat3, DVec3};

use super::{BlenderVersion, FileDigest, LightUnits};

/// The file format of a scene. Some defaults depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize)]
pub enum SourceFormat {
    /// glTF 2.0, `.gltf` or `.glb`.
    #[default]
    Gltf,
    /// Wavefront OBJ.
    Obj,
    /// Stereolithography, text or binary.
    Stl,
    /// The Stanford polygon format, text or binary.
    Ply,
}

/// The up axis of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum UpAxis {
    /// +Y: coordinates are used as stored.
    #[default]
    Y,
    /// +Z: (x, y, z) becomes (x, z, −y) for everything in the file.
    Z,
}

impl UpAxis {
    /// Returns the usual up axis of a format: +Z for STL and PLY, +Y for others.
    pub fn of_format(format: SourceFormat) -> UpAxis {
        match format {
            SourceFormat::Gltf | SourceFormat::Obj => UpAxis::Y,
            SourceFormat::Stl | SourceFormat::Ply => UpAxis::Z,
        }
    }

    /// Returns the rotation from the file's coordinates to +Y up.
    pub fn rotation(self) -> DMat3 {
        match self {
            UpAxis::Y => DMat3::IDENTITY,
            UpAxis::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
        }
    }

    /// Returns the size of a box of the scene along the axes of the file.
    pub fn size_in_file(self, size: DVec3) -> DVec3 {
        match self {
            UpAxis::Y => size,
            UpAxis::Z => DVec3::new(size.x, size.z, size.y),
        }
    }

    /// Returns the name of the axis.
    pub fn name(self) -> &'static str {
        match self {
            UpAxis::Y => "y",
            UpAxis::Z => "z",
        }
    }
}

/// The source of a scene.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// File format.
    pub format: SourceFormat,
    /// The axis of the file that points up. The scene's is +Y.
    pub up: UpAxis,
    /// Program that wrote the file (`asset.generator`, or the first comment of an OBJ).
    pub generator: String,
    /// glTF extensions named by the file, in file order.
    pub extensions: Vec<String>,
    /// Names of the scenes in the file.
    pub scenes: Vec<String>,
    /// Digest of the scene file itself.
    pub digest: FileDigest,
    /// Files that the scene refers to, whether they exist or not.
    pub files: Vec<SourceFile>,
    /// Unit of the light intensities, where the file names it.
    pub light_units: Option<LightUnits>,
    /// Number of the vertices of an OBJ or PLY file that no face, line or point uses. They are not drawn.
    pub loose_vertices: u64,
    /// Names of the material variants (KHR_materials_variants).
    pub variants: Vec<String>,
}

/// A file that a scene refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Path relative to the folder of the scene file.
    pub name: String,
    /// Digest of its bytes.
    pub digest: FileDigest,
}

impl Source {
    /// Returns the names of the files that the scene refers to.
    pub fn file_names(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|file| file.name.as_str())
    }

    /// Returns true if one of Blender's exporters wrote the file.
    pub fn is_blender(&self) -> bool {
        is_blender_generator(&self.generator)
    }

    /// Returns the version of Blender that wrote the file, if the file names it.
    pub fn blender_version(&self) -> Option<BlenderVersion> {
        BlenderVersion::from_generator(&self.generator)
    }
}

/// Returns true if a generator is one of Blender's exporters.
pub fn is_blender_generator(generator: &str) -> bool {
    generator.contains("Blender") || generator.contains("blender")
}
