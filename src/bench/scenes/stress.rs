//! What trees of boxes find hard: slivers, soup, coincident layers.

use super::mesh::GeneratedMesh;
use super::noise::Random;
use super::vector::{add, scale};
use super::{GeneratedInstance, GeneratedScene};

fn alone(mesh: GeneratedMesh) -> GeneratedScene {
    GeneratedScene {
        name: String::new(),
        meshes: vec![mesh],
        instances: vec![GeneratedInstance::identity(0)],
        eye: [1.1, 0.8, 2.6],
        target: [0.0, 0.0, 0.0],
        yfov: 40.0,
        light: [2.0, 3.0, 2.5],
        sun: [-0.4, -0.7, -0.6],
        textured: false,
    }
}

/// Long thin triangles across the cube [−1, 1]³, all along its diagonals: their boxes are nearly
/// all air and overlap everywhere.
pub fn slivers(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("slivers", [0.6, 0.6, 0.7]);
    let mut random = Random::new(11);
    // Thinner as they grow more, so that as much light gets through.
    let thin = 0.6 / (triangles as f32).sqrt();
    for _ in 0..triangles {
        let middle = [0; 3].map(|_| random.between(-0.85, 0.85));
        let along = [0; 3].map(|_| {
            let side = if random.unit() < 0.5 { -0.12 } else { 0.12 };
            side * random.between(0.6, 1.0)
        });
        let across = [0; 3].map(|_| random.between(-thin, thin));
        push(&mut mesh, [scale(along, -1.0), along, add(along, across)].map(|p| add(middle, p)));
    }
    alone(mesh)
}

/// Random triangles in the cube [−1, 1]³, of sizes over two decades.
pub fn soup(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("soup", [0.7, 0.6, 0.5]);
    let mut random = Random::new(12);
    let usual = 2.0 / (triangles as f32).sqrt();
    for _ in 0..triangles {
        let middle = [0; 3].map(|_| random.between(-0.9, 0.9));
        let x = random.unit();
        let size = usual * (0.2 + 3.0 * x * x * x * x);
        push(&mut mesh, [(); 3].map(|()| add(middle, [0; 3].map(|_| random.between(-size, size)))));
    }
    alone(mesh)
}

/// Two squares that cross, eight grids in the very same place for each: every hit is a tie of eight.
pub fn layers(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("layers", [0.6, 0.7, 0.6]);
    const SHEETS: usize = 16;
    let quads = triangles / 2 / SHEETS;
    let rows = ((quads as f64).sqrt() as u32).max(1);
    for sheet in 0..SHEETS {
        mesh.grid(quads as u32 / rows, rows, |u, v| {
            let (x, y) = ((2.0 * u - 1.0) as f32, (1.0 - 2.0 * v) as f32);
            if sheet % 2 == 0 { [x, 0.0, -y] } else { [x, y, 0.0] }
        });
    }
    // What whole rows could not hold lies on triangles that are there already.
    for i in 0..triangles - mesh.triangles.len() {
        mesh.triangles.push(mesh.triangles[i]);
    }
    alone(mesh)
}

fn push(mesh: &mut GeneratedMesh, points: [[f32; 3]; 3]) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(points);
    mesh.triangles.push([base, base + 1, base + 2]);
}
