//! Cameras as files describe them: a projection carried by a node.

use glam::DVec2;

use super::ThinLens;

/// The extent of a file's camera that is kept where the picture has another aspect ratio than the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize)]
pub enum SensorFit {
    /// Blender's automatic sensor fit: keeps the extent along the longer side of the picture.
    Auto,
    /// Keeps the horizontal extent.
    Horizontal,
    /// Keeps the vertical extent.
    #[default]
    Vertical,
}

/// A camera of the file.
#[derive(Clone, Debug)]
pub struct FileCamera {
    /// Name of the camera itself.
    pub name: String,
    /// The node that places it. The camera looks down the node's −Z.
    pub node: u32,
    /// Projection.
    pub projection: FileProjection,
    /// Distance of the near plane along the view direction, in metres.
    pub znear: f64,
    /// Distance of the far plane; infinite where the file gives none.
    pub zfar: f64,
    /// Shift of the view rectangle to the right and up, in units of its larger side.
    pub shift: DVec2,
    /// The lens of its depth of field, where the file describes one.
    pub lens: Option<ThinLens>,
}

/// The projection of a camera of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileProjection {
    /// A perspective projection.
    Perspective {
        /// Vertical field of view in radians.
        yfov: f64,
        /// Width over height, where the file gives it.
        aspect: Option<f64>,
    },
    /// An orthographic projection, by half extents in metres.
    Orthographic {
        /// Half the width.
        xmag: f64,
        /// Half the height.
        ymag: f64,
    },
}

impl FileCamera {
    /// Returns width over height, where the file gives it.
    pub fn aspect(&self) -> Option<f64> {
        match self.projection {
            FileProjection::Perspective { aspect, .. } => aspect,
            FileProjection::Orthographic { xmag, ymag } => (ymag > 0.0).then_some(xmag / ymag),
        }
    }

    /// Returns the height of the view rectangle at distance 1, for a picture with the aspect ratio
    /// `picture` (width over height).
    pub(super) fn view_height(&self, fit: SensorFit, picture: f64) -> f64 {
        let height = match self.projection {
            FileProjection::Perspective { yfov, .. } => 2.0 * libm::tan(0.5 * yfov),
            FileProjection::Orthographic { ymag, .. } => 2.0 * ymag,
        };
        let own = self.aspect().unwrap_or(picture);
        match fit {
            SensorFit::Vertical => height,
            SensorFit::Horizontal => height * own / picture,
            SensorFit::Auto => height * own.max(1.0) / picture.max(1.0),
        }
    }
}
