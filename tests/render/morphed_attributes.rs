//! Morph targets of texture coordinates and vertex colours, seen in pictures.

use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    AlphaMode, Channels, ColorInput, Image, Lighting, Material, MipMaps, MorphTarget, Reflectance, Scene,
    Texels, Texture, TextureFilter, TextureRef, UvTransform, Wrap,
};
use glam::{Vec2, Vec4};

use crate::common::scenes::{self, grid};

/// A square that fills the view, in the colours of its vertices, perhaps times a texture.
fn square(colors: Option<Vec4>, alpha_mode: AlphaMode, target: impl Fn(usize) -> MorphTarget) -> Scene {
    let mut mesh = grid(1, 2);
    let count = mesh.positions.len();
    mesh.uvs = vec![vec![Vec2::new(0.25, 0.5); count]];
    mesh.colors = colors.map_or_else(Vec::new, |color| vec![color; count]);
    mesh.morph_targets = vec![target(count)];
    mesh.morph_weights = vec![0.0];
    let texture = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY };
    let material = Material {
        base_color: ColorInput { factor: Rgb::ONE, texture: Some(texture) },
        alpha_from_base: true,
        reflectance: Reflectance::Unlit,
        alpha_mode,
        ..Material::default()
    };
    let mut scene = scenes::of_material(mesh, material);
    // White on the left, and transparent red on the right.
    let texels = Texels::U8(vec![255, 255, 255, 255, 255, 0, 0, 0]);
    let (channels, mips) = (Channels::Rgba, MipMaps::default());
    scene.images = vec![Image { name: String::new(), width: 2, height: 1, channels, texels, mips }];
    scene.textures = vec![Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Nearest,
        ..Texture::default()
    }];
    scene
}

/// The colour of all pixels with this weight.
fn color(scene: &Scene, weight: f32) -> Rgba {
    let mut scene = scene.clone();
    scene.meshes[0].morph_weights = vec![weight];
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let view = blinn::scene::View { view_width: Some(0.5), view_height: Some(0.5), ..scenes::front_view() };
    let (camera, _) = view.resolve(&posed, 8, 8).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame { lights: Vec::new(), ..Frame::new(&posed, &accel, camera, &lit) };
    let settings = RenderSettings { width: 8, height: 8, ..Default::default() };
    let colors = render(&frame, &Phong::default(), &settings, &()).unwrap().colors;
    assert!(colors.iter().all(|c| *c == colors[0]), "{colors:?}");
    colors[0]
}

#[test]
fn colours_are_those_of_the_displaced_vertices() {
    let target = |count| MorphTarget {
        colors: vec![Vec4::new(-0.5, 1.0, 0.25, 0.0); count],
        ..MorphTarget::default()
    };
    let scene = square(Some(Vec4::new(0.5, 0.25, 0.5, 1.0)), AlphaMode::Opaque, target);
    for (weight, expected) in [(0.0, [0.5, 0.25, 0.5]), (0.5, [0.25, 0.75, 0.625]), (1.0, [0.0, 1.0, 0.75])] {
        assert_eq!(color(&scene, weight), Rgb::from(expected).extend(1.0), "{weight}");
    }
}

#[test]
fn textures_move_with_displaced_coordinates() {
    let target =
        |count| MorphTarget { uvs: vec![vec![Vec2::new(1.0, 0.0); count]], ..MorphTarget::default() };
    let scene = square(None, AlphaMode::Opaque, target);
    for (weight, expected) in [(0.0, Rgb::ONE), (0.5, Rgb::X), (1.0, Rgb::ONE), (-0.5, Rgb::X)] {
        assert_eq!(color(&scene, weight), expected.extend(1.0), "{weight}");
    }
}

/// Bounds of alpha, by which triangles are opaque or never seen, hold at every weight.
#[test]
fn displaced_alpha_hides_and_shows() {
    for alpha_mode in [AlphaMode::Mask(0.5), AlphaMode::Blend] {
        let faded = |count| MorphTarget { colors: vec![Vec4::NEG_W; count], ..MorphTarget::default() };
        let scene = square(Some(Vec4::ONE), alpha_mode, faded);
        assert_eq!([color(&scene, 0.0).w, color(&scene, 1.0).w], [1.0, 0.0], "{alpha_mode:?}");
        let shown = |count| MorphTarget { colors: vec![Vec4::W; count], ..MorphTarget::default() };
        let scene = square(Some(Vec4::new(1.0, 1.0, 1.0, 0.0)), alpha_mode, shown);
        assert_eq!([color(&scene, 0.0).w, color(&scene, 1.0).w], [0.0, 1.0], "{alpha_mode:?}");
        let moved =
            |count| MorphTarget { uvs: vec![vec![Vec2::new(0.5, 0.0); count]], ..MorphTarget::default() };
        let scene = square(None, alpha_mode, moved);
        assert_eq!([color(&scene, 0.0).w, color(&scene, 1.0).w], [1.0, 0.0], "{alpha_mode:?}");
    }
}
