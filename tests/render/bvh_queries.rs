//! Trees against no tree: every answer is the same, bit for bit, whatever tree gave it.

use std::sync::atomic::{AtomicUsize, Ordering};

use blinn::accel::{Accel, BuildSettings, Cutout, Flatten, Preset, RayBatch, SegmentBatch, Shared, Tier};
use blinn::geometry::{Hit, HitId};
use blinn::integrator::MaterialHitFilter;
use blinn::scene::{
    Animation, Channel, Channels, ColorInput, Image, Interpolation, Keys, Material, Mips, MorphTarget,
    PosedScene, ScalarInput, Scene, SurfaceClass, Target, Texels, Texture, TextureRef, UvTransform, Wrap,
};
use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3};

use crate::common::scenes::{self, Holes, Rng};

/// The nine scenes.
fn scenes() -> Vec<(&'static str, Scene)> {
    let rng = &mut Rng::new(1);
    let identity = [DAffine3::IDENTITY];
    let mut doubled = scenes::soup(500, 0.5, rng);
    let copies: Vec<[u32; 3]> = doubled
        .triangles
        .iter()
        .enumerate()
        .flat_map(|(i, &[a, b, c])| match i % 4 {
            0 => vec![],
            1 => vec![[b, c, a]],
            2 => vec![[c, b, a]],
            _ => vec![[a, b, c], [b, a, c], [c, a, b]],
        })
        .collect();
    doubled.triangles.extend(copies);
    // Some of its copies face the other way, where only one side is seen.
    let mut turned = Scene::default();
    let single_sided = scenes::material(SurfaceClass::Opaque, false);
    scenes::add(&mut turned, doubled.clone(), single_sided, &identity);
    let mut slivers = scenes::fan(3000, rng.direction(), rng);
    slivers.positions[0] = slivers.positions[1] * 0.999;
    let place = |rng: &mut Rng, scale: DVec3| {
        let turn = DQuat::from_axis_angle(rng.direction(), 6.0 * rng.unit());
        DAffine3::from_scale_rotation_translation(scale, turn, rng.in_cube())
    };
    let mut placed: Vec<DAffine3> =
        [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(0.1, 2.0, 1.0), DVec3::splat(-0.3)]
            .into_iter()
            .map(|scale| place(rng, scale))
            .collect();
    placed.push(placed[0]);
    // One that flattens, which goes into the world tree.
    placed.push(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
    let mut instances = Scene::default();
    scenes::add(&mut instances, scenes::sphere(12), scenes::material(SurfaceClass::Opaque, false), &placed);
    scenes::add(
        &mut instances,
        scenes::grid(9, 1),
        scenes::material(SurfaceClass::Opaque, true),
        &placed[1..2],
    );
    let mut mixed = Scene::default();
    for class in [SurfaceClass::Opaque, SurfaceClass::Cutout, SurfaceClass::Translucent] {
        for double_sided in [false, true] {
            let count = if class == SurfaceClass::Opaque { 30 } else { 300 };
            let at = [place(rng, DVec3::ONE), place(rng, DVec3::new(-1.0, 0.5, 1.0))];
            let mesh = scenes::soup(count, 0.6, rng);
            scenes::add(&mut mixed, mesh.clone(), scenes::material(class, double_sided), &at[..1]);
            // The same again in the same place, and one drawn twice.
            scenes::add(&mut mixed, mesh.clone(), scenes::material(class, double_sided), &at[..1]);
            scenes::add(&mut mixed, mesh, scenes::material(class, !double_sided), &at);
        }
    }
    // The last pairs may come and go: they are moving things that keep their places.
    let moving = mixed.nodes.len() as u32 / 2..mixed.nodes.len() as u32;
    let keys = Keys { times: vec![0.0], values: vec![1.0], width: 1, interpolation: Interpolation::Step };
    let channels = moving.map(|node| Channel { target: Target::Visibility(node), keys: keys.clone() });
    mixed.animations.push(Animation { name: String::new(), channels: channels.collect() });
    let fan = scenes::fan(60, DVec3::new(0.6, 0.0, 0.8), rng);
    vec![
        ("sphere", scenes::scene(scenes::sphere(24), &identity)),
        ("fan", scenes::scene(fan, &identity)),
        ("grid", scenes::scene(scenes::grid(60, 1), &identity)),
        ("soup", scenes::scene(scenes::soup(20_000, 0.1, rng), &identity)),
        ("coincident", scenes::scene(doubled, &identity)),
        ("turned", turned),
        ("slivers", scenes::scene(slivers, &identity)),
        ("instances", instances),
        ("mixed", mixed),
    ]
}

/// Rays from in and around the scene to anywhere in it; a third of them at vertices and edges,
/// some along the axes.
fn rays(posed: &PosedScene, count: usize) -> Vec<(Vec3, Vec3)> {
    let mut rng = Rng::new(2);
    let any = |rng: &mut Rng| {
        let instance = rng.below(posed.instances.len()) as u32;
        let triangle = rng.below(posed.mesh(instance).triangles.len()) as u32;
        let v = posed.world_triangle(HitId { instance, triangle });
        v[0].lerp(v[1], if rng.one_in(2) { 0.0 } else { rng.unit() as f32 })
    };
    (0..count)
        .map(|i| {
            let o = (rng.in_cube() * 3.0).as_vec3();
            let d = if i % 3 == 0 { any(&mut rng) - o } else { rng.in_cube().as_vec3() - o };
            match i % 11 {
                0 => (any(&mut rng).with_x(4.0), Vec3::new(-2.0, 0.0, -0.0)),
                1 => (any(&mut rng).with_y(-4.0), Vec3::new(-0.0, 0.5, 0.0)),
                _ => (o, d),
            }
        })
        .collect()
}

const MOST: usize = 12;

/// The first hits along every ray, one after the other, as far as `MOST`.
fn layers(accel: &Accel, rays: &[(Vec3, Vec3)], cull: bool, shared: Shared) -> Vec<Vec<Hit>> {
    let mut found = vec![Vec::new(); rays.len()];
    let mut open: Vec<usize> = (0..rays.len()).collect();
    let mut hits = Vec::new();
    while !open.is_empty() {
        let mut batch = RayBatch { shared, cull, far: 5.0, ..RayBatch::default() };
        for &i in &open {
            batch.push(rays[i].0, rays[i].1);
            // None before the first round.
            batch.after.extend(found[i].last());
        }
        accel.intersect(&batch, &Holes, &mut hits);
        open = open
            .into_iter()
            .zip(&hits)
            .filter_map(|(i, hit)| {
                found[i].push(*hit);
                (!hit.is_miss() && found[i].len() < MOST).then_some(i)
            })
            .collect();
    }
    found
}

fn segments(rays: &[(Vec3, Vec3)]) -> SegmentBatch {
    let mut segments = SegmentBatch::default();
    for (o, d) in rays {
        segments.push(*o, *o + *d * 0.8, HitId { instance: 0, triangle: 0 });
    }
    segments
}

fn bits(layers: &[Vec<Hit>]) -> Vec<Vec<(u32, HitId)>> {
    layers.iter().map(|l| l.iter().map(|hit| (hit.t.to_bits(), hit.id)).collect()).collect()
}

/// All in the world's trees, and all that can be in trees of its own.
const FLATTENED: [Flatten; 2] = [Flatten::USUAL, Flatten::NOTHING];

/// All layers, shadows and transmittances of every preset and tier are those of asking every
/// triangle.
#[test]
fn every_tree_answers_as_no_tree_does() {
    let all = scenes();
    assert_eq!(all.len(), 9);
    for ((name, scene), flatten) in all.iter().flat_map(|scene| FLATTENED.map(|flatten| (scene, flatten))) {
        let posed = scenes::posed(scene);
        if flatten == Flatten::NOTHING && posed.instances.len() == 1 {
            continue;
        }
        let rays = rays(&posed, if *name == "soup" { 100 } else { 500 });
        let segments = segments(&rays);
        let answers = |preset, tier| {
            let accel = Accel::build(&posed, &BuildSettings { preset, tier, flatten }).0;
            let (mut occluded, mut light) = (Vec::new(), Vec::new());
            accel.occluded(&segments, &Holes, &mut occluded);
            accel.transmittance(&segments, &Holes, &mut light);
            let light: Vec<[u32; 3]> = light.iter().map(|l| l.to_array().map(f32::to_bits)).collect();
            let seen = [false, true].map(|cull| bits(&layers(&accel, &rays, cull, Shared::None)));
            (seen, occluded, light)
        };
        let flat = answers(Preset::Flat, Tier::Portable);
        let hits = flat.0[0].iter().flatten().filter(|hit| hit.1 != HitId::NONE).count();
        assert!(hits > 200, "{name}: only {hits} hits to compare");
        let medium = scenes::tiers().map(|tier| (Preset::Medium, tier));
        for (preset, tier) in medium.chain([Preset::Fast, Preset::Slow].map(|p| (p, Tier::best()))) {
            let tree = answers(preset, tier);
            for (i, ray) in rays.iter().enumerate() {
                for cull in 0..2 {
                    assert_eq!(
                        tree.0[cull][i], flat.0[cull][i],
                        "{name} {preset:?} {tier:?}: ray {i} {ray:?}"
                    );
                }
                assert_eq!(tree.1[i], flat.1[i], "{name} {preset:?} {tier:?}: shadow {i}");
                assert_eq!(tree.2[i], flat.2[i], "{name} {preset:?} {tier:?}: light {i}");
            }
        }
    }
}

/// The walk that counts steps finds what the others find, whichever the instructions, and counts alike.
#[test]
fn the_counting_walk_meets_the_same_hits() {
    for (name, scene) in &scenes() {
        let posed = scenes::posed(scene);
        let rays = rays(&posed, 300);
        let mut batch = RayBatch { cull: true, far: 5.0, ..RayBatch::default() };
        rays.iter().for_each(|(o, d)| batch.push(*o, *d));
        let accel = Accel::build(&posed, &BuildSettings::default()).0;
        let counted = accel.count_steps(&batch, &Holes);
        let mut hits = Vec::new();
        accel.intersect(&batch, &Holes, &mut hits);
        let (mut nodes, mut asked) = (0, 0);
        for (i, (hit, steps)) in counted.iter().enumerate() {
            assert_eq!((hit.t.to_bits(), hit.id), (hits[i].t.to_bits(), hits[i].id), "{name}: ray {i}");
            assert!(hit.is_miss() || steps.blocks > 0, "{name}: ray {i}");
            nodes += steps.nodes;
            asked += steps.blocks;
        }
        let portable = BuildSettings { tier: Tier::Portable, ..BuildSettings::default() };
        assert_eq!(Accel::build(&posed, &portable).0.count_steps(&batch, &Holes), counted, "{name}");
        // Trees spare rays most of what is there, and without one nothing is spared.
        let flat = BuildSettings { preset: Preset::Flat, ..BuildSettings::default() };
        let flat = Accel::build(&posed, &flat).0;
        let all: u32 = flat.count_steps(&batch, &Holes).iter().map(|(_, steps)| steps.blocks).sum();
        assert!(nodes > 0 && asked < all, "{name}: {nodes} nodes, {asked} of {all} blocks");
        let (cost, flat_cost) = (accel.sah_cost(), flat.sah_cost());
        assert!(cost > 1.0 && cost < flat_cost, "{name}: {cost} of {flat_cost}");
    }
    let empty = Scene::default();
    assert_eq!(Accel::build(&scenes::posed(&empty), &BuildSettings::default()).0.sah_cost(), 0.0);
}

/// What rays of a packet share, and some of them: from one place or along one way, near each other,
/// many at vertices and edges. Every sixteen have their own triangles to go to.
fn bundle(posed: &PosedScene, rng: &mut Rng, along: bool, count: usize) -> (Shared, Vec<(Vec3, Vec3)>) {
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
    (if along { Shared::Direction(d) } else { Shared::Origin(o) }, rays)
}

/// Rays that are told to share something, and so may be traced together, meet what they meet one
/// by one: every layer, shadow and transmittance, on every tier.
#[test]
fn packets_answer_as_single_rays_do() {
    let all = scenes();
    for ((name, scene), flatten) in all.iter().flat_map(|scene| FLATTENED.map(|flatten| (scene, flatten))) {
        let posed = scenes::posed(scene);
        if flatten == Flatten::NOTHING && posed.instances.len() == 1 {
            continue;
        }
        let settings = |tier| BuildSettings { preset: Preset::Medium, tier, flatten };
        let single = Accel::build(&posed, &settings(Tier::Portable)).0;
        for tier in scenes::tiers() {
            let accel = Accel::build(&posed, &settings(tier)).0;
            let mut rng = Rng::new(3);
            for n in 0..60 {
                // Whole packets, parts of them, and what does not fill a group.
                let count = [64, 300, 23, 256][n % 4];
                let (shared, rays) = bundle(&posed, &mut rng, n % 3 == 2, count);
                let context = format!("{name} {flatten:?} {tier:?} {n} {shared:?}");
                let cull = n % 2 == 0;
                let together = bits(&layers(&accel, &rays, cull, shared));
                assert_eq!(together, bits(&layers(&single, &rays, cull, Shared::None)), "{context}");
                // Towards the light, if it is one.
                let segments = |rays: &[(Vec3, Vec3)]| {
                    let mut segments = SegmentBatch { shared, ..SegmentBatch::default() };
                    for &(o, d) in rays {
                        let source = HitId { instance: 0, triangle: 3 };
                        match shared {
                            Shared::Origin(light) => segments.push(light + d * 0.9, light, source),
                            _ => segments.push(o, o, source),
                        }
                    }
                    segments
                };
                let ask = |accel: &Accel, rays: &[(Vec3, Vec3)]| {
                    let (mut blocked, mut light) = (Vec::new(), Vec::new());
                    accel.occluded(&segments(rays), &Holes, &mut blocked);
                    accel.transmittance(&segments(rays), &Holes, &mut light);
                    let light = light.iter().map(|l| l.to_array().map(f32::to_bits)).collect::<Vec<_>>();
                    blocked.into_iter().zip(light).collect::<Vec<_>>()
                };
                let one_by_one: Vec<_> = rays.iter().flat_map(|&ray| ask(&single, &[ray])).collect();
                assert_eq!(ask(&accel, &rays), one_by_one, "{context}");
            }
        }
    }
}

/// All of it lets half of the light through.
struct Halved;

impl Cutout for Halved {
    fn keeps(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmits(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::splat(0.5)
    }
}

/// [`Halved`], with a note of how often it was asked.
#[derive(Default)]
struct Counted(AtomicUsize);

impl Cutout for Counted {
    fn keeps(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        Halved.keeps(id, o, d)
    }

    fn transmits(&self, id: HitId, o: Vec3, d: Vec3) -> Vec3 {
        self.0.fetch_add(1, Ordering::Relaxed);
        Halved.transmits(id, o, d)
    }
}

/// Of a thousand panes that each halve the light, as many are asked as leave some of it; a few let
/// through the product of theirs.
#[test]
fn light_is_followed_until_none_is_left() {
    for (panes, left, most) in [(17, 0.5f32.powi(17), 17), (18, 0.0, 18), (1000, 0.0, 19)] {
        let mut scene = Scene::default();
        let placed: Vec<_> =
            (0..panes).map(|i| DAffine3::from_translation(DVec3::Z * 0.01 * f64::from(i))).collect();
        scenes::add(
            &mut scene,
            scenes::grid(1, 2),
            scenes::material(SurfaceClass::Translucent, true),
            &placed,
        );
        let posed = scenes::posed(&scene);
        let (near, far) = (DVec3::new(0.1, 0.2, -1.0), DVec3::new(0.1, 0.2, 11.0));
        let [light, far] = [near, far].map(|p| (p - posed.centre).as_vec3());
        for (tier, flatten) in scenes::tiers().flat_map(|tier| FLATTENED.map(|flatten| (tier, flatten))) {
            let settings = BuildSettings { preset: Preset::Medium, tier, flatten };
            let accel = Accel::build(&posed, &settings).0;
            for shared in [Shared::None, Shared::Origin(light), Shared::Direction(-Vec3::Z)] {
                let mut segments = SegmentBatch { shared, ..SegmentBatch::default() };
                (0..40).for_each(|i| segments.push(far + Vec3::X * 0.01 * i as f32, light, HitId::NONE));
                let (asked, mut free) = (Counted::default(), Vec::new());
                accel.transmittance(&segments, &asked, &mut free);
                assert!(free.iter().all(|&free| free == Vec3::splat(left)), "{tier:?} {shared:?}: {free:?}");
                // Packets that go on alone may ask once more.
                let asked = asked.0.into_inner();
                assert!(asked <= 2 * 40 * most, "{panes} {tier:?} {flatten:?} {shared:?}: {asked}");
            }
        }
    }
}

/// Where light passes, a sheet is one layer also on its edges and vertices: to whatever ray, whichever
/// way the triangles are wound, in the world's tree and in one of its own.
#[test]
fn a_sheet_that_light_passes_is_one_layer() {
    let mut rng = Rng::new(5);
    let mut bumpy = scenes::grid(4, 2);
    for p in &mut bumpy.positions {
        p.z = rng.below(5) as f32 * 0.25;
    }
    let fan = scenes::fan(16, DVec3::Z, &mut rng);
    let turned = DAffine3::from_rotation_y(1.0) * DAffine3::from_rotation_x(0.5);
    let mut on_edges = 0;
    let here = DAffine3::IDENTITY;
    let sheets = [(scenes::grid(4, 2), here), (bumpy, here), (fan.clone(), here), (fan, turned)];
    for (mesh, placed) in sheets {
        let mut scene = Scene::default();
        let beside = DAffine3::from_translation(DVec3::X * 100.0) * placed;
        scenes::add(&mut scene, mesh, scenes::material(SurfaceClass::Translucent, true), &[placed, beside]);
        let posed = scenes::posed(&scene);
        // Vertices, and the middles of edges: those of no other triangle are at the sheet's rim.
        let triangles = (0..posed.mesh(0).triangles.len() as u32)
            .map(|triangle| posed.world_triangle(HitId { instance: 0, triangle }))
            .collect::<Vec<_>>();
        let places: Vec<Vec3> =
            triangles.iter().flat_map(|v| [v[0], 0.5 * (v[0] + v[1]), 0.5 * (v[1] + v[2])]).collect();
        let middle = (placed.transform_point3(DVec3::ZERO) - posed.centre).as_vec3();
        let inside = |p: &&Vec3| (**p - middle).abs().max_element() < 0.6;
        let normal = placed.transform_vector3(DVec3::Z).as_vec3();
        let eye = middle + 4.0 * normal + Vec3::new(0.125, 0.25, 0.0);
        let through: Vec<&Vec3> = places.iter().filter(inside).collect();
        for flatten in FLATTENED {
            for tier in scenes::tiers() {
                let settings = BuildSettings { preset: Preset::Medium, tier, flatten };
                let accel = Accel::build(&posed, &settings).0;
                let from_eye: Vec<_> = through.iter().map(|&&p| (eye, p - eye)).collect();
                let along: Vec<_> = through.iter().map(|&&p| (p + 4.0 * normal, -normal)).collect();
                let all = [
                    (Shared::Origin(eye), &from_eye),
                    (Shared::None, &from_eye),
                    (Shared::Direction(-normal), &along),
                    (Shared::None, &along),
                ];
                for (shared, rays) in all {
                    for (found, ray) in layers(&accel, rays, false, shared).iter().zip(rays) {
                        assert_eq!(found.len(), 2, "{ray:?} {flatten:?} {tier:?} {shared:?}: {found:?}");
                        on_edges += 1;
                    }
                }
                let mut segments = SegmentBatch { shared: Shared::Origin(eye), ..SegmentBatch::default() };
                from_eye.iter().for_each(|&(o, d)| segments.push(o + 2.0 * d, eye, HitId::NONE));
                let mut light = Vec::new();
                accel.transmittance(&segments, &Halved, &mut light);
                assert!(light.iter().all(|l| *l == Vec3::splat(0.5)), "{light:?}");
            }
        }
    }
    assert!(on_edges > 1000, "{on_edges}");
}

/// Layers come in the order of (t, id), each triangle once; all coincident ones are there.
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
    let found = &layers(&accel, &ray, false, Shared::None)[0];
    assert_eq!(found.len(), 5 + 1);
    assert!(found.windows(2).all(|w| w[0].before(&w[1])));
    assert!(found[..5].iter().all(|hit| hit.t == 1.0));
}

/// Eye rays see the front of single-sided triangles alone, mirrored or not, shared or not, and
/// both sides of double-sided ones.
#[test]
fn back_faces_are_culled_where_they_are_single_sided() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let far = DAffine3::from_translation(DVec3::Z * 50.0);
    for double_sided in [false, true] {
        for placed in
            [vec![DAffine3::IDENTITY], vec![mirror], vec![DAffine3::IDENTITY, far], vec![mirror, far]]
        {
            let mut scene = Scene::default();
            // The grid's front looks to +Z; mirrored in x it still does.
            scenes::add(
                &mut scene,
                scenes::grid(2, 2),
                scenes::material(SurfaceClass::Opaque, double_sided),
                &placed,
            );
            let posed = scenes::posed(&scene);
            let accel = scenes::build(&posed);
            let middle = posed.instances[0].transform.affine.translation.as_vec3();
            let mut batch = RayBatch { cull: true, far: 10.0, ..RayBatch::default() };
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

/// What is drawn in few triangles goes into the world; the rest has trees of its own, the smallest
/// meshes last. What moves is in a world of its own.
#[test]
fn worlds_take_as_much_as_they_are_told_to() {
    let mut scene = Scene::default();
    let opaque = || scenes::material(SurfaceClass::Opaque, false);
    let at = |x: f64| DAffine3::from_translation(DVec3::X * x);
    // 3 × 2, 2 × 8 and 1 × 18 triangles, and 1 × 32 that move.
    scenes::add(&mut scene, scenes::grid(1, 1), opaque(), &[at(0.0), at(2.0), at(4.0)]);
    scenes::add(&mut scene, scenes::grid(2, 1), opaque(), &[at(6.0), at(8.0)]);
    scenes::add(&mut scene, scenes::grid(3, 1), opaque(), &[at(10.0)]);
    scenes::add(&mut scene, scenes::grid(4, 1), opaque(), &[at(12.0)]);
    let keys = Keys { times: vec![0.0], values: vec![1.0], width: 1, interpolation: Interpolation::Step };
    let channels = vec![Channel { target: Target::Visibility(6), keys }];
    scene.animations.push(Animation { name: String::new(), channels });
    let posed = scenes::posed(&scene);
    let stats = |still: u64, moving: u64| {
        let flatten = Flatten { still, moving };
        let accel = Accel::build(&posed, &BuildSettings { flatten, ..BuildSettings::default() }).0;
        (accel.stats().trees, accel.stats().entries)
    };
    assert_eq!(stats(1000, 1000), (2, 6 + 16 + 18 + 32), "still and moving");
    assert_eq!(stats(1000, 31), (2, 6 + 16 + 18 + 32), "what moves has a tree of its own");
    assert_eq!(stats(22, 32), (2, 6 + 16 + 18 + 32));
    assert_eq!(stats(21, 32), (3, 6 + 8 + 18 + 32), "the larger mesh has its own");
    assert_eq!(stats(5, 0), (4, 2 + 8 + 18 + 32), "both have");
}

/// After an update the answers are those of a new build.
#[test]
fn an_update_is_as_good_as_a_build() {
    for flatten in FLATTENED {
        update_as_good_as_build(&BuildSettings { flatten, ..BuildSettings::default() });
    }
}

fn update_as_good_as_build(settings: &BuildSettings) {
    let mut scene = scenes().swap_remove(6).1;
    let (mut kept, _) = Accel::build(&scenes::posed(&scene), settings);
    for step in 0..3 {
        for (i, node) in scene.nodes.iter_mut().enumerate() {
            let turn = DAffine3::from_rotation_x(0.3 * (i + step) as f64);
            // First the shared instances alone, then all.
            if step > 0 || i < 4 {
                node.local = blinn::scene::Local::Matrix(turn * node.local.affine());
            }
            node.visible = !(step == 2 && i > 0 && i < 5);
        }
        let posed = scenes::posed(&scene);
        let (new, report) = Accel::build(&posed, settings);
        assert_eq!(kept.update(&posed), report);
        let rays = rays(&posed, 1000);
        assert_eq!(
            bits(&layers(&kept, &rays, false, Shared::None)),
            bits(&layers(&new, &rays, false, Shared::None)),
            "step {step}"
        );
    }
}

/// A soup twice, the second one aside, and what its weights do: bring the second to the first, bend all,
/// take the area from some, scatter all.
fn bending() -> Scene {
    let rng = &mut Rng::new(5);
    let mut mesh = scenes::soup(2000, 0.2, rng);
    // In steps that sums are exact in.
    let coarse = |p: Vec3| (p * 4096.0).round() / 4096.0;
    mesh.positions.iter_mut().for_each(|p| *p = coarse(*p));
    let aside = Vec3::new(0.5, 0.25, 0.0);
    let (first, vertices) = (mesh.positions.clone(), mesh.positions.len() as u32);
    mesh.positions.extend(first.iter().map(|p| p + aside));
    mesh.triangles.extend_from_within(..);
    let half = mesh.triangles.len() / 2;
    mesh.triangles[half..].iter_mut().flatten().for_each(|v| *v += vertices);
    // None of these can be hit, and some of them never.
    mesh.triangles.extend([[0, 0, 1], [4, 5, 5]]);
    let few = |i: usize| i % first.len() < 300;
    let each = |f: &mut dyn FnMut(usize, Vec3) -> Vec3| MorphTarget {
        positions: (0..2 * first.len()).map(|i| f(i, first[i % first.len()])).collect(),
        ..MorphTarget::default()
    };
    mesh.morphs = vec![
        each(&mut |i, _| if i < first.len() { Vec3::ZERO } else { -aside }),
        each(&mut |i, p| if few(i) { Vec3::ZERO } else { coarse(Vec3::new(0.0, p.x * p.x, 0.3 * p.y)) }),
        each(&mut |i, p| if few(i) { Vec3::new(0.0, -p.y, -p.z) } else { Vec3::ZERO }),
        each(&mut |_, _| coarse((rng.in_cube() * 2.0).as_vec3())),
    ];
    mesh.morph_weights = vec![0.0; 4];
    let mut scene = scenes::scene(mesh, &[DAffine3::IDENTITY]);
    scene.nodes[0].weights = vec![0.0; 4];
    scene
}

/// Trees that were built for one shape answer for another as new ones do, and leave out the same.
#[test]
fn trees_follow_what_bends() {
    let mut scene = bending();
    let (mut kept, _) = Accel::build(&scenes::posed(&scene), &BuildSettings::default());
    let (mut coincident, mut flat) = (0, 0);
    for weights in [
        [0.0, 0.125, 0.0, 0.0],
        [0.0, 0.25, 0.0, 0.0],
        [0.0, 0.25, 1.0, 0.0],
        [0.0, 0.375, 1.0, 0.0],
        [1.0, 0.375, 0.0, 0.0],
        [1.0, 0.5, 0.0, 0.0],
        [1.0, 0.5, 0.0, 1.0],
        [0.0, 0.5, 0.0, 1.0],
    ] {
        scene.nodes[0].weights = weights.to_vec();
        let posed = scenes::posed(&scene);
        let (new, report) = Accel::build(&posed, &BuildSettings::default());
        assert_eq!(kept.update(&posed), report, "{weights:?}");
        coincident += report.coincident;
        flat += report.zero_area;
        let rays = rays(&posed, 500);
        let segments = segments(&rays);
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        kept.occluded(&segments, &Holes, &mut ours);
        new.occluded(&segments, &Holes, &mut theirs);
        assert_eq!(ours, theirs, "{weights:?}");
        let seen = |accel: &Accel| bits(&layers(accel, &rays, false, Shared::None));
        assert_eq!(seen(&kept), seen(&new), "{weights:?}");
    }
    assert!(coincident > 3900 && flat > 300, "{coincident} in one place, {flat} flat");
}

/// Where an animation makes glass of a wall, trees that were built before know it.
#[test]
fn trees_follow_what_becomes_glass() {
    for flatten in FLATTENED {
        let settings = BuildSettings { flatten, ..BuildSettings::default() };
        let mut scene = Scene::default();
        let at = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X)];
        scenes::add(&mut scene, scenes::sphere(8), scenes::material(SurfaceClass::Opaque, true), &at);
        let (mut kept, _) = Accel::build(&scenes::posed(&scene), &settings);
        scene.materials[0].transmission.factor = 0.5;
        let posed = scenes::posed(&scene);
        let new = Accel::build(&posed, &settings).0;
        kept.update(&posed);
        let segments = segments(&rays(&posed, 500));
        let light = |accel: &Accel| {
            let mut light = Vec::new();
            accel.transmittance(&segments, &Holes, &mut light);
            light
        };
        assert_eq!(light(&kept), light(&new));
        assert!(light(&new).iter().any(|l| l.x > 0.0 && l.x < 1.0), "something is seen through");
    }
}

/// Translucent by its material, but its texture has no hole where it is looked up: it blocks light like
/// anything opaque, until the texture moves. Trees that were built before know that, too.
#[test]
fn trees_follow_textures_that_move() {
    for flatten in FLATTENED {
        let settings = BuildSettings { flatten, ..BuildSettings::default() };
        let mut scene = Scene::default();
        let at = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X)];
        let mut mesh = scenes::sphere(8);
        let half = |p: &Vec3| Vec2::new(0.25 + 0.2 * p.x, 0.5);
        mesh.uvs = vec![mesh.positions.iter().map(half).collect()];
        let by = |x: f32| {
            let transform = UvTransform::khr(Vec2::new(x, 0.0), 0.0, Vec2::ONE);
            Some(TextureRef { texture: 0, uv_set: 0, transform })
        };
        let base = ColorInput { texture: by(0.0), ..ColorInput::new(Vec3::ONE) };
        let blend =
            Material { base, alpha_from_base: true, ..scenes::material(SurfaceClass::Translucent, true) };
        scenes::add(&mut scene, mesh, Material { alpha: ScalarInput::new(1.0), ..blend }, &at);
        // The right half is clear.
        let alphas = (0..64).flat_map(|i| [9, if i < 32 { 255 } else { 51 }]).collect();
        scene.images.push(Image {
            name: String::new(),
            width: 64,
            height: 1,
            channels: Channels::La,
            texels: Texels::U8(alphas),
            mips: Mips::default(),
        });
        scene.textures.push(Texture { wrap: [Wrap::Clamp; 2], ..Texture::default() });
        let light = |scene: &Scene, accel: &Accel| {
            let (posed, mut light) = (scenes::posed(scene), Vec::new());
            accel.transmittance(&segments(&rays(&posed, 500)), &MaterialHitFilter(&posed), &mut light);
            light
        };
        let some = |light: &[Vec3]| light.iter().any(|l| l.x > 0.0 && l.x < 1.0);
        let (mut kept, _) = Accel::build(&scenes::posed(&scene), &settings);
        assert!(!kept.has_translucent() && !some(&light(&scene, &kept)));
        for (offset, part) in [(0.1, true), (0.5, true), (0.0, false)] {
            scene.materials[0].base.texture = by(offset);
            let posed = scenes::posed(&scene);
            kept.update(&posed);
            let new = Accel::build(&posed, &settings).0;
            assert_eq!(light(&scene, &kept), light(&scene, &new));
            assert_eq!((new.has_translucent(), some(&light(&scene, &new))), (part, part), "{offset}");
        }
    }
}
