//! The views of a technical drawing: orthographic, along the axes and isometric.

use glam::{DVec2, DVec3};

use super::{Camera, ClipPlanes, Projection};
use blinn_core::geometry::{Aabb, Basis};

/// A view of a technical drawing. Front, right and top look along −Z, −X and −Y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From +Z, with +X to the right and +Y up.
    Front,
    /// From +X, with −Z to the right and +Y up.
    Right,
    /// From +Y, with +X to the right and −Z up.
    Top,
    /// From (1, 1, 1): all three axes have the same scale.
    Isometric,
}

impl StandardView {
    /// All views.
    pub const ALL: [StandardView; 4] =
        [StandardView::Front, StandardView::Right, StandardView::Top, StandardView::Isometric];

    /// Returns the name, such as `front`.
    pub fn name(self) -> &'static str {
        match self {
            StandardView::Front => "front",
            StandardView::Right => "right",
            StandardView::Top => "top",
            StandardView::Isometric => "isometric",
        }
    }

    /// Returns the camera basis.
    pub fn basis(self) -> Basis {
        match self {
            StandardView::Front => Basis { u: DVec3::X, v: DVec3::Y, w: DVec3::Z },
            StandardView::Right => Basis { u: DVec3::NEG_Z, v: DVec3::Y, w: DVec3::X },
            StandardView::Top => Basis { u: DVec3::X, v: DVec3::NEG_Z, w: DVec3::Y },
            StandardView::Isometric => {
                let w = DVec3::ONE.normalize();
                let u = DVec3::new(1.0, 0.0, -1.0).normalize();
                Basis { u, v: w.cross(u), w }
            }
        }
    }

    /// Returns the width and height of a box as the view shows it, in metres.
    pub fn projected_extent(self, bounds: &Aabb) -> DVec2 {
        projected_extent(&self.basis(), bounds)
    }

    /// Returns the orthographic camera that shows `bounds` in the middle of a view rectangle of `size` metres.
    pub fn camera(self, bounds: &Aabb, size: DVec2) -> Camera {
        orthographic_camera(self.basis(), bounds, size)
    }
}

/// Returns the width and height of a box along u and v, in metres.
pub fn projected_extent(basis: &Basis, bounds: &Aabb) -> DVec2 {
    let extent = bounds.extent();
    DVec2::new(basis.u.abs().dot(extent), basis.v.abs().dot(extent))
}

/// Returns the orthographic camera along −w that shows `bounds` in the middle of a view rectangle of `size` metres.
pub fn orthographic_camera(basis: Basis, bounds: &Aabb, size: DVec2) -> Camera {
    let diagonal = bounds.extent().length();
    let distance = if diagonal > 0.0 { diagonal } else { size.max_element() };
    Camera {
        view_point: bounds.centre() + basis.w * distance,
        basis,
        view_width: size.x,
        view_height: size.y,
        view_centre: DVec2::ZERO,
        proj_distance: 1.0,
        projection: Projection::Orthographic,
        clip: ClipPlanes::OFF,
        lens: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bases_are_right_handed_and_boxes_lie_in_front_and_within_their_extent() {
        let bounds = Aabb { min: DVec3::new(-1.0, 2.0, 5.0), max: DVec3::new(3.0, 2.5, 12.0) };
        for view in StandardView::ALL {
            let Basis { u, v, w } = view.basis();
            assert!((u.cross(v) - w).length() < 1e-15, "{view:?}");
            let extent = view.projected_extent(&bounds);
            let camera = view.camera(&bounds, extent);
            for i in 0..8 {
                let pick = |axis: usize| [bounds.min[axis], bounds.max[axis]][i >> axis & 1];
                let offset = DVec3::new(pick(0), pick(1), pick(2)) - camera.view_point;
                assert!(offset.dot(w) < 0.0, "{view:?}");
                let across = 2.0 * offset.dot(u).abs() / extent.x;
                let up = 2.0 * offset.dot(v).abs() / extent.y;
                assert!(across < 1.0 + 1e-12 && up < 1.0 + 1e-12, "{view:?}: {across} {up}");
            }
        }
    }
}
