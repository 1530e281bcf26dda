//! Where rays meet triangles: obvhs trees, traversed in batches, with one watertight hit test.
//!
//! Two levels: a tree for each mesh that is drawn more than once, one world tree for all other
//! triangles, and a tree over those. A hit is (instance, triangle), whatever tree found it.

mod batch;

pub use batch::{Cutout, HitBatch, RayBatch, SegmentBatch, Shared};

/// How trees are built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildSettings {
    /// How much time a tree is worth. The picture never depends on it.
    pub preset: Preset,
}

/// obvhs's presets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Built soonest.
    Fast,
    /// The usual.
    #[default]
    Medium,
    /// Traversed soonest.
    Slow,
}

/// What a build left out of the trees. Ids never move: what is left out is just never hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleanReport {
    /// Triangles with a vertex that is not a finite number, or beyond ±1e18.
    pub non_finite: u64,
    /// Triangles without area.
    pub zero_area: u64,
    /// Triangles equal to another in place and winding, of which the one with the lowest id is
    /// met first: they share an entry of the tree.
    pub coincident: u64,
}

/// Stub.
#[derive(Clone, Debug)]
pub struct Accel;
impl Accel {
    /// Stub.
    pub fn build(_: &crate::scene::PosedScene, _: &BuildSettings) -> (Accel, CleanReport) {
        (Accel, CleanReport::default())
    }
    /// Stub.
    pub fn intersect(&self, _rays: &RayBatch, _c: &dyn Cutout, _hits: &mut HitBatch) {}
    /// Stub.
    pub fn occluded(&self, _s: &SegmentBatch, _c: &dyn Cutout, _o: &mut Vec<bool>) {}
    /// Stub.
    pub fn transmittance(&self, _s: &SegmentBatch, _c: &dyn Cutout, _o: &mut Vec<crate::geometry::Rgb>) {}
    /// Stub.
    pub fn has_translucent(&self) -> bool {
        false
    }
}
