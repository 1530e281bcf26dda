//! Visibility of known surface points from the eye.

use glam::{DVec2, DVec3, UVec2};

use crate::integrator::first_hit::{FirstHit, first_hits};
use crate::integrator::frame::Frame;
use crate::integrator::material::opacity::base_color;
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;
use blinn_core::geometry::{HitId, Rgb};
use blinn_scene::PosedScene;

/// A point of a surface, and where a picture may show it.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceTarget {
    /// The triangle.
    pub id: HitId,
    /// True for the front face, false for the back.
    pub front: bool,
    /// Position relative to the centre of the posed scene.
    pub p: DVec3,
    /// Film position, in the units of [`Camera::eye_ray`](blinn_scene::Camera::eye_ray).
    pub film: DVec2,
}

impl FirstHit<'_> {
    /// The surface point of the hit as a target for other frames at the same time, with its base colour in linear RGB;
    /// `None` without a hit. The film position is that of the sample.
    pub fn target(&self, frame: &Frame) -> Option<(SurfaceTarget, Rgb)> {
        let (_, surface) = self.surface.as_ref()?;
        let material = &frame.posed.materials[surface.material as usize];
        let color = base_color(frame.posed, material, &surface.ctx);
        let film = DVec2::new(self.sample.x, self.sample.y);
        let p = point_at(frame.posed, surface);
        Some((SurfaceTarget { id: surface.id, front: surface.front, p, film }, color))
    }
}

/// The position of a surface point in a posed scene, relative to its centre.
pub(crate) fn point_at(posed: &PosedScene, surface: &SurfacePoint) -> DVec3 {
    let HitId { instance, .. } = surface.id;
    let p = surface.ctx.interpolate(posed.positions(instance));
    posed.instances[instance as usize].transform.point_f64(p)
}

/// Returns for each target whether the eye ray at its film position sees it first.
pub fn sees(frame: &Frame, targets: &[SurfaceTarget], scratch: &mut Scratch) -> Vec<bool> {
    let sample = |target: &SurfaceTarget| Sample {
        x: target.film.x,
        y: target.film.y,
        pixel: UVec2::ZERO,
        index: 0,
        footprint: [0.0; 2],
        aperture: DVec2::ZERO,
    };
    let samples: Vec<Sample> = targets.iter().map(sample).collect();
    let hits = first_hits(frame, &samples, scratch);
    targets.iter().zip(&hits).map(|(target, hit)| is_target(frame, hit, target)).collect()
}

/// Difference of distances, relative to the distance, up to which two hits are the same point: more than rounding, and
/// less than the thickness of things.
const SAME_DISTANCE: f64 = 1e-5;

/// True if the first hit of a ray towards a target is the target.
fn is_target(frame: &Frame, first: &FirstHit, target: &SurfaceTarget) -> bool {
    let Some((hit, surface)) = &first.surface else { return false };
    if surface.id == target.id {
        return surface.front == target.front;
    }
    // At an edge, the ray may hit a neighbour.
    let ray = frame.eye_ray(&first.sample);
    let distance = (target.p - ray.o.as_dvec3()).length();
    let hit_distance = f64::from(hit.t) * ray.d.as_dvec3().length();
    (hit_distance - distance).abs() <= SAME_DISTANCE * distance
}
