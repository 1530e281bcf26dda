//! A camera of our own that flies along a curve, one PNG for each place. Loading and building are done
//! once: only the view changes.
//!
//!     cargo run --release --example camera_path models/lecture/lecture.glb FOLDER

use std::error::Error;
use std::path::PathBuf;

use blinn::accel::{Accel, BuildSettings};
use blinn::display::{Background, Display, ViewTransform};
use blinn::glam::{DVec3, Vec3};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::output::{Depth, Format, Picture, Replace, save};
use blinn::render::{RenderSettings, render};
use blinn::scene::{Lighting, PoseSettings, View, pose};

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let file = words.next().ok_or("say which scene")?;
    let folder = PathBuf::from(words.next().ok_or("say which folder to write to")?);
    let (scene, _) = load(file.as_ref(), &LoadOptions::default())?;
    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &BuildSettings::default());
    let settings = RenderSettings { width: 320, height: 180, ..Default::default() };
    let background = Background::Color(Vec3::splat(0.05));
    let display = Display { ev: 0.0, view: ViewTransform::Standard, background };

    let sphere = posed.bounding_sphere();
    for i in 0..8 {
        // A spiral that rises around the scene's middle.
        let (turn, rise) = (f64::from(i) * 0.25, f64::from(i) * 0.15);
        let place = DVec3::new(2.5 * turn.cos(), rise, 2.5 * turn.sin()) * sphere.radius;
        let view =
            View { view_point: Some(sphere.centre + place), look_at: Some(sphere.centre), ..View::default() };
        let (camera, _) = view.resolve(&posed, settings.width, settings.height)?;
        let lit = Lighting::default().resolve(&posed, &camera);
        let pixels = render(&Frame::new(&posed, &accel, camera, &lit), &Phong::default(), &settings, &())?;
        let out = folder.join(format!("path_{:04}.png", i + 1));
        save(&Picture::new(pixels, display), &out, Format::Png, Depth::Usual, Replace::Yes)?;
        println!("wrote {}", out.display());
    }
    Ok(())
}
