//! Successive mip levels that are computed together, band by band, so that most means never leave the cache.

use std::slice::ChunksMut;
use std::sync::{Mutex, PoisonError};

use crate::texture::downsample::{Halve, Size};
use crate::texture::level_encoding::{LevelEncoding, StoredValue};

/// Most levels of a group.
const MAX_LEVELS: usize = 4;
/// Texels of the finest level of a band, unless a band of one row of the coarsest level has more.
const BAND_TEXELS: usize = 1 << 12;

/// A level of any size, and smaller ones as long as sizes are even.
pub(super) struct LevelGroup {
    /// From the finest to the coarsest.
    pub sizes: Vec<Size>,
    encoding: LevelEncoding,
}

/// Computes the means of rows of the finest level of a group, from one on.
type ComputeRows<'a> = dyn Fn(usize, &mut [f32]) + Sync + 'a;

/// The parts of all levels of a group that have not been computed.
struct Bands<'a, T> {
    next: usize,
    texels: Vec<ChunksMut<'a, T>>,
    means: ChunksMut<'a, f32>,
}

/// Rows of all levels of a group that cover the same part of the image.
struct Band<'a, T> {
    index: usize,
    /// Texels of each level.
    texels: Vec<&'a mut [T]>,
    /// Means of the coarsest level.
    means: &'a mut [f32],
}

impl<'a, T> Bands<'a, T> {
    fn take(&mut self) -> Option<Band<'a, T>> {
        let texels: Option<Vec<_>> = self.texels.iter_mut().map(Iterator::next).collect();
        let band = Band { index: self.next, texels: texels?, means: self.means.next()? };
        self.next += 1;
        Some(band)
    }
}

impl LevelGroup {
    /// Returns the levels that follow one of size `fine`.
    pub fn new(fine: Size, encoding: LevelEncoding) -> LevelGroup {
        let next = |size: &Size| size.is_even().then(|| size.half());
        let sizes = std::iter::successors(Some(fine.half()), next).take(MAX_LEVELS).collect();
        LevelGroup { sizes, encoding }
    }

    /// Computes the means of the coarsest level and the texels of all levels.
    ///
    /// Large levels are divided among threads of their own. Tasks in rayon's pool could deadlock: a task that
    /// waits for the pool, while another thread waits for this pyramid, may wait for itself.
    pub fn compute<T: StoredValue>(&self, compute_rows: &ComputeRows) -> (Vec<f32>, Vec<Vec<T>>) {
        let LevelEncoding { mean_channels, channels, .. } = self.encoding;
        let channels = channels as usize;
        let (finest, coarsest) = (self.sizes[0], self.sizes[self.sizes.len() - 1]);
        let mut means = vec![0.0; coarsest.texels() * mean_channels];
        let texels = self.sizes.iter().map(|size| vec![T::default(); size.texels() * channels]);
        let mut texels: Vec<Vec<T>> = texels.collect();
        let steps = self.sizes.len() - 1;
        let coarse_rows = (BAND_TEXELS / (finest.width << steps)).clamp(1, coarsest.height);
        let band_texels = |level: usize| (coarse_rows << (steps - level)) * self.sizes[level].width;
        let chunks = texels.iter_mut().enumerate();
        let bands = Mutex::new(Bands {
            next: 0,
            texels: chunks.map(|(level, texels)| texels.chunks_mut(band_texels(level) * channels)).collect(),
            means: means.chunks_mut(band_texels(steps) * mean_channels),
        });
        let next = || bands.lock().unwrap_or_else(PoisonError::into_inner).take();
        let work = || {
            // The coarsest level is not in scratch.
            let size = |level: usize| if level < steps { band_texels(level) * mean_channels } else { 0 };
            let mut scratch = [0, 1].map(|level| vec![0.0; size(level)]);
            while let Some(band) = next() {
                let first_row = band.index * (coarse_rows << steps);
                self.compute_band(band, &|rows| compute_rows(first_row, rows), &mut scratch);
            }
        };
        let threads = (finest.texels() >> 16).clamp(1, rayon::current_num_threads().clamp(1, 16));
        std::thread::scope(|scope| {
            // If the system refuses a thread, the running ones do its share.
            let spawned = |_: &usize| std::thread::Builder::new().spawn_scoped(scope, work).is_ok();
            let _ = (1..threads).take_while(spawned).count();
            work();
        });
        (means, texels)
    }

    /// Computes a band. `scratch` holds the means of two levels.
    fn compute_band<T: StoredValue>(
        &self,
        band: Band<T>,
        compute_finest: &dyn Fn(&mut [f32]),
        scratch: &mut [Vec<f32>; 2],
    ) {
        let LevelEncoding { mean_channels, channels, simd, .. } = self.encoding;
        let last = self.sizes.len() - 1;
        let [coarser, finer] = scratch;
        let (mut coarser, mut finer) = (&mut coarser[..], &mut finer[..]);
        for (level, texels) in band.texels.into_iter().enumerate() {
            let row = self.sizes[level].width * mean_channels;
            let means = if level == last {
                &mut *band.means
            } else {
                &mut coarser[..texels.len() / channels as usize * mean_channels]
            };
            if level == 0 {
                compute_finest(means);
            } else {
                let fine_row = self.sizes[level - 1].width * mean_channels;
                for (rows, means) in finer.chunks(2 * fine_row).zip(means.chunks_mut(row)) {
                    let (above, below) = rows.split_at(fine_row);
                    simd.run(Halve { above, below, channels: mean_channels, means });
                }
            }
            self.encoding.encode(means, texels);
            std::mem::swap(&mut finer, &mut coarser);
        }
    }
}
