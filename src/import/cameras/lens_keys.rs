//! Keys of a lens in `transforms.json`: at the root for all frames, or in a frame.

use serde::de::{Error, MapAccess};

use super::lens::Lens;
use super::picture_size::picture_size;

/// Values of `camera_model` that are pinholes if the distortion is 0.
const PINHOLES: [&str; 7] =
    ["PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "OPENCV", "FULL_OPENCV", "SIMPLE_RADIAL", "RADIAL"];
/// Coefficients of distortion, which must be 0.
const DISTORTION: [&str; 14] = [
    "k1",
    "k2",
    "k3",
    "k4",
    "k5",
    "k6",
    "p1",
    "p2",
    "ftheta_p0",
    "ftheta_p1",
    "ftheta_p2",
    "ftheta_p3",
    "ftheta_p4",
    "p3",
];
/// Flags of lenses that are no pinholes.
const OTHER_LENSES: [&str; 3] = ["is_fisheye", "latlong", "equirectangular"];

/// The keys that were found. Focal lengths, principal point and size are pixels, angles radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LensKeys {
    angle_x: Option<f64>,
    angle_y: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    width: Option<f64>,
    height: Option<f64>,
}

impl LensKeys {
    /// Reads the value of a key. Returns false, and reads nothing, if the key does not belong to a lens.
    pub fn read<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<bool, A::Error> {
        let place = match key {
            "camera_angle_x" => &mut self.angle_x,
            "camera_angle_y" => &mut self.angle_y,
            "fl_x" => &mut self.fl_x,
            "fl_y" => &mut self.fl_y,
            "cx" => &mut self.cx,
            "cy" => &mut self.cy,
            "w" => &mut self.width,
            "h" => &mut self.height,
            "camera_model" => {
                let model: String = map.next_value()?;
                if !PINHOLES.contains(&model.to_ascii_uppercase().as_str()) {
                    return Err(A::Error::custom(format!(
                        "the camera model {model} is not supported; undistort the images and export pinhole cameras"
                    )));
                }
                return Ok(true);
            }
            _ if DISTORTION.contains(&key) => {
                let coefficient = map.next_value::<Option<f64>>()?.unwrap_or(0.0);
                if coefficient != 0.0 {
                    return Err(A::Error::custom(format!(
                        "the distortion {key} = {coefficient} is not supported; undistort the images and export \
                         pinhole cameras"
                    )));
                }
                return Ok(true);
            }
            _ if OTHER_LENSES.contains(&key) => {
                if map.next_value::<Option<bool>>()? == Some(true) {
                    return Err(A::Error::custom(format!(
                        "{key} lenses are not supported; export pinhole cameras"
                    )));
                }
                return Ok(true);
            }
            _ => return Ok(false),
        };
        *place = map.next_value()?;
        Ok(true)
    }

    /// Returns true if no key was found.
    pub fn is_empty(&self) -> bool {
        *self == LensKeys::default()
    }

    /// The lens and the size of the picture. Keys that are missing here are those of `root`.
    pub fn resolve(&self, root: &LensKeys) -> Result<(Lens, Option<(u32, u32)>), String> {
        let size = picture_size(self.width.or(root.width), self.height.or(root.height))?;
        let angle_y = self.angle_y.or(root.angle_y);
        let lens = match (self.fl_x.or(root.fl_x), self.angle_x.or(root.angle_x)) {
            (Some(fx), _) => Lens::Pixels {
                fx,
                fy: self.fl_y.or(root.fl_y).unwrap_or(fx),
                cx: self.cx.or(root.cx),
                cy: self.cy.or(root.cy),
            },
            (None, Some(x)) => match (self.cx.or(root.cx), self.cy.or(root.cy), size) {
                (None, None, _) => Lens::Angles { x, y: angle_y },
                (cx, cy, Some((width, height))) => {
                    let focal = |pixels: u32, angle: f64| 0.5 * f64::from(pixels) / libm::tan(0.5 * angle);
                    let fx = focal(width, x);
                    Lens::Pixels { fx, fy: angle_y.map_or(fx, |y| focal(height, y)), cx, cy }
                }
                _ => return Err("cx and cy need the size of the picture; add w and h".into()),
            },
            (None, None) => {
                return Err("has no focal length; add fl_x, or camera_angle_x in radians".into());
            }
        };
        lens.check()?;
        Ok((lens, size))
    }
}
