//! Arbitrary output variables: what lies behind a pixel's centre, one layer for each.
//!
//! To add one: a variant, its row in [`Aov::ALL`] and [`Aov::channels`], and its line in
//! [`Aov::evaluate`].

use glam::DVec3;

use super::{Frame, MaterialHitFilter, Sample, Scratch, SurfacePoint};
use crate::accel::{RayBatch, TraversalStats};
use crate::geometry::{Hit, Ray, Rgb};
use crate::integrator::material::coefficients::{alpha, base_color};
use crate::scene::AlphaMode;

/// A layer: one value for each pixel, of the first surface at the pixel's centre, never filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aov {
    /// Distance along −w in metres; +∞ where miss_value is hit.
    Depth,
    /// Shading normal, world, to the viewer's side.
    Normal,
    /// The same without normal maps.
    VertexNormal,
    /// The triangle's own normal.
    GeometricNormal,
    /// World position in metres.
    Position,
    /// Base colour × texture × vertex colour, linear.
    Albedo,
    /// Texture coordinates, set 0.
    Uv,
    /// 1 where anything is hit.
    Mask,
    /// Which object, from 1; 0 for none.
    ObjectId,
    /// Which material, from 1; 0 for none.
    MaterialId,
    /// What the eye ray cost: nodes and blocks of the trees that it looked into until its first hit was
    /// known. Counted where miss_value is hit, too.
    Steps,
}

impl Aov {
    /// All of them.
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

    /// Its name, and the names of its channels behind the dot.
    pub fn channels(self) -> (&'static str, &'static str) {
        match self {
            Aov::Depth => ("depth", "Z"),
            Aov::Normal => ("normal", "XYZ"),
            Aov::VertexNormal => ("vertex-normal", "XYZ"),
            Aov::GeometricNormal => ("geometric-normal", "XYZ"),
            Aov::Position => ("position", "XYZ"),
            Aov::Albedo => ("albedo", "RGB"),
            Aov::Uv => ("uv", "UV"),
            Aov::Mask => ("mask", "A"),
            Aov::ObjectId => ("object-id", "I"),
            Aov::MaterialId => ("material-id", "I"),
            Aov::Steps => ("steps", "NB"),
        }
    }

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.channels().0
    }

    /// Numbers a pixel.
    pub fn channel_count(self) -> usize {
        self.channels().1.len()
    }

    /// The layer of that name.
    pub fn by_name(name: &str) -> Option<Aov> {
        Aov::ALL.into_iter().find(|a| a.name() == name)
    }

    /// Whether its numbers count things.
    pub fn is_id(self) -> bool {
        matches!(self, Aov::ObjectId | Aov::MaterialId | Aov::Steps)
    }

    /// Its value where miss_value is hit.
    pub fn miss_value(self) -> f32 {
        if self == Aov::Depth { f32::INFINITY } else { 0.0 }
    }

    /// Appends its value at a first hit.
    pub fn evaluate(self, frame: &Frame, first: &FirstHit, out: &mut Vec<f32>) {
        if self == Aov::Steps {
            let TraversalStats { nodes, blocks } = first.steps(frame);
            return out.extend([nodes as f32, blocks as f32]);
        }
        let Some((hit, s)) = &first.surface else {
            out.extend(std::iter::repeat_n(self.miss_value(), self.channel_count()));
            return;
        };
        let vector = |out: &mut Vec<f32>, v: DVec3| out.extend(v.as_vec3().to_array());
        let turned = |n: DVec3| frame.scene_to_world.matrix3 * n;
        match self {
            Aov::Depth => out.push((f64::from(hit.t) * frame.camera.depth_per_t()) as f32),
            Aov::Normal => vector(out, turned(s.shading_normal(frame.posed))),
            Aov::VertexNormal => vector(out, turned(s.n_v)),
            Aov::GeometricNormal => vector(out, turned(s.n_g)),
            Aov::Position => {
                vector(out, frame.scene_to_world.transform_point3(s.p.as_dvec3() + frame.posed.centre))
            }
            Aov::Albedo => {
                let material = &frame.posed.materials[s.material as usize];
                let color: Rgb = base_color(frame.posed, material, &s.on);
                out.extend(color.to_array());
            }
            Aov::Uv => out.extend(s.on.uv(0).to_array()),
            Aov::Mask => out.push(1.0),
            Aov::ObjectId => out.push(frame.posed.scene.instances[s.id.instance as usize].object as f32),
            Aov::MaterialId => out.push((s.material + 1) as f32),
            // Has no need of a surface.
            Aov::Steps => {}
        }
    }
}

/// The first surface that alpha masks keep, whatever its opacity — but for places where its
/// alpha texture leaves miss_value at all: those are holes.
#[derive(Clone, Debug)]
pub struct FirstHit<'s> {
    sample: Sample,
    surface: Option<(Hit, SurfacePoint<'s>)>,
}

impl FirstHit<'_> {
    /// What the eye ray of its sample takes to its first hit.
    fn steps(&self, frame: &Frame) -> TraversalStats {
        let mut ray = RayBatch::default();
        frame.eye_rays(std::slice::from_ref(&self.sample), &mut ray);
        let counted = frame.accel.intersect_with_stats(&ray, &MaterialHitFilter(frame.posed));
        counted.first().map(|(_, steps)| *steps).unwrap_or_default()
    }
}

/// The first hits of eye rays through `samples`.
pub fn first_hits<'s>(frame: &Frame<'s>, samples: &[Sample], scratch: &mut Scratch) -> Vec<FirstHit<'s>> {
    frame.eye_rays(samples, &mut scratch.rays);
    let mut found: Vec<FirstHit> = samples.iter().map(|&sample| FirstHit { sample, surface: None }).collect();
    let mut whose: Vec<usize> = (0..samples.len()).collect();
    while !whose.is_empty() {
        frame.accel.intersect(&scratch.rays, &MaterialHitFilter(frame.posed), &mut scratch.hits);
        let mut behind = Vec::new();
        for (i, hit) in scratch.hits.iter().enumerate().filter(|(_, hit)| !hit.is_miss()) {
            let ray = Ray { o: scratch.rays.origins[i], d: scratch.rays.directions[i] };
            let surface = SurfacePoint::at(frame.posed, hit.id, ray);
            if is_hole(frame, &surface) {
                behind.push(i);
            } else {
                found[whose[i]].surface = Some((*hit, surface));
            }
        }
        scratch.rays.continue_behind(&behind, &scratch.hits);
        whose = behind.iter().map(|&i| whose[i]).collect();
    }
    found
}

/// Less of a surface than any 8-bit picture could show.
const NOTHING: f32 = 1.0 / 512.0;

fn is_hole(frame: &Frame, surface: &SurfacePoint) -> bool {
    let material = &frame.posed.materials[surface.material as usize];
    // A material that is transparent all over is there to be found.
    let left = || alpha(frame.posed, material, &surface.on);
    match material.alpha_mode {
        AlphaMode::Opaque => false,
        AlphaMode::Mask(_) => left() == 0.0,
        AlphaMode::Blend => material.alpha.factor > NOTHING && left() < NOTHING,
    }
}
