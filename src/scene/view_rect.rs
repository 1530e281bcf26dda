//! Off-centre view rectangles, and pinhole cameras in pixels.

use std::fmt;

use glam::{DVec2, DVec3};

use super::camera_pose::{NEGLIGIBLE, is_homogeneous};
use super::{Camera, ClipPlanes, Projection};
use blinn_core::geometry::Basis;

/// A view rectangle in the lecture's terms, at the projection distance d. Metres along u and v from the point
/// where the view axis meets it. Off-centre unless l = −r and b = −t.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ViewRect {
    /// The left edge l, along u.
    pub left: f64,
    /// The right edge r, greater than l.
    pub right: f64,
    /// The bottom edge b, along v.
    pub bottom: f64,
    /// The top edge t, greater than b.
    pub top: f64,
}

impl ViewRect {
    /// Returns the perspective camera that has this view rectangle at distance 1, without clipping planes.
    pub fn camera(&self, view_point: DVec3, basis: Basis) -> Camera {
        Camera {
            view_point,
            basis,
            view_width: self.width(),
            view_height: self.height(),
            view_centre: self.centre(),
            proj_distance: 1.0,
            projection: Projection::Perspective,
            clip: ClipPlanes::OFF,
            lens: None,
        }
    }

    /// Returns r − l.
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    /// Returns t − b.
    pub fn height(&self) -> f64 {
        self.top - self.bottom
    }

    /// Returns the centre along u and v.
    pub fn centre(&self) -> DVec2 {
        0.5 * DVec2::new(self.left + self.right, self.bottom + self.top)
    }

    /// Returns the rectangle that covers the same view at `factor` times the distance.
    pub fn scaled(&self, factor: f64) -> ViewRect {
        let ViewRect { left, right, bottom, top } = *self;
        ViewRect { left: factor * left, right: factor * right, bottom: factor * bottom, top: factor * top }
    }

    /// Returns true if the rectangle has a positive, finite width and height.
    pub fn is_valid(&self) -> bool {
        let has_area = self.width() > 0.0 && self.height() > 0.0;
        has_area && self.width().is_finite() && self.height().is_finite() && self.centre().is_finite()
    }
}

impl fmt::Display for ViewRect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{},{},{},{}", self.left, self.right, self.bottom, self.top)
    }
}

/// A pinhole camera in pixels, as computer vision has it: the matrix K without skew.
///
/// Rows count downward. Pixel (i, j) has its centre at (i + ½, j + ½), so the picture covers 0…width by
/// 0…height. OpenCV's calibration puts pixel centres at integers: add ½ to its c_x and c_y.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Intrinsics {
    /// Focal length along a row, in pixels.
    pub fx: f64,
    /// Focal length along a column, in pixels.
    pub fy: f64,
    /// Principal point from the left edge, in pixels.
    pub cx: f64,
    /// Principal point from the top edge, in pixels.
    pub cy: f64,
}

impl Intrinsics {
    /// Reads the 3×3 matrix K of a pinhole camera, row by row.
    ///
    /// # Errors
    /// The matrix has skew, or is none of a pinhole camera. The text is the predicate of a sentence.
    pub fn from_matrix([fx, skew, cx, below, fy, cy, x, y, one]: [f64; 9]) -> Result<Intrinsics, String> {
        let is_negligible = |v: f64, unit: f64| v.abs() <= NEGLIGIBLE * unit.abs();
        if !is_negligible(skew, fx) {
            return Err(format!("has the skew {skew}; only cameras without skew are supported"));
        }
        if !(is_negligible(below, fy) && is_homogeneous([x, y, 0.0, one])) {
            return Err("must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]".into());
        }
        Ok(Intrinsics { fx, fy, cx, cy })
    }

    /// Returns the intrinsics of a perspective camera for pictures of `size` = (width, height) pixels.
    pub fn of(camera: &Camera, size: (u32, u32)) -> Intrinsics {
        let Camera { view_width, view_height, view_centre, proj_distance, .. } = *camera;
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        Intrinsics {
            fx: width * proj_distance / view_width,
            fy: height * proj_distance / view_height,
            cx: 0.5 * width - width * view_centre.x / view_width,
            cy: 0.5 * height + height * view_centre.y / view_height,
        }
    }

    /// Returns the view rectangle at distance 1 for pictures of `size` = (width, height) pixels.
    pub fn view_rect(&self, size: (u32, u32)) -> ViewRect {
        let Intrinsics { fx, fy, cx, cy } = *self;
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        ViewRect { left: -cx / fx, right: (width - cx) / fx, bottom: (cy - height) / fy, top: cy / fy }
    }

    /// Returns true if the focal lengths are positive and all numbers are finite.
    pub fn is_valid(&self) -> bool {
        let Intrinsics { fx, fy, cx, cy } = *self;
        fx > 0.0 && fy > 0.0 && [fx, fy, cx, cy].iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_principal_point_left_of_the_middle_moves_the_rectangle_to_the_right() {
        let k = Intrinsics { fx: 100.0, fy: 50.0, cx: 20.0, cy: 30.0 };
        let rect = k.view_rect((120, 80));
        assert_eq!(rect, ViewRect { left: -0.2, right: 1.0, bottom: -1.0, top: 0.6 });
        assert_eq!(rect.scaled(2.0).centre(), DVec2::new(0.8, -0.4));
        assert!(rect.is_valid() && k.is_valid());
    }

    #[test]
    fn matrices_have_no_skew_but_for_rounding() {
        let k = [250.0, 3e-14, 160.0, -1e-15, 240.0, 120.0, 0.0, 1e-12, 0.999_999_999_999_999_9];
        let expected = Intrinsics { fx: 250.0, fy: 240.0, cx: 160.0, cy: 120.0 };
        assert_eq!(Intrinsics::from_matrix(k), Ok(expected));
        let with = |i: usize, v: f64| {
            let mut k = k;
            k[i] = v;
            Intrinsics::from_matrix(k)
        };
        assert_eq!(with(1, 1e-5), Ok(expected));
        assert!(with(1, 0.5).unwrap_err().contains("skew 0.5"));
        for (i, v) in [(1, f64::NAN), (3, 0.5), (6, 160.0), (7, 1e-3), (8, 2.0), (8, 0.0)] {
            assert!(with(i, v).is_err(), "{i} {v}");
        }
    }

    #[test]
    fn rectangles_without_area_and_numbers_that_are_not_finite_are_invalid() {
        let rect = ViewRect { left: -1.0, right: 1.0, bottom: -1.0, top: 1.0 };
        for wrong in [
            ViewRect { left: 1.0, ..rect },
            ViewRect { top: f64::NAN, ..rect },
            ViewRect { right: f64::INFINITY, ..rect },
            ViewRect { bottom: 2.0, ..rect },
        ] {
            assert!(!wrong.is_valid(), "{wrong:?}");
        }
        let k = Intrinsics { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 };
        for wrong in
            [Intrinsics { fx: -1.0, ..k }, Intrinsics { fy: 0.0, ..k }, Intrinsics { cx: f64::NAN, ..k }]
        {
            assert!(!wrong.is_valid(), "{wrong:?}");
        }
    }
}
