//! Framing: camera distances and view rectangles that show a bounding sphere, and orbits around it.

use glam::{DVec2, DVec3};

use super::{Camera, Orbit, OrbitAngles, Projection};
use blinn_core::geometry::{Basis, Sphere};

/// View direction of framed views: from above, right of the front.
pub const DEFAULT_VIEW_DIR: DVec3 = DVec3::new(-1.0, -0.7, -1.4);
/// Vertical field of view of framed views, 40°.
pub const DEFAULT_YFOV: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Space around the bounding sphere, as a factor of its radius.
pub(super) const MARGIN: f64 = 1.1;

/// Returns the distance from which a sphere of `radius` fits, with a margin, into a perspective view
/// whose rectangle at distance 1 has these half extents.
fn framing_distance(radius: f64, half_width: f64, half_height: f64) -> f64 {
    let tangent = half_width.min(half_height);
    // Divides by the sine of the half angle: the sphere touches the narrower pair of frustum planes.
    MARGIN * radius * (1.0 + tangent * tangent).sqrt() / tangent
}

/// Returns the distance from which a sphere of `radius` fits, with a margin, into an off-centre view whose
/// rectangle at distance 1 has this half size and this centre, if the sphere is in the middle of the picture.
fn off_centre_distance(radius: f64, half_size: DVec2, centre: DVec2) -> f64 {
    // The nearer plane of each pair is the one farther from the view axis.
    let side = centre.abs() + half_size;
    let distance = |half: f64, side: f64| MARGIN * radius * (1.0 + side * side).sqrt() / half;
    distance(half_size.x, side.x).max(distance(half_size.y, side.y))
}

impl Camera {
    /// Moves back along w until the sphere is in view, and sideways until it is in the middle of the picture.
    pub(super) fn frame_sphere(&mut self, sphere: Sphere) {
        let is_centred = self.view_centre == DVec2::ZERO;
        let distance = match self.projection {
            Projection::Perspective if !is_centred => {
                let half_size = 0.5 * DVec2::new(self.view_width, self.view_height);
                let d = self.proj_distance;
                off_centre_distance(sphere.radius, half_size / d, self.view_centre / d)
            }
            Projection::Perspective => {
                let half = 0.5 / self.proj_distance;
                framing_distance(sphere.radius, half * self.view_width, half * self.view_height)
            }
            Projection::Orthographic => {
                self.widen(sphere.radius);
                2.0 * sphere.radius
            }
        };
        self.view_point = sphere.centre + self.basis.w * distance;
        if !is_centred {
            let sideways = match self.projection {
                Projection::Perspective => self.view_centre * (distance / self.proj_distance),
                Projection::Orthographic => self.view_centre,
            };
            self.view_point -= self.basis.u * sideways.x + self.basis.v * sideways.y;
        }
    }

    /// Widens the view rectangle until a sphere of `radius` fits.
    pub(super) fn widen(&mut self, radius: f64) {
        let smaller = self.view_width.min(self.view_height);
        let wanted = 2.0 * MARGIN * radius;
        if smaller < wanted {
            let factor = wanted / smaller;
            self.view_width *= factor;
            self.view_height *= factor;
            self.view_centre *= factor;
        }
    }

    /// Returns the point on the view axis at the depth of `centre`; `centre` itself if it is behind.
    pub fn axis_point(&self, centre: DVec3) -> DVec3 {
        let ahead = -self.basis.w;
        let depth = (centre - self.view_point).dot(ahead);
        if depth > 0.0 { self.view_point + ahead * depth } else { centre }
    }

    /// Rotates the camera around `pivot`: by the azimuth about `up`, then by the elevation.
    pub(super) fn orbit(&mut self, pivot: DVec3, up: DVec3, by: OrbitAngles) {
        let mut turned = [self.view_point - pivot, self.basis.u, self.basis.v, self.basis.w];
        let about = |axis: DVec3, angle: f64, all: &mut [DVec3; 4]| {
            let Some(axis) = axis.try_normalize() else { return };
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            // Rodrigues' rotation formula.
            *all = all.map(|v| v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos));
        };
        about(up, by.azimuth, &mut turned);
        about(-turned[1], by.elevation, &mut turned);
        let [offset, u, v, w] = turned;
        self.view_point = pivot + offset;
        self.basis = Basis { u, v, w };
    }
}

impl Orbit {
    /// Returns the basis of a camera there. It is defined straight above and below, too, where an up
    /// direction would be parallel to the view.
    pub fn basis(&self) -> Basis {
        let (sin_a, cos_a) = (libm::sin(self.azimuth), libm::cos(self.azimuth));
        let (sin_e, cos_e) = (libm::sin(self.elevation), libm::cos(self.elevation));
        Basis {
            u: DVec3::new(cos_a, 0.0, -sin_a),
            v: DVec3::new(-sin_e * sin_a, cos_e, -sin_e * cos_a),
            w: DVec3::new(cos_e * sin_a, sin_e, cos_e * cos_a),
        }
    }
}
