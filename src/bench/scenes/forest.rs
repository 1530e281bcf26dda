//! A forest: a few kinds of trees, each drawn many times, on a rolling ground.

use super::mesh::GeneratedMesh;
use super::noise::{Random, fractal};
use super::scan::surface;
use super::shapes::placed;
use super::{GeneratedInstance, GeneratedScene};

const KINDS: usize = 5;
const TREES: usize = 10_000;

/// Metres of the square that is planted.
const SIDE: f32 = 600.0;

/// Ten thousand trees of five kinds.
pub fn scene(triangles: usize) -> GeneratedScene {
    let mut ground = GeneratedMesh::named("ground", [0.16, 0.2, 0.07]);
    ground.grid(20, 20, |u, v| {
        let (x, z) = ((u as f32 - 0.5) * 1.2 * SIDE, (v as f32 - 0.5) * 1.2 * SIDE);
        [x, height(x, z), z]
    });
    ground.smooth();
    let rest = triangles - ground.triangles.len();
    let share = (rest / KINDS) & !1;
    let mut meshes = vec![ground];
    for kind in 0..KINDS {
        let own = if kind == 0 { rest - share * (KINDS - 1) } else { share };
        meshes.push(tree(own, kind as u64));
    }
    let mut instances = vec![GeneratedInstance::identity(0)];
    let mut random = Random::new(5);
    for i in 0..TREES {
        // A jittered grid: no two trees in one place.
        let cell = SIDE / 100.0;
        let x = ((i % 100) as f32 + random.between(0.15, 0.85)) * cell - SIDE / 2.0;
        let z = ((i / 100) as f32 + random.between(0.15, 0.85)) * cell - SIDE / 2.0;
        let (size, angle) = (random.between(0.7, 1.3), random.between(0.0, std::f32::consts::TAU));
        let mesh = 1 + (random.bits() % KINDS as u64) as usize;
        instances.push(GeneratedInstance { mesh, columns: placed(size, angle, [x, height(x, z) - 0.2, z]) });
    }
    GeneratedScene {
        name: String::new(),
        meshes,
        instances,
        eye: [-250.0, 60.0, -250.0],
        target: [0.0, 0.0, 0.0],
        yfov: 45.0,
        light: [0.0, 150.0, 0.0],
        sun: [0.5, -0.7, -0.5],
        textured: false,
    }
}

fn height(x: f32, z: f32) -> f32 {
    (14.0 * fractal([f64::from(x) / 180.0, 0.5, f64::from(z) / 180.0], 1.0, 3, 0.5, 9)) as f32
}

/// A trunk, and a crown of leaves: small triangles anywhere in a rough ball, in pairs.
fn tree(triangles: usize, kind: u64) -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("tree", [0.1 + 0.04 * kind as f32, 0.3 + 0.03 * kind as f32, 0.08]);
    let high = 5.0 + kind as f32;
    mesh.turned([0.0; 3], &[(0.3, 0.0), (0.2, 0.4 * high), (0.08, high)], 8, 0.0);
    // Boughs: a small closed surface inside, so that the crown is not a mere cloud.
    let boughs = ((triangles / 8) & !1).max(48);
    mesh.join(&surface(boughs, 20 + kind, mesh.color), |p| [p[0] * 1.2, high + p[1] * 1.6, p[2] * 1.2]);
    let mut random = Random::new(100 + kind);
    while mesh.triangles.len() < triangles {
        let d = [0; 3].map(|_| random.between(-1.0, 1.0));
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if !(0.3..1.0).contains(&length) {
            continue;
        }
        let at = [d[0] * 2.2, high + d[1] * 2.8, d[2] * 2.2];
        let [u, v] = [(); 2].map(|()| [0; 3].map(|_| random.between(-0.09, 0.09)));
        let base = mesh.positions.len() as u32;
        for (s, t) in [(-1.0, 0.0), (0.0, -0.5), (1.0, 0.0), (0.0, 0.5)] {
            mesh.positions.push([0, 1, 2].map(|a| at[a] + s * u[a] + t * v[a]));
        }
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + base)));
    }
    mesh.smooth();
    mesh
}
