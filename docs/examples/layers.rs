//! Renders AOVs to arrays: depth, shading normal and object id.
//!
//!     cargo run --release --example layers models/cornell/cornell.glb

use std::error::Error;

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{Lighting, PoseSettings, View, pose};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("missing argument: scene")?;
    let (scene, _) = load(file.as_ref(), &LoadOptions::default())?;
    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 160, height: 160, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, settings.width, settings.height)?;
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);

    let wanted = [Aov::Depth, Aov::Normal, Aov::ObjectId];
    for layer in render_aovs(&frame, &wanted, &settings, &())? {
        // Row-major, row 0 on top, `width` numbers per pixel: an array of H × W × C.
        let channels = layer.aov.channel_count();
        let centre = (80 * 160 + 80) * channels;
        println!("{} at the centre: {:?}", layer.aov.name(), &layer.values[centre..centre + channels]);
    }
    Ok(())
}
