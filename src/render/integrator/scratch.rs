//! Memory of an integrator that is reused from tile to tile.

use crate::integrator::paths::Wave;
use crate::integrator::shading_batch::BatchBuffers;
use crate::integrator::shadow_rays::ShadowBuffers;
use blinn_accel::{HitBatch, RayBatch};

/// Memory that a thread reuses from tile to tile.
#[derive(Default)]
pub struct Scratch {
    pub(crate) rays: RayBatch,
    pub(crate) hits: HitBatch,
    pub(crate) points: BatchBuffers,
    pub(crate) shadow: ShadowBuffers,
    pub(crate) waves: Vec<WaveBuffers>,
}

/// Memory for a wave of secondary rays.
#[derive(Default)]
pub(crate) struct WaveBuffers {
    pub wave: Wave,
    pub rays: RayBatch,
    pub hits: HitBatch,
}
