//! Refits: an updated BVH answers as one that is built from scratch.

use blinn::accel::{Accel, AccelSettings, Coherence, FlattenBudget};
use blinn::integrator::MaterialHitFilter;
use blinn::scene::{
    Animation, Channel, ChannelTarget, Channels, ColorInput, Image, Interpolation, Keyframes, Material,
    MipMaps, MorphTarget, ScalarInput, Scene, SurfaceClass, Texels, Texture, TextureRef, UvTransform, Wrap,
};
use glam::{DAffine3, DVec3, Vec2, Vec3};

use super::{FLATTENED, all_scenes, bits, layers, rays, segments};
use crate::common::scenes::{self, Holes, Rng};

/// Meshes with few instanced triangles go into the static world; the others are instanced, smallest meshes
/// last. Animated ones go into a dynamic world.
#[test]
fn instancing_obeys_the_flatten_budget() {
    let mut scene = Scene::default();
    let opaque = || scenes::material(SurfaceClass::Opaque, false);
    let at = |x: f64| DAffine3::from_translation(DVec3::X * x);
    // 3 × 2, 2 × 8 and 1 × 18 triangles, and 1 × 32 that move.
    scenes::add(&mut scene, scenes::grid(1, 1), opaque(), &[at(0.0), at(2.0), at(4.0)]);
    scenes::add(&mut scene, scenes::grid(2, 1), opaque(), &[at(6.0), at(8.0)]);
    scenes::add(&mut scene, scenes::grid(3, 1), opaque(), &[at(10.0)]);
    scenes::add(&mut scene, scenes::grid(4, 1), opaque(), &[at(12.0)]);
    let keys =
        Keyframes { times: vec![0.0], values: vec![1.0], width: 1, interpolation: Interpolation::Step };
    let channels = vec![Channel { target: ChannelTarget::Visibility(6), keyframes: keys }];
    scene.animations.push(Animation { name: String::new(), channels });
    let posed = scenes::posed(&scene);
    let stats = |static_triangles: u64, dynamic_triangles: u64| {
        let flatten = FlattenBudget { static_triangles, dynamic_triangles };
        let accel = Accel::build(&posed, &AccelSettings { flatten, ..AccelSettings::default() }).0;
        (accel.stats().bvhs, accel.stats().triangles)
    };
    assert_eq!(stats(1000, 1000), (2, 6 + 16 + 18 + 32), "static and dynamic");
    assert_eq!(stats(1000, 31), (2, 6 + 16 + 18 + 32), "the dynamic mesh has a BLAS of its own");
    assert_eq!(stats(22, 32), (2, 6 + 16 + 18 + 32));
    assert_eq!(stats(21, 32), (3, 6 + 8 + 18 + 32), "the larger mesh has a BLAS");
    assert_eq!(stats(5, 0), (4, 2 + 8 + 18 + 32), "both have a BLAS");
}

/// An update returns the answers of a new build.
#[test]
fn an_update_answers_as_a_rebuild_does() {
    for flatten in FLATTENED {
        check_updates(&AccelSettings { flatten, ..AccelSettings::default() });
    }
}

fn check_updates(settings: &AccelSettings) {
    let mut scene = all_scenes().swap_remove(6).1;
    let (mut updated, _) = Accel::build(&scenes::posed(&scene), settings);
    for step in 0..3 {
        for (i, node) in scene.nodes.iter_mut().enumerate() {
            let turn = DAffine3::from_rotation_x(0.3 * (i + step) as f64);
            // First with instanced meshes only, then with all.
            if step > 0 || i < 4 {
                node.local = blinn::scene::LocalTransform::Matrix(turn * node.local.affine());
            }
            node.visible = !(step == 2 && i > 0 && i < 5);
        }
        let posed = scenes::posed(&scene);
        let (new, report) = Accel::build(&posed, settings);
        assert_eq!(updated.update(&posed), report);
        let rays = rays(&posed, 1000);
        assert_eq!(
            bits(&layers(&updated, &rays, false, Coherence::None)),
            bits(&layers(&new, &rays, false, Coherence::None)),
            "step {step}"
        );
    }
}

/// Two copies of a triangle soup. Morph weights move the second onto the first, deform all, collapse some
/// triangles, and scatter all.
fn deforming() -> Scene {
    let rng = &mut Rng::new(5);
    let mut mesh = scenes::soup(2000, 0.2, rng);
    // In steps whose sums are exact.
    let coarse = |p: Vec3| (p * 4096.0).round() / 4096.0;
    mesh.positions.iter_mut().for_each(|p| *p = coarse(*p));
    let aside = Vec3::new(0.5, 0.25, 0.0);
    let (first, vertices) = (mesh.positions.clone(), mesh.positions.len() as u32);
    mesh.positions.extend(first.iter().map(|p| p + aside));
    mesh.triangles.extend_from_within(..);
    let half = mesh.triangles.len() / 2;
    mesh.triangles[half..].iter_mut().flatten().for_each(|v| *v += vertices);
    // None of these can be hit, some of them in no shape.
    mesh.triangles.extend([[0, 0, 1], [4, 5, 5]]);
    let few = |i: usize| i % first.len() < 300;
    let each = |f: &mut dyn FnMut(usize, Vec3) -> Vec3| MorphTarget {
        positions: (0..2 * first.len()).map(|i| f(i, first[i % first.len()])).collect(),
        ..MorphTarget::default()
    };
    mesh.morph_targets = vec![
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

/// A BVH that was built for one shape answers for another as a new one does, and leaves out the same
/// triangles.
#[test]
fn refitted_bvhs_follow_deforming_meshes() {
    let mut scene = deforming();
    let (mut updated, _) = Accel::build(&scenes::posed(&scene), &AccelSettings::default());
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
        let (new, report) = Accel::build(&posed, &AccelSettings::default());
        assert_eq!(updated.update(&posed), report, "{weights:?}");
        coincident += report.coincident;
        flat += report.zero_area;
        let rays = rays(&posed, 500);
        let segments = segments(&rays);
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        updated.occluded(&segments, &Holes, &mut ours);
        new.occluded(&segments, &Holes, &mut theirs);
        assert_eq!(ours, theirs, "{weights:?}");
        let seen = |accel: &Accel| bits(&layers(accel, &rays, false, Coherence::None));
        assert_eq!(seen(&updated), seen(&new), "{weights:?}");
    }
    assert!(coincident > 3900 && flat > 300, "{coincident} coincident, {flat} without area");
}

/// Animated alpha makes a wall translucent, and an existing BVH follows.
#[test]
fn updates_follow_materials_that_become_translucent() {
    for flatten in FLATTENED {
        let settings = AccelSettings { flatten, ..AccelSettings::default() };
        let mut scene = Scene::default();
        let at = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X)];
        scenes::add(&mut scene, scenes::sphere(8), scenes::material(SurfaceClass::Opaque, true), &at);
        let (mut updated, _) = Accel::build(&scenes::posed(&scene), &settings);
        scene.materials[0].transmission.factor = 0.5;
        let posed = scenes::posed(&scene);
        let new = Accel::build(&posed, &settings).0;
        updated.update(&posed);
        let segments = segments(&rays(&posed, 500));
        let light = |accel: &Accel| {
            let mut light = Vec::new();
            accel.transmittance(&segments, &Holes, &mut light);
            light
        };
        assert_eq!(light(&updated), light(&new));
        assert!(light(&new).iter().any(|l| l.x > 0.0 && l.x < 1.0), "something transmits light");
    }
}

/// A translucent material whose texture is opaque at all texture coordinates blocks light as an opaque one
/// does, until the texture transform moves. An existing BVH follows that, too.
#[test]
fn updates_follow_animated_texture_transforms() {
    for flatten in FLATTENED {
        let settings = AccelSettings { flatten, ..AccelSettings::default() };
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
        let blend = Material {
            base_color: base,
            alpha_from_base: true,
            ..scenes::material(SurfaceClass::Translucent, true)
        };
        scenes::add(&mut scene, mesh, Material { alpha: ScalarInput::new(1.0), ..blend }, &at);
        // The right half is transparent.
        let alphas = (0..64).flat_map(|i| [9, if i < 32 { 255 } else { 51 }]).collect();
        scene.images.push(Image {
            name: String::new(),
            width: 64,
            height: 1,
            channels: Channels::La,
            texels: Texels::U8(alphas),
            mips: MipMaps::default(),
        });
        scene.textures.push(Texture { wrap: [Wrap::Clamp; 2], ..Texture::default() });
        let light = |scene: &Scene, accel: &Accel| {
            let (posed, mut light) = (scenes::posed(scene), Vec::new());
            accel.transmittance(&segments(&rays(&posed, 500)), &MaterialHitFilter(&posed), &mut light);
            light
        };
        let some = |light: &[Vec3]| light.iter().any(|l| l.x > 0.0 && l.x < 1.0);
        let (mut updated, _) = Accel::build(&scenes::posed(&scene), &settings);
        assert!(!updated.has_translucent() && !some(&light(&scene, &updated)));
        for (offset, part) in [(0.1, true), (0.5, true), (0.0, false)] {
            scene.materials[0].base_color.texture = by(offset);
            let posed = scenes::posed(&scene);
            updated.update(&posed);
            let new = Accel::build(&posed, &settings).0;
            assert_eq!(light(&scene, &updated), light(&scene, &new));
            assert_eq!((new.has_translucent(), some(&light(&scene, &new))), (part, part), "{offset}");
        }
    }
}
