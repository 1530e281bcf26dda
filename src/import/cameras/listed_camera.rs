//! A camera of a list.

use glam::DVec3;

use super::lens::Lens;
use blinn_core::geometry::Basis;
use blinn_scene::UpAxis;
use blinn_scene::{Camera, LightRotation};

/// Most cameras of a list: as many as frames.
pub const MAX_CAMERAS: usize = 1_000_000;

/// A pinhole camera of a list, in the scene's world.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedCamera {
    /// Name of its picture without extension, with `/` between folders, safe below any folder. `None` if the list has
    /// no names.
    pub name: Option<String>,
    /// Position in metres.
    pub view_point: DVec3,
    /// Axes u, v, w, as the file has them: they may deviate from unit length by its rounding.
    pub basis: Basis,
    /// Lens.
    pub lens: Lens,
    /// Width and height of the picture in pixels.
    pub size: Option<(u32, u32)>,
    /// Time of the scene in seconds.
    pub time: Option<f64>,
    /// Metres per step of integer depth images.
    pub depth_step: Option<f64>,
    /// Rotation of the light.
    pub light: LightRotation,
}

impl ListedCamera {
    /// Returns the camera without clipping planes. Pictures of any number of pixels show the same view; `size` matters
    /// only for a camera without a size of its own.
    pub fn camera(&self, size: (u32, u32)) -> Camera {
        let rect = self.lens.view_rect(self.size.unwrap_or(size));
        rect.camera(self.view_point, self.basis)
    }

    /// Returns the camera in a world with +Y up, for a file whose world has `up`.
    pub(super) fn in_world(self, up: UpAxis) -> ListedCamera {
        let turned = |v: DVec3| match up {
            UpAxis::Y => v,
            UpAxis::Z => DVec3::new(v.x, v.z, 0.0 - v.y),
        };
        let Basis { u, v, w } = self.basis;
        let basis = Basis { u: turned(u), v: turned(v), w: turned(w) };
        ListedCamera { view_point: turned(self.view_point), basis, ..self }
    }
}
