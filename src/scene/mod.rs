//! What a file says, as plain data: immutable, flat arrays with `u32` ids, in the file's own
//! local frames. Nothing here knows files, trees of boxes or pixels.
//!
//! Lengths are metres, angles radians, colours linear RGB (Rec. 709). The world is right-handed
//! with +Y up.

mod animation;
mod camera;
mod content;
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
mod turn;

pub use animation::animated_properties::{CameraField, LightField, MaterialField, Slot};
pub use animation::clip::{OverClip, clip_end};
pub use animation::deform::Deformed;
pub use animation::keyframes::{Animation, Channel, Interpolation, Keys, Target};
pub use animation::pose::{
    AnimationChoice, PoseError, PoseSettings, PosedInstance, PosedScene, playing, pose,
};
pub use animation::tangent_frames::Made;
pub use camera::{Camera, Clip, Fit, Orbit, Projection, View, ViewError};
pub use content::Content;
pub(crate) use content::Hashing;
pub use framing::{DEFAULT_VIEW_DIR, DEFAULT_YFOV, ViewNotes};
pub use ground::{Ground, GroundKind};
pub use light::{Cone, Incident, Lamp, Light, LightKind, LightUnits, PosedKind, PosedLight, Way};
pub use material::{
    AlphaMode, Channel4, ColorInput, Dielectric, Material, MtlReflectance, NormalMap, Reflectance,
    ScalarInput, SurfaceClass,
};
pub use mesh::{Influences, Mesh, MorphTarget};
pub(crate) use node::rotation;
pub use node::{Instance, Local, Node, Placement};
pub use opaque_triangles::Solid;
pub use rig::{GivenLight, LightSource, Lighting, Lit, Rig, headlight, three_point};
pub use select::{Glob, NothingFound, Selection};
pub use skin::Skin;
pub use sky::Sky;
pub use texture::anisotropic::Footprint;
pub(crate) use texture::batch::Places;
pub use texture::image::{Channels, Image, Texels};
pub use texture::mips::{Mips, Reading};
pub use texture::sampling::{Filter, Texture, TextureRef, UvTransform, Wrap};
pub use texture::srgb::{linear_to_srgb, linear_to_srgb8, srgb_to_linear};
pub use turn::Turn;

/// The format a scene came in, for the defaults that depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Format {
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
    pub format: Format,
    /// The program that wrote it, as the file says (`asset.generator`, or an OBJ's first comment).
    pub generator: String,
    /// glTF extensions named by the file, in its order.
    pub extensions: Vec<String>,
    /// Scenes in the file, by name.
    pub scenes: Vec<String>,
    /// What was in the scene's own file.
    pub content: Content,
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
    pub content: Content,
}

impl Source {
    /// The names of the files that it refers to.
    pub fn names(&self) -> impl Iterator<Item = &str> {
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
    /// Format, generator and the like.
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
    pub fn drawn_triangles(&self) -> u64 {
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
