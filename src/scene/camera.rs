//! The lecture's camera: where eye rays come from.

use glam::DVec3;

use super::{FileCamera, FileProjection, Scene};
use crate::geometry::{Basis, Ray, RayDifferential};

/// How the view rectangle is looked through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Every eye ray starts at the view point.
    Perspective,
    /// Every eye ray runs along the view direction.
    Orthographic,
}

/// Planes across the view direction between which there is something to see, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlanes {
    /// Nearer is not seen.
    pub near: f64,
    /// Farther is not seen; may be infinite.
    pub far: f64,
}

impl ClipPlanes {
    /// Everything in front of the view point.
    pub const OFF: ClipPlanes = ClipPlanes { near: 0.0, far: f64::INFINITY };
}

/// Which extent of a file's camera is kept where the picture's shape differs from the camera's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SensorFit {
    /// Blender's sensor fit: the longer side of the picture sees what the camera's longer side saw.
    Auto,
    /// The horizontal extent.
    Horizontal,
    /// The vertical extent.
    #[default]
    Vertical,
}

/// The lecture's camera, complete. World coordinates, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// e.
    pub view_point: DVec3,
    /// u, v, w.
    pub basis: Basis,
    /// Width of the view rectangle.
    pub view_width: f64,
    /// Height of the view rectangle.
    pub view_height: f64,
    /// d, the distance of the view rectangle from e; 1 where it does not matter.
    pub proj_distance: f64,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// What is cut off.
    pub clip: ClipPlanes,
}

impl Camera {
    /// The eye ray through film position (x, y), both in 0…1, x to the right and y *upward*:
    /// pixel (i, j) of n_x by n_y has its centre at ((i + ½)/n_x, (j + ½)/n_y). The ray is
    /// relative to `centre`.
    ///
    /// With l, r = ∓view_width/2 and b, t = ∓view_height/2: `u = l + (r − l)·x`,
    /// `v = b + (t − b)·y`.
    /// - Perspective: `s = e + u·u + v·v − d·w`; origin e, direction s − e.
    /// - Orthographic: origin e + u·u + v·v, direction −w.
    #[inline]
    pub fn eye_ray(&self, x: f64, y: f64, centre: DVec3) -> Ray {
        let (r, t) = (0.5 * self.view_width, 0.5 * self.view_height);
        let (l, b) = (-r, -t);
        let across = self.basis.u * (l + (r - l) * x) + self.basis.v * (b + (t - b) * y);
        let e = self.view_point - centre;
        let (o, d) = match self.projection {
            Projection::Perspective => (e, across - self.basis.w * self.proj_distance),
            Projection::Orthographic => (e + across, -self.basis.w),
        };
        Ray { o: o.as_vec3(), d: d.as_vec3() }
    }

    /// How eye rays change with a step of `x` to the right and of `y` upward on the film, in the units
    /// of [`Camera::eye_ray`]; the same everywhere, since that is linear in both.
    pub fn ray_differential(&self, x: f64, y: f64) -> RayDifferential {
        let steps = [self.basis.u * (self.view_width * x), self.basis.v * (self.view_height * y)];
        match self.projection {
            Projection::Perspective => RayDifferential { o: [DVec3::ZERO; 2], d: steps },
            Projection::Orthographic => RayDifferential { o: steps, d: [DVec3::ZERO; 2] },
        }
    }

    /// How far one unit of an eye ray's t goes along −w: depth = t times this.
    pub fn depth_per_t(&self) -> f64 {
        match self.projection {
            Projection::Perspective => self.proj_distance,
            Projection::Orthographic => 1.0,
        }
    }
}

/// Why there is no camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// The file has no such camera.
    #[error("no camera '{0}' in the file; it has: {1}")]
    NoCamera(String, String),
    /// `view_up` is parallel to the view direction.
    #[error("view up {up} is parallel to the view direction {dir}: give another --view-up")]
    ParallelUp {
        /// The up that was given.
        up: String,
        /// The direction.
        dir: String,
    },
    /// The view direction has no length.
    #[error("the view direction has no length: view point and look-at are the same point {0}")]
    NoDirection(String),
    /// A camera of the file looks nowhere.
    #[error(
        "the file's camera '{0}' looks nowhere: its node, or one above it, has a scale of 0; give a --view-dir"
    )]
    Flattened(String),
    /// A number that makes no picture.
    #[error("{what} must be {rule}, not {value}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        value: f64,
    },
}

/// A place around what is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Radians from the front, which is +Z, to the right, +X.
    pub azimuth: f64,
    /// Radians above the horizon, within a quarter turn.
    pub elevation: f64,
    /// Metres from the middle; `None`: as far as it takes to see everything.
    pub distance: Option<f64>,
}

impl Orbit {
    /// The `i`-th, from 0, of `n` places all around, from the top down: a Fibonacci sphere, on which
    /// every place has as much room as any other, and none is straight above or below.
    pub fn fibonacci_sphere(i: u32, n: u32) -> Orbit {
        /// 2π (1 − 1/φ).
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
        // Bands of equal height have equal areas, by Archimedes.
        let height = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n.max(1));
        let turn = f64::from(i) * GOLDEN_ANGLE;
        Orbit { azimuth: turn % std::f64::consts::TAU, elevation: libm::asin(height), distance: None }
    }
}

/// Angles by which a camera moves around what it looks at, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrbitAngles {
    /// To the right.
    pub azimuth: f64,
    /// Upwards.
    pub elevation: f64,
}

/// A view as asked for, in the lecture's words: whatever is `None` comes from the camera of the
/// file, or from framing the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// A camera of the file by name or index.
    pub camera: Option<String>,
    /// e.
    pub view_point: Option<DVec3>,
    /// −w, any length.
    pub view_dir: Option<DVec3>,
    /// Instead of a direction: a point to look at.
    pub look_at: Option<DVec3>,
    /// Up in the picture.
    pub view_up: Option<DVec3>,
    /// d.
    pub proj_distance: Option<f64>,
    /// Width of the view rectangle.
    pub view_width: Option<f64>,
    /// Height of the view rectangle.
    pub view_height: Option<f64>,
    /// Instead of a height: the vertical field of view in radians.
    pub yfov: Option<f64>,
    /// Perspective or orthographic.
    pub projection: Option<Projection>,
    /// What is cut off.
    pub clip: Option<ClipPlanes>,
    /// What is kept of a file camera where the shapes differ.
    pub fit: SensorFit,
    /// Instead of a view point and a direction: a place around the point to look at, or around
    /// the scene's middle.
    pub orbit: Option<Orbit>,
    /// Moves the camera, as all else makes it, around what it looks at.
    pub orbit_by: OrbitAngles,
    /// How many times larger things appear.
    pub zoom: Option<f64>,
}

impl View {
    /// True where nothing of a file's first camera remains: a place and a direction are given.
    pub fn replaces_file_camera(&self) -> bool {
        let directed = self.view_dir.is_some() || self.look_at.is_some();
        self.orbit.is_some() || (self.view_point.is_some() && directed)
    }

    /// Whether a camera of `scene`'s file takes part in it.
    pub fn uses_file_camera(&self, scene: &Scene) -> bool {
        self.camera.is_some() || !(self.replaces_file_camera() || scene.cameras.is_empty())
    }

    /// This view without what moves around or closer in it: scenes are metered so.
    pub fn without_orbit(&self) -> View {
        View { orbit: None, orbit_by: OrbitAngles::default(), zoom: None, ..self.clone() }
    }
}

impl FileCamera {
    /// Width over height, where the file says.
    pub fn aspect(&self) -> Option<f64> {
        match self.projection {
            FileProjection::Perspective { aspect, .. } => aspect,
            FileProjection::Orthographic { xmag, ymag } => (ymag > 0.0).then_some(xmag / ymag),
        }
    }

    /// Height of the view rectangle at distance 1 for a picture of width/height `picture`.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_on_a_sphere_are_apart_alike() {
        for n in [1, 2, 20, 500] {
            let place = |i: u32| {
                let Orbit { azimuth, elevation, .. } = Orbit::fibonacci_sphere(i, n);
                let (y, r) = (libm::sin(elevation), libm::cos(elevation));
                DVec3::new(r * libm::sin(azimuth), y, r * libm::cos(azimuth))
            };
            let all: Vec<DVec3> = (0..n).map(place).collect();
            let middle = all.iter().sum::<DVec3>() / f64::from(n);
            assert!(n < 20 || middle.length() < 0.05, "{n}: {middle}");
            // As far as they would be apart in a plane of as much area, packed as closely as can be.
            let room = (8.0 * std::f64::consts::PI / 3f64.sqrt() / f64::from(n)).sqrt();
            for (i, a) in all.iter().enumerate() {
                assert!(a.y.abs() < 1.0);
                let near = all.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, b)| a.distance(*b));
                let nearest = near.fold(2.0, f64::min);
                assert!(n < 20 || (0.8..1.0).contains(&(nearest / room)), "{n}: {i} {nearest} of {room}");
            }
        }
    }
}
