//! Estimates the memory of edges.

use blinn_render::EdgeStyle;
use blinn_scene::{Mesh, Scene};
use glam::Vec3;

/// Per triangle and vertex while edges are found: half-edges, and two edges twice. Closed meshes have 1.5 edges per triangle.
const FOUND_EDGES_TRIANGLE: u64 = 36 + 2 * KEPT_EDGES_TRIANGLE;
const FOUND_EDGES_VERTEX: u64 = 28;
/// Per triangle: edges that pictures share.
const KEPT_EDGES_TRIANGLE: u64 = 32;
/// Per triangle of a picture whose sharp edges are drawn: its normal.
const NORMAL: u64 = 24;
/// Per edge of a picture, as an edge and in cells.
const DRAWN_EDGE: u64 = 104;
/// The part of the angle of sharp edges by which the triangles at a vertex may turn from their mean where no edge is drawn. Half
/// of the angle is enough for two of them; instances that are stretched turn them further.
const SMOOTH_PART: f64 = 0.25;

/// Returns the bytes of the edges of all meshes and those of one picture.
pub(crate) fn edge_bytes(scene: &Scene, style: &EdgeStyle) -> u64 {
    let meshes = || scene.meshes.iter().filter(|mesh| !mesh.triangles.is_empty());
    let triangles: u64 = meshes().map(|mesh| mesh.triangles.len() as u64).sum();
    let vertices: u64 = meshes().map(|mesh| mesh.positions.len() as u64).sum();
    let found = FOUND_EDGES_TRIANGLE * triangles + FOUND_EDGES_VERTEX * vertices;
    let drawn: Vec<u64> = scene.meshes.iter().map(|mesh| drawn_bytes(mesh, style)).collect();
    let drawn = scene.instances.iter().map(|instance| drawn[instance.mesh as usize]);
    found.max(KEPT_EDGES_TRIANGLE * triangles + drawn.fold(0, u64::saturating_add))
}

/// Returns the bytes of a mesh's edges in a picture.
fn drawn_bytes(mesh: &Mesh, style: &EdgeStyle) -> u64 {
    let triangles = mesh.triangles.len() as u64;
    let all = 2 * triangles;
    let is_deformed = !mesh.morph_targets.is_empty() || mesh.influences.per_vertex > 0;
    let is_known = mesh.edge_marks.is_empty() && !is_deformed && !style.kinds.all && !style.kinds.silhouette;
    let edges = if is_known { all.min(sides_of_sharp_vertices(mesh, style.angle)) } else { all };
    NORMAL * triangles + DRAWN_EDGE * edges
}

/// Counts the sides of triangles that may be sharp edges or borders: those with both ends at vertices around which the triangles
/// turn, or do not close. Finding the edges themselves would take as much memory as they do.
fn sides_of_sharp_vertices(mesh: &Mesh, angle: f64) -> u64 {
    let normal = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut axes = vec![Vec3::ZERO; mesh.positions.len()];
    // The next vertices less the previous ones, which cancel where the triangles close around a vertex.
    let mut rims = vec![0u32; mesh.positions.len()];
    for &corners in &mesh.triangles {
        let n = normal(corners);
        let [a, b, c] = corners;
        for (corner, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
            axes[corner as usize] += n;
            let rim = &mut rims[corner as usize];
            *rim = rim.wrapping_add(scattered(next)).wrapping_sub(scattered(previous));
        }
    }
    axes.iter_mut().for_each(|axis| *axis = axis.normalize_or_zero());
    let least_cos = (SMOOTH_PART * angle).to_radians().cos() as f32;
    let mut is_sharp: Vec<bool> = rims.iter().map(|&rim| rim != 0).collect();
    for &corners in &mesh.triangles {
        let n = normal(corners);
        for corner in corners.map(|corner| corner as usize) {
            // Triangles without area have no normal.
            is_sharp[corner] |= n != Vec3::ZERO && n.dot(axes[corner]) < least_cos;
        }
    }
    let ends = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    ends.filter(|ends| ends.iter().all(|&end| is_sharp[end as usize])).count() as u64
}

/// Scatters the bits of a vertex's number, so that sums of few of them cancel only in pairs.
fn scattered(vertex: u32) -> u32 {
    let x = (vertex ^ vertex >> 16).wrapping_mul(0x7feb_352d);
    let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}
