//! Exposure by the light of a scene, as a photographer meters it.

use super::{Cancelled, Pixels, ProgressMonitor, RenderSettings, render};
use crate::geometry::Rgb;
use crate::integrator::{Frame, Integrator};

/// What the log-average of a well-exposed picture is.
pub const MID_GREY: f64 = 0.18;

/// Width at which scenes are metered: fixed, so that the exposure depends on no picture size.
pub const METER_WIDTH: u32 = 256;

/// What a scene's light measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Stops that bring the log-average to mid-grey, held back where the percentile_99 hundredth
    /// would pass 1.
    pub ev: f64,
    /// Stops between the log-average and mid-grey; positive for a dark scene.
    pub below_mid_grey: f64,
    /// The light that a hundredth of what is seen exceeds.
    pub percentile_99: f64,
}

/// Meters a frame whose camera was made for a picture of width/height `aspect`. `None` where
/// nothing that is seen is lit.
///
/// # Errors
/// [`Cancelled`] when `watch` says so.
pub fn meter(
    frame: &Frame,
    integrator: &dyn Integrator,
    aspect: f64,
    watch: &dyn ProgressMonitor,
) -> Result<Option<Metering>, Cancelled> {
    let height = (f64::from(METER_WIDTH) / aspect).round().clamp(1.0, 4096.0) as u32;
    let settings = RenderSettings { width: METER_WIDTH, height, samples: 1, ..Default::default() };
    Ok(measure(&render(frame, integrator, &settings, watch)?))
}

/// Rec. 709 luminance.
fn luminance(c: Rgb) -> f64 {
    0.2126 * f64::from(c.x) + 0.7152 * f64::from(c.y) + 0.0722 * f64::from(c.z)
}

fn measure(pixels: &Pixels) -> Option<Metering> {
    let lit = |l: &f64| *l > 0.0 && l.is_finite();
    let mut seen: Vec<f64> = pixels.colors.iter().map(|c| luminance(c.truncate())).filter(lit).collect();
    if seen.is_empty() {
        return None;
    }
    seen.sort_by(f64::total_cmp);
    let log_average = seen.iter().map(|&l| libm::log2(l)).sum::<f64>() / seen.len() as f64;
    let below_mid_grey = libm::log2(MID_GREY) - log_average;
    let percentile_99 = seen[(seen.len() - 1) * 99 / 100];
    Some(Metering { ev: below_mid_grey.min(-libm::log2(percentile_99)), below_mid_grey, percentile_99 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rgba;

    fn of(values: &[f32]) -> Option<Metering> {
        let colors = values.iter().map(|&v| Rgba::new(v, v, v, 1.0)).collect();
        measure(&Pixels { width: values.len() as u32, height: 1, colors })
    }

    #[test]
    fn an_even_scene_comes_to_mid_grey() {
        let m = of(&[0.09; 50]).unwrap();
        assert!((m.ev - 1.0).abs() < 1e-6 && (m.below_mid_grey - 1.0).abs() < 1e-6);
    }

    #[test]
    fn highlights_hold_the_exposure_back() {
        let mut values = vec![0.01; 90];
        values.extend([1.0; 10]);
        let m = of(&values).unwrap();
        assert!(m.ev.abs() < 1e-9 && m.below_mid_grey > 3.0 && m.percentile_99 == 1.0);
    }

    #[test]
    fn an_unlit_scene_has_no_exposure() {
        assert!(of(&[0.0; 4]).is_none());
    }
}
