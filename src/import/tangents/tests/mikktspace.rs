//! Compares tangents with the package bevy_mikktspace, bit by bit except for the sign of zero.

use std::collections::HashSet;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use proptest::prelude::*;

use super::*;

/// Square root and arc cosine with the same bits on all platforms.
struct SameOps;

impl Ops for SameOps {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

/// A mesh as the package reads it.
struct PackageMesh<'m> {
    mesh: &'m Mesh,
    faces: Vec<usize>,
    tangents: Vec<Option<Vec4>>,
}

impl PackageMesh<'_> {
    fn vertex(&self, face: usize, k: usize) -> usize {
        self.mesh.triangles[self.faces[face]][k] as usize
    }
}

impl Geometry<SameOps> for PackageMesh<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, k: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, k)].into()
    }

    fn normal(&self, face: usize, k: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, k)].into()
    }

    fn tex_coord(&self, face: usize, k: usize) -> [f32; 2] {
        let uv = self.mesh.uvs[0][self.vertex(face, k)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, k: usize) {
        let corner = self.faces[face] * 3 + k;
        self.tangents[corner] = space.map(|space| Vec4::from(space.tangent_encoded()));
    }
}

/// The package's tangents of all corners. Triangles without area and duplicates have none.
fn package_tangents(mesh: &Mesh) -> Vec<Option<Vec4>> {
    let key = |v: u32| {
        let v = v as usize;
        let [p, n, t] = [mesh.positions[v], mesh.normals[v], mesh.uvs[0][v].extend(0.0)];
        [p.x, p.y, p.z, n.x, n.y, n.z, t.x, 1.0 - t.y].map(|x| (x + 0.0).to_bits())
    };
    let mut seen = HashSet::new();
    let mut is_new = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(key);
        let turned = [[a, b, c], [b, c, a], [c, a, b]];
        seen.insert(turned.into_iter().min())
    };
    let has_area = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        a != b && b != c && c != a
    };
    let used = |&t: &usize| has_area(mesh.triangles[t]) && is_new(mesh.triangles[t]);
    let faces = (0..mesh.triangles.len()).filter(used).collect();
    let mut geometry = PackageMesh { mesh, faces, tangents: vec![None; mesh.triangles.len() * 3] };
    generate_tangents(&mut geometry).unwrap();
    geometry.tangents
}

fn assert_equals_package(mesh: &Mesh, name: &str) {
    let own = corner_tangents(mesh, &mesh.uvs[0]);
    let own = own.corners.iter().map(|&id| own.tangents.get(id as usize).copied());
    let mut compared = 0;
    // Overflow makes tangents that are not finite, and replaced later. Duplicates have tangents here only.
    let finite = |tangent: Option<Vec4>| tangent.filter(|tangent| tangent.is_finite());
    for (corner, (own, package)) in own.zip(package_tangents(mesh)).enumerate() {
        let [own, package] = [own, package].map(finite);
        if package.is_some() {
            assert_eq!(own, package, "{name}, corner {corner}");
            compared += 1;
        }
    }
    assert!(compared > 0 || mesh.triangles.len() < 24, "{name}");
}

/// A small generator of numbers from 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn below(&mut self, end: usize) -> usize {
        ((self.next() * end as f32) as usize).min(end - 1)
    }
}

/// A sphere with bumps, a seam and poles, and smooth normals. `uv` maps coordinates from 0 to 1.
fn sphere(rings: u32, uv: impl Fn(Vec2) -> Vec2) -> Mesh {
    let mut mesh = Mesh { uvs: vec![Vec::new()], ..Mesh::default() };
    let segments = 2 * rings;
    for i in 0..=rings {
        for j in 0..=segments {
            let [t, s] = [i as f32 / rings as f32, j as f32 / segments as f32];
            let theta = t * std::f32::consts::PI;
            let phi = (j % segments) as f32 / segments as f32 * std::f32::consts::TAU;
            let normal = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.positions.push(normal * (1.0 + 0.1 * (5.0 * theta).sin() * (7.0 * phi).cos()));
            mesh.normals.push(normal);
            mesh.uvs[0].push(uv(Vec2::new(s, t)));
        }
    }
    for i in 0..rings {
        for j in 0..segments {
            let a = i * (segments + 1) + j;
            let b = a + segments + 1;
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

/// A disk whose coordinates go twice around its center, so that tangents on opposite sides are opposed.
fn twofold_disk(segments: u32) -> Mesh {
    let mut mesh = Mesh { uvs: vec![vec![Vec2::new(0.5, 0.0)]], ..Mesh::default() };
    mesh.positions.push(Vec3::ZERO);
    mesh.triangles.extend((0..segments).map(|i| [0, i + 1, (i + 1) % segments + 1]));
    for i in 0..segments {
        let turn = i as f32 / segments as f32;
        let phi = turn * std::f32::consts::TAU;
        mesh.positions.push(Vec3::new(phi.cos(), phi.sin(), 0.0));
        mesh.uvs[0].push(Vec2::new(0.5 + 0.5 * (phi * 2.0).cos(), 1.0 + 0.5 * (phi * 2.0).sin()));
    }
    mesh.normals = vec![Vec3::Z; mesh.positions.len()];
    mesh
}

/// Shuffles and turns triangles.
fn shuffled(mut mesh: Mesh, numbers: &mut Numbers) -> Mesh {
    for i in (1..mesh.triangles.len()).rev() {
        mesh.triangles.swap(i, numbers.below(i + 1));
    }
    for triangle in &mut mesh.triangles {
        triangle.rotate_left(numbers.below(3));
    }
    mesh
}

/// Gives each corner a vertex of its own; `flat` with the normals of triangles.
fn soup(mut mesh: Mesh, flat: bool) -> Mesh {
    let normals = std::mem::take(&mut mesh.normals);
    let corners: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    flat::generate_normals(&mut mesh);
    if !flat {
        mesh.normals = corners.iter().map(|&v| normals[v as usize]).collect();
    }
    mesh
}

/// Collapses some triangles and some coordinates, repeats and reverses some triangles.
fn damaged(mut mesh: Mesh, numbers: &mut Numbers) -> Mesh {
    for _ in 0..mesh.positions.len() / 8 {
        let [a, b] = [(); 2].map(|()| numbers.below(mesh.positions.len()));
        mesh.uvs[0][a] = mesh.uvs[0][b];
        let t = numbers.below(mesh.triangles.len());
        let [p, q, r] = mesh.triangles[t];
        match numbers.below(4) {
            0 => mesh.positions[p as usize] = mesh.positions[q as usize],
            1 => mesh.triangles.push([q, r, p]),
            2 => mesh.triangles.push([p, r, q]),
            _ => [p, q, r].iter().for_each(|&v| mesh.uvs[0][v as usize] = mesh.uvs[0][p as usize]),
        }
    }
    mesh
}

#[test]
fn tangents_equal_those_of_the_package() {
    let mut numbers = Numbers(1);
    let whole = |uv: Vec2| uv;
    let mirrored = |uv: Vec2| Vec2::new((uv.x - 0.5).abs(), uv.y);
    let turned = |uv: Vec2| Vec2::new(uv.y + 0.3 * uv.x, uv.x * uv.x);
    let coarse = |uv: Vec2| (uv * 4.0).floor() / 4.0;
    let mut compared = 0;
    let mut check = |mesh: &Mesh, name: &str| {
        assert_equals_package(mesh, name);
        compared += 1;
    };
    for rings in [2, 3, 8, 16] {
        let maps: [(&str, &dyn Fn(Vec2) -> Vec2); 4] =
            [("whole", &whole), ("mirrored", &mirrored), ("turned", &turned), ("coarse", &coarse)];
        for (name, uv) in maps {
            let mesh = sphere(rings, uv);
            check(&mesh, name);
            check(&shuffled(mesh.clone(), &mut numbers), &format!("{name}, shuffled"));
            check(&soup(mesh.clone(), false), &format!("{name}, soup"));
            check(&soup(shuffled(mesh.clone(), &mut numbers), true), &format!("{name}, flat"));
            for _ in 0..8 {
                let mesh = shuffled(damaged(mesh.clone(), &mut numbers), &mut numbers);
                check(&mesh, &format!("{name}, damaged"));
                check(&soup(mesh, false), &format!("{name}, damaged soup"));
            }
        }
    }
    for segments in [3, 4, 5, 6, 8, 64, 999] {
        check(&twofold_disk(segments), "disk");
        check(&shuffled(twofold_disk(segments), &mut numbers), "shuffled disk");
    }
    let mut fan = twofold_disk(1500);
    fan.uvs[0] = fan.positions.iter().map(|p| p.truncate()).collect();
    check(&fan, "fan");
    assert_eq!(compared, 4 * 4 * 20 + 15);
}

/// The disks above have vertices whose group is split.
#[test]
fn opposed_tangents_split_a_group() {
    let mesh = twofold_disk(8);
    let tangents = corner_tangents(&mesh, &mesh.uvs[0]);
    let center: HashSet<u32> = (0..8).map(|t| tangents.corners[3 * t]).collect();
    assert!(center.len() > 1, "{center:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]
    #[test]
    fn degenerate_meshes_equal_those_of_the_package(mesh in degenerate_meshes()) {
        assert_equals_package(&mesh, "degenerate");
    }
}
