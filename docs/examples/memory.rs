//! Renders to memory: a scene to rows of RGBA bytes, without writing a file.
//!
//!     cargo run --release --example memory models/textured/textured.glb

use std::error::Error;

use blinn::accel::{Accel, AccelSettings};
use blinn::display::{Display, ViewTransform};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{Lighting, PoseSettings, View, pose};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("missing argument: scene")?;
    let (scene, warnings) = load(file.as_ref(), &LoadOptions::default())?;
    warnings.iter().for_each(|warning| eprintln!("{warning}"));

    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 320, height: 240, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, settings.width, settings.height)?;
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let pixels = render(&frame, &Phong::default(), &settings, &())?;

    // Converts linear light to bytes with straight alpha, row 0 on top.
    let view = ViewTransform::default_for(&scene.source);
    let display = Display { view, ..Display::default() };
    let bytes: Vec<[u8; 4]> = display.to_rgba8(&pixels);
    let covered = bytes.iter().filter(|pixel| pixel[3] > 0).count();
    println!("{}x{} pixels, {covered} of them covered", pixels.width, pixels.height);
    Ok(())
}
