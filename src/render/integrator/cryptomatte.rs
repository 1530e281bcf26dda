//! Cryptomatte coverage: the share of each sample that each object and material covers (Friedman and Jones, “Fully
//! Automatic ID Mattes with Support for Motion Blur and Transparency”, SIGGRAPH 2015).
//!
//! A surface covers the fraction alpha of what the surfaces in front of it leave open. A blended pane therefore shares its
//! pixels with what is behind it, while glass (transmission) covers all of them. Cycles does the same.

use crate::integrator::frame::Frame;
use crate::integrator::material::opacity::opacity;
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRays};
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;

/// A kind of Cryptomatte layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MatteKind {
    /// Objects, as in [`Aov::ObjectId`](super::Aov::ObjectId).
    Object,
    /// Materials.
    Material,
}

impl MatteKind {
    /// All kinds.
    pub const ALL: [MatteKind; 2] = [MatteKind::Object, MatteKind::Material];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            MatteKind::Object => "object",
            MatteKind::Material => "material",
        }
    }
}

/// A surface along an eye ray, and the share of the sample that it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatteCoverage {
    /// Number of the object, from 1; 0 for none.
    pub object: u32,
    /// Number of the material, from 1.
    pub material: u32,
    /// Above 0; the coverages of a sample add up to at most 1.
    pub coverage: f32,
}

impl MatteCoverage {
    /// Number of the object or material, from 1; 0 for none.
    pub fn id(&self, kind: MatteKind) -> u32 {
        match kind {
            MatteKind::Object => self.object,
            MatteKind::Material => self.material,
        }
    }
}

/// Calls `add` with the index of a sample and a surface that it sees: first the nearest surface of each sample, then the
/// surfaces behind these, and so on.
pub fn trace_mattes(
    frame: &Frame,
    samples: &[Sample],
    scratch: &mut Scratch,
    mut add: impl FnMut(usize, MatteCoverage),
) {
    // The share of each sample that is not covered yet.
    let mut open = vec![1f32; samples.len()];
    let mut rays = PathRays::new(frame, samples, &mut scratch.rays, &mut scratch.hits);
    for _ in 0..MAX_SURFACES_PER_RAY {
        rays.intersect(frame);
        for eye in rays.iter().filter(|eye| !eye.hit.is_miss()) {
            let surface = SurfacePoint::at(frame.posed, &eye.hit, eye.ray);
            let material = &frame.posed.materials[surface.material as usize];
            let open = &mut open[eye.path];
            let coverage = *open * opacity(frame.posed, material, &surface.ctx);
            *open -= coverage;
            if coverage > 0.0 {
                let object = frame.posed.scene.instances[eye.hit.id.instance as usize].object;
                add(eye.path, MatteCoverage { object, material: surface.material + 1, coverage });
            }
        }
        rays.continue_behind(|sample| open[sample] > 0.0);
        if rays.is_empty() {
            break;
        }
    }
}
