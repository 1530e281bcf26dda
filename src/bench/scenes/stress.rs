//! Worst cases of BVHs: slivers, triangle soup and coincident layers.

use super::mesh::GeneratedMesh;
use super::noise::Random;
use super::scene::{GeneratedInstance, GeneratedScene};
use super::vector::{add, scale};

/// A scene of one mesh around the origin.
fn single_mesh_scene(mesh: GeneratedMesh) -> GeneratedScene {
    GeneratedScene {
        name: String::new(),
        meshes: vec![mesh],
        instances: vec![GeneratedInstance::identity(0)],
        eye: [1.1, 0.8, 2.6],
        target: [0.0, 0.0, 0.0],
        yfov: 40.0,
        light: [2.0, 3.0, 2.5],
        sun_direction: [-0.4, -0.7, -0.6],
        textured: false,
    }
}

/// Long thin triangles along the diagonals of the cube [−1, 1]³: their bounding boxes are nearly empty and overlap
/// everywhere.
pub fn slivers(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("slivers", [0.6, 0.6, 0.7]);
    let mut random = Random::new(11);
    // The more triangles, the thinner, so that the same fraction of rays passes.
    let half_width = 0.6 / (triangles as f32).sqrt();
    for _ in 0..triangles {
        let centre = [0; 3].map(|_| random.between(-0.85, 0.85));
        let along = [0; 3].map(|_| {
            let side = if random.unit() < 0.5 { -0.12 } else { 0.12 };
            side * random.between(0.6, 1.0)
        });
        let across = [0; 3].map(|_| random.between(-half_width, half_width));
        push_triangle(&mut mesh, [scale(along, -1.0), along, add(along, across)].map(|p| add(centre, p)));
    }
    single_mesh_scene(mesh)
}

/// Random triangles in the cube [−1, 1]³, with sizes over two decades.
pub fn soup(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("soup", [0.7, 0.6, 0.5]);
    let mut random = Random::new(12);
    let typical_size = 2.0 / (triangles as f32).sqrt();
    for _ in 0..triangles {
        let centre = [0; 3].map(|_| random.between(-0.9, 0.9));
        let x = random.unit();
        let size = typical_size * (0.2 + 3.0 * x * x * x * x);
        push_triangle(&mut mesh, [(); 3].map(|()| add(centre, [0; 3].map(|_| random.between(-size, size)))));
    }
    single_mesh_scene(mesh)
}

/// Two crossing squares, each of eight coincident grids: every hit is a tie of eight.
pub fn layers(triangles: usize) -> GeneratedScene {
    let mut mesh = GeneratedMesh::named("layers", [0.6, 0.7, 0.6]);
    const SHEETS: usize = 16;
    let quads = triangles / 2 / SHEETS;
    let rows = ((quads as f64).sqrt() as u32).max(1);
    for sheet in 0..SHEETS {
        mesh.add_grid(quads as u32 / rows, rows, |u, v| {
            let (x, y) = ((2.0 * u - 1.0) as f32, (1.0 - 2.0 * v) as f32);
            if sheet % 2 == 0 { [x, 0.0, -y] } else { [x, y, 0.0] }
        });
    }
    // The remaining triangles duplicate existing ones.
    for i in 0..triangles - mesh.triangles.len() {
        mesh.triangles.push(mesh.triangles[i]);
    }
    single_mesh_scene(mesh)
}

fn push_triangle(mesh: &mut GeneratedMesh, points: [[f32; 3]; 3]) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(points);
    mesh.triangles.push([base, base + 1, base + 2]);
}
