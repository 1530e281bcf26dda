//! Settings of BVH construction and traversal.

use blinn_core::simd::SimdLevel;

/// How BVHs are built and traversed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelSettings {
    /// Build time against traversal time. Pictures never depend on it.
    pub preset: Preset,
    /// The SIMD instructions of traversal: by default the best that the processor has. Pictures never depend on
    /// it.
    pub simd: SimdLevel,
    /// Limit on the instanced meshes that are copied into a world BVH. Pictures depend on it by the rounding of t.
    pub flatten: FlattenBudget,
}

/// The kind of BVH: none, or one built by a preset of the builder (obvhs).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// No BVH: every ray tests every triangle. The reference for tests.
    BruteForce,
    /// Fastest build.
    Fast,
    /// Balanced.
    #[default]
    Medium,
    /// Fastest traversal.
    Slow,
}

impl Preset {
    /// Returns the preset with which building a BVH over `triangles` and tracing `samples` camera samples, with the shadow
    /// rays of their hits, take the least time together.
    pub fn for_samples(samples: u64, triangles: u64) -> Preset {
        if samples < triangles { Preset::Fast } else { Preset::Medium }
    }
}

/// How many triangles of meshes that could have a BLAS of their own are copied into a world BVH instead, each
/// counted as often as it is instanced. The smallest meshes come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlattenBudget {
    /// For meshes that are instanced more than once and stand still. Each triangle costs memory, and build time
    /// once.
    pub static_triangles: u64,
    /// For meshes that move. Each triangle costs build time in every frame.
    pub dynamic_triangles: u64,
}

impl Default for FlattenBudget {
    fn default() -> Self {
        FlattenBudget::DEFAULT
    }
}

impl FlattenBudget {
    /// The measured optimum: ray packets, which traverse world BVHs only, gain more than the copies cost.
    pub const DEFAULT: FlattenBudget =
        FlattenBudget { static_triangles: 1 << 20, dynamic_triangles: 1 << 18 };
    /// Gives every mesh that can have one a BLAS of its own.
    pub const ZERO: FlattenBudget = FlattenBudget { static_triangles: 0, dynamic_triangles: 0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thumbnails_of_large_models_are_built_fast() {
        assert_eq!(Preset::for_samples(64 * 64, 70_000), Preset::Fast);
        assert_eq!(Preset::for_samples(640 * 360, 70_000), Preset::Medium);
        assert_eq!(Preset::for_samples(0, 0), Preset::Medium);
    }
}
