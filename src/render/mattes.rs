//! Cryptomatte layers: the coverage of each pixel by objects and materials, over all samples of the pixel filter.

use glam::UVec2;
use rayon::prelude::*;

use crate::integrator::{Frame, MatteKind, Sample, Scratch, trace_mattes};
use crate::progress::ProgressMonitor;
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_scene::Scene;

/// Objects or materials that a pixel keeps: those with the largest coverage (Cryptomatte's ranks).
pub const MATTE_RANKS: usize = 6;

/// The coverage of every pixel by every object or material, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// Objects or materials.
    pub kind: MatteKind,
    /// Names as in the scene, of ids from 1 on. They may be empty, and may not be unique.
    pub names: Vec<String>,
    /// For each pixel the end of its part of `coverages`.
    ends: Vec<usize>,
    /// Ids from 1, with their coverage.
    coverages: Vec<(u32, f32)>,
}

impl Matte {
    /// At most [`MATTE_RANKS`] ids, from 1, with their coverage of pixel `i`, largest first.
    pub fn pixel(&self, i: usize) -> &[(u32, f32)] {
        let start = i.checked_sub(1).map_or(0, |previous| self.ends[previous]);
        &self.coverages[start..self.ends[i]]
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// True without pixels.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

/// Samples that are traced at once.
const BATCH_SAMPLES: usize = 1 << 14;

/// For each kind the ids that a pixel sees, with the sum of their coverage over its samples.
type CoverageSums = [Vec<(u32, f64)>; MatteKind::ALL.len()];

/// The part of a [`Matte`] of some pixels.
#[derive(Default)]
struct Ranks {
    /// For each pixel the end of its part of `coverages`.
    ends: Vec<usize>,
    coverages: Vec<(u32, f32)>,
}

impl Ranks {
    /// Adds a pixel whose coverages are summed over `samples`.
    fn push(&mut self, mut sums: Vec<(u32, f64)>, samples: usize) {
        sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mean = |&(id, sum): &(u32, f64)| (id, (sum / samples as f64) as f32);
        self.coverages.extend(sums.iter().take(MATTE_RANKS).map(mean));
        self.ends.push(self.coverages.len());
    }
}

/// Renders mattes of every kind, with the same samples as the picture.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_mattes(
    frame: &Frame,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<Matte>, Cancelled> {
    let generator = SampleGenerator::new(settings, frame.camera.lens);
    let window = settings.window();
    let columns: Vec<u32> = (window.x..window.x + window.width).collect();
    let samples_per_pixel = generator.samples_per_pixel();
    let batch_pixels = (BATCH_SAMPLES / samples_per_pixel).max(1);
    let rows: Vec<[Ranks; MatteKind::ALL.len()]> = (window.y..window.y + window.height)
        .into_par_iter()
        .map_init(<(Scratch, Vec<Sample>)>::default, |(scratch, samples), y| {
            let mut row = <[Ranks; MatteKind::ALL.len()]>::default();
            for batch in columns.chunks(batch_pixels) {
                if monitor.is_cancelled() {
                    break;
                }
                let pixels: Vec<UVec2> = batch.iter().map(|&x| UVec2::new(x, y)).collect();
                generator.generate(frame.simd(), &pixels, samples);
                for sums in sum_coverage(frame, samples, pixels.len(), scratch) {
                    let kinds = row.iter_mut().zip(sums);
                    kinds.for_each(|(ranks, sums)| ranks.push(sums, samples_per_pixel));
                }
            }
            row
        })
        .collect();
    if monitor.is_cancelled() {
        return Err(Cancelled);
    }
    let matte = |(k, &kind): (usize, &MatteKind)| {
        let mut ends = Vec::with_capacity(rows.len() * columns.len());
        let mut coverages = Vec::with_capacity(rows.iter().map(|row| row[k].coverages.len()).sum());
        for Ranks { ends: row_ends, coverages: row_coverages } in rows.iter().map(|row| &row[k]) {
            ends.extend(row_ends.iter().map(|end| coverages.len() + end));
            coverages.extend_from_slice(row_coverages);
        }
        Matte { kind, names: names(frame.posed.scene, kind), ends, coverages }
    };
    Ok(MatteKind::ALL.par_iter().enumerate().map(matte).collect())
}

/// Sums the coverage of each pixel over its samples.
fn sum_coverage(
    frame: &Frame,
    samples: &[Sample],
    pixels: usize,
    scratch: &mut Scratch,
) -> Vec<CoverageSums> {
    let mut sums: Vec<CoverageSums> = vec![CoverageSums::default(); pixels];
    let samples_per_pixel = samples.len() / pixels;
    trace_mattes(frame, samples, scratch, |sample, surface| {
        for (kind, sums) in MatteKind::ALL.iter().zip(&mut sums[sample / samples_per_pixel]) {
            add(sums, surface.id(*kind), surface.coverage);
        }
    });
    sums
}

/// Adds coverage to the sum of an id. Id 0, which belongs to no object, has no matte.
fn add(sums: &mut Vec<(u32, f64)>, id: u32, coverage: f32) {
    match sums.iter_mut().find(|(other, _)| *other == id) {
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
