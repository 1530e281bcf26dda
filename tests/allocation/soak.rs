//! Frame after frame in one process: memory does not grow.

use blinn::accel::{Accel, AccelSettings};
use blinn::display::{Background, Display};
use blinn::geometry::Rgb;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::output::{BitDepth, ImageFormat, Picture};
use blinn::render::{RenderSettings, render};
use blinn::scene::{AnimationChoice, Lighting, PoseSettings, View, pose};

use crate::{MEMORY, alone};

use crate::common::model_path;

const SCENES: [&str; 8] = [
    "figure/figure.glb",
    "alpha/alpha.glb",
    "textured/textured.obj",
    "tests/gltf/torus_draco_eb.glb",
    "tests/gltf/torus_meshopt_filters.glb",
    "tests/gltf/basisu.glb",
    "cornell/cornell.obj",
    "tests/gltf/more/blender_skin_draco.glb",
];

/// From scene file to encoded picture. Returns its size.
fn frame(number: usize) -> usize {
    let path = model_path(SCENES[number % SCENES.len()]);
    let (scene, _) = load(&path, &LoadOptions::default()).unwrap();
    let time = number as f64 / 24.0;
    let at = PoseSettings { time, animation: AnimationChoice::Default, centre: None };
    let posed = pose(&scene, &at).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 48, height: 27, samples: 2, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, settings.width, settings.height).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let pixels =
        render(&Frame::new(&posed, &accel, camera, &lit), &Phong::default(), &settings, &()).unwrap();
    let display = Display { background: Background::Color(Rgb::ZERO), ..Display::default() };
    let format = [ImageFormat::Png, ImageFormat::Exr, ImageFormat::Jpeg(90), ImageFormat::Webp][number % 4];
    let picture = Picture::new(pixels, display);
    format.encode(&picture, BitDepth::Default).unwrap().len()
}

/// The resident memory of this process in bytes.
fn resident() -> Option<usize> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    pages.split_whitespace().nth(1)?.parse::<usize>().ok().map(|pages| pages * 4096)
}

fn run(frames: usize, settled: usize) {
    let _turn = alone();
    let (mut heap, mut all) = (0, 0);
    for number in 0..frames {
        frame(number);
        if number + 1 == settled {
            (heap, all) = (MEMORY.current_usage(), resident().unwrap_or(0));
        }
    }
    let (heap_now, all_now) = (MEMORY.current_usage(), resident().unwrap_or(0));
    println!("{frames} frames: heap {heap} then {heap_now}, resident {all} then {all_now}");
    // Threads keep their scratch buffers; nothing else stays allocated.
    assert!(heap_now < heap + (1 << 20), "{heap} bytes after {settled} frames, {heap_now} after {frames}");
    assert!(
        all_now < all + (48 << 20),
        "{all} bytes resident after {settled} frames, {all_now} after {frames}"
    );
}

#[test]
fn frames_give_back_what_they_take() {
    run(96, 32);
}

#[test]
#[ignore = "takes many minutes: just soak"]
fn ten_thousand_frames_give_back_what_they_take() {
    run(10_000, 500);
}
