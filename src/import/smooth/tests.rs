use super::*;
use blinn_core::cancellation::CancelToken;
use blinn_scene::{Instance, Material, MorphTarget, Node};

/// A scene with one mesh per list of triangles, all of one object.
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

/// Distinct normals along the z axis.
fn normals_at_edge(scene: &Scene) -> Vec<Vec3> {
    let mut out = Vec::new();
    for mesh in &scene.meshes {
        for v in mesh.triangles.as_flattened().iter().map(|&v| v as usize) {
            let p = mesh.positions[v];
            let n = mesh.normals[v];
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
        apply(&mut smooth, NormalMode::CreaseAngle(91.0), &CancelToken::default()).unwrap();
        let [n] = normals_at_edge(&smooth)[..] else { panic!("{:?}", normals_at_edge(&smooth)) };
        assert!(n.abs_diff_eq(Vec3::new(1.0, 1.0, 0.0).normalize(), 1e-6), "{n}");
        let mut sharp = scene(&CORNER, &parts);
        apply(&mut sharp, NormalMode::CreaseAngle(90.0), &CancelToken::default()).unwrap();
        assert_eq!(normals_at_edge(&sharp), [Vec3::Y, Vec3::X]);
        // The two triangles of a square share their vertices.
        let vertices: usize = sharp.meshes.iter().map(|m| m.normals.len()).sum();
        assert_eq!(vertices, if parts.len() == 1 { 8 } else { 12 });
    }
}

#[test]
fn flat_mode_removes_normals_and_file_mode_keeps_them() {
    let mut off = scene(&CORNER, &[&FLOOR]);
    apply(&mut off, NormalMode::Flat, &CancelToken::default()).unwrap();
    assert!(off.meshes[0].normals.is_empty());
    let mut file = scene(&CORNER, &[&FLOOR]);
    apply(&mut file, NormalMode::File, &CancelToken::default()).unwrap();
    assert_eq!(file.meshes[0].normals, [Vec3::X; 6]);
}

#[test]
fn texture_seams_are_smooth_and_keep_their_coordinates() {
    // The wall has its own vertices along the edge.
    let mut positions = CORNER.to_vec();
    positions.extend([CORNER[0], CORNER[1]]);
    let both = [FLOOR, [[6, 4, 5], [6, 5, 7]]].concat();
    let mut scene = scene(&positions, &[&both]);
    let uvs: Vec<_> = (0..8).map(|i| glam::Vec2::splat(i as f32)).collect();
    scene.meshes[0].uvs = vec![uvs.clone()];
    apply(&mut scene, NormalMode::CreaseAngle(120.0), &CancelToken::default()).unwrap();
    assert_eq!(normals_at_edge(&scene).len(), 1);
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
        let a = 2 + i;
        let b = 2 + (i + 1) % n;
        triangles.extend([[0, b, a], [1, a, b]]);
    }
    let mut scene = scene(&positions, &[&triangles]);
    apply(&mut scene, NormalMode::CreaseAngle(30.0), &CancelToken::default()).unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions.len(), 2 + 2 * n as usize);
    assert!(mesh.normals[0].abs_diff_eq(Vec3::Y, 1e-5) && mesh.normals[1].abs_diff_eq(-Vec3::Y, 1e-5));
}

/// Edges that are smooth in the base shape are smooth in morph targets.
#[test]
fn morph_targets_get_the_normals_of_their_shapes() {
    let mut scene = scene(&CORNER, &[&[FLOOR, WALL].concat()]);
    // The target lays the wall down into the plane of the floor.
    let mut down = vec![Vec3::ZERO; 6];
    down[4..].fill(Vec3::new(-1.0, -1.0, 0.0));
    let target = MorphTarget { positions: down, normals: vec![Vec3::X; 6], ..MorphTarget::default() };
    scene.meshes[0].morph_targets = vec![target, MorphTarget::default()];
    for (angle, vertices) in [(120.0, 6), (30.0, 8)] {
        let mut scene = scene.clone();
        apply(&mut scene, NormalMode::CreaseAngle(angle), &CancelToken::default()).unwrap();
        let Mesh { normals, morph_targets, .. } = &scene.meshes[0];
        let deltas = (morph_targets[0].normals.len(), morph_targets[1].normals.len());
        assert_eq!((normals.len(), deltas), (vertices, (vertices, 0)));
        for (n, d) in normals.iter().zip(&morph_targets[0].normals) {
            assert!((n + d).abs_diff_eq(Vec3::Y, 1e-6), "{n} and {d}");
        }
    }
}

#[test]
fn invalid_positions_yield_unit_normals() {
    for value in [f32::NAN, f32::INFINITY, 1e38, 0.0] {
        let mut positions = CORNER;
        positions[1] = [value; 3];
        let mut scene = scene(&positions, &[&[FLOOR, WALL, FLOOR].concat()]);
        apply(&mut scene, NormalMode::CreaseAngle(60.0), &CancelToken::default()).unwrap();
        assert!(scene.meshes[0].normals.iter().all(|n| n.is_normalized()));
    }
}
