//! A scanned object: a sphere with lobes, bends, wrinkles and noise, with detail from its full size down to single
//! triangles.

use super::mesh::GeneratedMesh;
use super::noise::{Random, fractal_noise, mix};
use super::scene::{GeneratedInstance, GeneratedScene};
use super::vector::{dot, unit};

/// Generates the object, within about a unit of the origin.
pub fn scene(triangles: usize) -> GeneratedScene {
    GeneratedScene {
        name: String::new(),
        meshes: vec![scan_surface(triangles, 1, [0.72, 0.62, 0.5])],
        instances: vec![GeneratedInstance::identity(0)],
        eye: [0.62, 0.42, 1.75],
        target: [0.0, 0.0, 0.0],
        yfov: 42.0,
        light: [3.0, 4.0, 2.0],
        sun_direction: [-0.5, -0.75, -0.43],
        textured: false,
    }
}

/// A closed surface of exactly `triangles` triangles (an even number, at least 48) around the origin. `seed`
/// determines its shape.
pub fn scan_surface(triangles: usize, seed: u64, color: [f32; 3]) -> GeneratedMesh {
    let mut n = 2;
    while 12 * (n + 1) * (n + 1) <= triangles {
        n += 1;
    }
    let mut mesh = GeneratedMesh::named("scan", color);
    let mut points = cube_sphere(n, triangles, &mut mesh);
    let lobes = lobes(seed);
    let edge = 1.5 / n as f64;
    for_each_parallel(&mut points, |index, d| *d = displace(*d, index, edge, &lobes, seed));
    mesh.positions = points.into_iter().map(|p| p.map(|x| x as f32)).collect();
    mesh.smooth();
    mesh
}

/// A cube sphere of 6n² quads. The triangles beyond 12n² come from quads that are split into four triangles instead of
/// two, evenly distributed.
fn cube_sphere(n: usize, triangles: usize, mesh: &mut GeneratedMesh) -> Vec<[f64; 3]> {
    let quads = 6 * n * n;
    let split = (triangles - 12 * n * n) / 2;
    let mut points = Vec::with_capacity(triangles / 2 + 2);
    let mut vertices = CubeVertices::new(n);
    mesh.triangles.reserve(triangles);
    for quad in 0..quads {
        let (face, i, j) = (quad / (n * n), quad / n % n, quad % n);
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            .map(|(i, j)| vertices.index(face, i, j, &mut points));
        // Bresenham's line from (0, 0) to (quads, split) distributes the splits.
        if (quad + 1) * split / quads > quad * split / quads {
            let m = points.len() as u32;
            points.push(cube_to_sphere(cube_point(face, i as f64 + 0.5, j as f64 + 0.5, n)));
            mesh.triangles.extend([[a, b, m], [b, c, m], [c, d, m], [d, a, m]]);
        } else {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    points
}

/// The vertices of the cube's grid. Faces share those on their edges, which are found by position.
struct CubeVertices {
    n: usize,
    /// Index of each face's grid points, or `u32::MAX`.
    faces: Vec<u32>,
    /// Index of the points on edges.
    edges: std::collections::HashMap<[u32; 3], u32>,
}

impl CubeVertices {
    fn new(n: usize) -> CubeVertices {
        CubeVertices { n, faces: vec![u32::MAX; 6 * (n + 1) * (n + 1)], edges: Default::default() }
    }

    /// The index of a vertex, which is added to `points` when it is first used.
    fn index(&mut self, face: usize, i: usize, j: usize, points: &mut Vec<[f64; 3]>) -> u32 {
        let n = self.n;
        let slot = &mut self.faces[(face * (n + 1) + i) * (n + 1) + j];
        if *slot != u32::MAX {
            return *slot;
        }
        let mut new = || {
            points.push(cube_to_sphere(cube_point(face, i as f64, j as f64, n)));
            points.len() as u32 - 1
        };
        let inside = i > 0 && j > 0 && i < n && j < n;
        *slot = if inside {
            new()
        } else {
            let position = cube_point(face, i as f64, j as f64, n).map(|x| (x + n as f64) as u32);
            *self.edges.entry(position).or_insert_with(new)
        };
        *slot
    }
}

/// The point (i, j) of a face's grid of n × n cells, on the cube [−n, n]³. i, j and the outward normal are
/// right-handed.
fn cube_point(face: usize, i: f64, j: f64, n: usize) -> [f64; 3] {
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

/// Maps the cube to the unit sphere. Equal lengths become equal angles, so that cells have similar sizes.
fn cube_to_sphere(p: [f64; 3]) -> [f64; 3] {
    let side = p[0].abs().max(p[1].abs()).max(p[2].abs());
    let q = p.map(|x| libm::tan(std::f64::consts::FRAC_PI_4 * (x / side)));
    let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]).sqrt();
    q.map(|x| x / length)
}

/// A bump of the surface.
struct Lobe {
    direction: [f32; 3],
    height: f64,
    sharpness: f64,
}

fn lobes(seed: u64) -> Vec<Lobe> {
    let mut random = Random::new(seed);
    (0..7)
        .map(|i| {
            let d = [0; 3].map(|_| random.between(-1.0, 1.0));
            let (height, sharpness) = if i < 2 { (0.42, 16.0) } else { (0.24, 8.0) };
            let height = height * f64::from(random.between(0.7, 1.1));
            Lobe { direction: unit(d), height, sharpness }
        })
        .collect()
}

/// The point of the surface in direction `d`. `edge` is the approximate length of an edge.
fn displace(d: [f64; 3], index: usize, edge: f64, lobes: &[Lobe], seed: u64) -> [f64; 3] {
    let mut r = 0.52;
    for Lobe { direction, height, sharpness } in lobes {
        let cosine = f64::from(dot(d.map(|x| x as f32), *direction));
        r += height * libm::exp(sharpness * (cosine - 1.0));
    }
    let q = d.map(|x| x * r);
    // The absolute value gives sharp folds at the zeros of the noise.
    let wrinkles = 1.0 - fractal_noise(q, 5.0, 3, 0.5, seed + 40).abs();
    let skin = 0.07 * fractal_noise(q, 2.3, 10, 0.48, seed) + 0.035 * wrinkles * wrinkles;
    // Noise of the scanner: a thirtieth of an edge.
    let noise = (mix(index as u64 ^ (seed << 40)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let p = d.map(|x| x * (r + skin + edge * noise / 15.0));
    // Bending space gives overhangs. The slope of the bend stays below one, so the surface does not intersect itself.
    let bend = |axis: u64| 0.17 * fractal_noise(p, 1.9, 2, 0.4, seed + 80 + 7 * axis);
    [p[0] + bend(0), p[1] + bend(1), p[2] + bend(2)]
}

/// Calls `change` for each item, on all processors.
fn for_each_parallel<T: Send>(items: &mut [T], change: impl Fn(usize, &mut T) + Sync) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let chunk = items.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        for (k, slice) in items.chunks_mut(chunk).enumerate() {
            let change = &change;
            scope.spawn(move || slice.iter_mut().enumerate().for_each(|(i, t)| change(k * chunk + i, t)));
        }
    });
}
