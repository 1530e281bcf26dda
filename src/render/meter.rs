//! Exposure metering: the log-average and the highlights of a scene's light.

use crate::film::Pixels;
use crate::integrator::{Frame, Integrator};
use crate::memory::RenderMemory;
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use crate::tiles::render_uniform;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgb;

/// Log-average luminance of a well-exposed picture.
pub const MID_GREY: f64 = 0.18;

/// Width in pixels at which scenes are metered: fixed, so that the exposure does not depend on the picture's size.
pub const METER_WIDTH: u32 = 256;

/// The metered light of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Exposure in stops that brings the log-average to mid-grey, limited so that the 99th percentile stays at most 1.
    pub ev: f64,
    /// Stops from the log-average to mid-grey; positive for a dark scene.
    pub below_mid_grey: f64,
    /// 99th percentile of the luminance of lit pixels.
    pub percentile_99: f64,
}

/// Meters a frame whose camera is set up for a picture of width/height `aspect`. `None` if no pixel is lit.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn meter(
    frame: &Frame,
    integrator: &dyn Integrator,
    aspect: f64,
    monitor: &dyn ProgressMonitor,
) -> Result<Option<Metering>, Cancelled> {
    let height = (f64::from(METER_WIDTH) / aspect).round().clamp(1.0, 4096.0) as u32;
    let settings = RenderSettings { width: METER_WIDTH, height, samples: 1, ..Default::default() };
    Ok(measure(&render_uniform(&RenderMemory::default(), frame, integrator, &settings, monitor)?))
}

/// Rec. 709 luminance.
fn luminance(c: Rgb) -> f64 {
    0.2126 * f64::from(c.x) + 0.7152 * f64::from(c.y) + 0.0722 * f64::from(c.z)
}

fn measure(pixels: &Pixels) -> Option<Metering> {
    let is_lit = |l: &f64| *l > 0.0 && l.is_finite();
    let mut lit: Vec<f64> = pixels.colors.iter().map(|c| luminance(c.truncate())).filter(is_lit).collect();
    if lit.is_empty() {
        return None;
    }
    lit.sort_unstable_by(f64::total_cmp);
    let log_average = lit.iter().map(|&l| libm::log2(l)).sum::<f64>() / lit.len() as f64;
    let below_mid_grey = libm::log2(MID_GREY) - log_average;
    let percentile_99 = lit[(lit.len() - 1) * 99 / 100];
    Some(Metering { ev: below_mid_grey.min(-libm::log2(percentile_99)), below_mid_grey, percentile_99 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgba;

    fn measure_values(values: &[f32]) -> Option<Metering> {
        let colors = values.iter().map(|&v| Rgba::new(v, v, v, 1.0)).collect();
        measure(&Pixels { width: values.len() as u32, height: 1, colors })
    }

    #[test]
    fn a_uniform_scene_is_exposed_to_mid_grey() {
        let m = measure_values(&[0.09; 50]).unwrap();
        assert!((m.ev - 1.0).abs() < 1e-6 && (m.below_mid_grey - 1.0).abs() < 1e-6);
    }

    #[test]
    fn highlights_limit_the_exposure() {
        let mut values = vec![0.01; 90];
        values.extend([1.0; 10]);
        let m = measure_values(&values).unwrap();
        assert!(m.ev.abs() < 1e-9 && m.below_mid_grey > 3.0 && m.percentile_99 == 1.0);
    }

    #[test]
    fn an_unlit_scene_has_no_exposure() {
        assert!(measure_values(&[0.0; 4]).is_none());
    }
}
