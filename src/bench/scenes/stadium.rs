//! Teapot in a stadium: a few thousand triangles 400 metres wide, and all others within 10 centimetres at the centre.

use super::mesh::GeneratedMesh;
use super::scan::scan_surface;
use super::scene::{GeneratedInstance, GeneratedScene};

/// Generates the stadium.
pub fn scene(triangles: usize) -> GeneratedScene {
    let mut stands = GeneratedMesh::named("stands", [0.5, 0.5, 0.55]);
    let profile: Vec<(f32, f32)> = (0..8)
        .flat_map(|i| [(60.0 + 17.0 * i as f32, 8.0 * i as f32), (77.0 + 17.0 * i as f32, 8.0 * i as f32)])
        .collect();
    // The stands face inward.
    stands.add_revolved([0.0; 3], &profile, 64, 0.0);
    stands.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let mut lawn = GeneratedMesh::named("lawn", [0.1, 0.4, 0.12]);
    lawn.add_grid(4, 4, |u, v| [(u * 400.0 - 200.0) as f32, 0.0, (v * 400.0 - 200.0) as f32]);
    let remaining = triangles - stands.triangles.len() - lawn.triangles.len();
    let dense = scan_surface(remaining, 2, [0.75, 0.7, 0.65]);
    let mut pot = GeneratedMesh::named("pot", dense.color);
    pot.append(&dense, |p| [p[0] * 0.05, p[1] * 0.05 + 0.06, p[2] * 0.05]);
    pot.smooth();
    let meshes = vec![stands, lawn, pot];
    GeneratedScene {
        name: String::new(),
        instances: (0..meshes.len()).map(GeneratedInstance::identity).collect(),
        meshes,
        eye: [0.05, 0.12, 0.25],
        target: [0.0, 0.065, 0.0],
        yfov: 45.0,
        light: [30.0, 60.0, 20.0],
        sun_direction: [-0.4, -0.8, -0.45],
        textured: false,
    }
}
