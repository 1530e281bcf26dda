//! Arbitrary output variables (AOVs): one layer of numbers for each, of the first surface at a pixel's centre.
//!
//! To add one: a variant, its row in [`Aov::ALL`], its name and channels, and its case in [`Aov::evaluate`].

use glam::DVec3;

use crate::accel::{RayBatch, TraversalStats};
use crate::geometry::{Hit, Rgb};
use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::material::opacity::{base_color, opacity};
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRays};
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::scene::AlphaMode;

/// A layer: values of the first surface at each pixel's centre, never filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
}

impl Aov {
    /// All layers.
    pub const ALL: [Aov; 11] = [
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
        }
    }

    /// Names of its channels, one letter for each.
    pub fn channels(self) -> &'static str {
        match self {
            Aov::Depth => "Z",
            Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal | Aov::Position => "XYZ",
            Aov::Albedo => "RGB",
            Aov::Uv => "UV",
            Aov::Mask => "A",
            Aov::ObjectId | Aov::MaterialId => "I",
            // Nodes and blocks of triangles.
            Aov::Steps => "NB",
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

    /// True for whole numbers: identifiers and counts.
    pub fn is_id(self) -> bool {
        matches!(self, Aov::ObjectId | Aov::MaterialId | Aov::Steps)
    }

    /// Value where no surface is hit.
    pub fn miss_value(self) -> f32 {
        if self == Aov::Depth { f32::INFINITY } else { 0.0 }
    }

    /// Appends the values at a first hit.
    pub fn evaluate(self, frame: &Frame, first: &FirstHit, out: &mut Vec<f32>) {
        if self == Aov::Steps {
            let TraversalStats { nodes, blocks } = first.traversal_stats(frame);
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
        match self {
            Aov::Depth => out.push((f64::from(hit.t) * frame.camera.depth_per_t()) as f32),
            Aov::Normal => normal(out, surface.shading_normal(posed)),
            Aov::VertexNormal => normal(out, surface.n_v),
            Aov::GeometricNormal => normal(out, surface.n_g),
            Aov::Position => vector(out, to_world.transform_point3(surface.p.as_dvec3() + posed.centre)),
            Aov::Albedo => {
                let material = &posed.materials[surface.material as usize];
                let color: Rgb = base_color(posed, material, &surface.ctx);
                out.extend(color.to_array());
            }
            Aov::Uv => out.extend(surface.ctx.uv(0).to_array()),
            Aov::Mask => out.push(1.0),
            Aov::ObjectId => out.push(posed.scene.instances[surface.id.instance as usize].object as f32),
            Aov::MaterialId => out.push((surface.material + 1) as f32),
            // Handled above, because it needs no surface.
            Aov::Steps => {}
        }
    }
}

/// The first surface along an eye ray. Alpha masks and the fully transparent texels of a blended material are holes; a
/// surface that is partly transparent counts.
#[derive(Clone, Debug)]
pub struct FirstHit<'s> {
    sample: Sample,
    surface: Option<(Hit, SurfacePoint<'s>)>,
}

impl FirstHit<'_> {
    /// Cost of the eye ray up to its first hit. Traces the ray again, because only this layer counts the steps.
    fn traversal_stats(&self, frame: &Frame) -> TraversalStats {
        let mut ray = RayBatch::default();
        frame.generate_eye_rays(std::slice::from_ref(&self.sample), &mut ray);
        let hits = frame.accel.intersect_with_stats(&ray, &MaterialHitFilter(frame.posed));
        hits.first().map(|(_, stats)| *stats).unwrap_or_default()
    }
}

/// The first hits of the eye rays of `samples`.
pub fn first_hits<'s>(frame: &Frame<'s>, samples: &[Sample], scratch: &mut Scratch) -> Vec<FirstHit<'s>> {
    let mut first: Vec<FirstHit> = samples.iter().map(|&sample| FirstHit { sample, surface: None }).collect();
    let mut rays = PathRays::new(frame, samples, &mut scratch.rays, &mut scratch.hits);
    for _ in 0..MAX_SURFACES_PER_RAY {
        rays.intersect(frame);
        for eye in rays.iter().filter(|eye| !eye.hit.is_miss()) {
            let surface = SurfacePoint::at(frame.posed, eye.hit.id, eye.ray);
            if !is_hole(frame, &surface) {
                first[eye.path].surface = Some((eye.hit, surface));
            }
        }
        rays.continue_behind(|sample| first[sample].surface.is_none());
        if rays.is_empty() {
            break;
        }
    }
    first
}

/// Less opacity than an 8-bit picture can show.
const MIN_OPACITY: f32 = 1.0 / 512.0;

/// True where a texture makes a surface fully transparent.
fn is_hole(frame: &Frame, surface: &SurfacePoint) -> bool {
    let material = &frame.posed.materials[surface.material as usize];
    let opacity = || opacity(frame.posed, material, &surface.ctx);
    match material.alpha_mode {
        AlphaMode::Opaque => false,
        AlphaMode::Mask(_) => opacity() == 0.0,
        // A material that is transparent everywhere is an object nevertheless.
        AlphaMode::Blend => material.alpha.factor > MIN_OPACITY && opacity() < MIN_OPACITY,
    }
}
