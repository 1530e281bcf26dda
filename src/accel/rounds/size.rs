//! Radii of points and lines as rays see them.

/// The radius of spheres and capsules along a ray: `in_scene`, but at least `min` and at most `max` lengths of the
/// ray's direction times the t of the point of the ray that is nearest to the centre.
///
/// The eye rays of a perspective camera all have the same projection distance, so that a radius that is proportional to
/// t has the same number of pixels everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundSize {
    /// Radius in metres.
    pub in_scene: f32,
    /// Least radius in metres for each unit of t.
    pub min: f32,
    /// Greatest radius in metres for each unit of t.
    pub max: f32,
}

impl RoundSize {
    /// Not drawn.
    pub const NONE: RoundSize = RoundSize { in_scene: 0.0, min: 0.0, max: f32::INFINITY };

    /// A radius in metres.
    pub fn in_scene(radius: f32) -> RoundSize {
        RoundSize { in_scene: radius, ..RoundSize::NONE }
    }

    /// Returns true if there is a size at all.
    pub fn is_drawn(&self) -> bool {
        (self.in_scene > 0.0 || self.min > 0.0) && self.max > 0.0
    }

    /// Returns the radius at `t`.
    #[inline(always)]
    pub(crate) fn at(&self, t: f64) -> f64 {
        // 0 · ∞ is NaN, which `min` ignores.
        f64::from(self.in_scene).max(f64::from(self.min) * t).min(f64::from(self.max) * t).max(0.0)
    }

    /// Returns the greatest radius up to `t`.
    #[inline(always)]
    pub(crate) fn up_to(&self, t: f32) -> f32 {
        self.in_scene.max(self.min * t).min(self.max * t)
    }
}

/// The sizes of points and lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundSizes {
    /// The radius of points.
    pub points: RoundSize,
    /// Half the width of lines.
    pub lines: RoundSize,
}

impl RoundSizes {
    /// Neither points nor lines are drawn.
    pub const NONE: RoundSizes = RoundSizes { points: RoundSize::NONE, lines: RoundSize::NONE };
}
