//! Every BVH query against brute force, bit for bit, whichever BVH and SIMD level answers it.

mod queries;
mod streams;
mod transmittance;
mod update;

use blinn::accel::{Accel, Coherence, FlattenBudget, RayBatch, ShadowRayBatch};
use blinn::geometry::{Hit, HitId};
use blinn::scene::{
    Animation, Channel, ChannelTarget, Interpolation, Keyframes, PosedScene, Scene, SurfaceClass,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::common::scenes::{self, Holes, Rng};

/// The nine test scenes.
fn all_scenes() -> Vec<(&'static str, Scene)> {
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
    // Some instances are mirrored, and single-sided.
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
    // A transform without volume, which goes into the world BVH.
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
            // Two coincident copies of it, and one that is instanced twice.
            scenes::add(&mut mixed, mesh.clone(), scenes::material(class, double_sided), &at[..1]);
            scenes::add(&mut mixed, mesh, scenes::material(class, !double_sided), &at);
        }
    }
    // The last pairs are animated with constant keys: dynamic instances that stay in place.
    let moving = mixed.nodes.len() as u32 / 2..mixed.nodes.len() as u32;
    let keys =
        Keyframes { times: vec![0.0], values: vec![1.0], width: 1, interpolation: Interpolation::Step };
    let channels =
        moving.map(|node| Channel { target: ChannelTarget::Visibility(node), keyframes: keys.clone() });
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

/// Rays from in and around the scene into it; a third of them at vertices and edges, some along the axes.
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

/// The first `MOST` hits along every ray.
fn layers(accel: &Accel, rays: &[(Vec3, Vec3)], cull: bool, shared: Coherence) -> Vec<Vec<Hit>> {
    let mut found = vec![Vec::new(); rays.len()];
    let mut open: Vec<usize> = (0..rays.len()).collect();
    let mut hits = Vec::new();
    while !open.is_empty() {
        let mut batch =
            RayBatch { coherence: shared, cull_back_faces: cull, t_max: 5.0, ..RayBatch::default() };
        for &i in &open {
            batch.push(rays[i].0, rays[i].1);
            // No hit precedes the first round.
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

fn segments(rays: &[(Vec3, Vec3)]) -> ShadowRayBatch {
    let mut segments = ShadowRayBatch::default();
    for (o, d) in rays {
        segments.push(*o, *o + *d * 0.8, HitId { instance: 0, triangle: 0 });
    }
    segments
}

fn bits(layers: &[Vec<Hit>]) -> Vec<Vec<(u32, HitId)>> {
    layers.iter().map(|l| l.iter().map(|hit| (hit.t.to_bits(), hit.id)).collect()).collect()
}

/// All meshes in the world BVHs; every mesh that allows it in a BLAS of its own.
const FLATTENED: [FlattenBudget; 2] = [FlattenBudget::DEFAULT, FlattenBudget::ZERO];
