//! Points and line segments, and their exact intersection with rays.

use glam::{DVec3, Vec3};

use super::size::RoundSize;

/// Larger coordinates are not rendered.
const MAX_COORDINATE: f32 = 1e18;
/// Groups of points among which neighbours are searched, and the size of each.
const SPACING_GROUPS: usize = 1024;
const SPACING_GROUP: usize = 64;
/// The neighbour whose distance is the spacing of a cloud. On a grid all four are one cell away; of points thrown at random
/// on a surface, spheres of this radius cover 98 %.
const NEIGHBOUR: usize = 4;

/// A ray in f64.
#[derive(Clone, Copy)]
pub(super) struct Ray64 {
    pub o: DVec3,
    pub d: DVec3,
    /// The square of the length of `d`.
    pub dd: f64,
}

/// A primitive of a [`RoundBvh`](super::round_bvh::RoundBvh).
pub(super) trait RoundItem: Copy + Send + Sync {
    /// Number of the primitive.
    fn id(&self) -> u32;
    /// The bounds of its axis, without its radius.
    fn bounds(&self) -> [Vec3; 2];
    /// Returns true if both have the same axis.
    fn is_at_place_of(&self, other: &Self) -> bool;
    /// Returns the t where a ray enters it.
    fn enter(&self, ray: &Ray64, size: &RoundSize) -> Option<f64>;
}

/// A point of an instance, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointItem {
    pub p: Vec3,
    pub id: u32,
}

/// A line segment of an instance, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentItem {
    pub a: Vec3,
    pub b: Vec3,
    pub id: u32,
}

fn is_in_range(p: Vec3) -> bool {
    p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

impl PointItem {
    /// Returns false for coordinates that are not finite or too large.
    pub fn is_drawn(&self) -> bool {
        is_in_range(self.p)
    }
}

impl SegmentItem {
    /// Returns false for coordinates that are not finite or too large.
    pub fn is_drawn(&self) -> bool {
        is_in_range(self.a) && is_in_range(self.b)
    }
}

impl RoundItem for PointItem {
    #[inline(always)]
    fn id(&self) -> u32 {
        self.id
    }

    #[inline(always)]
    fn bounds(&self) -> [Vec3; 2] {
        [self.p; 2]
    }

    fn is_at_place_of(&self, other: &PointItem) -> bool {
        self.p == other.p
    }

    #[inline(always)]
    fn enter(&self, ray: &Ray64, size: &RoundSize) -> Option<f64> {
        let v = self.p.as_dvec3() - ray.o;
        let t = v.dot(ray.d) / ray.dd;
        enter_sphere(v, ray, size.at(t))
    }
}

impl RoundItem for SegmentItem {
    #[inline(always)]
    fn id(&self) -> u32 {
        self.id
    }

    #[inline(always)]
    fn bounds(&self) -> [Vec3; 2] {
        [self.a.min(self.b), self.a.max(self.b)]
    }

    fn is_at_place_of(&self, other: &SegmentItem) -> bool {
        self.a == other.a && self.b == other.b
    }

    #[inline(always)]
    fn enter(&self, ray: &Ray64, size: &RoundSize) -> Option<f64> {
        let a = self.a.as_dvec3() - ray.o;
        let e = (self.b - self.a).as_dvec3();
        let e = if e.is_finite() { e } else { self.b.as_dvec3() - self.a.as_dvec3() };
        // The point a + s e of the segment is at distance |w| from the point t of the ray.
        let (t_a, t_e) = (a.dot(ray.d) / ray.dd, e.dot(ray.d) / ray.dd);
        let (w_a, w_e) = (a - ray.d * t_a, e - ray.d * t_e);
        let slope2 = f64::from(size.min) * f64::from(size.min);
        let [start, end] = if slope2 > 0.0 { in_front(t_a, t_e)? } else { [0.0, 1.0] };
        // Least |w|² − (min t)², which is a quadratic function of s.
        let square = w_e.length_squared() - slope2 * t_e * t_e;
        let linear = w_a.dot(w_e) - slope2 * t_a * t_e;
        let value = |s: f64| s * (square * s + 2.0 * linear);
        let s = match -linear / square {
            s if square > 0.0 && s.is_finite() => s.clamp(start, end),
            _ if value(start) <= value(end) => start,
            _ => end,
        };
        let t = t_a + t_e * s;
        let r = size.at(t);
        if !((w_a + w_e * s).length_squared() <= r * r) {
            return None;
        }
        // A cone is a capsule with the radius that it has there, up to the second order of its slope.
        Some(enter_capsule(a, e, ray, r).unwrap_or(t))
    }
}

/// Returns the part of a segment with t > 0.
#[inline(always)]
fn in_front(t_a: f64, t_e: f64) -> Option<[f64; 2]> {
    let zero = -t_a / t_e;
    match (t_a > 0.0, t_a + t_e > 0.0) {
        (true, true) => Some([0.0, 1.0]),
        (true, false) => Some([0.0, zero.clamp(0.0, 1.0)]),
        (false, true) => Some([zero.clamp(0.0, 1.0), 1.0]),
        (false, false) => None,
    }
}

/// Returns the t where a ray enters a sphere of radius `r` about `v`, which is relative to its origin.
#[inline(always)]
fn enter_sphere(v: DVec3, ray: &Ray64, r: f64) -> Option<f64> {
    let t = v.dot(ray.d) / ray.dd;
    let w2 = (v - ray.d * t).length_squared();
    (w2 <= r * r).then(|| t - ((r * r - w2) / ray.dd).sqrt())
}

/// Returns the t where a ray enters the capsule of radius `r` about the segment from `a` to `a + e`: the first of its
/// cylinder and of the spheres at its ends.
#[inline(always)]
fn enter_capsule(a: DVec3, e: DVec3, ray: &Ray64, r: f64) -> Option<f64> {
    let ends = [enter_sphere(a, ray, r), enter_sphere(a + e, ray, r)];
    let (ee, ed, ea) = (e.length_squared(), e.dot(ray.d), e.dot(a));
    // Both projected along the axis.
    let (d, v) = (ray.d * ee - e * ed, a * ee - e * ea);
    let dd = d.length_squared();
    let middle = v.dot(d) / dd;
    let w2 = (v - d * middle).length_squared();
    let side = middle - ((r * r * ee * ee - w2) / dd).max(0.0).sqrt();
    let along = side * ed - ea;
    let is_on_side = w2 <= r * r * ee * ee && along >= 0.0 && along <= ee;
    let side = is_on_side.then_some(side);
    ends.into_iter().chain([side]).flatten().reduce(f64::min)
}

/// Returns the median distance from points to their [`NEIGHBOUR`]th-nearest neighbour, among groups of points that lie
/// together.
pub(super) fn spacing(points: &[PointItem]) -> Option<f32> {
    let groups = points.chunks(SPACING_GROUP).filter(|group| group.len() > NEIGHBOUR);
    let step = points.len().div_ceil(SPACING_GROUP).div_ceil(SPACING_GROUPS).max(1);
    let mut spacings = Vec::new();
    for group in groups.step_by(step) {
        for (i, point) in group.iter().enumerate() {
            let others = group.iter().enumerate().filter(|(j, _)| *j != i);
            let mut distances: Vec<f32> =
                others.map(|(_, other)| other.p.distance_squared(point.p)).collect();
            let (_, nth, _) = distances.select_nth_unstable_by(NEIGHBOUR - 1, f32::total_cmp);
            // Scanners repeat points.
            if *nth > 0.0 {
                spacings.push(*nth);
            }
        }
    }
    if spacings.is_empty() {
        return None;
    }
    let middle = spacings.len() / 2;
    let (_, median, _) = spacings.select_nth_unstable_by(middle, f32::total_cmp);
    Some(median.sqrt())
}
