//! An interior: a room of twelve triangles, fluted columns, tables, bookshelves, and statues with nearly all
//! triangles. Nothing is instanced.

use super::mesh::GeneratedMesh;
use super::noise::Random;
use super::scan::scan_surface;
use super::scene::{GeneratedInstance, GeneratedScene};
use super::shapes::transform;

const STATUES: usize = 19;

/// Generates the hall, 24 × 7 × 24 metres.
pub fn scene(triangles: usize) -> GeneratedScene {
    let mut meshes = vec![room(), columns(), tables(), shelves()];
    let remaining: usize = triangles - meshes.iter().map(|m| m.triangles.len()).sum::<usize>();
    let per_statue = (remaining / STATUES) & !1;
    for i in 0..STATUES {
        let triangles = if i == 0 { remaining - per_statue * (STATUES - 1) } else { per_statue };
        let color = [0.35 + 0.03 * (i % 7) as f32, 0.55 - 0.02 * (i % 5) as f32, 0.45];
        let statue = scan_surface(triangles, 1 + (i % 4) as u64, color);
        let (column, row) = (i % 5, i / 5);
        let position = [-8.0 + 4.0 * column as f32, 1.75, -8.0 + 4.0 * row as f32];
        let instance = GeneratedInstance { mesh: 0, columns: transform(0.85, 1.7 * i as f32, position) };
        let mut mesh = GeneratedMesh::named("statue", color);
        mesh.append(&statue, |p| instance.transform_point(p));
        mesh.smooth();
        meshes.push(mesh);
    }
    GeneratedScene {
        name: String::new(),
        instances: (0..meshes.len()).map(GeneratedInstance::identity).collect(),
        meshes,
        eye: [-11.0, 4.5, -11.0],
        target: [0.0, 1.2, 0.0],
        yfov: 55.0,
        light: [1.0, 6.5, 2.2],
        sun_direction: [0.35, -0.8, 0.48],
        textured: false,
    }
}

fn room() -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("room", [0.7, 0.68, 0.64]);
    mesh.add_room([-12.0, 0.0, -12.0], [12.0, 7.0, 12.0]);
    mesh
}

fn columns() -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("columns", [0.8, 0.78, 0.7]);
    // Slightly convex (entasis), with a base and a capital.
    let mut profile = vec![(0.34, 0.0), (0.34, 0.25), (0.24, 0.3)];
    profile.extend((1..8).map(|i| (0.24 + 0.008 * (4 - (i - 4_i32).abs()) as f32, 0.3 + 0.75 * i as f32)));
    profile.extend([(0.24, 6.4), (0.36, 6.7), (0.36, 7.0)]);
    for i in 0..16 {
        let foot = [-6.0 + 4.0 * (i % 4) as f32, 0.0, -6.0 + 4.0 * (i / 4) as f32];
        mesh.add_revolved(foot, &profile, 80, 0.06);
    }
    mesh.smooth();
    mesh
}

fn tables() -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("tables", [0.4, 0.24, 0.12]);
    for i in 0..25 {
        let (x, z) = (-8.0 + 4.0 * (i % 5) as f32, -8.0 + 4.0 * (i / 5) as f32);
        mesh.add_box([x - 0.8, 0.76, z - 0.8], [x + 0.8, 0.82, z + 0.8]);
        for leg in 0..4 {
            let (sx, sz) = ((leg % 2) as f32 * 1.4 - 0.7, (leg / 2) as f32 * 1.4 - 0.7);
            let (lx, lz) = (x + sx, z + sz);
            mesh.add_box([lx - 0.04, 0.0, lz - 0.04], [lx + 0.04, 0.76, lz + 0.04]);
        }
    }
    mesh
}

/// Bookshelves along two walls.
fn shelves() -> GeneratedMesh {
    let mut mesh = GeneratedMesh::named("shelves", [0.5, 0.16, 0.12]);
    let mut random = Random::new(77);
    for (wall, board) in (0..2).flat_map(|w| (0..5).map(move |b| (w, b))) {
        // From (along the wall, up, out of the wall) to the world.
        let point =
            |a: f32, y: f32, out: f32| if wall == 0 { [a, y, 11.95 - out] } else { [11.95 - out, y, a] };
        let y = 0.3 + 0.55 * board as f32;
        let add_box = |mesh: &mut GeneratedMesh, p: [f32; 3], q: [f32; 3]| {
            mesh.add_box([0, 1, 2].map(|a| p[a].min(q[a])), [0, 1, 2].map(|a| p[a].max(q[a])));
        };
        add_box(&mut mesh, point(-10.0, y, 0.0), point(10.0, y + 0.03, 0.4));
        let mut at = -9.9;
        for _ in 0..100 {
            let thickness = random.between(0.03, 0.09);
            let height = random.between(0.2, 0.42);
            let depth = random.between(0.2, 0.35);
            let corner = point(at + thickness, y + 0.03 + height, 0.02 + depth);
            add_box(&mut mesh, point(at, y + 0.03, 0.02), corner);
            at += thickness + random.between(0.0, 0.2);
        }
    }
    mesh
}
