//! Results that the bounds of all times of a clip share.

use std::sync::{Arc, OnceLock};

use crate::animation::clip_alpha::ClipAlpha;
use crate::animation::drawn_triangles::DrawnPoints;
use crate::{Animation, Scene};
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::{Aabb, Sphere};

/// Bounds over an animation clip, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClipBounds {
    pub bounds: Aabb,
    pub sphere: Sphere,
    /// Number of sampled times.
    pub samples: usize,
}

/// The bounds over an animation clip, once computed. Posed scenes of the same clip share it.
#[derive(Clone, Debug, Default)]
pub struct ClipBoundsCache(Arc<CachedBounds>);

#[derive(Debug, Default)]
struct CachedBounds {
    /// Ends the computation of the bounds.
    cancel: CancelToken,
    clip: OnceLock<ClipBounds>,
    alpha: OnceLock<ClipAlpha>,
    drawn: OnceLock<DrawnPoints>,
}

impl ClipBoundsCache {
    /// Returns an empty cache. If `cancel` is cancelled while bounds are computed, they are those of nothing, and
    /// [`ClipBoundsCache::check`] returns an error from then on.
    pub fn cancelled_by(cancel: &CancelToken) -> ClipBoundsCache {
        ClipBoundsCache(Arc::new(CachedBounds { cancel: cancel.clone(), ..CachedBounds::default() }))
    }

    /// Returns an error if the bounds may be incomplete.
    pub fn check(&self) -> Result<(), Cancelled> {
        self.0.cancel.check()
    }

    pub(super) fn cancel(&self) -> &CancelToken {
        &self.0.cancel
    }

    pub(super) fn clip(&self) -> Option<&ClipBounds> {
        self.0.clip.get()
    }

    pub(super) fn clip_or_init(&self, compute: impl FnOnce() -> ClipBounds) -> &ClipBounds {
        self.0.clip.get_or_init(compute)
    }

    /// Returns the bounds of alpha over the clip of the `active` animations.
    pub(super) fn alpha<'s>(
        &self,
        scene: &'s Scene,
        active: impl FnOnce() -> Vec<&'s Animation>,
    ) -> &ClipAlpha {
        self.0.alpha.get_or_init(|| ClipAlpha::new(scene, &active()))
    }

    /// Returns the drawn vertices, if vertices that are not drawn would change the bounds.
    pub(super) fn drawn(&self) -> Option<&DrawnPoints> {
        self.0.drawn.get()
    }

    /// Starts to distinguish drawn vertices from others.
    pub(super) fn drawn_or_init(&self, scene: &Scene) -> &DrawnPoints {
        self.0.drawn.get_or_init(|| DrawnPoints::new(scene))
    }
}
