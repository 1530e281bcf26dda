//! Arbitrary output variables (AOVs): one layer of numbers for each, of the first surface at a pixel's centre, or of the light
//! of the picture.
//!
//! To add one, follow the steps in CONTRIBUTING.md: some are in other files, and the compiler does not report those.

use glam::DVec3;

use crate::integrator::first_hit::FirstHit;
use crate::integrator::frame::Frame;
use crate::integrator::light_layers::LightLayer;
use crate::integrator::material::opacity::base_color;
use blinn_accel::TraversalStats;
use blinn_core::geometry::{HitId, Rgb};
use blinn_scene::ObjectSpaces;

/// A layer: values of the first surface at each pixel's centre, never filtered; or a part of the picture's light, linear RGB
/// premultiplied by alpha, of all samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
pub enum Aov {
    /// Distance along −w in metres; +∞ without a hit.
    Depth,
    /// Shading normal, world space, unit length, on the viewer's side.
    Normal,
    /// Shading normal before normal maps.
    VertexNormal,
    /// Normal of the triangle.
    GeometricNormal,
    /// World position in metres.
    Position,
    /// Base colour × texture × vertex colour, linear RGB.
    Albedo,
    /// Texture coordinates, set 0.
    Uv,
    /// 1 where anything is hit.
    Mask,
    /// Number of the object, from 1; 0 without a hit.
    ObjectId,
    /// Number of the material, from 1; 0 without a hit.
    MaterialId,
    /// Cost of the eye ray up to its first hit, or its miss: BVH nodes and leaf blocks tested.
    Steps,
    /// Distance along the eye ray in metres; +∞ without a hit.
    Distance,
    /// Shading normal in camera space: x to the right, y upward, z backward.
    CameraNormal,
    /// Position in camera space in metres.
    CameraPosition,
    /// Normalised object coordinates: the point in the rest shape of its object, in 0…1.
    Nocs,
    /// Flow to the next frame: pixels to the right and downward, and 1 where the next frame sees the point.
    FlowForward,
    /// Flow to the previous frame, in the same form.
    FlowBackward,
    /// Barycentric coordinates of the triangle's three corners.
    Barycentric,
    /// Number of the triangle, point or line in its object, from 1; 0 without a hit. An id with all bits: see [`Aov::id`].
    TriangleId,
    /// Light of light sources and glowing surfaces that matte surfaces reflect.
    DiffuseDirect,
    /// Ambient light and light of other surfaces that matte surfaces reflect.
    DiffuseIndirect,
    /// Light of light sources and glowing surfaces that specular lobes reflect or transmit.
    SpecularDirect,
    /// Light of other surfaces and of the environment that specular lobes reflect or transmit.
    SpecularIndirect,
    /// Light that surfaces emit, and colours of unlit ones.
    Emission,
    /// Light of the background.
    Environment,
}

impl Aov {
    /// All layers.
    pub const ALL: [Aov; 25] = [
        Aov::Depth,
        Aov::Normal,
        Aov::VertexNormal,
        Aov::GeometricNormal,
        Aov::Position,
        Aov::Albedo,
        Aov::Uv,
        Aov::Mask,
        Aov::ObjectId,
        Aov::MaterialId,
        Aov::Steps,
        Aov::Distance,
        Aov::CameraNormal,
        Aov::CameraPosition,
        Aov::Nocs,
        Aov::FlowForward,
        Aov::FlowBackward,
        Aov::Barycentric,
        Aov::TriangleId,
        Aov::DiffuseDirect,
        Aov::DiffuseIndirect,
        Aov::SpecularDirect,
        Aov::SpecularIndirect,
        Aov::Emission,
        Aov::Environment,
    ];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Depth => "depth",
            Aov::Normal => "normal",
            Aov::VertexNormal => "vertex-normal",
            Aov::GeometricNormal => "geometric-normal",
            Aov::Position => "position",
            Aov::Albedo => "albedo",
            Aov::Uv => "uv",
            Aov::Mask => "mask",
            Aov::ObjectId => "object-id",
            Aov::MaterialId => "material-id",
            Aov::Steps => "steps",
            Aov::Distance => "distance",
            Aov::CameraNormal => "camera-normal",
            Aov::CameraPosition => "camera-position",
            Aov::Nocs => "nocs",
            Aov::FlowForward => "flow-forward",
            Aov::FlowBackward => "flow-backward",
            Aov::Barycentric => "barycentric",
            Aov::TriangleId => "triangle-id",
            Aov::DiffuseDirect => "diffuse-direct",
            Aov::DiffuseIndirect => "diffuse-indirect",
            Aov::SpecularDirect => "specular-direct",
            Aov::SpecularIndirect => "specular-indirect",
            Aov::Emission => "emission",
            Aov::Environment => "environment",
        }
    }

    /// Names of its channels, one letter for each.
    pub fn channels(self) -> &'static str {
        match self {
            Aov::Depth => "Z",
            Aov::Distance => "D",
            Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal | Aov::Position => "XYZ",
            Aov::CameraNormal | Aov::CameraPosition | Aov::Nocs => "XYZ",
            Aov::Albedo => "RGB",
            Aov::Uv => "UV",
            Aov::Mask => "A",
            Aov::ObjectId | Aov::MaterialId | Aov::TriangleId => "I",
            // Nodes and leaf blocks.
            Aov::Steps => "NB",
            // V is the visibility.
            Aov::FlowForward | Aov::FlowBackward => "XYV",
            Aov::Barycentric => "UVW",
            Aov::DiffuseDirect | Aov::DiffuseIndirect | Aov::SpecularDirect | Aov::SpecularIndirect => "RGB",
            Aov::Emission | Aov::Environment => "RGB",
        }
    }

    /// Numbers per pixel.
    pub fn channel_count(self) -> usize {
        self.channels().len()
    }

    /// The layer of that name.
    pub fn by_name(name: &str) -> Option<Aov> {
        Aov::ALL.into_iter().find(|a| a.name() == name)
    }

    /// The light that the layer holds; `None` for layers of the first surface.
    pub fn light(self) -> Option<LightLayer> {
        match self {
            Aov::DiffuseDirect => Some(LightLayer::DiffuseDirect),
            Aov::DiffuseIndirect => Some(LightLayer::DiffuseIndirect),
            Aov::SpecularDirect => Some(LightLayer::SpecularDirect),
            Aov::SpecularIndirect => Some(LightLayer::SpecularIndirect),
            Aov::Emission => Some(LightLayer::Emission),
            Aov::Environment => Some(LightLayer::Environment),
            _ => None,
        }
    }

    /// True for whole numbers: identifiers and counts.
    pub fn is_id(self) -> bool {
        matches!(self, Aov::ObjectId | Aov::MaterialId | Aov::Steps | Aov::TriangleId)
    }

    /// The whole number that a value of a layer with [`Aov::is_id`] stands for. Triangle ids are stored as the bits of
    /// the value, because an object may have more triangles than floats count.
    pub fn id(self, value: f32) -> u32 {
        if self == Aov::TriangleId { value.to_bits() } else { value as u32 }
    }

    /// True for layers that need the frames before and after.
    pub fn is_flow(self) -> bool {
        matches!(self, Aov::FlowForward | Aov::FlowBackward)
    }

    /// True for layers that need the [`ObjectSpaces`] of the scene.
    pub fn needs_object_spaces(self) -> bool {
        matches!(self, Aov::Nocs | Aov::TriangleId)
    }

    /// True for distances, which are +∞ without a hit.
    pub fn is_distance(self) -> bool {
        matches!(self, Aov::Depth | Aov::Distance)
    }

    /// True for unit vectors.
    pub fn is_normal(self) -> bool {
        use Aov::{CameraNormal, GeometricNormal, Normal, VertexNormal};
        matches!(self, Normal | VertexNormal | GeometricNormal | CameraNormal)
    }

    /// Value where no surface is hit.
    pub fn miss_value(self) -> f32 {
        if self.is_distance() { f32::INFINITY } else { 0.0 }
    }

    /// Appends the values at a first hit; 0 for layers of light. `spaces` are those of the scene, if [`Aov::needs_object_spaces`].
    pub fn evaluate(
        self,
        frame: &Frame,
        spaces: Option<&ObjectSpaces>,
        first: &FirstHit,
        out: &mut Vec<f32>,
    ) {
        if self.light().is_some() {
            // `render_light_layers` averages light over all samples.
            return out.extend([0.0; 3]);
        }
        if self == Aov::Steps {
            let TraversalStats { nodes, blocks, .. } = first.traversal_stats(frame);
            return out.extend([nodes as f32, blocks as f32]);
        }
        let Some((hit, surface)) = &first.surface else {
            out.extend(std::iter::repeat_n(self.miss_value(), self.channel_count()));
            return;
        };
        let posed = frame.posed;
        let to_world = frame.scene_to_world;
        let vector = |out: &mut Vec<f32>, v: DVec3| out.extend(v.as_vec3().to_array());
        let normal = |out: &mut Vec<f32>, n: DVec3| vector(out, to_world.matrix3 * n);
        let point = || surface.p.as_dvec3() + posed.centre;
        match self {
            Aov::Depth => out.push((f64::from(hit.t) * frame.camera.depth_per_t()) as f32),
            Aov::Distance => out.push((f64::from(hit.t) * first.direction(frame).length()) as f32),
            Aov::Normal => normal(out, surface.shading_normal(posed)),
            Aov::VertexNormal => normal(out, surface.n_v),
            Aov::GeometricNormal => normal(out, surface.n_g),
            Aov::CameraNormal => {
                let axes = frame.camera.basis;
                let n = surface.shading_normal(posed);
                vector(out, DVec3::new(n.dot(axes.u), n.dot(axes.v), n.dot(axes.w)).normalize_or_zero());
            }
            Aov::Position => vector(out, to_world.transform_point3(point())),
            Aov::CameraPosition => vector(out, frame.camera.to_camera(point())),
            Aov::Albedo => {
                let material = &posed.materials[surface.material as usize];
                let color: Rgb = base_color(posed, material, &surface.ctx);
                out.extend(color.to_array());
            }
            Aov::Uv => out.extend(surface.ctx.uv(0).to_array()),
            Aov::Mask => out.push(1.0),
            Aov::ObjectId => out.push(posed.scene.instances[surface.id.instance as usize].object as f32),
            Aov::MaterialId => out.push((surface.material + 1) as f32),
            Aov::Nocs => {
                let object = posed.scene.instances[surface.id.instance as usize].object;
                let space = spaces.and_then(|spaces| spaces.object(object));
                let p = surface.ctx.interpolate(&posed.mesh(surface.id.instance).positions);
                vector(out, space.map_or(DVec3::ZERO, |space| space.normalized(p)));
            }
            Aov::FlowForward => out.extend(first.flow.forward),
            Aov::FlowBackward => out.extend(first.flow.backward),
            Aov::Barycentric => out.extend(surface.ctx.coords.b),
            Aov::TriangleId => {
                let HitId { instance, triangle } = surface.id;
                let number = spaces.map_or(triangle, |spaces| spaces.primitive_in_object(instance, triangle));
                out.push(f32::from_bits(number.saturating_add(1)));
            }
            // Handled above, because it needs no surface.
            Aov::Steps => {}
            Aov::DiffuseDirect | Aov::DiffuseIndirect | Aov::SpecularDirect | Aov::SpecularIndirect => {}
            Aov::Emission | Aov::Environment => {}
        }
    }
}
