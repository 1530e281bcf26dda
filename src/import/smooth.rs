//! `--smooth`: normals by the angle between faces, whatever the file says of them.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::tangents;
use crate::scene::{GeneratedFrames, Mesh, Scene};

/// Which normals are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum NormalMode {
    /// The file's own, or what its format says of a mesh without.
    #[default]
    File,
    /// None: every triangle is flat.
    Flat,
    /// New ones: smooth across edges whose faces meet at less than this angle in degrees.
    CreaseAngle(f64),
}

/// Gives all meshes of a scene the normals that were asked for, and new tangents where a material
/// has a normal map.
pub(super) fn apply(scene: &mut Scene, mode: NormalMode) {
    if mode == NormalMode::File {
        return;
    }
    for mesh in &mut scene.meshes {
        mesh.normals = Vec::new();
        mesh.tangents = Vec::new();
        mesh.generated_frames = GeneratedFrames::None;
        for morph in &mut mesh.morph_targets {
            (morph.normals, morph.tangents) = (Vec::new(), Vec::new());
        }
    }
    if let NormalMode::CreaseAngle(degrees) = mode {
        for group in groups(scene) {
            by_angle(&mut scene.meshes, &group, libm::cos(degrees.to_radians()));
        }
    }
    for mesh in &mut scene.meshes {
        if let Some(map) = scene.materials.get(mesh.material as usize).and_then(|m| m.normal) {
            tangents::generate(mesh, &map.texture, &scene.source);
        }
    }
}

/// Meshes that are parts of one object: a change of material does not cut a surface.
fn groups(scene: &Scene) -> Vec<Vec<usize>> {
    let mut first: Vec<Option<(u32, u32)>> = vec![None; scene.meshes.len()];
    for instance in &scene.instances {
        first[instance.mesh as usize].get_or_insert((instance.node, instance.object));
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of = HashMap::new();
    for (mesh, first) in first.into_iter().enumerate() {
        let new = groups.len();
        let group = first.map_or(new, |f| *group_of.entry(f).or_insert(new));
        if group == new {
            groups.push(Vec::new());
        }
        groups[group].push(mesh);
    }
    groups
}

/// The angle of a face at its corner `p`, between the edges to its neighbours; radians.
pub(super) fn angle_at(p: DVec3, neighbours: [DVec3; 2]) -> f64 {
    let [a, b] = neighbours.map(|q| (q - p).normalize_or_zero());
    libm::acos(a.dot(b).clamp(-1.0, 1.0))
}

/// Makes the normals of some meshes as if they were one, at rest and in the shapes of their morph targets.
/// `least` is the cosine that the normals of two faces have at least, at rest, where their common edge is
/// smooth.
fn by_angle(meshes: &mut [Mesh], group: &[usize], least: f64) {
    let faces = faces(meshes, group);
    let normals = face_normals(meshes, &faces, None);
    // Vertices in one place are one, whatever else they carry.
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    let mut place_of: Vec<u32> = Vec::with_capacity(faces.len() * 3);
    for (m, t) in &faces {
        for &v in t {
            // Adding zero makes one of both zeros.
            let bits = (meshes[*m].positions[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
            let next = places.len() as u32;
            place_of.push(*places.entry(bits).or_insert(next));
        }
    }
    // Corners that are joined across smooth edges have one normal.
    let mut joined: Vec<u32> = (0..place_of.len() as u32).collect();
    for [a, b] in smooth_edges(&place_of, &normals, least) {
        join(&mut joined, a, b);
    }
    let roots: Vec<u32> = (0..joined.len() as u32).map(|c| root(&mut joined, c)).collect();
    let mut start = 0;
    for &m in group {
        let corners = start..start + 3 * meshes[m].triangles.len();
        split(&mut meshes[m], &roots[corners.clone()]);
        start = corners.end;
    }
    let targets = group.iter().map(|&m| meshes[m].morph_targets.len()).max().unwrap_or(0);
    for shape in [None].into_iter().chain((0..targets).map(Some)) {
        let normals = corner_normals(meshes, group, shape, &roots);
        let mut normals = &normals[..];
        for &m in group {
            let mesh = &mut meshes[m];
            let own = normals.split_off(..3 * mesh.triangles.len()).unwrap_or_default();
            give(mesh, shape, own);
        }
    }
}

/// Gives a mesh its corners' normals: its own, or what they differ from those in the shape of a morph target.
fn give(mesh: &mut Mesh, shape: Option<usize>, corners: &[Vec3]) {
    let corners = || mesh.triangles.as_flattened().iter().map(|&v| v as usize).zip(corners);
    let Some(target) = shape else {
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
        corners().for_each(|(v, &normal)| mesh.normals[v] = normal);
        return;
    };
    let Some(target) = mesh.morph_targets.get_mut(target).filter(|target| !target.positions.is_empty())
    else {
        return;
    };
    target.normals = vec![Vec3::ZERO; mesh.positions.len()];
    corners().for_each(|(v, &normal)| target.normals[v] = normal - mesh.normals[v]);
}

/// The normals of faces at rest, or in the shape of a morph target; 0 without an area.
fn face_normals(meshes: &[Mesh], faces: &[(usize, [u32; 3])], shape: Option<usize>) -> Vec<DVec3> {
    let normal = |(m, t): &(usize, [u32; 3])| {
        let [a, b, c] = corners(&meshes[*m], t, shape);
        (b - a).cross(c - a).normalize_or_zero()
    };
    faces.par_iter().map(normal).collect()
}

/// Where a face's corners are at rest, or in the shape of a morph target.
fn corners(mesh: &Mesh, t: &[u32; 3], shape: Option<usize>) -> [DVec3; 3] {
    let target = shape.and_then(|target| mesh.morph_targets.get(target));
    let moved = |v: u32| target.and_then(|t| t.positions.get(v as usize)).copied().unwrap_or_default();
    t.map(|v| mesh.positions[v as usize].as_dvec3() + moved(v).as_dvec3())
}

/// The unit normal of each corner of some meshes in a shape: the mean of the faces whose corners have its root,
/// weighted by their angles.
fn corner_normals(meshes: &[Mesh], group: &[usize], shape: Option<usize>, roots: &[u32]) -> Vec<Vec3> {
    let faces = faces(meshes, group);
    let normals = face_normals(meshes, &faces, shape);
    let mut sums = vec![DVec3::ZERO; roots.len()];
    for (i, (m, t)) in faces.iter().enumerate() {
        let p = corners(&meshes[*m], t, shape);
        for k in 0..3 {
            let angle = angle_at(p[k], [p[(k + 1) % 3], p[(k + 2) % 3]]);
            sums[roots[3 * i + k] as usize] += normals[i] * angle;
        }
    }
    let unit = |(corner, &root): (usize, &u32)| {
        // Where faces cancel, one of their own.
        let n = sums[root as usize].try_normalize().unwrap_or(normals[corner / 3]);
        n.try_normalize().unwrap_or(DVec3::Y).as_vec3()
    };
    roots.iter().enumerate().map(unit).collect()
}

/// The triangles of some meshes, each with its mesh.
fn faces(meshes: &[Mesh], group: &[usize]) -> Vec<(usize, [u32; 3])> {
    group.iter().flat_map(|&m| meshes[m].triangles.iter().map(move |t| (m, *t))).collect()
}

/// Pairs of corners that meet at the ends of smooth edges.
fn smooth_edges(place_of: &[u32], normals: &[DVec3], least: f64) -> Vec<[u32; 2]> {
    /// Faces at one edge that are compared each with each.
    const MOST: usize = 16;
    // An edge by its places, and the corner that it starts from.
    let next = |c: u32| if c % 3 == 2 { c - 2 } else { c + 1 };
    let mut edges: Vec<([u32; 2], u32)> = (0..place_of.len() as u32)
        .map(|c| {
            let (a, b) = (place_of[c as usize], place_of[next(c) as usize]);
            ([a.min(b), a.max(b)], c)
        })
        .filter(|(places, _)| places[0] != places[1])
        .collect();
    edges.par_sort_unstable();
    let mut out = Vec::new();
    for same in edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() <= MOST) {
        for (i, &(_, c)) in same.iter().enumerate() {
            for &(_, d) in &same[i + 1..] {
                if normals[c as usize / 3].dot(normals[d as usize / 3]) <= least {
                    continue;
                }
                let turned = place_of[c as usize] != place_of[d as usize];
                let (d, d_next) = if turned { (next(d), d) } else { (d, next(d)) };
                out.extend([[c, d], [next(c), d_next]]);
            }
        }
    }
    out
}

fn root(joined: &mut [u32], mut c: u32) -> u32 {
    while joined[c as usize] != c {
        joined[c as usize] = joined[joined[c as usize] as usize];
        c = joined[c as usize];
    }
    c
}

fn join(joined: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(joined, a), root(joined, b));
    // The lower one stays, so that the order of joining does not matter.
    joined[a.max(b) as usize] = a.min(b);
}

/// Gives each vertex as many copies as its corners have different keys.
fn split(mesh: &mut Mesh, keys: &[u32]) {
    let vertices = mesh.positions.len();
    let mut own: Vec<Option<u32>> = vec![None; vertices];
    let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
    let mut copied: Vec<u32> = Vec::new();
    for (corner, &key) in mesh.triangles.as_flattened_mut().iter_mut().zip(keys) {
        let vertex = *corner;
        if *own[vertex as usize].get_or_insert(key) != key {
            *corner = *copies.entry((vertex, key)).or_insert_with(|| {
                copied.push(vertex);
                (vertices + copied.len() - 1) as u32
            });
        }
    }
    tangents::append(mesh, &copied);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, MorphTarget, Node};

    /// A scene of one mesh for each list of triangles, all of one object.
    fn scene(positions: &[[f32; 3]], parts: &[&[[u32; 3]]]) -> Scene {
        let mesh = |triangles: &&[[u32; 3]]| Mesh {
            positions: positions.iter().map(|p| Vec3::from_array(*p)).collect(),
            normals: vec![Vec3::X; positions.len()],
            triangles: triangles.to_vec(),
            ..Default::default()
        };
        let instance = |mesh: u32| Instance { node: 0, mesh, object: 1, ..Instance::default() };
        Scene {
            nodes: vec![Node { visible: true, ..Default::default() }],
            meshes: parts.iter().map(mesh).collect(),
            materials: vec![Material::default()],
            instances: (0..parts.len() as u32).map(instance).collect(),
            ..Default::default()
        }
    }

    /// Two squares that meet at a right angle along the z axis.
    const CORNER: [[f32; 3]; 6] =
        [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.], [1., 0., 1.], [0., 1., 0.], [0., 1., 1.]];
    const FLOOR: [[u32; 3]; 2] = [[0, 1, 3], [0, 3, 2]];
    const WALL: [[u32; 3]; 2] = [[0, 4, 5], [0, 5, 1]];

    fn at_edge(scene: &Scene) -> Vec<Vec3> {
        let mut out = Vec::new();
        for mesh in &scene.meshes {
            for v in mesh.triangles.as_flattened().iter().map(|&v| v as usize) {
                let (p, n) = (mesh.positions[v], mesh.normals[v]);
                if p.x == 0.0 && p.y == 0.0 && !out.contains(&n) {
                    out.push(n);
                }
            }
        }
        out
    }

    #[test]
    fn edges_are_smooth_below_the_angle_and_sharp_from_it_on() {
        let both = [FLOOR, WALL].concat();
        for parts in [vec![&both[..]], vec![&FLOOR[..], &WALL[..]]] {
            let mut smooth = scene(&CORNER, &parts);
            apply(&mut smooth, NormalMode::CreaseAngle(91.0));
            let [n] = at_edge(&smooth)[..] else { panic!("{:?}", at_edge(&smooth)) };
            assert!(n.abs_diff_eq(Vec3::new(1.0, 1.0, 0.0).normalize(), 1e-6), "{n}");
            let mut sharp = scene(&CORNER, &parts);
            apply(&mut sharp, NormalMode::CreaseAngle(90.0));
            assert_eq!(at_edge(&sharp), [Vec3::Y, Vec3::X]);
            // The two triangles of a square still share their vertices.
            let vertices: usize = sharp.meshes.iter().map(|m| m.normals.len()).sum();
            assert_eq!(vertices, if parts.len() == 1 { 8 } else { 12 });
        }
    }

    #[test]
    fn off_is_flat_and_file_changes_nothing() {
        let mut off = scene(&CORNER, &[&FLOOR]);
        apply(&mut off, NormalMode::Flat);
        assert!(off.meshes[0].normals.is_empty());
        let mut file = scene(&CORNER, &[&FLOOR]);
        apply(&mut file, NormalMode::File);
        assert_eq!(file.meshes[0].normals, [Vec3::X; 6]);
    }

    #[test]
    fn seams_of_texture_coordinates_stay_smooth_and_keep_their_coordinates() {
        // The wall has vertices of its own along the edge.
        let mut positions = CORNER.to_vec();
        positions.extend([CORNER[0], CORNER[1]]);
        let both = [FLOOR, [[6, 4, 5], [6, 5, 7]]].concat();
        let mut scene = scene(&positions, &[&both]);
        let uvs: Vec<_> = (0..8).map(|i| glam::Vec2::splat(i as f32)).collect();
        scene.meshes[0].uvs = vec![uvs.clone()];
        apply(&mut scene, NormalMode::CreaseAngle(120.0));
        assert_eq!(at_edge(&scene).len(), 1);
        assert_eq!(scene.meshes[0].uvs[0], uvs);
    }

    #[test]
    fn a_cone_of_slanted_faces_is_smooth_around_and_sharp_at_its_base() {
        let n = 32;
        let ring = |i: u32| {
            let a = std::f32::consts::TAU * (i % n) as f32 / n as f32;
            [a.cos(), 0.0, a.sin()]
        };
        let mut positions = vec![[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        positions.extend((0..n).map(ring));
        let mut triangles = Vec::new();
        for i in 0..n {
            let (a, b) = (2 + i, 2 + (i + 1) % n);
            triangles.extend([[0, b, a], [1, a, b]]);
        }
        let mut scene = scene(&positions, &[&triangles]);
        apply(&mut scene, NormalMode::CreaseAngle(30.0));
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.positions.len(), 2 + 2 * n as usize);
        assert!(mesh.normals[0].abs_diff_eq(Vec3::Y, 1e-5) && mesh.normals[1].abs_diff_eq(-Vec3::Y, 1e-5));
    }

    /// What is smooth at rest is smooth as it bends, and so bends its normals.
    #[test]
    fn morph_targets_have_normals_of_their_shapes() {
        let mut scene = scene(&CORNER, &[&[FLOOR, WALL].concat()]);
        // Lays the wall down, so that all lies in one plane.
        let mut down = vec![Vec3::ZERO; 6];
        down[4..].fill(Vec3::new(-1.0, -1.0, 0.0));
        let target = MorphTarget { positions: down, normals: vec![Vec3::X; 6], ..MorphTarget::default() };
        scene.meshes[0].morph_targets = vec![target, MorphTarget::default()];
        for (angle, vertices) in [(120.0, 6), (30.0, 8)] {
            let mut scene = scene.clone();
            apply(&mut scene, NormalMode::CreaseAngle(angle));
            let Mesh { normals, morph_targets, .. } = &scene.meshes[0];
            let deltas = (morph_targets[0].normals.len(), morph_targets[1].normals.len());
            assert_eq!((normals.len(), deltas), (vertices, (vertices, 0)));
            for (n, d) in normals.iter().zip(&morph_targets[0].normals) {
                assert!((n + d).abs_diff_eq(Vec3::Y, 1e-6), "{n} and {d}");
            }
        }
    }

    #[test]
    fn wild_numbers_do_no_harm() {
        for wild in [f32::NAN, f32::INFINITY, 1e38, 0.0] {
            let mut positions = CORNER;
            positions[1] = [wild; 3];
            let mut scene = scene(&positions, &[&[FLOOR, WALL, FLOOR].concat()]);
            apply(&mut scene, NormalMode::CreaseAngle(60.0));
            assert!(scene.meshes[0].normals.iter().all(|n| n.is_normalized()));
        }
    }
}
