//! Options of an import.

use super::NormalMode;
use super::files::limits::Limits;
use super::memory_watch::MemoryWatch;
use blinn_core::cancellation::CancelToken;
use blinn_scene::{SourceFormat, UpAxis};
use glam::DMat3;

/// Selects one of the file's scenes.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum SceneChoice {
    /// The file's default scene, or the first.
    #[default]
    Default,
    /// The scene with this name, or else with this index.
    Named(String),
}

/// The choice of transmissive meshes that bound bodies, which refract light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum GlassMode {
    /// Those with a volume, and closed meshes of files whose format or exporter implies refraction.
    #[default]
    Auto,
    /// None: all are thin walls.
    Thin,
    /// All.
    Solid,
}

/// The treatment of material nodes in .blend files that glTF has no form for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum BakeMode {
    /// They are left out, with a warning.
    Never,
    /// They are baked to images.
    Auto,
}

/// The encoding of colours in MTL files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum MtlColors {
    /// By the program that wrote the file: sRGB for those that are known to write it, else linear.
    #[default]
    Auto,
    /// Displayed values.
    Srgb,
    /// Linear light.
    Linear,
}

/// Options of [`load`](super::load). Serialised without what does not decide which scene is loaded.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct LoadOptions {
    /// Limits that are checked before memory is allocated.
    #[serde(skip)]
    pub limits: Limits,
    /// The file's format; detected if `None`.
    pub format: Option<SourceFormat>,
    /// The scene to load.
    pub scene: SceneChoice,
    /// The file's up axis. `None` is that of its format: +Z for STL and PLY, +Y for others.
    pub up: Option<UpAxis>,
    /// Factor of all lengths in the file; `None` is 1.
    pub scale: Option<f64>,
    /// Name of a material variant (KHR_materials_variants); `none` or `None` selects the default materials.
    pub variant: Option<String>,
    /// The encoding of colours in MTL files.
    pub mtl_colors: MtlColors,
    /// Source of the vertex normals.
    pub normals: NormalMode,
    /// The transmissive meshes that refract.
    pub glass: GlassMode,
    /// Material nodes of .blend files; `None` is the setting of the file's scene.
    pub bake: Option<BakeMode>,
    /// Texels on a side of baked images; `None` is the setting of the file's scene.
    pub bake_size: Option<u32>,
    /// Allows references to files outside the scene's folder.
    pub allow_outside: bool,
    /// Ends the import early. It decides nothing else.
    #[serde(skip)]
    pub cancel: CancelToken,
    /// Learns what memory the import needs, and may end it early. It decides nothing else.
    #[serde(skip)]
    pub memory: MemoryWatch,
}

impl LoadOptions {
    /// Returns the up axis of a file: that of its format unless it is set.
    pub(crate) fn up_axis(&self, format: SourceFormat) -> UpAxis {
        self.up.unwrap_or(UpAxis::of_format(format))
    }

    /// Returns the transform from the coordinates of a file to the scene's: the up axis and the scale.
    pub(crate) fn root_transform(&self, format: SourceFormat) -> DMat3 {
        self.up_axis(format).rotation() * self.scale.unwrap_or(1.0)
    }
}
