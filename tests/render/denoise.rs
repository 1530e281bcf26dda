//! Reconstruction of noisy light: the same bytes however a picture is rendered, less noise, and the light of Cycles without
//! caustics.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use blinn::accel::{AccelSettings, SimdLevel};
use blinn::display::Display;
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Frame, Phong};
use blinn::render::{Denoise, NoisyPicture, PixelRect, Pixels, ProgressMonitor, RenderSettings, render};
use blinn::scene::{
    AreaLightShape, ColorInput, Environment, Lighting, Material, PosedAreaLight, Projection, Reflectance,
    Reflection, ScalarInput, Scene, Sheen, View,
};
use glam::{DAffine3, DMat3, DVec3};

use crate::common::scenes::{self, add};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 80;

fn plastic(color: Rgb, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(color),
        reflectance: Reflectance::metallic_roughness(0.0, roughness),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    }
}

fn at(x: f64, y: f64, z: f64, scale: f64) -> [DAffine3; 1] {
    [DAffine3::from_translation(DVec3::new(x, y, z)) * DAffine3::from_scale(DVec3::splat(scale))]
}

/// Two balls, one of them of glass, on a floor in front of a wall.
fn still_life() -> Scene {
    let mut scene = Scene::default();
    add(&mut scene, scenes::grid(1, 1), plastic(Rgb::new(0.6, 0.5, 0.4), 0.3), &at(0.0, 0.0, 0.0, 4.0));
    add(&mut scene, scenes::grid(1, 2), plastic(Rgb::splat(0.5), 0.9), &at(0.0, 0.0, -2.0, 4.0));
    add(&mut scene, scenes::ball(24, 12), plastic(Rgb::new(0.8, 0.1, 0.1), 0.4), &at(-0.7, 0.5, 0.0, 0.5));
    let glass = Material { transmission: ScalarInput::new(1.0), ..plastic(Rgb::ONE, 0.0) };
    add(&mut scene, scenes::ball(24, 12), glass, &at(0.7, 0.5, 0.0, 0.5));
    let ball = scene.instances[3].mesh as usize;
    scene.meshes[ball].is_body = true;
    scene
}

/// How a picture of the still life is rendered.
#[derive(Clone, Copy)]
struct Shot {
    samples: u32,
    denoise: Denoise,
    caustics: bool,
    simd: SimdLevel,
    tile: u32,
    size: [u32; 2],
    crop: Option<PixelRect>,
    /// Angle by which the lamp is turned about the vertical, in degrees.
    lamp_angle: f64,
}

impl Default for Shot {
    fn default() -> Shot {
        let simd = AccelSettings::default().simd;
        let size = [WIDTH, HEIGHT];
        Shot {
            samples: 4,
            denoise: Denoise::Auto,
            caustics: false,
            simd,
            tile: 32,
            size,
            crop: None,
            lamp_angle: 0.0,
        }
    }
}

impl Shot {
    fn take(&self, scene: &Scene) -> Vec<Rgba> {
        self.with_frame(scene, |frame, settings| {
            render(frame, &Phong::default(), settings, &()).unwrap().colors
        })
    }

    /// Calls `work` with the frame and the settings of the picture.
    fn with_frame<T>(&self, scene: &Scene, work: impl FnOnce(&Frame, &RenderSettings) -> T) -> T {
        let posed = scenes::posed(scene);
        let settings = AccelSettings { simd: self.simd, ..AccelSettings::default() };
        let accel = blinn::accel::Accel::build(&posed, &settings).0;
        let view = View {
            view_point: Some(DVec3::new(0.0, 1.2, 4.0)),
            view_dir: Some(DVec3::new(0.0, -0.2, -1.0)),
            projection: Some(Projection::Perspective),
            ..View::default()
        };
        let [width, height] = self.size;
        let (camera, _) = view.resolve(&posed, width, height).unwrap();
        let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
        // The lamp shines along its −z axis.
        let translation = DVec3::new(0.5, 3.0, 0.5) - posed.centre;
        let downward = DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y);
        let matrix3 = DMat3::from_rotation_y(self.lamp_angle.to_radians()) * downward;
        let to_world = DAffine3 { matrix3, translation };
        let light =
            PosedAreaLight::new(AreaLightShape::Rect, [1.0, 1.0], &to_world, Rgb::splat(8.0)).unwrap();
        let frame = Frame {
            area_lights: vec![light],
            indirect: 3,
            caustics: self.caustics,
            ..Frame::new(&posed, &accel, camera, &lit)
        };
        let settings = RenderSettings {
            width,
            height,
            samples: self.samples,
            denoise: self.denoise,
            crop: self.crop,
            tile: self.tile,
            ..RenderSettings::default()
        };
        work(&frame, &settings)
    }
}

fn bits(pixels: &[Rgba]) -> Vec<u32> {
    pixels.iter().flat_map(|p| p.to_array().map(f32::to_bits)).collect()
}

#[test]
fn reconstructed_pictures_do_not_depend_on_threads_tiles_or_simd_levels() {
    let scene = still_life();
    let expected = bits(&Shot::default().take(&scene));
    assert!(expected != bits(&Shot { denoise: Denoise::Off, ..Shot::default() }.take(&scene)));
    assert!(bits(&Shot { tile: 7, ..Shot::default() }.take(&scene)) == expected, "tiles");
    for simd in scenes::simd_levels() {
        assert!(bits(&Shot { simd, ..Shot::default() }.take(&scene)) == expected, "{simd:?}");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let pixels = pool.install(|| Shot::default().take(&scene));
        assert!(bits(&pixels) == expected, "{threads} threads");
    }
}

/// The filter alone has the pixels of pictures that are rendered and filtered strip by strip.
#[test]
fn filtering_a_noisy_picture_equals_rendering_without_noise() {
    let scene = still_life();
    let shot = Shot { size: [WIDTH, 150], ..Shot::default() };
    let filtered = shot.with_frame(&scene, |frame, settings| {
        let noisy = NoisyPicture::render(frame, &Phong::default(), settings, &()).unwrap();
        noisy.filter(frame, &()).unwrap().colors
    });
    assert!(bits(&filtered) == bits(&shot.take(&scene)));
}

#[test]
fn crops_equal_the_whole_picture() {
    let scene = still_life();
    let whole = Shot::default().take(&scene);
    for crop in [
        PixelRect { x: 50, y: 60, width: 30, height: 20 },
        PixelRect { x: 0, y: 0, width: 9, height: HEIGHT },
        PixelRect { x: 91, y: 3, width: 5, height: 1 },
    ] {
        let pixels = Shot { crop: Some(crop), ..Shot::default() }.take(&scene);
        let row = |y: u32| &whole[((crop.y + y) * WIDTH + crop.x) as usize..][..crop.width as usize];
        let expected: Vec<Rgba> = (0..crop.height).flat_map(|y| row(y).to_vec()).collect();
        assert!(bits(&pixels) == bits(&expected), "{crop:?}");
    }
}

/// Wide pictures are filtered in bands of columns.
#[test]
fn bands_of_columns_leave_no_seams() {
    let scene = still_life();
    let of = |crop| Shot { samples: 2, size: [1024, 768], crop: Some(crop), ..Shot::default() }.take(&scene);
    let (left, width) = (640, 60);
    let wide = PixelRect { x: 180, y: 420, width: 560, height: 3 };
    let narrow = PixelRect { x: left, width, ..wide };
    let from = (left - wide.x) as usize;
    let rows = of(wide);
    let expected: Vec<Rgba> = rows
        .chunks_exact(wide.width as usize)
        .flat_map(|row| row[from..from + width as usize].to_vec())
        .collect();
    assert!(bits(&of(narrow)) == bits(&expected));
}

/// Root of the mean squared error, with the light of sources bounded.
fn error(pixels: &[Rgba], expected: &[Rgba]) -> f64 {
    let bounded = |p: &Rgba| p.truncate().min(Rgb::splat(2.0));
    let sum: f64 =
        pixels.iter().zip(expected).map(|(a, b)| f64::from((bounded(a) - bounded(b)).length_squared())).sum();
    (sum / pixels.len() as f64).sqrt()
}

#[test]
fn reconstruction_removes_noise_and_keeps_the_picture() {
    let scene = still_life();
    let expected = Shot { samples: 512, denoise: Denoise::Off, ..Shot::default() }.take(&scene);
    for (samples, share) in [(4, 0.5), (16, 0.85)] {
        let shot = Shot { samples, ..Shot::default() };
        let noisy = error(&Shot { denoise: Denoise::Off, ..shot }.take(&scene), &expected);
        let reconstructed = error(&shot.take(&scene), &expected);
        assert!(reconstructed < share * noisy, "{samples} samples: {reconstructed}, {noisy} before");
    }
    // No light is lost.
    let mean = |pixels: &[Rgba]| pixels.iter().map(|p| f64::from(p.y)).sum::<f64>() / pixels.len() as f64;
    let [all, reconstructed] = [mean(&expected), mean(&Shot { samples: 64, ..Shot::default() }.take(&scene))];
    assert!((reconstructed / all - 1.0).abs() < 0.02, "{reconstructed} {all}");
}

/// The floor under the ball of glass, in the shadow of the light, and that beside it.
#[test]
fn solid_glass_casts_shadows_without_caustics() {
    let scene = still_life();
    let brightness = |pixels: &[Rgba], columns: Range<u32>| {
        let at = |x: u32| f64::from(pixels[(52 * WIDTH + x) as usize].y);
        columns.clone().map(at).sum::<f64>() / columns.len() as f64
    };
    let shot = Shot { samples: 64, ..Shot::default() };
    let [without, with] = [false, true].map(|caustics| Shot { caustics, ..shot }.take(&scene));
    let [dark, light] = [&without, &with].map(|pixels| brightness(pixels, 62..68));
    assert!(dark < 0.8 * light, "{dark} {light}");
    let [a, b] = [&without, &with].map(|pixels| brightness(pixels, 4..10));
    assert!((a / b - 1.0).abs() < 0.1, "beside it: {a} {b}");
}

/// Ambient occlusion is reconstructed, and light without noise is not.
#[test]
fn denoising_leaves_pictures_without_noise_alone() {
    let scene = still_life();
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = View::default().resolve(&posed, WIDTH, HEIGHT).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame { bounces: 0, ..Frame::new(&posed, &accel, camera, &lit) };
    let picture = |frame: &Frame, denoise: Denoise| {
        let settings = RenderSettings { width: WIDTH, height: HEIGHT, denoise, ..RenderSettings::default() };
        bits(&render(frame, &Phong::default(), &settings, &()).unwrap().colors)
    };
    assert!(picture(&frame, Denoise::On) == picture(&frame, Denoise::Off));
    let occlusion = AmbientOcclusion { samples: 4, distance: f64::INFINITY };
    let occluded = Frame { ambient_occlusion: Some(occlusion), ..frame };
    assert!(picture(&occluded, Denoise::Auto) == picture(&occluded, Denoise::On));
    assert!(picture(&occluded, Denoise::Auto) != picture(&occluded, Denoise::Off));
}

/// Mean difference of two pictures as displayed, of 255.
fn displayed_difference(a: &[Rgba], b: &[Rgba]) -> f64 {
    let shown = |colors: &[Rgba]| {
        let pixels = Pixels { width: WIDTH, height: HEIGHT, colors: colors.to_vec() };
        Display::default().to_rgba8(&pixels)
    };
    let differences =
        |(a, b): (&[u8; 4], &[u8; 4])| (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>();
    shown(a).iter().zip(&shown(b)).map(differences).sum::<f64>() / (3 * a.len()) as f64
}

/// A square lamp that turns about its axis hardly changes the light of the room: what changes from frame to frame is noise.
#[test]
fn a_turning_lamp_does_not_flicker() {
    let scene = still_life();
    let frames = |denoise: Denoise| -> Vec<Vec<Rgba>> {
        let frame = |i: u32| Shot { samples: 16, denoise, lamp_angle: 9.0 * f64::from(i), ..Shot::default() };
        (0..5).map(|i| frame(i).take(&scene)).collect()
    };
    let most = |frames: &[Vec<Rgba>]| {
        frames.windows(2).map(|pair| displayed_difference(&pair[0], &pair[1])).fold(0.0, f64::max)
    };
    let [noisy, still] = [Denoise::Off, Denoise::Auto].map(|denoise| most(&frames(denoise)));
    assert!(still < 1.0, "{still} of 255 from frame to frame");
    assert!(still < 0.5 * noisy, "{still} of 255 from frame to frame, {noisy} without filter");
}

/// Balls of metal of this roughness on a striped floor, by the light of the sky.
fn metals(roughness: f32) -> Scene {
    let mut scene = Scene::default();
    for i in 0..8 {
        let grey = Rgb::splat(if i % 2 == 0 { 0.8 } else { 0.02 });
        let matte = Material { reflection: Reflection::None, ..plastic(grey, 1.0) };
        add(&mut scene, scenes::grid(1, 1), matte, &at(f64::from(i) - 3.5, 0.0, 0.0, 0.5));
    }
    let mut metal = plastic(Rgb::new(0.9, 0.6, 0.3), roughness);
    if let Reflectance::MetallicRoughness { metallic, .. } = &mut metal.reflectance {
        *metallic = ScalarInput::new(1.0);
    }
    add(&mut scene, scenes::ball(48, 24), metal.clone(), &at(-0.6, 0.5, 0.0, 0.5));
    add(&mut scene, scenes::ball(48, 24), metal, &at(0.6, 0.5, 0.0, 0.5));
    scene
}

/// A picture of metals without indirect light.
fn metal_picture(scene: &Scene, shot: &Shot) -> Vec<Rgba> {
    let posed = scenes::posed(scene);
    let settings = AccelSettings { simd: shot.simd, ..AccelSettings::default() };
    let accel = blinn::accel::Accel::build(&posed, &settings).0;
    let view = View {
        view_point: Some(DVec3::new(0.0, 0.8, 2.5)),
        view_dir: Some(DVec3::new(0.0, -0.15, -1.0)),
        projection: Some(Projection::Perspective),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, WIDTH, HEIGHT).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let frame = Frame {
        environment: Some(Environment::uniform(Rgb::new(0.6, 0.8, 1.0))),
        ambient: Rgb::ONE,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    let Shot { samples, denoise, tile, crop, .. } = *shot;
    let settings = RenderSettings {
        width: WIDTH,
        height: HEIGHT,
        samples,
        denoise,
        tile,
        crop,
        ..RenderSettings::default()
    };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors
}

#[test]
fn smooth_metals_do_not_depend_on_threads_tiles_simd_levels_or_crops() {
    let scene = metals(0.5);
    let whole = metal_picture(&scene, &Shot::default());
    let expected = bits(&whole);
    assert!(bits(&metal_picture(&scene, &Shot { tile: 9, ..Shot::default() })) == expected, "tiles");
    for simd in scenes::simd_levels() {
        assert!(bits(&metal_picture(&scene, &Shot { simd, ..Shot::default() })) == expected, "{simd:?}");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let pixels = pool.install(|| metal_picture(&scene, &Shot::default()));
        assert!(bits(&pixels) == expected, "{threads} threads");
    }
    let crop = PixelRect { x: 40, y: 44, width: 20, height: 10 };
    let pixels = metal_picture(&scene, &Shot { crop: Some(crop), ..Shot::default() });
    let row = |y: u32| &whole[((crop.y + y) * WIDTH + crop.x) as usize..][..crop.width as usize];
    let expected: Vec<Rgba> = (0..crop.height).flat_map(|y| row(y).to_vec()).collect();
    assert!(bits(&pixels) == bits(&expected));
}

#[test]
fn rough_metals_lose_their_grain_and_mirrors_stay() {
    let picture = |roughness: f32, samples: u32, denoise: Denoise| {
        metal_picture(&metals(roughness), &Shot { samples, denoise, ..Shot::default() })
    };
    for (samples, share) in [(4, 0.35), (5, 0.35), (16, 0.7)] {
        let expected = picture(0.6, 1024, Denoise::Off);
        // Edges and the floor are the same in both.
        let edges = error(&picture(0.6, samples, Denoise::Off), &expected);
        let smooth = error(&picture(0.6, samples, Denoise::Auto), &expected);
        assert!(smooth < edges, "{samples} samples: {smooth}, {edges} before");
        let noise = |denoise: Denoise| {
            let pixels = picture(0.6, samples, denoise);
            let inside = |i: &usize| {
                (30..42).contains(&(i % WIDTH as usize)) && (40..56).contains(&(i / WIDTH as usize))
            };
            let chosen: Vec<usize> = (0..pixels.len()).filter(inside).collect();
            let of = |pixels: &[Rgba]| chosen.iter().map(|&i| pixels[i]).collect::<Vec<_>>();
            error(&of(&pixels), &of(&expected))
        };
        let [before, after] = [noise(Denoise::Off), noise(Denoise::Auto)];
        assert!(after < share * before, "{samples} samples inside a ball: {after}, {before} before");
    }
    assert!(bits(&picture(0.0, 4, Denoise::Auto)) == bits(&picture(0.0, 4, Denoise::Off)));
}

/// Counts the pixels that are done, and how often.
#[derive(Default)]
struct Progress {
    pixels: AtomicU64,
    reports: AtomicU64,
}

impl ProgressMonitor for Progress {
    fn pixels_done(&self, count: u64) {
        self.pixels.fetch_add(count, Ordering::Relaxed);
        self.reports.fetch_add(1, Ordering::Relaxed);
    }
}

/// Long renders report their progress while they render, and count each pixel of a crop once.
#[test]
fn progress_is_reported_tile_by_tile() {
    let scene = metals(0.5);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = View::default().resolve(&posed, WIDTH, HEIGHT).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    for indirect in [0, 2] {
        let frame = Frame { indirect, ..Frame::new(&posed, &accel, camera, &lit) };
        for crop in [None, Some(PixelRect { x: 40, y: 44, width: 20, height: 10 })] {
            let settings = RenderSettings {
                width: WIDTH,
                height: HEIGHT,
                denoise: Denoise::Auto,
                tile: 16,
                crop,
                ..RenderSettings::default()
            };
            let progress = Progress::default();
            let pixels = render(&frame, &Phong::default(), &settings, &progress).unwrap().colors;
            assert_eq!(progress.pixels.into_inner(), pixels.len() as u64, "{crop:?}");
            assert!(progress.reports.into_inner() > 10);
        }
    }
}

/// Bounced light on the fibres of a red cloth is white. Divided by the red of its base alone, it would be a bright cyan that the
/// filter spreads over the floor beside it.
#[test]
fn a_sheen_leaves_no_halo() {
    let mut scene = Scene::default();
    add(&mut scene, scenes::grid(1, 1), plastic(Rgb::splat(0.8), 0.9), &at(0.0, 0.0, 0.0, 4.0));
    let (color, roughness) = (ColorInput::new(Rgb::ONE), ScalarInput::new(0.5));
    let sheen = Sheen { color, roughness, ..Sheen::default() };
    let cloth = Material { sheen, ..plastic(Rgb::new(0.5, 0.05, 0.05), 0.8) };
    add(&mut scene, scenes::ball(24, 12), cloth, &at(0.0, 0.5, 0.0, 0.5));
    let picture = Shot { samples: 16, ..Shot::default() }.take(&scene);
    let floor: Vec<&Rgba> =
        picture.iter().filter(|color| color.x > 0.01 && color.y > 0.6 * color.x).collect();
    assert!(floor.len() > 500, "{} pixels", floor.len());
    let halo = floor.iter().filter(|color| color.y > 1.1 * color.x).count();
    assert_eq!(halo, 0, "of {} pixels", floor.len());
}
