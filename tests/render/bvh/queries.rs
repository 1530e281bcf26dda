//! Closest hits, layers and occlusion: single rays, packets and the counting traversal.

use blinn::accel::{
    Accel, AccelSettings, Coherence, FlattenBudget, Preset, RayBatch, ShadowRayBatch, SimdLevel,
};
use blinn::geometry::HitId;
use blinn::scene::{PoseSettings, PosedScene, Scene, SurfaceClass, pose};
use glam::{DAffine3, DVec3, Vec3};

use super::{FLATTENED, all_scenes, bits, layers, rays, segments};
use crate::common::scenes::{self, Holes, Rng};

/// All layers, occlusion and transmittance of every preset and SIMD level equal those of testing every
/// triangle.
#[test]
fn every_bvh_answers_as_brute_force_does() {
    let all = all_scenes();
    assert_eq!(all.len(), 9);
    for ((name, scene), flatten) in all.iter().flat_map(|scene| FLATTENED.map(|flatten| (scene, flatten))) {
        let posed = scenes::posed(scene);
        if flatten == FlattenBudget::ZERO && posed.instances.len() == 1 {
            continue;
        }
        let rays = rays(&posed, if *name == "soup" { 100 } else { 500 });
        let segments = segments(&rays);
        let answers = |preset, simd| {
            let accel = Accel::build(&posed, &AccelSettings { preset, simd, flatten }).0;
            let (mut occluded, mut light) = (Vec::new(), Vec::new());
            accel.occluded(&segments, &Holes, &mut occluded);
            accel.transmittance(&segments, &Holes, &mut light);
            let light: Vec<[u32; 3]> = light.iter().map(|l| l.to_array().map(f32::to_bits)).collect();
            let seen = [false, true].map(|cull| bits(&layers(&accel, &rays, cull, Coherence::None)));
            (seen, occluded, light)
        };
        let brute_force = answers(Preset::BruteForce, SimdLevel::Portable);
        let hits = brute_force.0[0].iter().flatten().filter(|hit| hit.1 != HitId::NONE).count();
        assert!(hits > 200, "{name}: only {hits} hits to compare");
        let medium = scenes::simd_levels().map(|simd| (Preset::Medium, simd));
        for (preset, simd) in medium.chain([Preset::Fast, Preset::Slow].map(|p| (p, SimdLevel::detect()))) {
            let with_bvh = answers(preset, simd);
            for (i, ray) in rays.iter().enumerate() {
                for cull in 0..2 {
                    assert_eq!(
                        with_bvh.0[cull][i], brute_force.0[cull][i],
                        "{name} {preset:?} {simd:?}: ray {i} {ray:?}"
                    );
                }
                assert_eq!(with_bvh.1[i], brute_force.1[i], "{name} {preset:?} {simd:?}: shadow {i}");
                assert_eq!(with_bvh.2[i], brute_force.2[i], "{name} {preset:?} {simd:?}: light {i}");
            }
        }
    }
}

/// The traversal that counts nodes and blocks returns the same hits, and the same counts at every SIMD level.
#[test]
fn the_counting_traversal_finds_the_same_hits() {
    for (name, scene) in &all_scenes() {
        let posed = scenes::posed(scene);
        let rays = rays(&posed, 300);
        let mut batch = RayBatch { cull_back_faces: true, t_max: 5.0, ..RayBatch::default() };
        rays.iter().for_each(|(o, d)| batch.push(*o, *d));
        let accel = Accel::build(&posed, &AccelSettings::default()).0;
        let counted = accel.intersect_with_stats(&batch, &Holes);
        let mut hits = Vec::new();
        accel.intersect(&batch, &Holes, &mut hits);
        let mut nodes = 0;
        let mut blocks = 0;
        for (i, (hit, stats)) in counted.iter().enumerate() {
            assert_eq!((hit.t.to_bits(), hit.id), (hits[i].t.to_bits(), hits[i].id), "{name}: ray {i}");
            assert!(hit.is_miss() || stats.blocks > 0, "{name}: ray {i}");
            nodes += stats.nodes;
            blocks += stats.blocks;
        }
        let portable = AccelSettings { simd: SimdLevel::Portable, ..AccelSettings::default() };
        assert_eq!(Accel::build(&posed, &portable).0.intersect_with_stats(&batch, &Holes), counted, "{name}");
        // A BVH skips most triangles; brute force skips none.
        let brute_force = AccelSettings { preset: Preset::BruteForce, ..AccelSettings::default() };
        let brute_force = Accel::build(&posed, &brute_force).0;
        let all: u32 =
            brute_force.intersect_with_stats(&batch, &Holes).iter().map(|(_, stats)| stats.blocks).sum();
        assert!(nodes > 0 && blocks < all, "{name}: {nodes} nodes, {blocks} of {all} blocks");
        let (cost, brute_force_cost) = (accel.sah_cost(), brute_force.sah_cost());
        assert!(cost > 1.0 && cost < brute_force_cost, "{name}: {cost} of {brute_force_cost}");
    }
    let empty = Scene::default();
    assert_eq!(Accel::build(&scenes::posed(&empty), &AccelSettings::default()).0.sah_cost(), 0.0);
}

/// The any-hit traversal that counts finds the same occlusion, with the same counts at every SIMD level, and stops at
/// the first occluder.
#[test]
fn the_counting_any_hit_traversal_finds_the_same_occlusion() {
    for (name, scene) in &all_scenes() {
        let posed = scenes::posed(scene);
        let segments = segments(&rays(&posed, 300));
        let accel = Accel::build(&posed, &AccelSettings::default()).0;
        let counted = accel.occluded_with_stats(&segments, &Holes);
        let mut occluded = Vec::new();
        accel.occluded(&segments, &Holes, &mut occluded);
        let found: Vec<bool> = counted.iter().map(|(occluded, _)| *occluded).collect();
        assert_eq!(found, occluded, "{name}");
        for (i, (occluded, stats)) in counted.iter().enumerate() {
            assert!(!occluded || stats.triangles > 0, "{name}: segment {i}");
            assert!(
                stats.triangles >= stats.blocks && stats.triangles <= 4 * stats.blocks,
                "{name}: {stats:?}"
            );
        }
        let portable = AccelSettings { simd: SimdLevel::Portable, ..AccelSettings::default() };
        assert_eq!(
            Accel::build(&posed, &portable).0.occluded_with_stats(&segments, &Holes),
            counted,
            "{name}"
        );
    }
}

/// Rays of a packet with a common origin or direction, close together, many at vertices and edges. Every 16
/// aim at a few triangles of their own.
fn coherent_rays(
    posed: &PosedScene,
    rng: &mut Rng,
    along: bool,
    count: usize,
) -> (Coherence, Vec<(Vec3, Vec3)>) {
    let instance = rng.below(posed.instances.len()) as u32;
    let triangles = posed.mesh(instance).triangles.len();
    let first = rng.below(triangles);
    let corner = |triangle: usize, corner: usize| {
        posed.world_triangle(HitId { instance, triangle: (triangle % triangles) as u32 })[corner % 3]
    };
    let o = (rng.in_cube() * 4.0).as_vec3();
    let d = if rng.one_in(4) { Vec3::new(0.0, -2.0, 0.0) } else { corner(first, 0) - o };
    let spread = 10f64.powf(-4.0 * rng.unit());
    let target = |rng: &mut Rng, group: usize| {
        let first = first + group % 5 * 2;
        let v = corner(first + rng.below(4), rng.below(3));
        match rng.below(3) {
            0 => v,
            1 => v.lerp(corner(first, rng.below(3)), rng.unit() as f32),
            _ => v + (rng.in_cube() * spread).as_vec3(),
        }
    };
    let targets = (0..count).map(|i| target(rng, i / 16));
    let rays = targets.map(|to| if along { (to - d, d) } else { (o, to - o) }).collect();
    (if along { Coherence::Direction(d) } else { Coherence::Origin(o) }, rays)
}

/// Packets of rays with a common origin or direction return the same as single rays: every layer, occlusion
/// and transmittance at every SIMD level.
#[test]
fn packets_answer_as_single_rays_do() {
    let all = all_scenes();
    for ((name, scene), flatten) in all.iter().flat_map(|scene| FLATTENED.map(|flatten| (scene, flatten))) {
        let posed = scenes::posed(scene);
        if flatten == FlattenBudget::ZERO && posed.instances.len() == 1 {
            continue;
        }
        let build = |simd| Accel::build(&posed, &AccelSettings { preset: Preset::Medium, simd, flatten }).0;
        let single = build(SimdLevel::Portable);
        let accels = scenes::simd_levels().map(|simd| (simd, build(simd))).collect::<Vec<_>>();
        let mut rng = Rng::new(3);
        for n in 0..60 {
            // Full packets, parts of packets, and incomplete groups.
            let count = [64, 300, 23, 256][n % 4];
            let (shared, rays) = coherent_rays(&posed, &mut rng, n % 3 == 2, count);
            let cull = n % 2 == 0;
            let one_by_one = bits(&layers(&single, &rays, cull, Coherence::None));
            let shadows_one_by_one: Vec<_> =
                rays.iter().flat_map(|&ray| shadows(&single, shared, &[ray])).collect();
            for (simd, accel) in &accels {
                let context = format!("{name} {flatten:?} {simd:?} {n} {shared:?}");
                assert_eq!(bits(&layers(accel, &rays, cull, shared)), one_by_one, "{context}");
                assert_eq!(shadows(accel, shared, &rays), shadows_one_by_one, "{context}");
            }
        }
    }
}

/// Occlusion, and the bits of transmittance, along rays: towards the light where they share one.
fn shadows(accel: &Accel, shared: Coherence, rays: &[(Vec3, Vec3)]) -> Vec<(bool, [u32; 3])> {
    let source = HitId { instance: 0, triangle: 3 };
    let mut segments = ShadowRayBatch { coherence: shared, ..ShadowRayBatch::default() };
    for &(o, d) in rays {
        match shared {
            Coherence::Origin(light) => segments.push(light + d * 0.9, light, source),
            _ => segments.push(o, o, source),
        }
    }
    let (mut blocked, mut light) = (Vec::new(), Vec::new());
    accel.occluded(&segments, &Holes, &mut blocked);
    accel.transmittance(&segments, &Holes, &mut light);
    let light = light.iter().map(|l| l.to_array().map(f32::to_bits));
    blocked.into_iter().zip(light).collect()
}

/// Rays of a packet from afar that are spread over the whole scene, so that hardly two of them hit the same block: from
/// triangles that are larger than the distance of neighbouring rays to some that are far smaller. They return the same as
/// single rays.
#[test]
fn packets_of_spread_rays_answer_as_single_rays_do() {
    for (name, mesh) in
        [("sphere", scenes::sphere(160)), ("soup", scenes::soup(20_000, 0.1, &mut Rng::new(4)))]
    {
        let scene = scenes::scene(mesh, &[DAffine3::IDENTITY]);
        let posed = scenes::posed(&scene);
        for simd in scenes::simd_levels() {
            let accel = Accel::build(&posed, &AccelSettings { simd, ..AccelSettings::default() }).0;
            let mut rng = Rng::new(5);
            for (n, spread) in [1.0, 0.3, 0.1, 0.03].into_iter().enumerate() {
                let o = (rng.direction() * 6.0).as_vec3();
                // In rows, as the pixels of a picture.
                let rays: Vec<(Vec3, Vec3)> = (0..512)
                    .map(|i| {
                        let to = Vec3::new((i % 16) as f32, (i / 16) as f32, (i * 7 % 16) as f32) / 8.0 - 1.0;
                        (o, to * spread - o)
                    })
                    .collect();
                let along: Vec<(Vec3, Vec3)> = rays.iter().map(|&(o, d)| (o + (o + d), -o)).collect();
                for (shared, rays) in [(Coherence::Origin(o), &rays), (Coherence::Direction(-o), &along)] {
                    let context = format!("{name} {simd:?} {n} {shared:?}");
                    let together = layers(&accel, rays, false, shared);
                    let alone = layers(&accel, rays, false, Coherence::None);
                    assert!(together.iter().any(|layers| !layers[0].is_miss()), "{context}");
                    assert_eq!(bits(&together), bits(&alone), "{context}");
                    let occluded = |rays: &[(Vec3, Vec3)]| {
                        let mut batch = ShadowRayBatch { coherence: shared, ..ShadowRayBatch::default() };
                        for &(o, d) in rays {
                            match shared {
                                Coherence::Origin(light) => batch.push(light + d * 0.95, light, HitId::NONE),
                                _ => batch.push(o, o, HitId::NONE),
                            }
                        }
                        let mut occluded = Vec::new();
                        accel.occluded(&batch, &Holes, &mut occluded);
                        occluded
                    };
                    let one_by_one: Vec<bool> = rays.iter().flat_map(|&ray| occluded(&[ray])).collect();
                    assert_eq!(occluded(rays), one_by_one, "{context}");
                }
            }
        }
    }
}

/// The triangle that a segment starts on does not occlude it, in world and instanced BVHs; a coincident one does, and so
/// does the same triangle of another instance.
#[test]
fn only_the_source_triangle_itself_is_skipped() {
    let mut square = scenes::grid(2, 2);
    let first = square.triangles[0];
    let single = square.triangles.len() as u32;
    square.triangles.push([first[1], first[2], first[0]]);
    let behind = DAffine3::from_translation(DVec3::Z * -1.0);
    for (placed, flatten) in [
        (vec![DAffine3::IDENTITY], FlattenBudget::DEFAULT),
        (vec![DAffine3::IDENTITY, behind], FlattenBudget::DEFAULT),
        (vec![DAffine3::IDENTITY, behind], FlattenBudget::ZERO),
    ] {
        let scene = scenes::scene(square.clone(), &placed);
        // Not recentred: the segments are in the frame of the scene.
        let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
        let posed = pose(&scene, &settings).unwrap();
        for simd in scenes::simd_levels() {
            let settings = AccelSettings { flatten, simd, ..AccelSettings::default() };
            let accel = Accel::build(&posed, &settings).0;
            for triangle in 0..single {
                let corners = square.triangles[triangle as usize].map(|v| square.positions[v as usize]);
                let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
                let mut segments = ShadowRayBatch { coherence: Coherence::None, ..ShadowRayBatch::default() };
                // Through the triangle alone, without and with its id, and on through the second instance.
                let [above, below] = [0.5, -0.5].map(|z| centre + Vec3::Z * z);
                let id = |instance, triangle| HitId { instance, triangle };
                segments.push(above, below, HitId::NONE);
                segments.push(above, below, id(0, triangle));
                segments.push(above, below, id(1, triangle));
                segments.push(above, below, id(0, single + 7));
                segments.push(above, centre - Vec3::Z * 1.5, id(0, triangle));
                let mut occluded = Vec::new();
                accel.occluded(&segments, &scenes::Plain, &mut occluded);
                let has_twin = triangle == 0;
                let second = placed.len() > 1;
                let expected = [true, has_twin, true, true, has_twin || second];
                assert_eq!(occluded, expected, "{flatten:?} {simd:?} triangle {triangle}");
            }
        }
    }
}

/// Layers are ordered by (t, id) and contain each triangle once, all coincident ones included.
#[test]
fn layers_are_in_order_and_complete() {
    let mut square = scenes::grid(1, 2);
    let same = square.triangles.clone();
    for turn in 0..4 {
        square
            .triangles
            .extend(same.iter().map(|&[a, b, c]| if turn % 2 == 0 { [c, b, a] } else { [b, c, a] }));
    }
    let scene = scenes::scene(square, &[DAffine3::IDENTITY]);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let ray = [(Vec3::new(0.3, 0.1, 2.0), Vec3::new(0.0, 0.0, -2.0))];
    let found = &layers(&accel, &ray, false, Coherence::None)[0];
    assert_eq!(found.len(), 5 + 1);
    assert!(found.windows(2).all(|w| w[0].before(&w[1])));
    assert!(found[..5].iter().all(|hit| hit.t == 1.0));
}

/// Eye rays hit single-sided triangles from the front only, mirrored or not, instanced or not, and
/// double-sided ones from both sides.
#[test]
fn back_faces_are_culled_where_they_are_single_sided() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let far = DAffine3::from_translation(DVec3::Z * 50.0);
    for double_sided in [false, true] {
        for placed in
            [vec![DAffine3::IDENTITY], vec![mirror], vec![DAffine3::IDENTITY, far], vec![mirror, far]]
        {
            let mut scene = Scene::default();
            // The grid's front faces +Z, also after mirroring in x.
            scenes::add(
                &mut scene,
                scenes::grid(2, 2),
                scenes::material(SurfaceClass::Opaque, double_sided),
                &placed,
            );
            let posed = scenes::posed(&scene);
            let accel = scenes::build(&posed);
            let middle = posed.instances[0].transform.affine.translation.as_vec3();
            let mut batch = RayBatch { cull_back_faces: true, t_max: 10.0, ..RayBatch::default() };
            for side in [1.0, -1.0] {
                let o = middle + Vec3::new(0.2, 0.3, 3.0 * side);
                batch.push(o, Vec3::NEG_Z * side);
            }
            let mut hits = Vec::new();
            accel.intersect(&batch, &Holes, &mut hits);
            assert!(!hits[0].is_miss(), "front, {placed:?}");
            assert_eq!(hits[1].is_miss(), !double_sided, "back, {placed:?}");
        }
    }
}
