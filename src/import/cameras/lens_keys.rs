//! Keys of a lens in `transforms.json`: at the root for all frames, or in a frame.

use serde::de::{Error, MapAccess};

use super::lens::Lens;
use super::picture_size::picture_size;
use blinn_scene::NEGLIGIBLE;

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
                if coefficient.abs() > NEGLIGIBLE {
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

    /// The lens and the size of the picture. Keys that are missing here are those of `root`; focal lengths and angles of
    /// view replace those of `root` together, whichever of them a frame has.
    pub fn resolve(&self, root: &LensKeys) -> Result<(Lens, Option<(u32, u32)>), String> {
        let size = picture_size(self.width.or(root.width), self.height.or(root.height))?;
        let (cx, cy) = (self.cx.or(root.cx), self.cy.or(root.cy));
        let focal = self.focal_lengths().or_shape_of(root.focal_lengths(), size);
        let lens = match (focal.x, focal.y) {
            (None, None) => {
                return Err("has no focal length; add fl_x, or camera_angle_x in radians".into());
            }
            (Some(Focal::Angle(x)), None) if (cx, cy) == (None, None) => Lens::Angles { x, y: None },
            (Some(Focal::Angle(x)), Some(Focal::Angle(y))) if (cx, cy) == (None, None) => {
                Lens::Angles { x, y: Some(y) }
            }
            (None, Some(Focal::Angle(y))) if (cx, cy) == (None, None) => Lens::VerticalAngle(y),
            (x, y) => {
                let pixels = |focal: Option<Focal>, side: fn((u32, u32)) -> u32| {
                    focal.and_then(|focal| focal.pixels(size.map(side)))
                };
                // Pixels are square where only one focal length is known.
                let (fx, fy) = match (pixels(x, |size| size.0), pixels(y, |size| size.1)) {
                    (Some(fx), fy) => (fx, fy.unwrap_or(fx)),
                    (None, Some(fy)) => (fy, fy),
                    (None, None) => return Err("cx and cy need the size of the picture; add w and h".into()),
                };
                Lens::Pixels { fx, fy, cx, cy }
            }
        };
        lens.check()?;
        Ok((lens, size))
    }

    /// The focal lengths. Those in pixels take precedence.
    fn focal_lengths(&self) -> FocalLengths {
        let focal =
            |pixels: Option<f64>, angle: Option<f64>| pixels.map(Focal::Pixels).or(angle.map(Focal::Angle));
        FocalLengths { x: focal(self.fl_x, self.angle_x), y: focal(self.fl_y, self.angle_y) }
    }
}

/// A focal length along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Focal {
    Pixels(f64),
    /// Angle of view in radians.
    Angle(f64),
}

impl Focal {
    /// In pixels, for a picture with `side` pixels along the axis, if that is known.
    fn pixels(self, side: Option<u32>) -> Option<f64> {
        match self {
            Focal::Pixels(f) => Some(f),
            Focal::Angle(angle) => side.map(|side| 0.5 * f64::from(side) / libm::tan(0.5 * angle)),
        }
    }
}

/// The focal lengths along both axes, as far as a file has them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FocalLengths {
    x: Option<Focal>,
    y: Option<Focal>,
}

impl FocalLengths {
    /// Those of `root` where none are here. Where one is here, the pixels keep the shape that they have in `root`.
    fn or_shape_of(self, root: FocalLengths, size: Option<(u32, u32)>) -> FocalLengths {
        let (width, height) = (size.map(|size| size.0), size.map(|size| size.1));
        let shape = || Some(root.y?.pixels(height)? / root.x?.pixels(width)?);
        match (self.x, self.y) {
            (None, None) => root,
            (Some(x), None) => {
                let y = x.pixels(width).zip(shape()).map(|(fx, shape)| Focal::Pixels(fx * shape));
                FocalLengths { x: Some(x), y }
            }
            (None, Some(y)) => {
                let x = y.pixels(height).zip(shape()).map(|(fy, shape)| Focal::Pixels(fy / shape));
                FocalLengths { x, y: Some(y) }
            }
            (Some(_), Some(_)) => self,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: LensKeys = LensKeys {
        angle_x: None,
        angle_y: None,
        fl_x: None,
        fl_y: None,
        cx: None,
        cy: None,
        width: Some(320.0),
        height: Some(240.0),
    };

    fn pixels(fx: f64, fy: f64) -> Lens {
        Lens::Pixels { fx, fy, cx: None, cy: None }
    }

    #[test]
    fn a_frame_replaces_all_focal_lengths_of_the_file() {
        let root = LensKeys { fl_x: Some(300.0), fl_y: Some(300.0), ..SIZE };
        let lens = |frame: LensKeys, root: &LensKeys| frame.resolve(root).unwrap().0;
        let none = LensKeys::default();
        assert_eq!(lens(none, &root), pixels(300.0, 300.0));
        assert_eq!(lens(LensKeys { fl_x: Some(250.0), ..none }, &root), pixels(250.0, 250.0));
        assert_eq!(lens(LensKeys { fl_y: Some(250.0), ..none }, &root), pixels(250.0, 250.0));
        let both = LensKeys { fl_x: Some(250.0), fl_y: Some(260.0), ..none };
        assert_eq!(lens(both, &root), pixels(250.0, 260.0));
        let angle = |pixels: f64, f: f64| Some(2.0 * libm::atan(0.5 * pixels / f));
        for frame in [
            LensKeys { angle_x: angle(320.0, 250.0), ..none },
            LensKeys { angle_y: angle(240.0, 250.0), ..none },
            LensKeys { angle_x: angle(320.0, 250.0), angle_y: angle(240.0, 250.0), ..none },
        ] {
            let rect = lens(frame, &root).view_rect((320, 240));
            let expected = pixels(250.0, 250.0).view_rect((320, 240));
            assert!((rect.right - expected.right).abs() < 1e-12 && (rect.top - expected.top).abs() < 1e-12);
        }
        // Pixels of another shape keep it.
        let wide = LensKeys { fl_x: Some(300.0), fl_y: Some(330.0), ..SIZE };
        assert_eq!(
            lens(LensKeys { fl_x: Some(200.0), ..none }, &wide),
            pixels(200.0, 200.0 * (330.0 / 300.0))
        );
    }

    #[test]
    fn one_focal_length_stands_for_both() {
        let lens = |keys: LensKeys| keys.resolve(&LensKeys::default()).unwrap().0;
        assert_eq!(lens(LensKeys { fl_y: Some(250.0), ..SIZE }), pixels(250.0, 250.0));
        assert_eq!(
            lens(LensKeys { fl_y: Some(250.0), width: None, height: None, ..SIZE }),
            pixels(250.0, 250.0)
        );
        let vertical = lens(LensKeys { angle_y: Some(1.0), ..SIZE });
        assert_eq!(vertical, Lens::VerticalAngle(1.0));
        let rect = vertical.view_rect((320, 240));
        assert!((rect.width() / rect.height() - 320.0 / 240.0).abs() < 1e-12);
        assert!((rect.top - libm::tan(0.5)).abs() < 1e-12);
        let mixed = lens(LensKeys { fl_x: Some(250.0), angle_y: Some(1.0), ..SIZE });
        assert_eq!(mixed, pixels(250.0, 120.0 / libm::tan(0.5)));
        let off_centre = LensKeys { angle_y: Some(1.0), cx: Some(150.0), cy: Some(120.0), ..SIZE };
        let f = 120.0 / libm::tan(0.5);
        assert_eq!(lens(off_centre), Lens::Pixels { fx: f, fy: f, cx: Some(150.0), cy: Some(120.0) });
        assert!(LensKeys { fl_y: Some(0.0), ..SIZE }.resolve(&LensKeys::default()).is_err());
        assert!(SIZE.resolve(&LensKeys::default()).unwrap_err().contains("no focal length"));
    }
}
