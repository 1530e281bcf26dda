//! Reports progress while rendering, and cancels when half of the pixels are done.
//!
//!     cargo run --release --example progress models/still-life/still-life.glb

use std::error::Error;
use std::sync::atomic::{AtomicU64, Ordering};

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::render::{Cancelled, ProgressMonitor, RenderSettings, render};
use blinn::scene::{Lighting, PoseSettings, View, pose};

/// Counts finished pixels of all threads and cancels at half of them.
struct StopAtHalf {
    done: AtomicU64,
    all: u64,
}

impl ProgressMonitor for StopAtHalf {
    fn pixels_done(&self, count: u64) {
        let done = count + self.done.fetch_add(count, Ordering::Relaxed);
        eprint!("\r{:3} %", 100 * done / self.all);
    }

    fn is_cancelled(&self) -> bool {
        self.done.load(Ordering::Relaxed) * 2 >= self.all
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("missing argument: scene")?;
    let (scene, _) = load(file.as_ref(), &LoadOptions::default())?;
    let posed = pose(&scene, &PoseSettings::default())?;
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 480, height: 320, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, settings.width, settings.height)?;
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);

    let monitor = StopAtHalf { done: AtomicU64::new(0), all: 480 * 320 };
    match render(&frame, &Phong::default(), &settings, &monitor) {
        Ok(_) => println!("finished"),
        Err(Cancelled) => println!("cancelled after {} pixels", monitor.done.into_inner()),
    }
    Ok(())
}
