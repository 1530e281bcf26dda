//! Filtered textures by ray differentials, and highlights widened by the normals within a pixel.
//!
//! `cargo test --test render texture_filtering:: -- --ignored --nocapture` prints the tables of
//! docs/explanation/antialiasing.md.

mod tables;

use blinn::accel::{Accel, AccelSettings};
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{Aov, Frame, Integrator, LowDiscrepancySampler, Phong, Sample, Scratch};
use blinn::render::{RenderSettings, render, render_aovs};
use blinn::scene::{
    AlphaMode, Anisotropy, Channels, ColorInput, Image, Instance, Material, Mesh, MipMaps, MtlReflectance,
    Node, NormalMap, PoseSettings, PosedLight, Reflectance, Reflection, ScalarInput, Scene, TexelSemantics,
    Texels, Texture, TextureFilter, TextureRef, UvTransform, View, Wrap, pose,
};
use glam::{DVec3, Vec2, Vec3, Vec4};

/// Samples without differentials: the finest mip level, and highlights as sharp as their material.
struct Points;

impl Integrator for Points {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        let points: Vec<Sample> = samples.iter().map(|s| Sample { footprint: [0.0; 2], ..*s }).collect();
        Phong::default().render(frame, &points, sampler, scratch, out);
    }
}

fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    let texels = (0..width * height).flat_map(|i| texel(i % width, i / width)).collect();
    let (channels, texels) = (Channels::Rgba, Texels::U8(texels));
    Image { name: String::new(), width, height, channels, texels, mips: MipMaps::default() }
}

fn grey(v: u8) -> [u8; 4] {
    [v, v, v, 255]
}

/// 64 × 64 texels: a checkerboard of 8 × 8 squares, black and white.
fn checker() -> Image {
    image(64, 64, |x, y| grey(if (x / 8 + y / 8).is_multiple_of(2) { 255 } else { 0 }))
}

/// Black and white stripes along v, 8 texels wide.
fn stripes() -> Image {
    image(64, 64, |x, _| grey(if (x / 8).is_multiple_of(2) { 255 } else { 0 }))
}

/// White noise.
fn noise() -> Image {
    image(128, 128, |x, y| {
        let n = (x + 128 * y + 1).wrapping_mul(2_654_435_761);
        let n = (n ^ (n >> 15)).wrapping_mul(0x2c1b_3c6d);
        [(n >> 8) as u8, (n >> 16) as u8, (n >> 24) as u8, 255]
    })
}

fn reference(texture: u32) -> TextureRef {
    TextureRef { texture, uv_set: 0, transform: UvTransform::IDENTITY }
}

/// An unlit material.
fn unlit() -> Material {
    Material {
        base_color: ColorInput { factor: Rgb::ONE, texture: Some(reference(0)) },
        reflectance: Reflectance::Unlit,
        double_sided: true,
        ..Default::default()
    }
}

fn scene(meshes: Vec<Mesh>, materials: Vec<Material>, images: Vec<Image>) -> Scene {
    let textures = (0..images.len() as u32).map(|image| Texture { image, ..Texture::default() }).collect();
    let instance = |mesh| Instance { node: 0, mesh, object: 1, ..Instance::default() };
    Scene {
        nodes: vec![Node { visible: true, ..Default::default() }],
        instances: (0..meshes.len() as u32).map(instance).collect(),
        meshes,
        materials,
        textures,
        images,
        ..Default::default()
    }
}

/// A square floor of 200 m at y = 0, its texture rotated by `degrees`; one tile for each `tile` metres.
fn floor(degrees: f64, tile: f32) -> Mesh {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let corners = [(-1.0f32, -1.0f32), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let rotate = |(x, z): (f32, f32)| {
        let (x, z) = (f64::from(x) * 100.0, f64::from(z) * 100.0);
        Vec3::new((x * cos - z * sin) as f32, 0.0, (x * sin + z * cos) as f32)
    };
    Mesh {
        positions: corners.map(rotate).to_vec(),
        uvs: vec![corners.map(|(x, z)| Vec2::new(x, z) * (100.0 / tile)).to_vec()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

/// A view along −z and slightly down, from above the floor.
fn floor_view() -> View {
    View {
        view_point: Some(DVec3::new(0.0, 1.5, 0.0)),
        view_dir: Some(DVec3::new(0.0, -0.2, -1.0)),
        yfov: Some(0.6),
        ..Default::default()
    }
}

/// Renders without lights or with one.
fn picture(
    scene: &Scene,
    view: &View,
    light: Option<PosedLight>,
    settings: RenderSettings,
    integrator: &dyn Integrator,
) -> Vec<Rgba> {
    let posed = pose(scene, &PoseSettings { centre: Some(DVec3::ZERO), ..Default::default() }).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let (camera, _) = view.resolve(&posed, settings.width, settings.height).unwrap();
    let frame = Frame { lights: light.into_iter().collect(), ..unlit_frame(&posed, &accel, camera) };
    render(&frame, integrator, &settings, &()).unwrap().colors
}

fn unlit_frame<'a>(
    posed: &'a blinn::scene::PosedScene<'a>,
    accel: &'a Accel,
    camera: blinn::scene::Camera,
) -> Frame<'a> {
    let no_lights = blinn::scene::Lighting { sets: Some(Vec::new()), ..Default::default() };
    let lit = no_lights.resolve(posed, &camera);
    Frame { ambient: Rgb::ZERO, ..Frame::new(posed, accel, camera, &lit) }
}

const SIZE: (u32, u32) = (96, 54);

fn samples(samples: u32) -> RenderSettings {
    RenderSettings { width: SIZE.0, height: SIZE.1, samples, ..Default::default() }
}

fn row(pixels: &[Rgba], y: u32) -> &[Rgba] {
    &pixels[(y * SIZE.0) as usize..((y + 1) * SIZE.0) as usize]
}

fn root_mean_square(differences: impl Iterator<Item = Vec4>) -> f64 {
    let (mut sum, mut n) = (0.0, 0);
    for d in differences {
        (sum, n) = (sum + f64::from(d.truncate().length_squared()) / 3.0, n + 1);
    }
    (sum / f64::from(n)).sqrt()
}

fn error(actual: &[Rgba], expected: &[Rgba]) -> f64 {
    root_mean_square(actual.iter().zip(expected).map(|(&a, &b)| a - b))
}

/// The row of pixels that shows the floor at `distance` metres.
fn row_at(distance: f64) -> u32 {
    // tan of the angle below the view direction, over tan of half the field of view.
    let below = libm::tan(libm::atan(1.5 / distance) - libm::atan(0.2));
    ((0.5 + 0.5 * below / libm::tan(0.3)) * f64::from(SIZE.1)) as u32
}

#[test]
fn a_distant_checkerboard_is_its_mean_at_one_sample() {
    let scene = scene(vec![floor(20.0, 1.0)], vec![unlit()], vec![checker()]);
    let filtered = picture(&scene, &floor_view(), None, samples(1), &Phong::default());
    let points = picture(&scene, &floor_view(), None, samples(1), &Points);
    for y in row_at(90.0)..=row_at(40.0) {
        // A pixel covers more than ten squares, so the mean of black and white is half as bright.
        let off = |pixels: &[Rgba]| row(pixels, y).iter().map(|p| (p.x - 0.5).abs()).fold(0.0, f32::max);
        assert!(off(&filtered) < 0.02, "row {y}: {}", off(&filtered));
        assert!(off(&points) > 0.4, "row {y}: unfiltered samples would not pass");
    }
}

#[test]
fn anisotropic_filtering_keeps_receding_stripes_sharp() {
    let scene = scene(vec![floor(0.0, 4.0)], vec![unlit()], vec![stripes()]);
    let filtered = picture(&scene, &floor_view(), None, samples(1), &Phong::default());
    // Stripes are 0.5 m wide. At 9 m a pixel covers 0.1 m by 0.65 m: isotropic filtering would blur the stripes
    // away, as it does the checkerboard.
    let contrast = |pixels: &[Rgba]| {
        let pixels = row(pixels, row_at(9.0)).iter().map(|p| p.x);
        pixels.clone().fold(0.0, f32::max) - pixels.fold(1.0, f32::min)
    };
    assert!(contrast(&filtered) > 0.95, "{}", contrast(&filtered));
    let across = Scene { meshes: vec![floor(90.0, 4.0)], ..scene.clone() };
    let across = picture(&across, &floor_view(), None, samples(1), &Phong::default());
    assert!(contrast(&across) < 0.3, "{}", contrast(&across));
}

#[test]
fn an_alpha_mask_keeps_its_coverage_at_any_distance() {
    // A quarter of the fence is opaque: the mean of its alpha is below the cutoff.
    let fence = image(16, 16, |x, y| [255, 255, 255, if x % 4 < 2 && y % 4 < 2 { 255 } else { 0 }]);
    let material = Material { alpha_mode: AlphaMode::Mask(0.5), alpha_from_base: true, ..unlit() };
    let scene = scene(vec![floor(10.0, 0.5)], vec![material], vec![fence]);
    let settings = samples(64);
    let pixels = picture(&scene, &floor_view(), None, settings, &Phong::default());
    let rows = row_at(60.0)..row_at(10.0);
    let coverage = |y: u32| row(&pixels, y).iter().map(|p| p.w).sum::<f32>() / SIZE.0 as f32;
    assert!(rows.clone().all(|y| (0.15..0.3).contains(&coverage(y))));
    // Bilinear alpha exceeds the cutoff on 2 + 3 − 2·ln 2 of 16 texels: corners are rounded.
    let mean = rows.clone().map(coverage).sum::<f32>() / rows.len() as f32;
    assert!((mean - (5.0 - 2.0 * std::f32::consts::LN_2) / 16.0).abs() < 0.005, "{mean}");
}

#[test]
fn transparent_texels_do_not_bleed_into_opaque_ones() {
    // White leaves; the rest is transparent black.
    let leaves = image(64, 64, |x, y| if (x / 2 + y / 2).is_multiple_of(2) { [255; 4] } else { [0; 4] });
    for (alpha_mode, least) in [(AlphaMode::Mask(0.5), 0.9), (AlphaMode::Blend, 0.98)] {
        let material = Material { alpha_mode, alpha_from_base: true, ..unlit() };
        let scene = scene(vec![floor(10.0, 1.0)], vec![material], vec![leaves.clone()]);
        let pixels = picture(&scene, &floor_view(), None, samples(4), &Phong::default());
        for p in row(&pixels, row_at(30.0)).iter().filter(|p| p.w > 0.0) {
            // Premultiplied: white times coverage.
            assert!(p.x >= least * p.w, "{alpha_mode:?}: {p}");
        }
    }
}

#[test]
fn a_fully_transparent_pane_changes_nothing() {
    let alone = scene(vec![floor(20.0, 1.0)], vec![unlit()], vec![checker()]);
    let pane = Mesh {
        positions: vec![Vec3::new(-9.0, -9.0, -1.0), Vec3::new(9.0, -9.0, -1.0), Vec3::new(0.0, 9.0, -1.0)],
        triangles: vec![[0, 1, 2]],
        material: 1,
        ..Default::default()
    };
    let clear = Material {
        alpha: ScalarInput::new(0.0),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Default::default()
    };
    let behind = scene(vec![floor(20.0, 1.0), pane], vec![unlit(), clear], vec![checker()]);
    let render = |scene: &Scene| picture(scene, &floor_view(), None, samples(1), &Phong::default());
    assert_eq!(render(&alone), render(&behind));
}

#[test]
fn aovs_sample_the_finest_mip_level() {
    for decode_last in [false, true] {
        let mut scene = scene(vec![floor(20.0, 1.0)], vec![unlit()], vec![noise()]);
        scene.textures[0].decode_last = decode_last;
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let (accel, _) = Accel::build(&posed, &AccelSettings::default());
        let (camera, _) = floor_view().resolve(&posed, SIZE.0, SIZE.1).unwrap();
        let frame = unlit_frame(&posed, &accel, camera);
        let layers = render_aovs(&frame, &[Aov::Uv, Aov::Albedo, Aov::Mask], &samples(4), &()).unwrap();
        let [uv, albedo, mask] = &layers[..] else { panic!("three layers") };
        let mut covered = 0;
        for (i, _) in mask.values.iter().enumerate().filter(|(_, m)| **m > 0.0) {
            let uv = Vec2::new(uv.values[2 * i], uv.values[2 * i + 1]);
            let texel = scene.textures[0].sample(&scene.images, uv, TexelSemantics::Color);
            assert_eq!(albedo.values[3 * i..3 * i + 3], texel.to_array()[..3]);
            covered += 1;
        }
        assert!(covered > 1000);
    }
}

#[test]
fn nearest_filtering_applies_where_texels_are_magnified() {
    let mut scene = scene(vec![floor(0.0, 400.0)], vec![unlit()], vec![noise()]);
    scene.textures[0].filter = TextureFilter::Nearest;
    let render = |integrator: &dyn Integrator| picture(&scene, &floor_view(), None, samples(1), integrator);
    let (filtered, points) = (render(&Phong::default()), render(&Points));
    // Texels are 3 m wide: up to 20 m away, a pixel covers less than one.
    for y in row_at(15.0)..SIZE.1 {
        assert_eq!(row(&filtered, y), row(&points, y));
    }
    assert_ne!(filtered, points);
}

#[test]
fn ray_differentials_are_differences_of_eye_rays() {
    let scene = scene(vec![floor(0.0, 1.0)], vec![unlit()], vec![checker()]);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    for projection in [blinn::scene::Projection::Perspective, blinn::scene::Projection::Orthographic] {
        let view = View { projection: Some(projection), ..floor_view() };
        let (camera, _) = view.resolve(&posed, 160, 90).unwrap();
        let (a, b) = (camera.eye_ray(0.2, 0.3, DVec3::ZERO), camera.eye_ray(0.45, 0.8, DVec3::ZERO));
        let step = camera.ray_differential(0.25, 0.5);
        assert!((b.o - a.o).abs_diff_eq((step.o[0] + step.o[1]).as_vec3(), 1e-5), "{projection:?}");
        assert!((b.d - a.d).abs_diff_eq((step.d[0] + step.d[1]).as_vec3(), 1e-5), "{projection:?}");
        assert_ne!(step, Default::default());
    }
}

/// A unit sphere with smooth normals, texture coordinates and tangents.
fn sphere() -> Mesh {
    let (rings, columns) = (48u32, 96u32);
    let mut mesh = Mesh { uvs: vec![Vec::new()], ..Mesh::default() };
    for (i, j) in (0..=rings).flat_map(|i| (0..=columns).map(move |j| (i, j))) {
        let (u, v) = (f64::from(j) / f64::from(columns), f64::from(i) / f64::from(rings));
        let (sin, cos) = libm::sincos(u * std::f64::consts::TAU);
        let (out, up) = libm::sincos(v * std::f64::consts::PI);
        let p = Vec3::new((out * sin) as f32, up as f32, (out * cos) as f32);
        mesh.positions.push(p);
        mesh.normals.push(p);
        mesh.tangents.push(Vec4::new(cos as f32, 0.0, -sin as f32, 1.0));
        mesh.uvs[0].push(Vec2::new(u as f32 * 4.0, v as f32 * 2.0));
    }
    for (i, j) in (0..rings).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let a = i * (columns + 1) + j;
        let b = a + columns + 1;
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    mesh
}

/// A normal map of bumps 16 texels wide, with slopes up to 0.5.
fn bumps() -> Image {
    image(256, 256, |x, y| {
        let slope = |v: u32| 0.5 * libm::sin((f64::from(v) + 0.5) / 16.0 * std::f64::consts::TAU);
        let n = DVec3::new(-slope(x), -slope(y), 1.0).normalize();
        let code = |v: f64| ((v * 0.5 + 0.5) * 255.0).round() as u8;
        [code(n.x), code(n.y), code(n.z), 255]
    })
}

/// A metal ball of this roughness, with or without the normal map.
fn ball(roughness: f32, bumpy: bool) -> Scene {
    let material = Material {
        base_color: ColorInput::new(Rgb::splat(0.8)),
        reflectance: Reflectance::metallic_roughness(1.0, roughness),
        normal: bumpy.then(|| NormalMap { texture: reference(0), scale: 1.0, scale_is_strength: false }),
        ..Default::default()
    };
    scene(vec![sphere()], vec![material], vec![bumps()])
}

/// A view of a ball from `distance`, 400 pixels wide.
fn towards_ball(distance: f64) -> View {
    View {
        view_point: Some(DVec3::new(0.0, 0.0, distance)),
        look_at: Some(DVec3::ZERO),
        yfov: Some(0.27),
        ..Default::default()
    }
}

fn sun() -> PosedLight {
    PosedLight::sun(DVec3::new(-0.5, -0.6, -0.7), Rgb::ONE)
}

fn mean(pixels: &[Rgba]) -> f64 {
    pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / pixels.len() as f64
}

/// Red and green are the direction, blue the strength.
#[test]
fn a_texture_turns_and_weakens_an_anisotropy() {
    let highlight = |strength: f32, rotation: f32, texel: Option<[u8; 4]>| {
        let mut metal = ball(0.4, false);
        metal.images = vec![image(1, 1, |_, _| texel.unwrap_or([255; 4]))];
        let texture = texel.map(|_| reference(0));
        metal.materials[0].reflection = Reflection::Fresnel;
        metal.materials[0].anisotropy =
            Some(Anisotropy { strength, rotation, texture, ..Anisotropy::default() });
        picture(&metal, &towards_ball(8.0), Some(sun()), samples(1), &Phong::default())
    };
    let along_u = highlight(0.9, 0.0, None);
    let along_v = highlight(0.9, std::f32::consts::FRAC_PI_2, None);
    let round = highlight(0.0, 0.0, None);
    let turned = highlight(0.9, 0.0, Some([128, 255, 255, 255]));
    let weakened = highlight(0.9, 0.0, Some([255, 128, 0, 255]));
    let stretch = error(&along_u, &along_v).min(error(&along_u, &round));
    assert!(stretch > 0.01, "{stretch}");
    // 128 is nearly the middle between −1 and 1.
    for (name, off) in [("turned", error(&turned, &along_v)), ("weakened", error(&weakened, &round))] {
        assert!(off < 0.05 * stretch, "{name}: {off} of {stretch}");
    }
}

#[test]
fn highlights_narrower_than_a_sample_keep_their_energy() {
    for (distance, bumpy) in [(60.0, false), (20.0, true)] {
        let (ball, view) = (ball(0.15, bumpy), towards_ball(distance));
        let render =
            |n, integrator: &dyn Integrator| picture(&ball, &view, Some(sun()), samples(n), integrator);
        let expected = render(256, &Points);
        let (one, point) = (render(1, &Phong::default()), render(1, &Points));
        assert!(
            (mean(&one) / mean(&expected) - 1.0).abs() < 0.15,
            "{bumpy}: {} {}",
            mean(&one),
            mean(&expected)
        );
        assert!(error(&one, &expected) < 0.5 * error(&point, &expected), "{bumpy}");
    }
}

#[test]
fn mtl_shininess_is_not_widened() {
    let mut ball = ball(0.15, true);
    ball.materials[0].reflectance = Reflectance::Mtl(MtlReflectance {
        ambient: None,
        specular: ColorInput::new(Rgb::ONE),
        shininess: 200.0,
        ior: 0.0,
    });
    ball.materials[0].normal = None;
    let render = |integrator: &dyn Integrator| {
        picture(&ball, &towards_ball(40.0), Some(sun()), samples(1), integrator)
    };
    assert_eq!(render(&Phong::default()), render(&Points));
}

#[test]
fn a_slow_turntable_does_not_shimmer() {
    let turntable = |integrator: &dyn Integrator, n| -> Vec<Vec<Rgba>> {
        let render = |i: i32| {
            let scene = scene(vec![floor(30.0 + 0.5 * f64::from(i), 1.0)], vec![unlit()], vec![checker()]);
            picture(&scene, &floor_view(), None, samples(n), integrator)
        };
        (0..3).map(render).collect()
    };
    let expected = turntable(&Points, 144);
    let render = |integrator: &dyn Integrator| shimmer(&turntable(integrator, 1), &expected);
    let (filtered, points) = (render(&Phong::default()), render(&Points));
    assert!(filtered < 0.04 && points > 10.0 * filtered, "{filtered} filtered, {points} unfiltered");
}

/// The share of the change from frame to frame that is error.
fn shimmer(actual: &[Vec<Rgba>], expected: &[Vec<Rgba>]) -> f64 {
    let change = |frames: &[Vec<Rgba>], f: usize, i: usize| frames[f + 1][i] - frames[f][i];
    let all = (0..actual.len() - 1).flat_map(|f| (0..actual[f].len()).map(move |i| (f, i)));
    root_mean_square(all.map(|(f, i)| change(actual, f, i) - change(expected, f, i)))
}

#[test]
fn all_wrap_modes_and_odd_sizes_sample_inside_the_image() {
    let sizes = [(1, 1), (3, 5), (1, 7), (129, 2)];
    for (wrap, (w, h)) in
        [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].into_iter().flat_map(|w| sizes.map(|s| (w, s)))
    {
        let grey = image(w, h, |_, _| grey(100));
        let mut scene = scene(vec![floor(20.0, 0.7)], vec![unlit()], vec![grey]);
        scene.textures[0].wrap = [wrap, Wrap::Repeat];
        let pixels = picture(&scene, &floor_view(), None, samples(1), &Phong::default());
        let expected = blinn::scene::srgb_to_linear(100.0 / 255.0);
        for p in pixels.iter().filter(|p| p.w > 0.0) {
            assert!((p.x - expected).abs() < 1e-5, "{wrap:?} {w} x {h}: {p}");
        }
    }
}
