use glam::DAffine3;

use super::*;
use blinn_scene::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene, pose};

/// A scene with one mesh.
fn scene_of(mesh: Mesh, transform: DAffine3) -> Scene {
    Scene {
        meshes: vec![mesh],
        nodes: vec![Node { local: LocalTransform::Matrix(transform), visible: true, ..Node::default() }],
        instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

fn centred_at_origin() -> PoseSettings {
    PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }
}

/// Cycles' two conventions differ under a non-uniform scale.
#[test]
fn normals_are_interpolated_in_world_or_object_space() {
    let normals = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, 0.6), Vec3::Z];
    let scale = DVec3::new(1.0, 0.25, 1.0);
    let expected = |locally: bool| {
        let world = normals.map(|n| n.as_dvec3() / scale);
        let n = world.map(|n| if locally { n } else { n.normalize() });
        (n[0] * 0.5 + n[1] * 0.25 + n[2] * 0.25).normalize()
    };
    assert!(expected(true).dot(expected(false)) < 0.99);
    for locally in [false, true] {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: normals.into(),
            interpolate_normals_locally: locally,
            ..Mesh::default()
        };
        let scene = scene_of(mesh, DAffine3::from_scale(scale));
        let posed = pose(&scene, &centred_at_origin()).unwrap();
        let ray = Ray { o: Vec3::new(0.25, 0.0625, 1.0), d: Vec3::NEG_Z };
        let triangle = ShadingTriangle::new(&posed, HitId { instance: 0, triangle: 0 });
        let n = triangle.surface_point(ray, None).n_v;
        assert!(n.abs_diff_eq(expected(locally), 1e-6), "{locally}: {n}, not {}", expected(locally));
    }
}

/// Normals that lean more than 90° off their triangle, as those of foliage: Cycles reverses them on the back alone.
#[test]
fn normals_beyond_their_triangle_turn_to_it_unless_the_mesh_keeps_them() {
    let normal = Vec3::new(0.6, 0.0, -0.8);
    for (flips_winding, keeps, from_front, from_behind) in
        [(false, true, normal, -normal), (false, false, -normal, normal), (true, true, normal, -normal)]
    {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: vec![normal; 3],
            keeps_normal_side: keeps,
            ..Mesh::default()
        };
        let mirror = DAffine3::from_scale(DVec3::new(1.0, if flips_winding { -1.0 } else { 1.0 }, 1.0));
        let scene = scene_of(mesh, mirror);
        let posed = pose(&scene, &centred_at_origin()).unwrap();
        let triangle = ShadingTriangle::new(&posed, HitId { instance: 0, triangle: 0 });
        let y = if flips_winding { -0.25 } else { 0.25 };
        for (z, expected) in [(1.0, from_front), (-1.0, from_behind)] {
            let ray = Ray { o: Vec3::new(0.25, y, z), d: Vec3::new(0.0, 0.0, -z) };
            let point = triangle.surface_point(ray, None);
            assert!(point.n_g.z * f64::from(z) > 0.0);
            assert!(
                point.n_v.abs_diff_eq(expected.as_dvec3(), 1e-6),
                "{flips_winding} {keeps} {z}: {}",
                point.n_v
            );
        }
    }
}

/// Smooth, flat and degenerate triangles, from both sides, edge-on and past the edges; every number of rays, with and
/// without differentials, at every SIMD level.
#[test]
fn eight_hits_at_once_equal_single_hits() {
    let corners = [Vec3::ZERO, Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.2, 1.0, 0.3), Vec3::new(2.0, 0.2, 0.0)];
    let normals = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.8, 0.6), -Vec3::Z];
    let step = |x, y, z| DVec3::new(x, y, z) * 0.01;
    let differential =
        RayDifferential { o: [DVec3::ZERO; 2], d: [step(1.0, 0.2, 0.0), step(0.0, 1.0, -0.3)] };
    let ray = |i: usize| {
        let [x, y] = [i % 5, i / 5 % 7].map(|k| k as f32 * 0.3 - 0.4);
        let o = if i % 3 == 2 { Vec3::new(0.3, 0.4, -2.0) } else { Vec3::new(0.1, -0.2, 3.0) };
        let d = Vec3::new(x, y, 0.0) - o;
        Ray { o, d: if i % 11 == 10 { Vec3::new(1.0, 0.1, 0.0) } else { d } }
    };
    for (smooth, keeps_normal_side) in [(false, false), (true, false), (true, true)] {
        let mesh = Mesh {
            positions: corners.into(),
            triangles: vec![[0, 1, 2], [2, 3, 1], [0, 1, 3], [1, 1, 2]],
            normals: if smooth { normals.into() } else { Vec::new() },
            keeps_normal_side,
            ..Mesh::default()
        };
        let rotation = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.2);
        let scene = scene_of(mesh, rotation);
        let posed = pose(&scene, &centred_at_origin()).unwrap();
        for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported()) {
            let mut points = PointsSoa::default();
            let mut next = 0;
            for (id, differential) in (0..4).flat_map(|t| [(t, None), (t, Some(differential))]) {
                let triangle = ShadingTriangle::new(&posed, HitId { instance: 0, triangle: id });
                for count in (1..=HIT_LANES).cycle().take(40) {
                    let count = count.min(points.free_lanes());
                    let mut rays = Ray8::ZERO;
                    (0..count).for_each(|i| rays.set(i, ray(next + i)));
                    triangle.append_hits(simd, &rays, count, differential, &mut points);
                    for i in next..next + count {
                        let (block, lane) = points.lane(i);
                        // Compared as text, because NaN differs from itself.
                        let batched = format!("{:?}", triangle.surface.surface_from_hit(&block.hit(lane)));
                        let single = format!("{:?}", triangle.surface_point(ray(i), differential.as_ref()));
                        assert_eq!(batched, single, "{simd:?} {smooth} {id} {count}");
                    }
                    next += count;
                }
            }
        }
    }
}
