//! What a file says, as plain data: immutable, flat arrays with `u32` ids, in the file's own
//! local frames. Nothing here knows files, trees of boxes or pixels.
//!
//! Lengths are metres, angles radians, colours linear RGB (Rec. 709). The world is right-handed
//! with +Y up.

mod animation;
mod camera;
mod file_digest;
mod framing;
mod ground;
mod light;
mod material;
mod memory_size;
mod mesh;
mod node;
mod opaque_triangles;
mod rig;
mod select;
mod skin;
mod sky;
mod texture;
mod turntable;

pub use animation::animated_properties::{CameraProperty, LightProperty, MaterialProperty, TextureSlot};
pub use animation::clip::{ClipBoundsCache, clip_duration};
pub use animation::deform::DeformedMesh;
pub use animation::keyframes::{Animation, Channel, ChannelTarget, Interpolation, Keyframes};
pub use animation::pose::{
    AnimationChoice, PoseError, PoseSettings, PosedInstance, PosedScene, active_animations, pose,
};
pub use animation::tangent_frames::GeneratedFrames;
pub use camera::{Camera, ClipPlanes, Orbit, OrbitAngles, Projection, SensorFit, View, ViewError};
pub use file_digest::FileDigest;
pub(crate) use file_digest::HashingReader;
pub use framing::{DEFAULT_VIEW_DIR, DEFAULT_YFOV, ViewNotes};
pub use ground::{Ground, GroundKind};
pub use light::{
    Light, LightEval, LightKind, LightSample, LightUnits, LocalLight, PosedLight, PosedLightKind, SpotCone,
};
pub use material::{
    AlphaMode, ColorInput, Dielectric, Material, MtlReflectance, NormalMap, Reflectance, ScalarInput,
    SurfaceClass, TextureChannel,
};
pub use mesh::{Influences, Mesh, MorphTarget};
pub(crate) use node::rotation;
pub use node::{Instance, LocalTransform, Node, PackedTrs};
pub use opaque_triangles::OpaqueTriangles;
pub use rig::{LightSet, Lighting, ResolvedLighting, Rig, UserLight, headlight, three_point};
pub use select::{Glob, NoMatch, Selection};
pub use skin::Skin;
pub use sky::SkyIrradiance;
pub use texture::anisotropic::Footprint;
pub(crate) use texture::batch::SampleCoords;
pub use texture::image::{Channels, Image, Texels};
pub use texture::mips::{MipMaps, TexelSemantics};
pub use texture::sampling::{Texture, TextureFilter, TextureRef, UvTransform, Wrap};
pub use texture::srgb::{linear_to_srgb, linear_to_srgb8, srgb_to_linear};
pub use turntable::AxisRotation;

/// The format a scene came in, for the defaults that depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SourceFormat {
    /// glTF 2.0, `.gltf` or `.glb`.
    #[default]
    Gltf,
    /// Wavefront OBJ.
    Obj,
}

/// Where a scene came from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// The file format.
    pub format: SourceFormat,
    /// The program that wrote it, as the file says (`asset.generator`, or an OBJ's first comment).
    pub generator: String,
    /// glTF extensions named by the file, in its order.
    pub extensions: Vec<String>,
    /// Scenes in the file, by name.
    pub scenes: Vec<String>,
    /// What was in the scene's own file.
    pub digest: FileDigest,
    /// Files that it refers to, whether they are there or not.
    pub files: Vec<SourceFile>,
    /// Names of material variants.
    pub variants: Vec<String>,
}

/// A file that a scene refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Its name relative to the scene's own folder.
    pub name: String,
    /// What was in it.
    pub digest: FileDigest,
}

impl Source {
    /// The names of the files that it refers to.
    pub fn file_names(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|file| file.name.as_str())
    }

    /// True for files written by Blender's exporters.
    pub fn is_blender(&self) -> bool {
        self.generator.contains("Blender") || self.generator.contains("blender")
    }
}

/// A camera of the file: a projection that a node carries.
#[derive(Clone, Debug)]
pub struct FileCamera {
    /// The camera's own name.
    pub name: String,
    /// The node that it looks from, down its −Z.
    pub node: u32,
    /// Its view.
    pub projection: FileProjection,
    /// Distance of the near plane along the view.
    pub znear: f64,
    /// Distance of the far plane; infinite where the file gives none.
    pub zfar: f64,
}

/// The projection of a camera in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileProjection {
    /// Vertical field of view in radians; width over height where the file says so.
    Perspective {
        /// Full vertical angle.
        yfov: f64,
        /// Width over height.
        aspect: Option<f64>,
    },
    /// Half extents in metres.
    Orthographic {
        /// Half the width.
        xmag: f64,
        /// Half the height.
        ymag: f64,
    },
}

/// A scene as its file describes it. Ids are indices into the arrays here.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The file's name without folder and ending.
    pub name: String,
    /// SourceFormat, generator and the like.
    pub source: Source,
    /// Nodes, parents before children, in the order of a depth-first walk.
    pub nodes: Vec<Node>,
    /// Triangle meshes, each of one material; stored once however often they are drawn.
    pub meshes: Vec<Mesh>,
    /// What is drawn: a mesh at a node.
    pub instances: Vec<Instance>,
    /// Names of the objects that [`Instance::object`] counts, from object 1 on.
    pub objects: Vec<String>,
    /// Materials; every mesh has one.
    pub materials: Vec<Material>,
    /// Textures: an image with its wrapping and filter.
    pub textures: Vec<Texture>,
    /// Decoded images.
    pub images: Vec<Image>,
    /// Lights at nodes.
    pub lights: Vec<Light>,
    /// Cameras at nodes, in the order of a depth-first walk.
    pub cameras: Vec<FileCamera>,
    /// Animations.
    pub animations: Vec<Animation>,
    /// Skins.
    pub skins: Vec<Skin>,
}

impl Scene {
    /// Triangles as drawn, each instance counted.
    pub fn instanced_triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].triangles.len() as u64).sum()
    }

    /// The camera called `name` — by its node or its own name, the first that matches — or, where
    /// no name matches, the one with that index in the walk.
    pub fn find_camera(&self, name: &str) -> Option<usize> {
        let by_node = |c: &FileCamera| self.nodes[c.node as usize].name == name;
        let by_own = |c: &FileCamera| c.name == name;
        let cameras = || self.cameras.iter();
        cameras()
            .position(by_node)
            .or_else(|| cameras().position(by_own))
            .or_else(|| name.parse().ok().filter(|&i| i < self.cameras.len()))
    }
}
