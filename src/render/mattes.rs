//! Cryptomatte layers: the coverage of each pixel by objects and materials, over all samples of the pixel filter.

use std::ops::Range;

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
    /// The pixels, [`BLOCK_PIXELS`] in each but the last. They are not joined: that would take their memory twice.
    blocks: Vec<MatteBlock>,
}

/// The coverage of some pixels in a row of all.
#[derive(Clone, Debug, Default, PartialEq)]
struct MatteBlock {
    /// For each pixel the end of its part of `coverages`.
    ends: Vec<u32>,
    /// Ids from 1, with their coverage.
    coverages: Vec<(u32, f32)>,
}

/// Pixels of a block: a power of two, for looking them up.
const BLOCK_PIXELS: usize = 1 << 12;

impl Matte {
    /// At most [`MATTE_RANKS`] ids, from 1, with their coverage of pixel `i`, largest first.
    pub fn pixel(&self, i: usize) -> &[(u32, f32)] {
        let MatteBlock { ends, coverages } = &self.blocks[i / BLOCK_PIXELS];
        let nth = i % BLOCK_PIXELS;
        let start = nth.checked_sub(1).map_or(0, |previous| ends[previous]);
        &coverages[start as usize..ends[nth] as usize]
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.ends.len()).sum()
    }

    /// True without pixels.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }
}

/// Samples that are traced at once.
const BATCH_SAMPLES: usize = 1 << 14;

/// For each kind the ids that a pixel sees, with the sum of their coverage over its samples.
type CoverageSums = [Vec<(u32, f64)>; MatteKind::ALL.len()];

impl MatteBlock {
    /// Adds a pixel whose coverages are summed over `samples`.
    fn push(&mut self, mut sums: Vec<(u32, f64)>, samples: usize) {
        sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mean = |&(id, sum): &(u32, f64)| (id, (sum / samples as f64) as f32);
        self.coverages.extend(sums.iter().take(MATTE_RANKS).map(mean));
        self.ends.push(self.coverages.len() as u32);
    }

    fn shrink_to_fit(&mut self) {
        self.ends.shrink_to_fit();
        self.coverages.shrink_to_fit();
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
    let width = window.width as usize;
    let pixels: Vec<Range<usize>> = block_ranges(width * window.height as usize);
    let samples_per_pixel = generator.samples_per_pixel();
    let batch_pixels = (BATCH_SAMPLES / samples_per_pixel).max(1);
    let blocks: Vec<[MatteBlock; MatteKind::ALL.len()]> = pixels
        .into_par_iter()
        .with_max_len(1)
        .map_init(<(Scratch, Vec<Sample>)>::default, |(scratch, samples), block_pixels| {
            let mut blocks = <[MatteBlock; MatteKind::ALL.len()]>::default();
            let position =
                |i: usize| UVec2::new(window.x + (i % width) as u32, window.y + (i / width) as u32);
            let positions: Vec<UVec2> = block_pixels.map(position).collect();
            for batch in positions.chunks(batch_pixels) {
                if monitor.is_cancelled() {
                    break;
                }
                generator.generate(frame.simd(), batch, samples);
                for sums in sum_coverage(frame, samples, batch.len(), scratch) {
                    let kinds = blocks.iter_mut().zip(sums);
                    kinds.for_each(|(block, sums)| block.push(sums, samples_per_pixel));
                }
            }
            blocks.iter_mut().for_each(MatteBlock::shrink_to_fit);
            blocks
        })
        .collect();
    if monitor.is_cancelled() {
        return Err(Cancelled);
    }
    let mut mattes = MatteKind::ALL.map(|kind| {
        let blocks = Vec::with_capacity(blocks.len());
        Matte { kind, names: names(frame.posed.scene, kind), blocks }
    });
    for of_kinds in blocks {
        mattes.iter_mut().zip(of_kinds).for_each(|(matte, block)| matte.blocks.push(block));
    }
    Ok(mattes.into())
}

/// Divides `pixels` pixels among blocks.
fn block_ranges(pixels: usize) -> Vec<Range<usize>> {
    (0..pixels).step_by(BLOCK_PIXELS).map(|start| start..pixels.min(start + BLOCK_PIXELS)).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_found_in_their_blocks() {
        let count = 2 * BLOCK_PIXELS + 3;
        let ids = |i: usize| (1..=(i % 3) as u32).map(|id| (id, 1.0 / f64::from(id)));
        let block = |pixels: Range<usize>| {
            let mut block = MatteBlock::default();
            pixels.for_each(|i| block.push(ids(i).collect(), 1));
            block
        };
        let blocks = block_ranges(count).into_iter().map(block).collect();
        let matte = Matte { kind: MatteKind::Object, names: Vec::new(), blocks };
        assert_eq!(matte.len(), count);
        for i in 0..count {
            let expected: Vec<(u32, f32)> = ids(i).map(|(id, coverage)| (id, coverage as f32)).collect();
            assert_eq!(matte.pixel(i), expected, "pixel {i}");
        }
    }
}
