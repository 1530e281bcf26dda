//! Settings of the filter for each kind of light.

/// Weights are averaged over so many pixels to each side.
pub(super) const SMOOTHING: usize = 1;
/// Variance is averaged over so many pixels to each side.
pub(super) const VARIANCE_RADIUS: usize = 2;
/// Light is fitted within the range of the pixels that are so many to each side.
pub(super) const RANGE_RADIUS: usize = 2;
/// Spikes stand out from so many pixels to each side.
pub(super) const SPIKE_RADIUS: usize = 1;

/// Kinds of light that are filtered differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Light of sources on matte surfaces. It has sharp shadows: each pixel has its own fit.
    DirectDiffuse,
    /// Light of other surfaces on matte surfaces. It is smooth: a block of pixels shares a fit.
    IndirectDiffuse,
    /// Reflections and transmission. What they show follows surface colour too.
    Specular,
}

impl PartKind {
    pub const ALL: [PartKind; 3] = [PartKind::DirectDiffuse, PartKind::IndirectDiffuse, PartKind::Specular];
}

/// Settings of the filter.
#[derive(Clone, Debug)]
pub(super) struct Params {
    /// Neighbours are at most so many pixels to each side.
    pub radius: usize,
    /// Patches that are compared reach so many pixels to each side.
    pub patch: usize,
    /// Tolerance of differences between patches, in standard deviations (k of NL-means).
    pub tolerance: f32,
    /// Tikhonov regularisation of the fit.
    pub ridge: f64,
    /// Regularisation of positions, relative to their spread.
    pub position_ridge: f64,
    /// Side of the blocks of pixels that share a fit.
    pub step: usize,
    /// Fits surface colour as well.
    pub albedo: bool,
    /// Fits near occlusion as well.
    pub occlusion: bool,
    /// Bound of a pixel's light, relative to the brightest pixel beside it.
    pub spikes: f32,
    /// Size of the tiles that are filtered at once.
    pub tile: [usize; 2],
}

impl Params {
    pub fn new(kind: PartKind) -> Params {
        let exact = Params {
            radius: 6,
            patch: 3,
            tolerance: 0.7,
            ridge: 1e-4,
            position_ridge: 1e-2,
            step: 0,
            albedo: false,
            occlusion: false,
            spikes: 16.0,
            tile: [64, 32],
        };
        match kind {
            PartKind::DirectDiffuse => exact,
            PartKind::IndirectDiffuse => Params {
                radius: 6,
                patch: 1,
                tolerance: 1.5,
                step: 2,
                tile: [128, 64],
                position_ridge: 0.1,
                occlusion: true,
                ..exact
            },
            PartKind::Specular => Params { albedo: true, ..exact },
        }
    }

    /// Pixels to each side that a fit takes part of its light from.
    pub fn reach(&self) -> usize {
        if self.blocks() { 2 * self.radius + 1 } else { self.radius }
    }

    /// Pixels around a tile that its light depends on.
    pub fn margin(&self) -> usize {
        let cells = self.radius + self.patch + SMOOTHING;
        let neighbours = if self.blocks() { 2 * (cells + self.radius + 1) } else { cells };
        neighbours + VARIANCE_RADIUS + SPIKE_RADIUS
    }

    /// Pixels to each side that the light of a pixel depends on.
    #[cfg(test)]
    pub fn dependence(&self) -> usize {
        self.margin() + if self.occlusion { super::near_occlusion::REACH } else { 0 }
    }

    /// Number of features of a fit.
    pub fn features(&self) -> usize {
        6 + if self.albedo { 3 } else { 0 } + if self.occlusion { 2 } else { 0 }
    }

    pub fn blocks(&self) -> bool {
        self.step > 0
    }
}
