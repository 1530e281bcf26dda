//! Batches of rays and of shadow rays, and the hit filter for alpha masks and transmittance.
//!
//! Callers say what the rays of a batch share, never how they are traced.

use glam::Vec3;

use crate::rounds::RoundSizes;
use blinn_core::geometry::{Hit, HitId};

/// The origin or direction that all rays of a batch share, so that they can be traced as ray packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coherence {
    /// The origin: eye rays of a perspective camera, shadow rays of a point light.
    Origin(Vec3),
    /// The direction: eye rays of an orthographic camera, shadow rays of a directional light.
    Direction(Vec3),
    /// Nothing.
    None,
}

/// Rays to intersect, in world space. The arrays are parallel; `after` and `source` may be empty instead.
#[derive(Clone, Debug)]
pub struct RayBatch {
    /// The vector that the rays share.
    pub coherence: Coherence,
    /// Ignore back faces of single-sided materials, as eye rays do.
    pub cull_back_faces: bool,
    /// Origins.
    pub origins: Vec<Vec3>,
    /// Directions of any length but zero, in which t counts.
    pub directions: Vec<Vec3>,
    /// Hits need a t of at least this, and greater than 0.
    pub t_min: f32,
    /// Hits need a t of at most this.
    pub t_max: f32,
    /// Finds the hit behind a given one: if it is not empty, each ray's hit comes later than this one in the order of
    /// (t, id), whatever `t_min`. Coincident triangles are found one after the other.
    pub after: Vec<Hit>,
    /// The triangle that each ray starts on, which it does not hit. The hits of rays that leave a surface
    /// are found faster with it. Such rays are not traced as packets.
    pub source: Vec<HitId>,
    /// The sizes in which the rays see points and lines. By default those of
    /// [`Accel::set_solid_rounds`](crate::Accel::set_solid_rounds).
    pub rounds: RoundSizes,
}

impl Default for RayBatch {
    fn default() -> Self {
        RayBatch {
            coherence: Coherence::None,
            cull_back_faces: false,
            origins: Vec::new(),
            directions: Vec::new(),
            t_min: 0.0,
            t_max: f32::INFINITY,
            after: Vec::new(),
            source: Vec::new(),
            rounds: RoundSizes::NONE,
        }
    }
}

impl RayBatch {
    /// The triangle that ray `i` starts on, or [`HitId::NONE`].
    #[inline]
    pub(crate) fn source(&self, i: usize) -> HitId {
        self.source.get(i).copied().unwrap_or(HitId::NONE)
    }

    /// The greatest hit in the order of (t, id) that comes before all hits from `t_min` on.
    #[inline]
    pub(crate) fn lower_bound(&self) -> Hit {
        let t = if self.t_min > 0.0 { self.t_min.next_down() } else { 0.0 };
        Hit { t, id: HitId::NONE }
    }

    /// The hit that the hit of ray `i` has to come after.
    #[inline]
    pub(crate) fn after(&self, i: usize) -> Hit {
        self.after.get(i).copied().unwrap_or_else(|| self.lower_bound())
    }

    /// Removes all rays and keeps the memory.
    pub fn clear(&mut self) {
        self.origins.clear();
        self.directions.clear();
        self.after.clear();
        self.source.clear();
    }

    /// Adds a ray.
    #[inline]
    pub fn push(&mut self, o: Vec3, d: Vec3) {
        self.origins.push(o);
        self.directions.push(d);
    }

    /// Keeps the rays with these indices, in ascending order, and continues each behind its hit.
    pub fn continue_behind(&mut self, indices: &[usize], hits: &[Hit]) {
        for (to, &from) in indices.iter().enumerate() {
            self.origins[to] = self.origins[from];
            self.directions[to] = self.directions[from];
            if let Some(&source) = self.source.get(from) {
                self.source[to] = source;
            }
        }
        self.source.truncate(indices.len());
        self.origins.truncate(indices.len());
        self.directions.truncate(indices.len());
        self.after.clear();
        self.after.extend(indices.iter().map(|&from| hits[from]));
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Returns true if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.origins.is_empty()
    }
}

/// The closest hits of a batch, parallel to its rays.
pub type HitBatch = Vec<Hit>;

/// Shadow rays from surface points to a light, in world space. The arrays are parallel. Rays of ambient occlusion are
/// shadow rays as well.
#[derive(Clone, Debug)]
pub struct ShadowRayBatch {
    /// The vector that the rays share. `Origin`: the position of the light, at which all end. `Direction`: the direction
    /// *to* a directional light, in which all go on for ever. `None`: each has its own end.
    pub coherence: Coherence,
    /// Start points: surface points, already offset from their surface by their error bound.
    pub from: Vec<Vec3>,
    /// End points; unused for directional lights.
    pub to: Vec<Vec3>,
    /// The triangle, point or line that each ray starts on, which cannot occlude it.
    pub source: Vec<HitId>,
    /// The sizes of points and lines that occlude. By default those of
    /// [`Accel::set_solid_rounds`](crate::Accel::set_solid_rounds).
    pub rounds: RoundSizes,
}

impl Default for ShadowRayBatch {
    fn default() -> Self {
        ShadowRayBatch {
            coherence: Coherence::None,
            from: Vec::new(),
            to: Vec::new(),
            source: Vec::new(),
            rounds: RoundSizes::NONE,
        }
    }
}

impl ShadowRayBatch {
    /// Removes all rays and keeps the memory.
    pub fn clear(&mut self) {
        self.from.clear();
        self.to.clear();
        self.source.clear();
    }

    /// Adds a ray.
    #[inline]
    pub fn push(&mut self, from: Vec3, to: Vec3, source: HitId) {
        self.from.push(from);
        self.to.push(to);
        self.source.push(source);
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// Returns true if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }
}

/// Decides what depends on materials, for triangles that are not opaque.
///
/// Methods are called in any order and perhaps more than once for a hit: results must depend on the arguments
/// only.
pub trait HitFilter: Sync {
    /// Returns whether the hit of an alpha-tested triangle counts: where its alpha mask is not transparent.
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool;

    /// Returns the transmittance of a translucent triangle where the ray hits it, in linear RGB: from 0 (opaque) to
    /// 1 (invisible).
    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Vec3;

    /// Returns the absorption coefficient behind a translucent triangle minus that in front of it, for a ray of direction
    /// `d`: per unit of t, in linear RGB. 0 unless the triangle bounds an absorbing medium.
    fn absorption_step(&self, _id: HitId, _d: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

/// Counts every hit: masked and translucent triangles are opaque.
pub struct AcceptAll;

impl HitFilter for AcceptAll {
    fn accepts(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmittance(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}
