//! Projects edges to the picture.

use glam::{DMat3, DVec2, DVec3};

use super::EdgeWidth;
use crate::settings::RenderSettings;
use blinn_scene::{Camera, Projection};

/// Least depth of a perspective projection, relative to the greater depth of an edge's ends.
const MIN_DEPTH_RATIO: f64 = 1e-9;
/// Rounding of numbers between the ends of a segment stays below this fraction of the greater one.
const DEPTH_SLACK: f64 = 1e-12;
/// The greatest half width in pixels.
const MAX_HALF_WIDTH: f64 = 50.0;

/// An edge in the picture, cut to the depths and the part of the picture that are seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Ends in pixels from the upper left corner of the whole picture.
    pub ends: [DVec2; 2],
    /// The depths of both ends; for perspective projections their inverse. They are linear in the picture.
    pub depths: [f64; 2],
    /// Length in pixels from the end of the edge before it was cut.
    pub skipped: f64,
    /// Length in pixels before it was cut to the picture.
    pub length: f64,
}

/// A camera's projection to pixels.
pub(super) struct Projector {
    to_camera: DMat3,
    /// Relative to the centre of the scene.
    eye: DVec3,
    w: DVec3,
    is_perspective: bool,
    proj_distance: f64,
    near: f64,
    far: f64,
    /// Pixels for each unit of the view rectangle, downward.
    scale: DVec2,
    offset: DVec2,
    /// The part of the picture that lines can be seen in.
    low: DVec2,
    high: DVec2,
    half_width: HalfWidth,
}

/// Half the width of edges, in a form without branches for tests of several samples at once.
#[derive(Clone, Copy)]
struct HalfWidth {
    /// Pixels, if `metres` is 0.
    at_any_depth: f64,
    /// Metres on the view rectangle at depth 1, if the width in pixels depends on the depth, else 0.
    metres: f64,
    /// Pixels for each metre of the view rectangle.
    scale: f64,
}

impl HalfWidth {
    fn new(width: EdgeWidth, camera: &Camera, scale: f64) -> HalfWidth {
        let (at_any_depth, metres) = match width {
            EdgeWidth::Pixels(width) => (0.5 * width, 0.0),
            EdgeWidth::Metres(width) if camera.projection == Projection::Perspective => {
                (0.0, 0.5 * width * camera.proj_distance)
            }
            EdgeWidth::Metres(width) => (0.5 * width * scale, 0.0),
        };
        HalfWidth { at_any_depth, metres, scale }
    }
}

impl Projector {
    /// `centre` is that of the posed scene.
    pub fn new(camera: &Camera, centre: DVec3, width: EdgeWidth, settings: &RenderSettings) -> Projector {
        let size = DVec2::new(f64::from(settings.width), f64::from(settings.height));
        let scale = size / DVec2::new(camera.view_width, -camera.view_height);
        let window = settings.window();
        let margin = MAX_HALF_WIDTH + settings.filter.radius() + 1.0;
        let low = DVec2::new(f64::from(window.x), f64::from(window.y));
        let high = low + DVec2::new(f64::from(window.width), f64::from(window.height));
        Projector {
            to_camera: DMat3::from_cols(camera.basis.u, camera.basis.v, camera.basis.w).inverse(),
            eye: camera.view_point - centre,
            w: camera.basis.w,
            is_perspective: camera.projection == Projection::Perspective,
            proj_distance: camera.proj_distance,
            near: camera.clip.near.max(0.0),
            far: camera.clip.far,
            scale,
            offset: 0.5 * size - camera.view_centre * scale,
            low: low - margin,
            high: high + margin,
            half_width: HalfWidth::new(width, camera, -scale.y),
        }
    }

    /// Returns true if the camera sees the side of a plane through `p` that its normal points to.
    pub fn sees_front(&self, p: DVec3, normal: DVec3) -> bool {
        let to_eye = if self.is_perspective { self.eye - p } else { self.w };
        normal.dot(to_eye) > 0.0
    }

    /// Projects an edge between two points relative to the centre; `None` where it cannot be seen.
    pub fn project(&self, a: DVec3, b: DVec3) -> Option<Segment> {
        let [a, b] = [a, b].map(|p| self.to_camera * (p - self.eye));
        let [da, db] = [-a.z, -b.z];
        let near = if self.is_perspective { self.near.max(MIN_DEPTH_RATIO * da.max(db)) } else { self.near };
        let [start, end] = clip([0.0, 1.0], da, db, near, self.far)?;
        let at = |s: f64| {
            if s == 0.0 {
                a
            } else if s == 1.0 {
                b
            } else {
                a + (b - a) * s
            }
        };
        let mut ends = [DVec2::ZERO; 2];
        let mut depths = [0.0; 2];
        for (i, p) in [at(start), at(end)].into_iter().enumerate() {
            let depth = -p.z;
            let on_rectangle =
                if self.is_perspective { p.truncate() * (self.proj_distance / depth) } else { p.truncate() };
            ends[i] = on_rectangle * self.scale + self.offset;
            depths[i] = if self.is_perspective { 1.0 / depth } else { depth };
        }
        if !(ends[0].is_finite() && ends[1].is_finite() && depths[0].is_finite() && depths[1].is_finite()) {
            return None;
        }
        let mut part = [0.0, 1.0];
        for axis in 0..2 {
            part = clip(part, ends[0][axis], ends[1][axis], self.low[axis], self.high[axis])?;
        }
        let length = ends[0].distance(ends[1]);
        let point = |s: f64| ends[0] + (ends[1] - ends[0]) * s;
        let depth = |s: f64| depths[0] + (depths[1] - depths[0]) * s;
        Some(Segment { ends: part.map(point), depths: part.map(depth), skipped: part[0] * length, length })
    }

    /// Returns the depth at a point of a segment, from the number that is linear in the picture.
    #[inline(always)]
    pub fn depth(&self, linear: f64) -> f64 {
        if self.is_perspective { 1.0 / linear } else { linear }
    }

    /// Returns bounds of the depths of a segment, from the numbers at its ends that are linear in the picture.
    pub fn depth_bounds(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let slack = DEPTH_SLACK * a.abs().max(b.abs());
        let (low, high) = (a.min(b) - slack, a.max(b) + slack);
        if !self.is_perspective {
            return [low, high];
        }
        [1.0 / high, if low > 0.0 { 1.0 / low } else { f64::INFINITY }]
    }

    /// Returns half the width in pixels, from the number that is linear in the picture.
    #[inline(always)]
    pub fn half_width(&self, linear: f64) -> f64 {
        let HalfWidth { at_any_depth, metres, scale } = self.half_width;
        let pixels = if metres > 0.0 { metres * linear * scale } else { at_any_depth };
        if pixels < MAX_HALF_WIDTH { pixels } else { MAX_HALF_WIDTH }
    }
}

/// Cuts the part `[start, end]` of a line, along which a number changes from `a` to `b`, to where the number is between two
/// others.
fn clip([start, end]: [f64; 2], a: f64, b: f64, low: f64, high: f64) -> Option<[f64; 2]> {
    let (mut start, mut end) = (start, end);
    // Where it leaves the side on which `from + (to − from) s` is positive.
    for (from, to) in [(a - low, b - low), (high - a, high - b)] {
        if from >= 0.0 && to >= 0.0 {
            continue;
        }
        // Also false for NaN.
        if !(from >= 0.0 || to >= 0.0) {
            return None;
        }
        let zero = from / (from - to);
        if from < 0.0 {
            start = start.max(zero);
        } else {
            end = end.min(zero);
        }
    }
    (start <= end).then_some([start, end])
}
