//! Lenses of listed cameras.

use blinn_scene::{Intrinsics, ViewRect};

/// A pinhole lens. Parts that a file leaves out follow from the size of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Focal lengths and principal point in pixels.
    Pixels {
        /// Focal length along a row.
        fx: f64,
        /// Focal length along a column.
        fy: f64,
        /// Principal point from the left edge; `None` for the middle.
        cx: Option<f64>,
        /// Principal point from the top edge; `None` for the middle.
        cy: Option<f64>,
    },
    /// Angles of view in radians, with the principal point in the middle.
    Angles {
        /// Horizontal angle.
        x: f64,
        /// Vertical angle; `None` for square pixels.
        y: Option<f64>,
    },
    /// Vertical angle of view in radians, with square pixels and the principal point in the middle.
    VerticalAngle(f64),
}

impl From<Intrinsics> for Lens {
    fn from(k: Intrinsics) -> Lens {
        Lens::Pixels { fx: k.fx, fy: k.fy, cx: Some(k.cx), cy: Some(k.cy) }
    }
}

impl Lens {
    /// Returns the view rectangle at distance 1 for a picture of `size` = (width, height) pixels.
    pub fn view_rect(&self, size: (u32, u32)) -> ViewRect {
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        match *self {
            Lens::Pixels { fx, fy, cx, cy } => {
                let (cx, cy) = (cx.unwrap_or(0.5 * width), cy.unwrap_or(0.5 * height));
                Intrinsics { fx, fy, cx, cy }.view_rect(size)
            }
            Lens::Angles { x, y } => {
                let right = libm::tan(0.5 * x);
                let top = y.map_or(right * height / width, |y| libm::tan(0.5 * y));
                ViewRect { left: -right, right, bottom: -top, top }
            }
            Lens::VerticalAngle(y) => {
                let top = libm::tan(0.5 * y);
                let right = top * width / height;
                ViewRect { left: -right, right, bottom: -top, top }
            }
        }
    }

    /// Returns the defect of a lens that is none.
    pub(super) fn check(&self) -> Result<(), String> {
        let positive = |name: &str, f: f64| match f > 0.0 && f.is_finite() {
            true => Ok(()),
            false => Err(format!("the focal length {name} must be greater than zero, not {f}")),
        };
        let finite = |name: &str, c: Option<f64>| match c.is_none_or(f64::is_finite) {
            true => Ok(()),
            false => Err(format!("the principal point {name} must be a finite number")),
        };
        let angle = |name: &str, a: f64| match a > 0.0 && a < std::f64::consts::PI {
            true => Ok(()),
            false => Err(format!("the {name} angle of view must be between 0 and π radians, not {a}")),
        };
        match *self {
            Lens::Pixels { fx, fy, cx, cy } => {
                positive("f_x", fx)?;
                positive("f_y", fy)?;
                finite("c_x", cx)?;
                finite("c_y", cy)
            }
            Lens::Angles { x, y } => {
                angle("horizontal", x)?;
                y.map_or(Ok(()), |y| angle("vertical", y))
            }
            Lens::VerticalAngle(y) => angle("vertical", y),
        }
    }
}
