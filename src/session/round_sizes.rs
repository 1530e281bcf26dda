//! Sizes of points and lines in a picture, from options in pixels or metres.

use blinn_accel::{Accel, RoundSize, RoundSizes};
use blinn_scene::{Camera, Projection};

/// Diameters in pixels between which points close the gaps of their cloud.
const AUTO_PIXELS: [f64; 2] = [2.0, 12.0];
/// Larger sizes are those of everything in view. Coordinates have the same limit.
const MAX_SIZE: f64 = 1e18;

/// A diameter of points or width of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub enum RoundWidth {
    /// A width that suits the picture: a pixel for lines, and for points what closes the gaps between neighbours.
    #[default]
    Auto,
    /// Pixels.
    Pixels(f64),
    /// Metres in the world.
    Metres(f64),
    /// Not drawn.
    Off,
}

impl RoundWidth {
    /// Reads a width: a number of metres, or of pixels such as `2px`, `auto` or `off`.
    ///
    /// # Errors
    /// The form that is expected.
    pub(crate) fn parse(text: &str) -> Result<RoundWidth, String> {
        let form = "expected pixels such as 3px, metres such as 0.01, auto or off";
        let (number, is_pixels) = match text {
            "auto" => return Ok(RoundWidth::Auto),
            "off" => return Ok(RoundWidth::Off),
            _ => (text.strip_suffix("px").unwrap_or(text), text.ends_with("px")),
        };
        let size: f64 = number.trim().parse().map_err(|_| form.to_string())?;
        match size {
            _ if !(size > 0.0 && size <= MAX_SIZE) => {
                Err(format!("must be greater than 0 and at most {MAX_SIZE:e}; off leaves them out"))
            }
            _ if is_pixels => Ok(RoundWidth::Pixels(size)),
            _ => Ok(RoundWidth::Metres(size)),
        }
    }
}

/// Returns the default sizes of points and lines that `camera` sees in a picture of `height` pixels.
pub fn default_round_sizes(accel: &Accel, camera: &Camera, height: u32) -> RoundSizes {
    round_sizes(RoundWidth::Auto, RoundWidth::Auto, accel, camera, height)
}

/// Returns the sizes of points and lines that `camera` sees in a picture of `height` pixels.
pub(crate) fn round_sizes(
    points: RoundWidth,
    lines: RoundWidth,
    accel: &Accel,
    camera: &Camera,
    height: u32,
) -> RoundSizes {
    // Half a pixel, for a unit of t.
    let half_pixel = 0.5 * camera.view_height / f64::from(height.max(1));
    let pixels = |least: f64, most: f64, in_scene: f64| {
        let (min, max) = (half_pixel * least, half_pixel * most);
        match camera.projection {
            Projection::Perspective => {
                RoundSize { in_scene: in_scene as f32, min: min as f32, max: max as f32 }
            }
            // The same at every distance.
            Projection::Orthographic => RoundSize::in_scene(in_scene.clamp(min, max) as f32),
        }
    };
    let size = |width: RoundWidth, auto: RoundSize| match width {
        RoundWidth::Auto => auto,
        RoundWidth::Pixels(width) => pixels(width, width, 0.0),
        RoundWidth::Metres(width) => RoundSize::in_scene((0.5 * width) as f32),
        RoundWidth::Off => RoundSize::NONE,
    };
    let [least, most] = AUTO_PIXELS;
    let spacing = f64::from(accel.point_spacing().unwrap_or(f32::MAX));
    RoundSizes {
        points: size(points, pixels(least, most, spacing)),
        lines: size(lines, pixels(1.0, 1.0, 0.0)),
    }
}

/// Returns the sizes that shadows and reflections have: those in metres.
pub(crate) fn solid_sizes(points: RoundWidth, lines: RoundWidth) -> RoundSizes {
    let size = |width: RoundWidth| match width {
        RoundWidth::Metres(width) => RoundSize::in_scene((0.5 * width) as f32),
        RoundWidth::Auto | RoundWidth::Pixels(_) | RoundWidth::Off => RoundSize::NONE,
    };
    RoundSizes { points: size(points), lines: size(lines) }
}

/// Reads the sizes in which rays without pixels hit points and lines: metres, `off`, or `auto`, which is the spacing of the
/// cloud for points, and no width for lines.
///
/// # Errors
/// The option that is wrong, and what is expected.
pub fn ray_sizes(point_size: &str, line_width: &str, accel: &Accel) -> Result<RoundSizes, String> {
    let size = |name: &str, text: &str, auto: Option<f32>| match RoundWidth::parse(text) {
        Ok(RoundWidth::Auto) => Ok(auto.map_or(RoundSize::NONE, RoundSize::in_scene)),
        Ok(RoundWidth::Metres(width)) => Ok(RoundSize::in_scene((0.5 * width) as f32)),
        Ok(RoundWidth::Off) => Ok(RoundSize::NONE),
        Ok(RoundWidth::Pixels(_)) => Err(format!("{name}: rays have no pixels; pass metres, auto or off")),
        Err(message) => Err(format!("{name}: {message}")),
    };
    Ok(RoundSizes {
        points: size("point_size", point_size, accel.point_spacing())?,
        lines: size("line_width", line_width, None)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_pixels_or_metres() {
        assert_eq!(RoundWidth::parse("3px"), Ok(RoundWidth::Pixels(3.0)));
        assert_eq!(RoundWidth::parse(".01"), Ok(RoundWidth::Metres(0.01)));
        assert_eq!(RoundWidth::parse("auto"), Ok(RoundWidth::Auto));
        assert_eq!(RoundWidth::parse("off"), Ok(RoundWidth::Off));
        for wrong in ["0", "-1px", "1e30", "nan", "inf", "0px"] {
            assert!(RoundWidth::parse(wrong).unwrap_err().contains("must be greater than 0"), "{wrong}");
        }
        for wrong in ["", "px", "3 pixels", "wide"] {
            assert!(RoundWidth::parse(wrong).unwrap_err().contains("expected pixels such as 3px"), "{wrong}");
        }
    }
}
