//! A scanned object: a sphere pulled into lobes, bent, wrinkled and roughened, with detail from
//! its whole size down to single triangles, as a clay figure through a scanner has.

use super::mesh::GeneratedMesh;
use super::noise::{fractal, mix};
use super::vector::dot;
use super::{GeneratedInstance, GeneratedScene};

/// The object, within about a unit of the origin.
pub fn scene(triangles: usize) -> GeneratedScene {
    GeneratedScene {
        name: String::new(),
        meshes: vec![surface(triangles, 1, [0.72, 0.62, 0.5])],
        instances: vec![GeneratedInstance::identity(0)],
        eye: [0.62, 0.42, 1.75],
        target: [0.0, 0.0, 0.0],
        yfov: 42.0,
        light: [3.0, 4.0, 2.0],
        sun: [-0.5, -0.75, -0.43],
        textured: false,
    }
}

/// A closed surface of exactly `triangles` triangles (an even number, at least 48) around the
/// origin. `seed` gives its shape.
pub fn surface(triangles: usize, seed: u64, color: [f32; 3]) -> GeneratedMesh {
    let mut n = 2;
    while 12 * (n + 1) * (n + 1) <= triangles {
        n += 1;
    }
    let mut mesh = GeneratedMesh::named("scan", color);
    let mut directions = sphere(n, triangles, &mut mesh);
    let lobes = lobes(seed);
    let edge = 1.5 / n as f64;
    in_parallel(&mut directions, |index, d| *d = shape(*d, index, edge, &lobes, seed));
    mesh.positions = directions.into_iter().map(|p| p.map(|x| x as f32)).collect();
    mesh.smooth();
    mesh
}

/// A sphere of 6n² quads and its triangles; where more triangles are wanted than 12n², some quads
/// spread over all of them become four triangles instead of two.
fn sphere(n: usize, triangles: usize, mesh: &mut GeneratedMesh) -> Vec<[f64; 3]> {
    let quads = 6 * n * n;
    let split = (triangles - 12 * n * n) / 2;
    let mut points = Vec::with_capacity(triangles / 2 + 2);
    let mut index = Welded::new(n);
    mesh.triangles.reserve(triangles);
    for quad in 0..quads {
        let (face, i, j) = (quad / (n * n), quad / n % n, quad % n);
        let [a, b, c, d] =
            [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| index.get(face, i, j, &mut points));
        // Bresenham's line through (0, 0) and (quads, split).
        if (quad + 1) * split / quads > quad * split / quads {
            let m = points.len() as u32;
            points.push(direction(on_cube(face, i as f64 + 0.5, j as f64 + 0.5, n)));
            mesh.triangles.extend([[a, b, m], [b, c, m], [c, d, m], [d, a, m]]);
        } else {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    points
}

/// Vertices of the cube's grid, each made once. Inner vertices of a face belong to it alone; those
/// on edges are found by their place.
struct Welded {
    n: usize,
    faces: Vec<u32>,
    edges: std::collections::HashMap<[u32; 3], u32>,
}

impl Welded {
    fn new(n: usize) -> Welded {
        Welded { n, faces: vec![u32::MAX; 6 * (n + 1) * (n + 1)], edges: Default::default() }
    }

    fn get(&mut self, face: usize, i: usize, j: usize, points: &mut Vec<[f64; 3]>) -> u32 {
        let n = self.n;
        let slot = &mut self.faces[(face * (n + 1) + i) * (n + 1) + j];
        if *slot != u32::MAX {
            return *slot;
        }
        let mut new = || {
            points.push(direction(on_cube(face, i as f64, j as f64, n)));
            points.len() as u32 - 1
        };
        let inside = i > 0 && j > 0 && i < n && j < n;
        *slot = if inside {
            new()
        } else {
            let place = on_cube(face, i as f64, j as f64, n).map(|x| (x + n as f64) as u32);
            *self.edges.entry(place).or_insert_with(new)
        };
        *slot
    }
}

/// A point of the cube [−n, n]³ on one of its faces, (i, j) of n cells along; seen from outside
/// i, j and the normal are right-handed.
fn on_cube(face: usize, i: f64, j: f64, n: usize) -> [f64; 3] {
    let n = n as f64;
    let (s, t) = (2.0 * i - n, 2.0 * j - n);
    match face {
        0 => [n, s, t],
        1 => [-n, t, s],
        2 => [t, n, s],
        3 => [s, -n, t],
        4 => [s, t, n],
        _ => [t, s, -n],
    }
}

/// The direction of a point on the cube, with angles in place of lengths: cells are then about
/// even.
fn direction(p: [f64; 3]) -> [f64; 3] {
    let side = p[0].abs().max(p[1].abs()).max(p[2].abs());
    let q = p.map(|x| libm::tan(std::f64::consts::FRAC_PI_4 * (x / side)));
    let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]).sqrt();
    q.map(|x| x / length)
}

/// Limbs: (direction, height, sharpness).
type Lobe = ([f32; 3], f64, f64);

fn lobes(seed: u64) -> Vec<Lobe> {
    let mut random = super::noise::Random::new(seed);
    (0..7)
        .map(|i| {
            let d = [0; 3].map(|_| random.between(-1.0, 1.0));
            let (high, sharp) = if i < 2 { (0.42, 16.0) } else { (0.24, 8.0) };
            (super::vector::unit(d), high * f64::from(random.between(0.7, 1.1)), sharp)
        })
        .collect()
}

/// From a direction to a point of the surface. `edge` is about the length of an edge.
fn shape(d: [f64; 3], index: usize, edge: f64, lobes: &[Lobe], seed: u64) -> [f64; 3] {
    let mut r = 0.52;
    for (axis, high, sharp) in lobes {
        let cosine = f64::from(dot(d.map(|x| x as f32), *axis));
        r += high * libm::exp(sharp * (cosine - 1.0));
    }
    let q = d.map(|x| x * r);
    // Wrinkles fold sharply where the noise is near zero.
    let wrinkles = 1.0 - fractal(q, 5.0, 3, 0.5, seed + 40).abs();
    let skin = 0.07 * fractal(q, 2.3, 10, 0.48, seed) + 0.035 * wrinkles * wrinkles;
    // The scanner's own noise: a thirtieth of an edge.
    let noise = (mix(index as u64 ^ (seed << 40)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let p = d.map(|x| x * (r + skin + edge * noise / 15.0));
    // Bending space gives overhangs; its slope stays below one, so nothing passes through itself.
    let bend = |axis: u64| 0.17 * fractal(p, 1.9, 2, 0.4, seed + 80 + 7 * axis);
    [p[0] + bend(0), p[1] + bend(1), p[2] + bend(2)]
}

/// Changes every item by itself, on all threads.
fn in_parallel<T: Send>(items: &mut [T], change: impl Fn(usize, &mut T) + Sync) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let chunk = items.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        for (k, part) in items.chunks_mut(chunk).enumerate() {
            let change = &change;
            scope.spawn(move || part.iter_mut().enumerate().for_each(|(i, t)| change(k * chunk + i, t)));
        }
    });
}
