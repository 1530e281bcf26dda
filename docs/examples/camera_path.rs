//! Moves a camera along a spiral and writes one PNG per position. The scene is loaded and its BVH built once.
//!
//!     cargo run --release --example camera_path models/lecture/lecture.glb FOLDER

use std::error::Error;
use std::path::PathBuf;

use blinn::accel::{Accel, AccelSettings};
use blinn::display::{Background, Display};
use blinn::glam::{DVec3, Vec3};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::output::{BitDepth, ImageFormat, Overwrite, Picture, save};
use blinn::render::{RenderSettings, render};
use blinn::scene::{Lighting, PoseSettings, View, pose};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let file = args.next().ok_or("missing argument: scene")?;
    let folder = PathBuf::from(args.next().ok_or("missing argument: output folder")?);
    let (scene, _) = load(file.as_ref(), &LoadOptions::default())?;
    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 320, height: 180, ..Default::default() };
    let background = Background::Color(Vec3::splat(0.05));
    let display = Display { background, ..Display::default() };

    let sphere = posed.bounding_sphere();
    for i in 0..8 {
        // A rising spiral around the scene's centre.
        let angle = f64::from(i) * 0.25;
        let height = f64::from(i) * 0.15;
        let offset = DVec3::new(2.5 * angle.cos(), height, 2.5 * angle.sin()) * sphere.radius;
        let view = View {
            view_point: Some(sphere.centre + offset),
            look_at: Some(sphere.centre),
            ..View::default()
        };
        let (camera, _) = view.resolve(&posed, settings.width, settings.height)?;
        let lit = Lighting::default().resolve(&posed, &camera);
        let pixels = render(&Frame::new(&posed, &accel, camera, &lit), &Phong::default(), &settings, &())?;
        let out = folder.join(format!("path_{:04}.png", i + 1));
        save(&Picture::new(pixels, display), &out, ImageFormat::Png, BitDepth::Default, Overwrite::Yes)?;
        println!("wrote {}", out.display());
    }
    Ok(())
}
