//! A forest: many instances of a few kinds of trees on rolling ground.

use super::mesh::GeneratedMesh;
use super::noise::{Random, fractal_noise};
use super::scan::scan_surface;
use super::scene::{GeneratedInstance, GeneratedScene};
use super::shapes::transform;

/// Kinds of trees.
const KINDS: usize = 5;
/// Instances of trees.
const TREES: usize = 10_000;

/// Side of the planted square in metres.
const SIDE: f32 = 600.0;

/// Generates ten thousand trees of five kinds.
pub fn scene(triangles: usize) -> GeneratedScene {
    let mut ground = GeneratedMesh::named("ground", [0.16, 0.2, 0.07]);
    ground.add_grid(20, 20, |u, v| {
        let (x, z) = ((u as f32 - 0.5) * 1.2 * SIDE, (v as f32 - 0.5) * 1.2 * SIDE);
        [x, height(x, z), z]
    });
    ground.smooth();
    let remaining = triangles - ground.triangles.len();
    let per_kind = (remaining / KINDS) & !1;
    let mut meshes = vec![ground];
    for kind in 0..KINDS {
        let triangles = if kind == 0 { remaining - per_kind * (KINDS - 1) } else { per_kind };
        meshes.push(tree(triangles, kind as u64));
    }
    let mut instances = vec![GeneratedInstance::identity(0)];
    let mut random = Random::new(5);
    for i in 0..TREES {
        // A jittered grid, so that no two trees coincide.
        let cell = SIDE / 100.0;
        let x = ((i % 100) as f32 + random.between(0.15, 0.85)) * cell - SIDE / 2.0;
        let z = ((i / 100) as f32 + random.between(0.15, 0.85)) * cell - SIDE / 2.0;
        let scale = random.between(0.7, 1.3);
        let angle = random.between(0.0, std::f32::consts::TAU);
        let mesh = 1 + (random.bits() % KINDS as u64) as usize;
        instances
            .push(GeneratedInstance { mesh, columns: transform(scale, angle, [x, height(x, z) - 0.2, z]) });
    }
    GeneratedScene {
        name: String::new(),
        meshes,
        instances,
        eye: [-250.0, 60.0, -250.0],
        target: [0.0, 0.0, 0.0],
        yfov: 45.0,
        light: [0.0, 150.0, 0.0],
        sun_direction: [0.5, -0.7, -0.5],
        textured: false,
    }
}

/// The height of the ground in metres.
fn height(x: f32, z: f32) -> f32 {
    (14.0 * fractal_noise([f64::from(x) / 180.0, 0.5, f64::from(z) / 180.0], 1.0, 3, 0.5, 9)) as f32
}

/// A trunk, and a crown of leaves: random quads in a rough ball.
fn tree(triangles: usize, kind: u64) -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("tree", [0.1 + 0.04 * kind as f32, 0.3 + 0.03 * kind as f32, 0.08]);
    let trunk_height = 5.0 + kind as f32;
    mesh.add_revolved([0.0; 3], &[(0.3, 0.0), (0.2, 0.4 * trunk_height), (0.08, trunk_height)], 8, 0.0);
    // A small closed surface inside the crown stands for its branches.
    let branches = ((triangles / 8) & !1).max(48);
    mesh.append(&scan_surface(branches, 20 + kind, mesh.color), |p| {
        [p[0] * 1.2, trunk_height + p[1] * 1.6, p[2] * 1.2]
    });
    let mut random = Random::new(100 + kind);
    while mesh.triangles.len() < triangles {
        let d = [0; 3].map(|_| random.between(-1.0, 1.0));
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if !(0.3..1.0).contains(&length) {
            continue;
        }
        let centre = [d[0] * 2.2, trunk_height + d[1] * 2.8, d[2] * 2.2];
        let [u, v] = [(); 2].map(|()| [0; 3].map(|_| random.between(-0.09, 0.09)));
        let base = mesh.positions.len() as u32;
        for (s, t) in [(-1.0, 0.0), (0.0, -0.5), (1.0, 0.0), (0.0, 0.5)] {
            mesh.positions.push([0, 1, 2].map(|a| centre[a] + s * u[a] + t * v[a]));
        }
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + base)));
    }
    mesh.smooth();
    mesh
}
