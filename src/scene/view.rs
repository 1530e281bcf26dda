//! Requested views, before the file's camera or framing completes them.

use blinn_core::option_words::{option_word, word_options};
use blinn_core::worded;
use glam::{DVec2, DVec3};

use super::{Camera, ClipPlanes, Intrinsics, Projection, Scene, SensorFit, ViewRect};

/// An error in a view.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// The file has no camera of that name or index.
    #[error("the file has no camera '{0}'; its cameras are: {1}")]
    NoCamera(String, String),
    /// `view_up` is parallel to the view direction.
    #[error("view up {up} is parallel to the view direction {dir}; {}", worded!("set another `view-up`"))]
    ParallelUp {
        /// The up vector.
        up: String,
        /// The view direction.
        dir: String,
    },
    /// The view direction has no length.
    #[error("the view direction has no length: view point and look-at are both {0}")]
    NoDirection(String),
    /// A camera of the file has no view direction.
    #[error(
        "the file's camera '{}' has no view direction: its node or a parent has scale 0; {}",
        .0,
        worded!("set `view-dir`")
    )]
    DegenerateFileCamera(String),
    /// Intrinsics for an orthographic camera.
    #[error(
        "{} describes a perspective camera, and {} is orthographic; {}",
        worded!("`intrinsics`"),
        .0,
        worded!("add `projection perspective`")
    )]
    OrthographicIntrinsics(String),
    /// A depth of field without a distance in focus.
    #[error("nothing in front of the camera is in focus: the distance is {}; {}", .0, worded!("set `focus`"))]
    NothingInFocus(f64),
    /// A view rectangle without area.
    #[error("{} must have L < R and B < T", option_word("view-rect", Some(&.0.to_string())))]
    EmptyViewRect(ViewRect),
    /// A value outside its range.
    #[error("{} must be {rule}, not {value}", word_options(.what))]
    OutOfRange {
        /// The option.
        what: &'static str,
        /// Its allowed values.
        rule: &'static str,
        /// Its value.
        value: f64,
    },
}

/// A camera position on a sphere around the point that the camera looks at.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Orbit {
    /// Radians from the front (+Z) to the right (+X).
    pub azimuth: f64,
    /// Radians above the horizon, in −π/2…π/2.
    pub elevation: f64,
    /// Distance from the centre in metres. `None` frames the whole scene.
    pub distance: Option<f64>,
}

impl Orbit {
    /// Returns position `i` (from 0) of `n` evenly distributed positions, from the top down, on a
    /// Fibonacci sphere. No position is straight above or below.
    pub fn fibonacci_sphere(i: u32, n: u32) -> Orbit {
        /// 2π (1 − 1/φ).
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
        // Bands of equal height on a sphere have equal areas (Archimedes).
        let height = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n.max(1));
        let turn = f64::from(i) * GOLDEN_ANGLE;
        Orbit { azimuth: turn % std::f64::consts::TAU, elevation: libm::asin(height), distance: None }
    }
}

/// Angles by which a camera moves around the point that it looks at, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct OrbitAngles {
    /// To the right.
    pub azimuth: f64,
    /// Upwards.
    pub elevation: f64,
}

/// The plane that is sharp in a depth of field.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum Focus {
    /// The plane at this distance along the view direction.
    Distance(f64),
    /// The plane through this point, perpendicular to the view direction.
    Point(DVec3),
}

/// A requested view, in the lecture's terms. Fields that are `None` come from the file's camera, or from
/// framing the scene. Lengths are metres, angles radians; all coordinates are world coordinates.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct View {
    /// A camera of the file, by name or index.
    pub camera: Option<String>,
    /// View point e.
    pub view_point: Option<DVec3>,
    /// View direction −w, of any length.
    pub view_dir: Option<DVec3>,
    /// A point to look at, in place of a direction.
    pub look_at: Option<DVec3>,
    /// Up direction of the picture.
    pub view_up: Option<DVec3>,
    /// Projection distance d.
    pub proj_distance: Option<f64>,
    /// Width of the view rectangle.
    pub view_width: Option<f64>,
    /// Height of the view rectangle.
    pub view_height: Option<f64>,
    /// Vertical field of view in radians, in place of a height.
    pub yfov: Option<f64>,
    /// The view rectangle at the projection distance, in place of a size or an angle.
    pub view_rect: Option<ViewRect>,
    /// The view rectangle of a perspective camera in pixels, in place of a size or an angle.
    pub intrinsics: Option<Intrinsics>,
    /// Blender's lens shift: moves the view rectangle to the right and up, in units of its larger side. `None` for that of
    /// the file's camera.
    pub shift: Option<DVec2>,
    /// Perspective or orthographic.
    pub projection: Option<Projection>,
    /// Clipping planes.
    pub clip: Option<ClipPlanes>,
    /// Radius of the aperture of a depth of field; 0 is a pinhole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_radius: Option<f64>,
    /// The plane in focus of a depth of field. `None` for the distance of the file's camera; else the point to look at, or the centre
    /// of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus: Option<Focus>,
    /// Number of corners of the aperture; below 3 it is a disc.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_blades: Option<u32>,
    /// Extent of a file camera that is kept in pictures of another aspect ratio.
    pub fit: SensorFit,
    /// A position around the point to look at, or around the centre of the scene, in place of a view
    /// point and a direction.
    pub orbit: Option<Orbit>,
    /// Moves the camera around the point that it looks at, after all else.
    pub orbit_by: OrbitAngles,
    /// Magnification about the centre of the picture.
    pub zoom: Option<f64>,
    /// A complete camera. Where it is set, no other field has an effect but those of the aperture.
    pub complete: Option<Camera>,
}

impl View {
    /// Returns true if the view replaces the position and the direction of the file's camera.
    pub fn replaces_file_camera(&self) -> bool {
        let directed = self.view_dir.is_some() || self.look_at.is_some();
        let is_complete = self.complete.is_some();
        is_complete || self.orbit.is_some() || (self.view_point.is_some() && directed)
    }

    /// Returns true if the view takes anything from a camera of `scene`'s file.
    pub fn uses_file_camera(&self, scene: &Scene) -> bool {
        self.camera.is_some() || !(self.replaces_file_camera() || scene.cameras.is_empty())
    }

    /// Returns this view without orbit and zoom. Exposure metering uses it.
    pub fn without_orbit(&self) -> View {
        View { orbit: None, orbit_by: OrbitAngles::default(), zoom: None, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fibonacci_positions_are_evenly_distributed() {
        for n in [1, 2, 20, 500] {
            let position = |i: u32| {
                let Orbit { azimuth, elevation, .. } = Orbit::fibonacci_sphere(i, n);
                let (y, r) = (libm::sin(elevation), libm::cos(elevation));
                DVec3::new(r * libm::sin(azimuth), y, r * libm::cos(azimuth))
            };
            let all: Vec<DVec3> = (0..n).map(position).collect();
            let mean = all.iter().sum::<DVec3>() / f64::from(n);
            assert!(n < 20 || mean.length() < 0.05, "{n}: {mean}");
            // The distance of neighbours in the densest packing of a plane of the same area.
            let spacing = (8.0 * std::f64::consts::PI / 3f64.sqrt() / f64::from(n)).sqrt();
            for (i, a) in all.iter().enumerate() {
                assert!(a.y.abs() < 1.0);
                let others = all.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, b)| a.distance(*b));
                let nearest = others.fold(2.0, f64::min);
                assert!(
                    n < 20 || (0.8..1.0).contains(&(nearest / spacing)),
                    "{n}: {i} {nearest} of {spacing}"
                );
            }
        }
    }
}
