//! Cryptomatte's measure: how much of each thing an eye ray sees.
//!
//! A surface counts by what it trace_mattes of what is still open behind those before it: alpha alone.
//! So a blended pane shares its pixels with what is behind it, and glass — transmission — is a
//! thing of its own that trace_mattes the rest. Cycles weighs both in the same way.

use super::{Frame, MaterialHitFilter, Sample, Scratch, SurfacePoint};
use crate::geometry::Ray;
use crate::integrator::material::coefficients::alpha;

/// What is told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MatteKind {
    /// Objects, as in [`super::Aov::ObjectId`].
    Object,
    /// Materials.
    Material,
}

impl MatteKind {
    /// Both.
    pub const ALL: [MatteKind; 2] = [MatteKind::Object, MatteKind::Material];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            MatteKind::Object => "object",
            MatteKind::Material => "material",
        }
    }
}

/// A part of what a sample sees: a surface, and how much of the sample it trace_mattes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatteCoverage {
    /// Which object, from 1; 0 for what is none.
    pub object: u32,
    /// Which material, from 1.
    pub material: u32,
    /// More than 0; a sample's trace_mattes are 1 together at most.
    pub coverage: f32,
}

impl MatteCoverage {
    /// Which one of a kind, from 1; 0 for none.
    pub fn id(&self, kind: MatteKind) -> u32 {
        match kind {
            MatteKind::Object => self.object,
            MatteKind::Material => self.material,
        }
    }
}

/// Surfaces along one eye ray that are looked through before the rest is let go.
const MAX_LAYERS: usize = 4096;

/// Calls `tell` with each sample's trace_mattes: sample by sample for every layer of surfaces, nearest
/// first.
pub fn trace_mattes(
    frame: &Frame,
    samples: &[Sample],
    scratch: &mut Scratch,
    mut tell: impl FnMut(usize, MatteCoverage),
) {
    let mut open = vec![1f32; samples.len()];
    let mut whose: Vec<usize> = (0..samples.len()).collect();
    frame.eye_rays(samples, &mut scratch.rays);
    for _ in 0..MAX_LAYERS {
        frame.accel.intersect(&scratch.rays, &MaterialHitFilter(frame.posed), &mut scratch.hits);
        let mut kept = Vec::new();
        for (i, hit) in scratch.hits.iter().enumerate().filter(|(_, hit)| !hit.is_miss()) {
            let ray = Ray { o: scratch.rays.origins[i], d: scratch.rays.directions[i] };
            let surface = SurfacePoint::at(frame.posed, hit.id, ray);
            let alpha = alpha(frame.posed, &frame.posed.materials[surface.material as usize], &surface.on);
            let open = &mut open[whose[i]];
            let coverage = *open * alpha;
            *open -= coverage;
            if coverage > 0.0 {
                let object = frame.posed.scene.instances[hit.id.instance as usize].object;
                tell(whose[i], MatteCoverage { object, material: surface.material + 1, coverage });
            }
            if *open > 0.0 {
                kept.push(i);
            }
        }
        if kept.is_empty() {
            break;
        }
        scratch.rays.continue_behind(&kept, &scratch.hits);
        whose = kept.iter().map(|&i| whose[i]).collect();
    }
}
