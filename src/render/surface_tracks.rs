//! Points of a scene's surface, and the pictures that see them: the sparse model of structure from motion.

use glam::{DVec2, DVec3, UVec2};
use rayon::prelude::*;

use crate::film::PixelRect;
use crate::integrator::{Frame, Sample, Scratch, SurfaceTarget, first_hits, sees};
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgb;
use blinn_scene::Camera;

/// A point that at least two pictures see.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceTrack {
    /// World position in metres.
    pub position: DVec3,
    /// Base colour, linear RGB.
    pub color: Rgb,
    /// Index of each picture that sees the point, in increasing order, and where: pixels to the right and downward from the
    /// upper left corner of the full picture. Pixel centres are at ½.
    pub observations: Vec<(u32, DVec2)>,
}

/// Points that are traced at once.
const BATCH: usize = 1 << 10;

/// Chooses about `count` points on the surface, at centres of pixels that are evenly distributed over the pictures of all
/// `cameras`, and finds the pictures that see them. The scene stands still.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn trace_surface_tracks(
    frame: &Frame,
    cameras: &[Camera],
    settings: &RenderSettings,
    count: usize,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<SurfaceTrack>, Cancelled> {
    let frames: Vec<Frame> = cameras.iter().map(|&camera| Frame { camera, ..frame.clone() }).collect();
    let per_picture = count.div_ceil(cameras.len().max(1));
    let chosen: Vec<Vec<ChosenPoint>> =
        frames.par_iter().map(|frame| choose_points(frame, settings, per_picture)).collect();
    let points: Vec<ChosenPoint> = chosen.into_iter().flatten().collect();
    let mut observations: Vec<Vec<(u32, DVec2)>> = vec![Vec::new(); points.len()];
    for (index, frame) in (0u32..).zip(&frames) {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let seen: Vec<Vec<Option<DVec2>>> =
            points.par_chunks(BATCH).map(|points| observe(frame, settings, points)).collect();
        for (track, pixel) in observations.iter_mut().zip(seen.into_iter().flatten()) {
            track.extend(pixel.map(|pixel| (index, pixel)));
        }
    }
    let track = |(point, observations): (ChosenPoint, Vec<(u32, DVec2)>)| SurfaceTrack {
        position: point.target.p + frame.posed.centre,
        color: point.color,
        observations,
    };
    let tracks = points.into_iter().zip(observations).filter(|(_, observations)| observations.len() > 1);
    Ok(tracks.map(track).collect())
}

/// A point on the surface.
#[derive(Clone, Copy)]
struct ChosenPoint {
    target: SurfaceTarget,
    color: Rgb,
}

/// Surface points at the centres of about `count` pixels of a picture.
fn choose_points(frame: &Frame, settings: &RenderSettings, count: usize) -> Vec<ChosenPoint> {
    let PixelRect { x, y, width, height } = settings.window();
    let pixels = u64::from(width) * u64::from(height);
    let step = ((pixels as f64 / count.max(1) as f64).sqrt() as usize).max(1);
    let start = |from: u32| from + step as u32 / 2;
    let rows = (start(y)..y + height).step_by(step);
    let columns = || (start(x)..x + width).step_by(step);
    let samples: Vec<Sample> =
        rows.flat_map(|y| columns().map(move |x| settings.centre_sample(UVec2::new(x, y)))).collect();
    let hits = first_hits(frame, &samples, &mut Scratch::default());
    let point = |(target, color): (SurfaceTarget, Rgb)| ChosenPoint { target, color };
    hits.iter().filter_map(|hit| hit.target(frame).map(point)).collect()
}

/// Where a picture shows each point, if it does.
fn observe(frame: &Frame, settings: &RenderSettings, points: &[ChosenPoint]) -> Vec<Option<DVec2>> {
    let PixelRect { x, y, width, height } = settings.window();
    let corner = DVec2::new(x.into(), y.into());
    let (low, high) = (corner, corner + DVec2::new(width.into(), height.into()));
    let size = DVec2::new(settings.width.into(), settings.height.into());
    let mut pixels = vec![None; points.len()];
    let mut indices = Vec::new();
    let mut targets = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let Some(film) = frame.camera.project(point.target.p + frame.posed.centre) else { continue };
        let pixel = DVec2::new(film.x, 1.0 - film.y) * size;
        if pixel.cmpge(low).all() && pixel.cmplt(high).all() {
            indices.push((i, pixel));
            targets.push(SurfaceTarget { film, ..point.target });
        }
    }
    let seen = sees(frame, &targets, &mut Scratch::default());
    for ((i, pixel), _) in indices.into_iter().zip(seen).filter(|(_, is_seen)| *is_seen) {
        pixels[i] = Some(pixel);
    }
    pixels
}
