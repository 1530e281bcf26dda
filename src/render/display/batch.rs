//! Batches of pixels in SoA layout, sized so that compilers vectorise the loops over them.

/// Pixels in a batch.
pub(super) const BATCH: usize = 16;

/// Linear colours of a batch: the red, green and blue channels.
pub(super) type RgbBatch = [[f32; BATCH]; 3];
