//! Meshes, scenes and random numbers for tests of rays and BVHs.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use blinn::accel::{Accel, AccelSettings, HitFilter, Preset, SimdLevel};
use blinn::geometry::HitId;
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    AlphaMode, Instance, LocalTransform, Material, Mesh, Node, PoseSettings, PosedScene, Projection,
    ScalarInput, Scene, SurfaceClass, View, pose,
};
use glam::{DAffine3, DVec3, Vec3};

/// A small random generator (xorshift64*), for the same numbers on every machine.
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Rng {
        Rng(0x9e37_79b9_7f4a_7c15u64.wrapping_mul(seed + 1) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [−1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        (((self.next() >> 32) * n as u64) >> 32) as usize
    }

    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// In the cube [−1, 1)³.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A uniformly distributed direction.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.in_cube();
            if (0.1..1.0).contains(&p.length()) {
                return p.normalize();
            }
        }
    }
}

/// `x` moved by `n` ulps.
pub fn ulps(x: f32, n: i32) -> f32 {
    (0..n.abs()).fold(x, |x, _| if n > 0 { x.next_up() } else { x.next_down() })
}

pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh { positions, triangles, ..Mesh::default() }
}

/// A closed sphere of about unit radius: a cube of 6·n² quads projected onto it, its vertices welded and
/// displaced a little.
pub fn sphere(n: i32) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut welded = HashMap::new();
    for face in 0..6 {
        let mut vertex = |i: i32, j: i32| {
            let (a, b) = (2 * i - n, 2 * j - n);
            let c = if face < 3 { n } else { -n };
            let p = match face % 3 {
                0 => [c, a, b],
                1 => [b, c, a],
                _ => [a, b, c],
            };
            *welded.entry(p).or_insert_with(|| {
                let wave = f64::from(p[0] * 31 + p[1] * 17 + p[2] * 7).sin();
                let at = DVec3::from(p.map(f64::from)).normalize() * (1.0 + 0.02 * wave);
                positions.push(at.as_vec3());
                positions.len() as u32 - 1
            })
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let q = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    mesh(positions, triangles)
}

/// A disc of `n` irregular triangles around its centre, across `normal`, of unit radius. Every second
/// triangle has the opposite winding.
pub fn fan(n: u32, normal: DVec3, rng: &mut Rng) -> Mesh {
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let mut positions = vec![Vec3::ZERO];
    for i in 0..n {
        let (sin, cos) = (TAU * (f64::from(i) + 0.6 * rng.unit()) / f64::from(n)).sin_cos();
        positions.push((x * cos + y * sin).as_vec3());
    }
    let triangle = |i: u32| {
        let (a, b) = (1 + i, 1 + (i + 1) % n);
        if i.is_multiple_of(2) { [0, a, b] } else { [b, a, 0] }
    };
    mesh(positions, (0..n).map(triangle).collect())
}

/// A flat grid of n × n squares over [−1, 1]², with `axis` (0, 1, 2) as its normal.
pub fn grid(n: u32, axis: usize) -> Mesh {
    let at = |i: u32| (f64::from(i) / f64::from(n) * 2.0 - 1.0) as f32;
    let mut positions = Vec::new();
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let mut p = [0.0; 3];
        p[(axis + 1) % 3] = at(i);
        p[(axis + 2) % 3] = at(j);
        positions.push(Vec3::from(p));
    }
    let vertex = |i: u32, j: u32| i * (n + 1) + j;
    let triangles = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(|(i, j)| {
        let q = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        if (i + j) % 2 == 0 {
            [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
        } else {
            [[q[1], q[2], q[3]], [q[1], q[3], q[0]]]
        }
    });
    mesh(positions, triangles.collect())
}

/// A closed box of six grids over [−1, 1]³, welded.
pub fn cube(n: u32) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (axis, side) in (0..3).flat_map(|axis| [-1f32, 1.0].map(|side| (axis, side))) {
        let face = grid(n, axis);
        let base = positions.len() as u32;
        positions.extend(face.positions.iter().map(|&p| {
            let mut p = p.to_array();
            p[axis] = side;
            Vec3::from(p)
        }));
        triangles.extend(face.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + base);
            if side > 0.0 { [a, b, c] } else { [c, b, a] }
        }));
    }
    mesh(positions, triangles)
}

/// `n` triangles at random in the unit cube, about `size` large; some are slivers.
pub fn soup(n: u32, size: f64, rng: &mut Rng) -> Mesh {
    let mut positions = Vec::new();
    for i in 0..n {
        let (centre, along) = (rng.in_cube(), rng.in_cube() * size);
        let thin = if i % 7 == 0 { 1e-5 } else { 1.0 };
        let across = rng.in_cube() * size * thin;
        positions.extend([centre, centre + along, centre + across + 0.5 * along].map(|p| p.as_vec3()));
    }
    mesh(positions, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Adds `mesh` to `scene` with a new material, once for each transform.
pub fn add(scene: &mut Scene, mut mesh: Mesh, material: Material, placed: &[DAffine3]) {
    mesh.material = scene.materials.len() as u32;
    scene.materials.push(material);
    for &to_world in placed {
        let node = scene.nodes.len() as u32;
        let local = LocalTransform::Matrix(to_world);
        scene.nodes.push(Node { local, visible: true, ..Node::default() });
        let mesh = scene.meshes.len() as u32;
        scene.instances.push(Instance { node, mesh, object: 1, ..Instance::default() });
    }
    scene.meshes.push(mesh);
}

pub fn scene(mesh: Mesh, placed: &[DAffine3]) -> Scene {
    let mut scene = Scene::default();
    add(&mut scene, mesh, material(SurfaceClass::Opaque, true), placed);
    scene
}

/// A scene of one mesh of a material, where its vertices are.
pub fn of_material(mesh: Mesh, material: Material) -> Scene {
    let mut scene = Scene::default();
    add(&mut scene, mesh, material, &[DAffine3::IDENTITY]);
    scene
}

/// An orthographic view along −z of the square [−1, 1]².
pub fn front_view() -> View {
    View {
        view_point: Some(DVec3::Z * 5.0),
        look_at: Some(DVec3::ZERO),
        projection: Some(Projection::Orthographic),
        view_width: Some(2.0),
        view_height: Some(2.0),
        ..View::default()
    }
}

pub fn material(class: SurfaceClass, double_sided: bool) -> Material {
    let alpha_mode = match class {
        SurfaceClass::Opaque => AlphaMode::Opaque,
        SurfaceClass::Cutout => AlphaMode::Mask(0.5),
        SurfaceClass::Translucent => AlphaMode::Blend,
    };
    // Hits on materials that are not opaque are filtered.
    let alpha = ScalarInput::new(if class == SurfaceClass::Opaque { 1.0 } else { 0.4 });
    Material { alpha_mode, alpha, double_sided, ..Material::default() }
}

pub fn posed(scene: &Scene) -> PosedScene<'_> {
    pose(scene, &PoseSettings::default()).expect("the rest pose is always there")
}

pub fn build(posed: &PosedScene) -> Accel {
    Accel::build(posed, &AccelSettings::default()).0
}

/// The SIMD levels that this processor supports.
pub fn simd_levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported())
}

pub fn build_with(posed: &PosedScene, preset: Preset) -> Accel {
    Accel::build(posed, &AccelSettings { preset, ..AccelSettings::default() }).0
}

/// Accepts all hits; translucent surfaces attenuate by an amount that depends on the triangle.
pub struct Plain;

impl HitFilter for Plain {
    fn accepts(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmittance(&self, id: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::new(0.9, 0.7, 0.5 + 0.01 * (id.triangle % 40) as f32)
    }
}

/// Rejects every third triangle.
pub struct Holes;

impl HitFilter for Holes {
    fn accepts(&self, id: HitId, _: Vec3, _: Vec3) -> bool {
        !id.triangle.is_multiple_of(3)
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Vec3 {
        Plain.transmittance(id, o, d)
    }
}

/// Scale and distance from the origin of a test's mesh. `twice` instances it, for a BLAS of its own.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub scale: f64,
    pub offset: f64,
    pub twice: bool,
}

/// Every scale at the origin, and unit size at every offset; each once and twice.
pub fn placements() -> Vec<Placement> {
    let kinds = [(1e-4, 0.0), (1.0, 0.0), (1e6, 0.0), (1.0, 1e3), (1.0, 1e5)];
    let both = |(scale, offset)| [false, true].map(|twice| Placement { scale, offset, twice });
    kinds.into_iter().flat_map(both).collect()
}

impl Placement {
    /// The node transforms: a fixed rotation, and the second shifted along `aside`.
    pub fn transforms(&self, aside: DVec3) -> Vec<DAffine3> {
        let turn = glam::DQuat::from_axis_angle(DVec3::new(0.6, -0.64, 0.48), 1.1);
        let at = |shift: DVec3| {
            let offset = DVec3::new(1.0, -0.7, 0.3) * self.offset;
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(self.scale),
                turn,
                offset + turn * shift * self.scale,
            )
        };
        if self.twice { vec![at(DVec3::ZERO), at(aside)] } else { vec![at(DVec3::ZERO)] }
    }
}

/// A ball of unit radius with smooth normals, as rows of quads between its poles.
pub fn ball(around: u32, down: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=down {
        let (sin, cos) = (PI * f64::from(j) / f64::from(down)).sin_cos();
        for i in 0..=around {
            let (s, c) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            mesh.positions.push(DVec3::new(sin * s, cos, sin * c).as_vec3());
        }
    }
    for (j, i) in (0..down).flat_map(|j| (0..around).map(move |i| (j, i))) {
        let row = around + 1;
        let (a, b) = (j * row + i, (j + 1) * row + i);
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    mesh.normals = mesh.positions.clone();
    mesh
}

/// Asserts that two positive numbers differ by less than `tolerance`, relative to the second.
pub fn assert_near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value / expected - 1.0).abs() < tolerance, "{what}: {value}, expected {expected}");
}

/// Returns the mean radiance in red of a picture of 16 × 16 pixels.
pub fn mean_radiance(frame: &Frame, samples: u32) -> f64 {
    let settings = RenderSettings { width: 16, height: 16, samples, ..Default::default() };
    let pixels = render(frame, &Phong::default(), &settings, &()).unwrap().colors;
    let sum: f64 = pixels.iter().map(|color| f64::from(color.x)).sum();
    sum / pixels.len() as f64
}
