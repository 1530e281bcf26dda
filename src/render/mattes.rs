//! How much of each pixel each thing covers, over all samples of the pixel's filter.

use glam::UVec2;
use rayon::prelude::*;

use super::{Cancelled, ProgressMonitor, RenderSettings, Sampling};
use crate::integrator::{Frame, MatteKind, Sample, Scratch, trace_mattes};
use crate::scene::Scene;

/// Things that a pixel keeps: those that cover most of it.
pub const MATTE_RANKS: usize = 6;

/// The coverage of every pixel by every thing of one kind, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// What is told apart.
    pub kind: MatteKind,
    /// Names as in the scene, of ids from 1 on: some may be empty, some alike.
    pub names: Vec<String>,
    /// Where each pixel's covers end.
    ends: Vec<usize>,
    /// Ids from 1, with their coverage.
    covers: Vec<(u32, f32)>,
}

impl Matte {
    /// At most [`MATTE_RANKS`] ids from 1 with what each covers of a pixel, largest first.
    pub fn pixel(&self, i: usize) -> &[(u32, f32)] {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.covers[start..self.ends[i]]
    }

    /// Pixels.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// True without any pixel.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

/// Samples that are looked at together.
const BATCH: usize = 1 << 14;

/// Renders the mattes of every kind, by the very samples of the picture.
///
/// # Errors
/// [`Cancelled`] when `watch` says so.
pub fn render_mattes(
    frame: &Frame,
    settings: &RenderSettings,
    watch: &dyn ProgressMonitor,
) -> Result<Vec<Matte>, Cancelled> {
    let sampling = Sampling::of(settings);
    let n = sampling.count();
    let window = settings.window();
    let columns: Vec<u32> = (window.x..window.x + window.width).collect();
    type Sums = [Vec<(u32, f64)>; MatteKind::ALL.len()];
    let rows: Vec<Vec<Sums>> = (window.y..window.y + window.height)
        .into_par_iter()
        .map_init(<(Scratch, Vec<Sample>)>::default, |(scratch, samples), y| {
            let mut row = Vec::new();
            for part in columns.chunks((BATCH / n).max(1)) {
                if watch.is_cancelled() {
                    break;
                }
                let pixels: Vec<UVec2> = part.iter().map(|&x| UVec2::new(x, y)).collect();
                sampling.samples(frame.accel, &pixels, samples);
                let mut sums = vec![Sums::default(); part.len()];
                trace_mattes(frame, samples, scratch, |sample, cover| {
                    for (kind, sums) in MatteKind::ALL.iter().zip(&mut sums[sample / n]) {
                        add(sums, cover.id(*kind), cover.coverage);
                    }
                });
                row.extend(sums);
            }
            row
        })
        .collect();
    if watch.is_cancelled() {
        return Err(Cancelled);
    }
    let matte = |(k, &kind): (usize, &MatteKind)| {
        let (mut ends, mut covers) = (Vec::new(), Vec::new());
        for pixel in rows.iter().flatten() {
            let mut ranked = pixel[k].clone();
            ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            let mean = |&(id, sum): &(u32, f64)| (id, (sum / n as f64) as f32);
            covers.extend(ranked.iter().take(MATTE_RANKS).map(mean));
            ends.push(covers.len());
        }
        Matte { kind, names: names(frame.posed.scene, kind), ends, covers }
    };
    Ok(MatteKind::ALL.iter().enumerate().map(matte).collect())
}

/// What is no object has no matte.
fn add(sums: &mut Vec<(u32, f64)>, id: u32, coverage: f32) {
    match sums.iter_mut().find(|(known, _)| *known == id) {
        _ if id == 0 => {}
        Some((_, sum)) => *sum += f64::from(coverage),
        None => sums.push((id, f64::from(coverage))),
    }
}

fn names(scene: &Scene, kind: MatteKind) -> Vec<String> {
    match kind {
        MatteKind::Object => scene.objects.clone(),
        MatteKind::Material => scene.materials.iter().map(|m| m.name.clone()).collect(),
    }
}
