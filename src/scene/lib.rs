//! The scene as plain data: immutable, flat arrays indexed by `u32` ids, in the file's local frames.
//!
//! The scene knows no files, no BVHs and no pixels. [`pose`] evaluates it at a time and gives a
//! [`PosedScene`].
//!
//! Lengths are metres, angles radians, colours linear RGB (Rec. 709). The world is right-handed with
//! +Y up.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod animation;
mod area_light;
mod base_view;
mod blender_version;
mod camera;
mod camera_pose;
mod css_colors;
mod edge_marks;
mod emission;
mod environment;
mod file_camera;
mod file_digest;
mod file_environment;
mod file_settings;
mod framing;
mod ground;
mod light;
mod light_profile;
mod light_units;
mod lighting;
mod material;
mod material_inputs;
mod material_layers;
mod memory_size;
mod mesh;
mod node;
mod normalization;
mod opaque_triangles;
mod polygons;
mod resolve_view;
mod rig;
mod rounds;
mod select;
mod skin;

mod source;
mod spot_cone;
mod standard_view;
mod texture;
mod thin_lens;
mod turntable;
mod view;
mod view_rect;
mod view_sampling;

use std::sync::Arc;

pub use animation::animated_properties::{CameraProperty, LightProperty, MaterialProperty, TextureSlot};
pub use animation::bounds_cache::ClipBoundsCache;
pub use animation::keyframes::{Animation, Channel, ChannelTarget, Interpolation, Keyframes};
pub use animation::object_space::{ObjectSpace, ObjectSpaces};
pub use animation::playback::{AnimationChoice, PoseError, active_animations, clip_duration};
pub use animation::pose::{PoseSettings, pose};
pub use animation::posed_scene::{PosedInstance, PosedScene};
pub use area_light::{AreaLight, AreaLightShape, PosedAreaLight};
pub use blender_version::BlenderVersion;
pub use camera::{Camera, ClipPlanes, EyeRays, Projection};
pub use camera_pose::{CameraAxes, FARTHEST, NEGLIGIBLE, SimilarityTransform, is_homogeneous};
pub use css_colors::{color_names, named_color};
pub use edge_marks::EdgeMarks;
pub use environment::{CubeMap, Environment, Panorama, SkyIrradiance, SourceDirection};
pub use file_camera::{FileCamera, FileProjection, SensorFit};
pub use file_digest::FileDigest;
pub use file_digest::HashingReader;
pub use file_environment::{EnvironmentProperty, FileEnvironment};
pub use file_settings::{FileFrames, FileSettings, GAMMAS, PictureRegion};
pub use framing::{DEFAULT_VIEW_DIR, DEFAULT_YFOV};
pub use ground::{Ground, GroundKind};
pub use light::{Light, LightEval, LightKind, LightSample, LocalLight, PosedLight, PosedLightKind};
pub use light_profile::{LightProfile, Photometry};
pub use light_units::{LUMENS_PER_WATT, LightUnits};
pub use lighting::{LightSet, Lighting, ResolvedLighting, UserLight};
pub use material::{
    AlphaMode, Dielectric, Material, MtlReflectance, Reflectance, Reflection, SurfaceClass, Volume,
};
pub use material_inputs::{ColorInput, NormalMap, ScalarInput, TangentAxes};
pub use material_layers::{
    Anisotropy, AnisotropyModel, Clearcoat, DiffuseTransmission, Iridescence, Sheen, SheenModel,
};
pub use mesh::{DeformedMesh, GeneratedFrames, Influences, Mesh, MorphTarget, uvs_at};
pub use node::unit_quaternion;
pub use node::{Instance, LocalTransform, Node, PackedTrs};
pub use normalization::{Normalization, UnitShape};
pub use opaque_triangles::OpaqueTriangles;
pub use polygons::Polygons;
pub use resolve_view::ViewNotes;
pub use rig::{Rig, headlight, studio_before, three_point};
pub use rounds::Rounds;
pub use select::{Glob, NoMatch, Selection};
pub use skin::Skin;
pub use source::{Source, SourceFile, SourceFormat, UpAxis, is_blender_generator};
pub use spot_cone::SpotCone;
pub use standard_view::{StandardView, orthographic_camera, projected_extent};
pub use texture::anisotropic::Footprint;
pub use texture::batch::SampleCoords;
pub use texture::image::Image;
pub use texture::mips::MipMaps;
pub use texture::sampling::{Texture, TextureFilter, TextureRef};
pub use texture::srgb::{linear_to_srgb, linear_to_srgb8, srgb_to_linear};
pub use texture::texels::{Channels, TexelSemantics, Texels, TextureChannel};
pub use texture::uv_transform::UvTransform;
pub use texture::wrap::Wrap;
pub use thin_lens::ThinLens;
pub use turntable::AxisRotation;
pub use view::{Focus, Orbit, OrbitAngles, View, ViewError};
pub use view_rect::{Intrinsics, ViewRect};
pub use view_sampling::{
    DEFAULT_BASELINE, DistanceRange, LightRotation, SampledDistance, SampledView, StereoEye, ViewLayout,
    ViewSampling, icosphere,
};

/// A scene as its file describes it. Ids are indices into the arrays.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// File name without folder and extension.
    pub name: String,
    /// Format, generator and files.
    pub source: Source,
    /// Nodes in depth-first order: parents before children.
    pub nodes: Vec<Node>,
    /// Meshes of triangles, points or lines with one material each. Instances share them.
    pub meshes: Vec<Mesh>,
    /// Meshes drawn at nodes.
    pub instances: Vec<Instance>,
    /// Object names. [`Instance::object`] counts them from 1.
    pub objects: Vec<String>,
    /// Materials. Every mesh has one.
    pub materials: Vec<Material>,
    /// Textures: images with wrap modes and filter.
    pub textures: Vec<Texture>,
    /// Decoded images.
    pub images: Vec<Image>,
    /// Lights at nodes.
    pub lights: Vec<Light>,
    /// Profiles of photometric lights.
    pub light_profiles: Vec<Arc<LightProfile>>,
    /// Area lights at nodes.
    pub area_lights: Vec<AreaLight>,
    /// Empty nodes that were probably area lights, which Blender's exporter does not write.
    pub lost_lights: Vec<u32>,
    /// The environment that lights the scene.
    pub environment: Option<FileEnvironment>,
    /// Cameras at nodes, in depth-first order.
    pub cameras: Vec<FileCamera>,
    /// Render settings of the file.
    pub settings: FileSettings,
    /// Animations.
    pub animations: Vec<Animation>,
    /// Skins.
    pub skins: Vec<Skin>,
}

impl Scene {
    /// Returns the number of triangles over all instances.
    pub fn instanced_triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].triangles.len() as u64).sum()
    }

    /// Returns the number of points over all instances.
    pub fn instanced_point_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].point_count() as u64).sum()
    }

    /// Returns the number of line segments over all instances.
    pub fn instanced_line_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].lines().len() as u64).sum()
    }

    /// Returns the intensity of a light in its brightest direction, in the file's unit.
    pub fn peak_intensity(&self, light: &Light) -> f32 {
        match self.light_profile(light) {
            Some(profile) => light.intensity * profile.peak(),
            None => light.intensity,
        }
    }

    /// Returns the profile of a photometric light.
    pub fn light_profile(&self, light: &Light) -> Option<&LightProfile> {
        match light.kind {
            LightKind::Photometric { profile } => {
                self.light_profiles.get(profile as usize).map(|profile| &**profile)
            }
            _ => None,
        }
    }

    /// Returns the names of the empty nodes that were probably area lights.
    pub fn lost_light_names(&self) -> Vec<String> {
        self.lost_lights.iter().map(|&node| self.nodes[node as usize].name.clone()).collect()
    }

    /// Returns the index of the camera that pictures are taken with unless another is named: the one that the file marks,
    /// else the first.
    pub fn default_camera(&self) -> Option<usize> {
        let marked = self.settings.camera.filter(|&camera| camera < self.cameras.len());
        marked.or((!self.cameras.is_empty()).then_some(0))
    }

    /// Returns the index of the first camera whose node, or else whose own name, is `name`. If no name
    /// matches, reads `name` as an index.
    pub fn find_camera(&self, name: &str) -> Option<usize> {
        let by_node = |c: &FileCamera| self.nodes[c.node as usize].name == name;
        let by_own_name = |c: &FileCamera| c.name == name;
        let cameras = || self.cameras.iter();
        cameras()
            .position(by_node)
            .or_else(|| cameras().position(by_own_name))
            .or_else(|| name.parse().ok().filter(|&i| i < self.cameras.len()))
    }
}
