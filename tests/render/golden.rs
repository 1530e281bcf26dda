//! Reference images: each term of the lecture on one small scene, and one picture of each model.
//!
//! No channel may differ by more than 2 of 255. `GOLDEN=update` rewrites the images; a failure writes a strip
//! of expected, actual and difference to target/golden.

use std::fs;
use std::path::Path;

use blinn::accel::{Accel, AccelSettings, RoundSize, RoundSizes};
use blinn::display::{Background, Display};
use blinn::geometry::Rgb;
use blinn::import::{LoadOptions, load, load_camera_xml};
use blinn::integrator::{AmbientOcclusion, Frame, MaterialOverrides, Phong, Stage};
use blinn::render::{
    Denoise, EdgeCache, EdgeKinds, EdgeStyle, EdgeWidth, HiddenEdges, RenderMemory, RenderSettings,
    draw_edges, render, render_edges,
};
use blinn::scene::{Ground, GroundKind, LightSet, Lighting, PoseSettings, UserLight, View, pose};
use glam::DVec3;

use crate::common::model_path;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 54;
const TOLERANCE: u8 = 2;

/// A picture of a model.
#[derive(Clone)]
struct Shot {
    model: &'static str,
    view: View,
    lighting: Lighting,
    stage: Stage,
    overrides: MaterialOverrides,
    time: f64,
    ev: f64,
    occlusion: Option<AmbientOcclusion>,
    ground: Option<GroundKind>,
    background: f32,
    edges: Option<EdgeStyle>,
}

impl Shot {
    fn of(model: &'static str) -> Shot {
        Shot {
            model,
            view: View::default(),
            lighting: Lighting::default(),
            stage: Stage::Phong,
            overrides: MaterialOverrides::default(),
            time: 0.0,
            ev: 0.0,
            occlusion: None,
            ground: None,
            background: 0.05,
            edges: None,
        }
    }

    /// The lecture's scene and first view, lit by one point light.
    fn lecture(stage: Stage) -> Shot {
        let view = load_camera_xml(&model_path("lecture/view-1.xml")).unwrap();
        let light = UserLight::Point { position: DVec3::new(4.0, 6.0, 1.0), intensity: Rgb::splat(40.0) };
        let lighting = Lighting { sets: Some(Vec::new()), user_lights: vec![light], ..Default::default() };
        Shot { view, lighting, stage, ..Shot::of("lecture/lecture.obj") }
    }

    fn render(&self) -> Vec<[u8; 4]> {
        let (scene, warnings) = load(&model_path(self.model), &LoadOptions::default()).unwrap();
        assert!(warnings.is_empty(), "{}: {warnings:?}", self.model);
        let posed = pose(&scene, &PoseSettings { time: self.time, ..Default::default() }).unwrap();
        let (accel, _) = Accel::build(&posed, &AccelSettings::default());
        let (camera, _) = self.view.resolve(&posed, WIDTH, HEIGHT).unwrap();
        let lit = self.lighting.resolve(&posed, &camera);
        // Points as large as the spacing of their cloud, lines of a pixel.
        let half_pixel = (0.5 * camera.view_height / f64::from(HEIGHT)) as f32;
        let rounds = RoundSizes {
            points: accel.point_spacing().map_or(RoundSize::NONE, RoundSize::in_scene),
            lines: RoundSize { in_scene: 0.0, min: half_pixel, max: half_pixel },
        };
        let frame = Frame {
            rounds,
            overrides: self.overrides,
            ambient_occlusion: self.occlusion,
            ground: self.ground.map(|kind| Ground::under(&posed.bounds(), kind)),
            ..Frame::new(&posed, &accel, camera, &lit)
        };
        let denoise = if frame.emitters.is_some() { Denoise::Auto } else { Denoise::Off };
        let settings =
            RenderSettings { width: WIDTH, height: HEIGHT, samples: 4, denoise, ..Default::default() };
        let mut pixels = render(&frame, &Phong { stage: self.stage }, &settings, &()).unwrap();
        if let Some(style) = &self.edges {
            let memory = RenderMemory::default();
            let edges = render_edges(&memory, &frame, style, &EdgeCache::default(), &settings, &()).unwrap();
            draw_edges(&mut pixels, &edges);
        }
        let background = Background::Color(Rgb::splat(self.background));
        Display { ev: self.ev, background, ..Display::default() }.to_rgba8(&pixels)
    }
}

fn shots() -> Vec<(&'static str, Shot)> {
    let phong = || Shot::lecture(Stage::Phong);
    let none = Rgb::ZERO;
    let only_specular =
        MaterialOverrides { k_d: Some(none), k_s: Some(Rgb::ONE), shininess: Some(30.0), k_e: None };
    let ambient = Lighting { sets: Some(Vec::new()), ambient: Some(Rgb::splat(0.6)), ..Default::default() };
    let mut two_lights = phong().lighting;
    two_lights
        .user_lights
        .push(UserLight::Sun { direction: DVec3::new(1.0, -1.5, -2.0), intensity: Rgb::new(0.2, 0.3, 0.5) });
    let with_ambient = Lighting { ambient: Some(Rgb::splat(0.1)), ..two_lights.clone() };
    let soft = Lighting { radius: Some(0.8), ..phong().lighting };
    let sky = Lighting { boost_ambient: true, ..Default::default() };
    let occlusion = Some(AmbientOcclusion { samples: 16, distance: 1.0 });
    let cube = Shot {
        occlusion,
        lighting: Lighting { radius: Some(0.1), ..sky.clone() },
        ..Shot::of("tests/cube.obj")
    };
    let plane = Some(GroundKind::Plane);
    let shadow = Some(GroundKind::ShadowCatcher);
    let view_2 = load_camera_xml(&model_path("lecture/view-2.xml")).unwrap();
    let headlight = Lighting { sets: Some(vec![LightSet::Headlight]), ..Default::default() };
    let edges = EdgeStyle {
        kinds: EdgeKinds { feature: true, silhouette: true, ..Default::default() },
        angle: 30.0,
        color: None,
        width: EdgeWidth::Pixels(0.7),
        hidden: HiddenEdges::Off,
    };
    let camera = |name: &str| View { camera: Some(name.into()), ..Default::default() };
    vec![
        ("term_color", Shot::lecture(Stage::Color)),
        ("term_diffuse", Shot::lecture(Stage::Diffuse)),
        ("term_shadow", Shot::lecture(Stage::Shadow)),
        ("term_specular", Shot { overrides: only_specular, ..phong() }),
        ("term_ambient", Shot { lighting: ambient, ..phong() }),
        ("term_two_lights", Shot { lighting: two_lights, ..phong() }),
        ("term_sum", Shot { lighting: with_ambient.clone(), ..phong() }),
        ("view_2", Shot { lighting: with_ambient, view: view_2, ..phong() }),
        ("headlight", Shot { lighting: headlight, ..phong() }),
        ("cornell", Shot::of("cornell/cornell.glb")),
        ("cornell_obj", Shot::of("cornell/cornell.obj")),
        ("still_life", Shot::of("still-life/still-life.glb")),
        ("assembly", Shot::of("assembly/assembly.glb")),
        ("assembly_edges", Shot { edges: Some(edges), ..Shot::of("assembly/assembly.glb") }),
        ("reconstruction", Shot::of("reconstruction/reconstruction.glb")),
        ("textured", Shot::of("textured/textured.glb")),
        ("textured_obj", Shot::of("textured/textured.obj")),
        ("figure_0", Shot::of("figure/figure.glb")),
        ("figure_half", Shot { time: 0.5, ..Shot::of("figure/figure.glb") }),
        ("soft_shadow", Shot { lighting: soft, ..phong() }),
        ("occlusion", Shot { lighting: sky, occlusion, ..Shot::of("cornell/cornell.glb") }),
        ("ground_plane", Shot { ground: plane, ..cube.clone() }),
        ("ground_shadow", Shot { ground: shadow, background: 1.0, ..cube }),
        ("alpha", Shot::of("alpha/alpha.glb")),
        ("alpha_second_camera", Shot { view: camera("1"), ..Shot::of("alpha/alpha.glb") }),
    ]
}

#[test]
fn pictures_equal_the_reference_images() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/render/golden");
    let update = std::env::var("GOLDEN").is_ok_and(|v| v == "update");
    let mut failures = Vec::new();
    for (name, shot) in shots() {
        let actual = shot.render();
        let file = golden.join(format!("{name}.png"));
        if update {
            fs::create_dir_all(&golden).unwrap();
            save(&file, WIDTH, &actual);
            assert!(fs::metadata(&file).unwrap().len() <= 20 * 1024, "{name} is over 20 KiB");
            continue;
        }
        let expected = image::open(&file)
            .unwrap_or_else(|e| panic!("{name}: {e}; GOLDEN=update writes it"))
            .into_rgba8();
        assert_eq!((expected.width(), expected.height()), (WIDTH, HEIGHT));
        let expected: Vec<[u8; 4]> = expected.pixels().map(|p| p.0).collect();
        let differs = |(a, b): (&[u8; 4], &[u8; 4])| (0..4).any(|c| a[c].abs_diff(b[c]) > TOLERANCE);
        let count = expected.iter().zip(&actual).filter(|&p| differs(p)).count();
        if count > 0 {
            save_comparison(name, &expected, &actual);
            failures.push(format!("{name}: {count} pixels"));
        }
    }
    assert!(failures.is_empty(), "see target/golden: {failures:?}");
}

fn save(file: &Path, width: u32, pixels: &[[u8; 4]]) {
    let height = pixels.len() as u32 / width;
    let rgb: Vec<u8> = pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    image::RgbImage::from_raw(width, height, rgb).unwrap().save(file).unwrap();
}

/// Writes expected, actual and eight times their difference side by side.
fn save_comparison(name: &str, expected: &[[u8; 4]], actual: &[[u8; 4]]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/golden");
    fs::create_dir_all(&folder).unwrap();
    let row = WIDTH as usize;
    let mut strip = Vec::new();
    for (a, b) in expected.chunks(row).zip(actual.chunks(row)) {
        strip.extend_from_slice(a);
        strip.extend_from_slice(b);
        let difference =
            |(a, b): (&[u8; 4], &[u8; 4])| [0, 1, 2, 3].map(|c| a[c].abs_diff(b[c]).saturating_mul(8));
        strip.extend(a.iter().zip(b).map(difference));
    }
    save(&folder.join(format!("{name}.png")), 3 * WIDTH, &strip);
}
