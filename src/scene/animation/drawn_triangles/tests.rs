//! Bounds hold exactly what can be seen: scenes with things that cannot, and a comparison with all triangles.

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

use super::*;
use crate::{
    AlphaMode, Animation, AnimationChoice, Channel, ChannelTarget, Channels, Image, Instance, Interpolation,
    Keyframes, LocalTransform, Material, MaterialProperty, MipMaps, MorphTarget, Node, PoseSettings,
    PosedScene, Skin, Texels, Texture, TextureRef, UvTransform, pose,
};
use blinn_core::geometry::Sphere;

/// A unit square at z = 0 and a material that is opaque.
fn square() -> Scene {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    add(&mut scene, mesh, DAffine3::IDENTITY);
    scene
}

/// Adds a mesh at a node of its own.
fn add(scene: &mut Scene, mesh: Mesh, to_world: DAffine3) -> u32 {
    let node = scene.nodes.len() as u32;
    let object = node + 1;
    scene.nodes.push(Node { local: LocalTransform::Matrix(to_world), visible: true, ..Node::default() });
    scene.instances.push(Instance { node, mesh: scene.meshes.len() as u32, object, ..Instance::default() });
    scene.meshes.push(mesh);
    node
}

/// A large triangle far away.
fn far_triangle() -> Mesh {
    let positions =
        vec![Vec3::new(100.0, 0.0, 0.0), Vec3::new(200.0, 0.0, 0.0), Vec3::new(100.0, 300.0, 9.0)];
    Mesh { positions, triangles: vec![[0, 1, 2]], uvs: vec![vec![Vec2::splat(0.5); 3]], ..Mesh::default() }
}

fn posed(scene: &Scene) -> PosedScene<'_> {
    pose(scene, &PoseSettings::default()).unwrap()
}

/// Asserts that nothing but the unit square can be seen, now and over the clip.
fn assert_only_the_square(scene: &Scene, what: &str) {
    let posed = posed(scene);
    let sphere = Sphere { centre: DVec3::new(0.5, 0.5, 0.0), radius: 0.5f64.sqrt() };
    for bounds in [posed.bounds(), posed.clip_bounds()] {
        assert_eq!((bounds.min, bounds.max), (DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)), "{what}");
    }
    for found in [posed.bounding_sphere(), posed.clip_sphere()] {
        assert!(found.centre == sphere.centre && (found.radius - sphere.radius).abs() < 1e-12, "{what}");
    }
}

/// Asserts that the far triangle counts.
fn assert_far(scene: &Scene, what: &str) {
    assert_eq!(posed(scene).clip_bounds().max, DVec3::new(200.0, 300.0, 9.0), "{what}");
}

fn keyframes(values: &[f32], width: usize) -> Keyframes {
    let times = (0..values.len() / width).map(|i| i as f32).collect();
    Keyframes { times, values: values.to_vec(), width, interpolation: Interpolation::Linear }
}

/// Moves the square's node a little, so that the clip is sampled.
fn animate(scene: &mut Scene, target: ChannelTarget, values: &[f32], width: usize) {
    let channel = Channel { target, keyframes: keyframes(values, width) };
    match scene.animations.first_mut() {
        Some(animation) => animation.channels.push(channel),
        None => scene.animations.push(Animation { name: String::new(), channels: vec![channel] }),
    }
}

/// Every scene also with an animation that moves nothing visibly, so that the bounds are sampled over a clip.
fn with_and_without_clip(scene: &Scene, check: impl Fn(&Scene)) {
    check(scene);
    let mut animated = scene.clone();
    for node in 0..animated.nodes.len() as u32 {
        animate(&mut animated, ChannelTarget::Visibility(node), &[1.0, 1.0, 1.0], 1);
    }
    assert!(posed(&animated).clip_bounds().min.is_finite());
    check(&animated);
}

#[test]
fn vertices_that_no_triangle_uses_do_not_count() {
    let mut scene = square();
    scene.meshes[0].positions.insert(0, Vec3::splat(-1e6));
    scene.meshes[0].positions.push(Vec3::splat(1e6));
    scene.meshes[0].triangles.iter_mut().flatten().for_each(|v| *v += 1);
    with_and_without_clip(&scene, |scene| assert_only_the_square(scene, "unused vertices"));
}

#[test]
fn triangles_without_area_do_not_count() {
    let third = Vec3::new(0.1, 0.2, 0.3);
    for (what, corners) in [
        ("a point", [Vec3::splat(50.0); 3]),
        ("an edge", [Vec3::splat(50.0), Vec3::splat(50.0), Vec3::new(70.0, 80.0, 90.0)]),
        ("a line", [Vec3::ZERO, Vec3::splat(-50.0), Vec3::splat(50.0)]),
        ("a line that f32 rounds", [third, third * 77.0, third * 1234.5]),
        ("not finite", [Vec3::splat(50.0), Vec3::new(f32::NAN, 60.0, 0.0), Vec3::new(70.0, 60.0, 1.0)]),
        ("too large", [Vec3::splat(50.0), Vec3::new(1e20, 60.0, 0.0), Vec3::new(70.0, 60.0, 1.0)]),
    ] {
        let mut scene = square();
        let mesh = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        add(&mut scene, mesh, DAffine3::IDENTITY);
        with_and_without_clip(&scene, |scene| assert_only_the_square(scene, what));
        // In the same mesh.
        let mut scene = square();
        scene.meshes[0].positions.extend(corners);
        scene.meshes[0].triangles.insert(0, [4, 5, 6]);
        with_and_without_clip(&scene, |scene| assert_only_the_square(scene, what));
    }
}

#[test]
fn instances_that_their_transform_collapses_do_not_count() {
    for scale in [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 0.0, -7.0)] {
        let mut scene = square();
        let turned = DMat3::from_rotation_y(0.3) * DMat3::from_diagonal(scale) * DMat3::from_rotation_z(1.1);
        let to_world = DAffine3::from_mat3_translation(turned, DVec3::splat(1e4));
        add(&mut scene, far_triangle(), to_world);
        with_and_without_clip(&scene, |scene| assert_only_the_square(scene, &scale.to_string()));
    }
    // A flat scale collapses only what stands upright.
    let mut scene = square();
    let upright = vec![Vec3::ZERO, Vec3::new(50.0, 0.0, 0.0), Vec3::new(50.0, 9.0, 0.0)];
    let mut mesh = Mesh { positions: upright, triangles: vec![[0, 1, 2]], ..Mesh::default() };
    mesh.positions.extend([Vec3::ZERO, Vec3::X, Vec3::Z]);
    mesh.triangles.push([3, 4, 5]);
    add(&mut scene, mesh, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
    with_and_without_clip(&scene, |scene| {
        for bounds in [posed(scene).bounds(), posed(scene).clip_bounds()] {
            assert_eq!((bounds.min, bounds.max), (DVec3::ZERO, DVec3::ONE));
        }
    });
}

/// The far triangle with a material of its own.
fn with_alpha(mode: AlphaMode, factor: f32) -> Scene {
    let mut scene = square();
    let mut material = Material { alpha_mode: mode, alpha_from_base: true, ..Material::default() };
    material.alpha.factor = factor;
    scene.materials.push(material);
    add(&mut scene, Mesh { material: 1, ..far_triangle() }, DAffine3::IDENTITY);
    scene
}

/// Gives the far triangle's material an image of two texels in a row with these values of alpha.
fn with_texture(mut scene: Scene, alpha: [u8; 2]) -> Scene {
    scene.images.push(Image {
        name: String::new(),
        width: 16,
        height: 1,
        channels: Channels::La,
        texels: Texels::U8((0..16).flat_map(|x| [255, alpha[usize::from(x >= 8)]]).collect()),
        mips: MipMaps::default(),
    });
    scene.textures.push(Texture { image: 0, ..Texture::default() });
    scene.materials[1].base_color.texture =
        Some(TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY });
    scene
}

#[test]
fn triangles_that_alpha_hides_do_not_count() {
    let opaque = with_alpha(AlphaMode::Opaque, 0.0);
    with_and_without_clip(&opaque, |scene| assert_far(scene, "opaque"));
    for (mode, hidden, shown) in [(AlphaMode::Blend, 0.0, 0.01), (AlphaMode::Mask(0.5), 0.49, 0.5)] {
        let what = format!("{mode:?}");
        let only_square = |scene: &Scene| assert_only_the_square(scene, &what);
        let far = |scene: &Scene| assert_far(scene, &what);
        with_and_without_clip(&with_alpha(mode, hidden), only_square);
        with_and_without_clip(&with_alpha(mode, shown), far);
        // Vertex colours.
        let mut scene = with_alpha(mode, 1.0);
        scene.meshes[1].colors = vec![Vec4::new(1.0, 1.0, 1.0, hidden); 3];
        with_and_without_clip(&scene, only_square);
        scene.meshes[1].colors[2].w = 1.0;
        with_and_without_clip(&scene, far);
        // Textures: empty, empty where the triangle is, and not empty.
        with_and_without_clip(&with_texture(with_alpha(mode, 1.0), [0, 0]), only_square);
        let mut scene = with_texture(with_alpha(mode, 1.0), [0, 255]);
        scene.meshes[1].uvs = vec![vec![Vec2::new(0.1, 0.5), Vec2::new(0.3, 0.5), Vec2::new(0.2, 0.5)]];
        with_and_without_clip(&scene, only_square);
        scene.meshes[1].uvs[0][2].x = 0.8;
        with_and_without_clip(&scene, far);
    }
}

#[test]
fn what_an_animation_shows_at_some_time_counts() {
    // Alpha.
    let base = ChannelTarget::Material(1, MaterialProperty::Base);
    for (values, is_shown) in [([0.0, 0.0], false), ([0.0, 0.6], true), ([0.6, 0.0], true)] {
        for mode in [AlphaMode::Blend, AlphaMode::Mask(0.5)] {
            let mut scene = with_alpha(mode, 1.0);
            animate(&mut scene, base, &[1.0, 1.0, 1.0, values[0], 1.0, 1.0, 1.0, values[1]], 4);
            with_and_without_clip(&scene, |scene| match is_shown {
                true => assert_far(scene, "alpha"),
                false => assert_only_the_square(scene, "alpha"),
            });
        }
    }
    let mut scene = with_alpha(AlphaMode::Mask(0.9), 0.5);
    with_and_without_clip(&scene, |scene| assert_only_the_square(scene, "cutoff"));
    animate(&mut scene, ChannelTarget::Material(1, MaterialProperty::AlphaCutoff), &[0.9, 0.4], 1);
    assert_far(&scene, "cutoff");
    // A texture that moves.
    let mut scene = with_texture(with_alpha(AlphaMode::Blend, 1.0), [0, 255]);
    scene.meshes[1].uvs = vec![vec![Vec2::splat(0.2); 3]];
    with_and_without_clip(&scene, |scene| assert_only_the_square(scene, "texture"));
    let slot = crate::TextureSlot::Base;
    animate(&mut scene, ChannelTarget::Material(1, MaterialProperty::Offset(slot)), &[0.0, 0.0, 0.5, 0.0], 2);
    assert_far(&scene, "texture");
    // A scale of 0 hides it while it is far away.
    let mut scene = square();
    let node = add(&mut scene, far_triangle(), DAffine3::IDENTITY);
    scene.nodes[node as usize].local = LocalTransform::IDENTITY;
    animate(&mut scene, ChannelTarget::Scale(node), &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3);
    assert_only_the_square(&scene, "scale 0 at all times");
    animate(&mut scene, ChannelTarget::Translation(node), &[1e5, 0.0, 0.0, 0.0, 0.0, 0.0], 3);
    assert_only_the_square(&scene, "scale 0 that moves");
    scene.animations[0].channels[0].keyframes.values = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    assert!(posed(&scene).clip_bounds().max.x >= 200.0);
    assert!(posed(&scene).bounds().max.x <= 1.0, "at the start it is hidden");
}

#[test]
fn parts_that_morph_targets_and_joints_collapse_do_not_count() {
    // A morph target pulls the far triangle into a point.
    let mut scene = square();
    let mut mesh = far_triangle();
    let to_point = mesh.positions.iter().map(|p| Vec3::X * 100.0 - *p).collect();
    mesh.morph_targets = vec![MorphTarget { positions: to_point, ..MorphTarget::default() }];
    mesh.morph_weights = vec![1.0];
    let node = add(&mut scene, mesh, DAffine3::IDENTITY);
    with_and_without_clip(&scene, |scene| assert_only_the_square(scene, "morph target"));
    animate(&mut scene, ChannelTarget::Weights(node), &[1.0, 0.0], 1);
    assert_far(&scene, "morph target over the clip");

    // A joint with scale 0 hides half of a mesh.
    let mut scene = square();
    let far = far_triangle().positions;
    let mesh = &mut scene.meshes[0];
    mesh.positions.extend(far);
    mesh.triangles.push([4, 5, 6]);
    mesh.influences.per_vertex = 1;
    mesh.influences.joints = vec![0, 0, 0, 0, 1, 1, 1];
    mesh.influences.weights = vec![1.0; 7];
    let hidden = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::splat(-400.0));
    for local in [DAffine3::IDENTITY, hidden] {
        let local = LocalTransform::Matrix(local);
        scene.nodes.push(Node { local, visible: true, ..Node::default() });
    }
    scene.instances[0].skin = Some(0);
    let inverse_bind = vec![DAffine3::IDENTITY; 2];
    scene.skins = vec![Skin { name: String::new(), joints: vec![1, 2], inverse_bind }];
    with_and_without_clip(&scene, |scene| assert_only_the_square(scene, "joint"));
    scene.nodes[2].local = LocalTransform::IDENTITY;
    with_and_without_clip(&scene, |scene| assert_far(scene, "joint"));
}

#[test]
fn nothing_that_can_be_seen_has_empty_bounds() {
    let mut scene = square();
    scene.meshes[0].triangles = vec![[0, 0, 1], [2, 2, 2]];
    let posed = posed(&scene);
    assert!(posed.bounds().is_empty() && posed.clip_bounds().is_empty());
    assert_eq!(posed.clip_sphere(), Sphere { centre: DVec3::ZERO, radius: 1.0 });
}

/// A triangle uses only one of the vertices at each pole of a sphere. The quick path finds it.
#[test]
fn poles_of_spheres_need_no_visit_of_all_triangles() {
    let mut scene = square();
    let n = 40u32;
    let mesh = &mut scene.meshes[0];
    mesh.positions.clear();
    mesh.triangles.clear();
    for i in 0..=n {
        let polar = std::f64::consts::PI * f64::from(i) / f64::from(n);
        for j in 0..=n {
            let around = std::f64::consts::TAU * f64::from(j) / f64::from(n);
            let (sin, cos) = polar.sin_cos();
            mesh.positions.push(DVec3::new(sin * around.cos(), cos, sin * around.sin()).as_vec3());
            let a = i * (n + 1) + j;
            if i < n && j < n {
                mesh.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
            }
        }
    }
    let posed = posed(&scene);
    assert_eq!((posed.bounds().min.y, posed.bounds().max.y), (-1.0, 1.0));
    assert!(posed.clip_bounds_cache().drawn().is_none(), "all triangles were visited");
}

/// Random meshes with unused vertices and degenerate triangles at random nodes: the same as over all triangles.
#[test]
fn bounds_are_those_of_all_triangles_with_area() {
    let number = |i: u32| f64::from((i.wrapping_mul(2_654_435_761) >> 8) % 2001) / 1000.0 - 1.0;
    let vector = |i: u32| DVec3::new(number(i), number(i + 1), number(i + 2));
    let mut differs = 0;
    for seed in 0..60u32 {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        for m in 0..4u32 {
            let k = 10_000 * seed + 2_000 * m;
            let count = 8 + (k / 7) % 200;
            let positions: Vec<Vec3> = (0..count).map(|i| vector(k + 3 * i).as_vec3()).collect();
            let index = |i: u32| (k + i * 31) / 3 % count;
            let triangles =
                (0..count / 9).map(|t| [index(3 * t), index(3 * t + 1), index(5 * t + 2)]).collect();
            let matrix3 = match (seed + m) % 7 {
                0 => DMat3::ZERO,
                1 => DMat3::from_diagonal(DVec3::new(1.0, 0.0, 2.0)),
                _ => DMat3::from_cols(vector(k + 900), vector(k + 903), vector(k + 906)),
            };
            let at = DAffine3 { matrix3, translation: 3.0 * vector(k + 909) };
            let mesh = Mesh { positions, triangles, ..Mesh::default() };
            add(&mut scene, mesh, at);
            let node = scene.instances.len() as u32 - 1;
            let copies = if m == 1 { 20 } else { 1 };
            for i in 0..copies {
                let local = LocalTransform::Matrix(DAffine3::from_translation(vector(k + 60 + i)));
                scene.nodes.push(Node { parent: None, local, visible: i % 3 > 0, ..Node::default() });
                let own = scene.instances[node as usize].clone();
                let instance = Instance { node: scene.nodes.len() as u32 - 1, ..own };
                scene.instances.push(instance);
            }
        }
        let centre = Some(DVec3::ZERO);
        let settings = PoseSettings { centre, animation: AnimationChoice::Rest, ..Default::default() };
        let posed = pose(&scene, &settings).unwrap();
        let mut expected = Aabb::EMPTY;
        let mut of_vertices = Aabb::EMPTY;
        let mut corners = Vec::new();
        for (i, instance) in posed.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            let point = |p: &Vec3| instance.transform.point_f64(*p);
            posed.positions(i as u32).iter().for_each(|p| of_vertices.extend(point(p)));
            for triangle in &posed.mesh(i as u32).triangles {
                let points = triangle.map(|v| point(&posed.positions(i as u32)[v as usize]));
                if has_area(&points) {
                    points.iter().for_each(|&p| expected.extend(p));
                    corners.extend(points);
                }
            }
        }
        assert_eq!(posed.bounds(), expected, "seed {seed}");
        let r2 = corners.iter().map(|p| p.distance_squared(expected.centre())).fold(0.0, f64::max);
        assert_eq!(posed.bounding_sphere().radius, r2.sqrt(), "seed {seed}");
        differs += usize::from(expected != of_vertices);
    }
    assert!(differs > 30, "only {differs} scenes have vertices that do not count");
}
