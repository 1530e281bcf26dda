//! Surroundings of a point: surfaces on all sides, or a way out.

use glam::{DMat3, DVec3, Vec3};

use blinn_accel::{Accel, RayBatch};
use blinn_core::geometry::Hit;
use blinn_render::integrator::MaterialHitFilter;
use blinn_scene::PosedScene;

/// The hits of rays from `position` in all of fourteen directions.
pub fn surroundings(posed: &PosedScene, accel: &Accel, position: Vec3, t_max: f32) -> Vec<Hit> {
    let directions = fourteen_directions();
    let rays =
        RayBatch { origins: vec![position; directions.len()], directions, t_max, ..RayBatch::default() };
    let mut hits = Vec::new();
    accel.intersect(&rays, &MaterialHitFilter(posed), &mut hits);
    hits
}

/// Returns true if surfaces are on all sides of `position`.
pub fn is_enclosed(posed: &PosedScene, accel: &Accel, position: Vec3) -> bool {
    surroundings(posed, accel, position, f32::INFINITY).iter().all(|hit| !hit.is_miss())
}

/// The directions to the faces and the corners of a cube.
fn fourteen_directions() -> Vec<Vec3> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    let signs = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
    // Slightly turned, so that no ray runs along an edge of a modelled box or sphere.
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.5, 0.81).normalize(), 0.3);
    axes.chain((0..8).map(signs)).map(|d| (turn * d.normalize()).as_vec3()).collect()
}
