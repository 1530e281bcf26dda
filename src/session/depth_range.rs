//! Checks that 16-bit depth holds the depths of an image.

use crate::error::SessionError;
use crate::log::SessionLog;
use crate::notice::{DepthOverflow, Notice};
use blinn_render::AovLayer;
use blinn_render::integrator::Aov;

/// Warns of depths that a 16-bit image with `step` metres per unit cannot store. They become 65535.
pub fn check_depth_range(
    layers: &[AovLayer],
    step: Option<f64>,
    frame: i64,
    log: &dyn SessionLog,
) -> Result<(), SessionError> {
    let Some(step) = step else { return Ok(()) };
    let depths = layers.iter().filter(|layer| layer.aov == Aov::Depth).flat_map(|layer| &layer.values);
    let farthest = depths.copied().filter(|depth| depth.is_finite()).fold(0.0, f32::max);
    let largest = step * f64::from(u16::MAX);
    if f64::from(farthest) <= largest + 0.5 * step {
        return Ok(());
    }
    let largest = largest as f32;
    log.warn(Notice::DepthOverflow(DepthOverflow { frame, farthest, step, largest }))
}
