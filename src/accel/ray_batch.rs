//! Rays, segments and hits by the batch. What happens inside a batch is the accelerator's affair:
//! callers say what rays share, and never how they are traced.

use glam::Vec3;

use crate::geometry::{Hit, HitId};

/// What the rays of a batch have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coherence {
    /// All start here: eye rays of a perspective camera; shadow rays of a point light.
    Origin(Vec3),
    /// All run along this: orthographic eye rays; shadow rays of a sun.
    Direction(Vec3),
    /// Nothing.
    None,
}

/// Rays to be intersected. The arrays are parallel; `after` may be empty instead.
#[derive(Clone, Debug)]
pub struct RayBatch {
    /// What they share.
    pub coherence: Coherence,
    /// True: eye rays do not see back faces of single-sided materials.
    pub cull_back_faces: bool,
    /// Origins.
    pub origins: Vec<Vec3>,
    /// Directions, any length but zero.
    pub directions: Vec<Vec3>,
    /// Only surfaces with t at least this, and above 0, are hit.
    pub t_min: f32,
    /// Only surfaces with t at most this are hit.
    pub t_max: f32,
    /// Where it is not empty: only surfaces that come later than this in the order of (t, id) are
    /// hit, `near` or not. A hit finds the one behind it, coincident ones included.
    pub after: Vec<Hit>,
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
        }
    }
}

impl RayBatch {
    /// The start of the order: everything that counts from `near` on comes after it.
    #[inline]
    pub(crate) fn start(&self) -> Hit {
        let t = if self.t_min > 0.0 { self.t_min.next_down() } else { 0.0 };
        Hit { t, id: HitId::NONE }
    }

    /// What the hit of ray `i` has to come after.
    #[inline]
    pub(crate) fn after(&self, i: usize) -> Hit {
        self.after.get(i).copied().unwrap_or_else(|| self.start())
    }

    /// Empties it, keeping its memory.
    pub fn clear(&mut self) {
        self.origins.clear();
        self.directions.clear();
        self.after.clear();
    }

    /// Adds a ray.
    pub fn push(&mut self, o: Vec3, d: Vec3) {
        self.origins.push(o);
        self.directions.push(d);
    }

    /// Keeps the rays of ascending indices `kept`, each to go on behind its hit.
    pub fn continue_behind(&mut self, kept: &[usize], hits: &[Hit]) {
        for (to, &from) in kept.iter().enumerate() {
            self.origins[to] = self.origins[from];
            self.directions[to] = self.directions[from];
        }
        self.origins.truncate(kept.len());
        self.directions.truncate(kept.len());
        self.after.clear();
        self.after.extend(kept.iter().map(|&from| hits[from]));
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// True without rays.
    pub fn is_empty(&self) -> bool {
        self.origins.is_empty()
    }
}

/// The closest hits of a batch, parallel to its rays.
pub type HitBatch = Vec<Hit>;

/// Shadow segments: is the way from a surface to a light free? The arrays are parallel.
#[derive(Clone, Debug)]
pub struct SegmentBatch {
    /// `Origin`: the light's position, where all segments end. `Direction`: the way *to* a sun,
    /// along which all go on for ever. `None`: each has its own end.
    pub coherence: Coherence,
    /// Where they start: surface points, already lifted off their surface by their error bound.
    pub from: Vec<Vec3>,
    /// Where they end; not used for suns.
    pub to: Vec<Vec3>,
    /// The triangle each starts on, which cannot block it.
    pub source: Vec<HitId>,
}

impl Default for SegmentBatch {
    fn default() -> Self {
        SegmentBatch { coherence: Coherence::None, from: Vec::new(), to: Vec::new(), source: Vec::new() }
    }
}

impl SegmentBatch {
    /// Empties it, keeping its memory.
    pub fn clear(&mut self) {
        self.from.clear();
        self.to.clear();
        self.source.clear();
    }

    /// Adds a segment.
    pub fn push(&mut self, from: Vec3, to: Vec3, source: HitId) {
        self.from.push(from);
        self.to.push(to);
        self.source.push(source);
    }

    /// Number of segments.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// True without segments.
    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }
}

/// Judges what only a material knows, for triangles that are not simply opaque.
pub trait AnyHitFilter: Sync {
    /// Whether the surface is there at all where the ray meets the triangle (alpha masks). Called
    /// for cutout triangles only, in any order and perhaps more than once: it must depend on its
    /// arguments alone.
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool;

    /// How much light passes where the ray meets the triangle: 0 blocks, 1 is air, and nothing is beyond
    /// those. Called for translucent triangles only, by the same rules.
    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Vec3;
}
