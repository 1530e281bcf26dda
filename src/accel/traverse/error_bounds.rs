//! Rounding error bounds of the f32 ray–triangle test.
//!
//! With c = v₀ − o, e₁ = v₁ − v₀, e₂ = v₂ − v₀ and n = e₁×e₂, the edge functions are
//!
//! - u = d·(e₂×c), v = d·(c×e₁) and w = det − u − v, where det = d·n;
//! - a ray hits the triangle where u, v and w have one sign, at t = (c·n)/det. The product c·n is the *depth*.
//!
//! These edge-relative forms are uncertain over a far thinner strip along the edges than the textbook's d·(a×b),
//! whose vertices are both relative to the origin. With ε = 2⁻²³ and 2-norms, rounding is bounded by
//! |δu|, |δv| ≤ 5ε|d||e||c| and |δw| ≤ 12ε|d||e|(|c| + |e|/2). One more ε covers o and d, which may have been rounded
//! to f32 themselves.
//!
//! These bounds are relative. Below the smallest normal f32, a rounding error is absolute: 2⁻¹⁵⁰ for each product; sums
//! are exact there. It is covered as follows, with M the largest distance or coordinate:
//!
//! - u, v and w: a component of e×c is off by 2⁻¹⁴⁹, which d scales by |d|. The floor of 10⁻³⁴·max(|d|, 1) covers it.
//! - with d×e computed first, for a shared direction, the error is 3·2⁻¹⁴⁹·M < 5·10⁻⁴⁵·M. The relative bound is at least
//!   6ε·M·e > 8·10⁻⁴⁵·M, because `max_edge` is never below the smallest normal f32.
//! - the depth: n is off by 2⁻¹⁴⁹, and c·n by 3·2⁻¹⁴⁹·M. The depth is used only where the determinant is certain, beyond the
//!   floor; then e² > 10⁻³⁴, and the relative bound of 16ε·M·e² is at least 10⁻⁴⁰·M.
//!
//! Box tests need no such term: boxes are padded by 4·10⁻²⁰ at least ([`MIN_PADDING`]).
//!
//! Compare "Managing Rounding Error" in *Physically Based Rendering* (pbrt-v4, section 6.8).
//!
//! [`MIN_PADDING`]: crate::bvh::canonical_triangle::MIN_PADDING

use crate::traverse::exact_triangle_test::GRAZING_DETERMINANT;
use blinn_core::geometry::EPSILON;

/// w is scaled by this so that the bound on u and v holds for it, too.
pub(crate) const W_SCALE: f32 = 5.0 / 12.0;

/// Error bounds of the edge functions for one or more rays and all triangles of one BVH.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeFunctionBounds {
    /// The bound on u, v and scaled w is `edge·(per_edge + edge·per_area) + floor`.
    per_edge: f32,
    per_area: f32,
    /// Covers underflow (see the module).
    floor: f32,
    /// The bound on the depth is `edge²·(per_depth + edge·16ε) + floor`.
    per_depth: f32,
    /// Determinants beyond `edge²·per_determinant + floor` have a certain sign, and are not grazing
    /// ([`GRAZING_DETERMINANT`]).
    per_determinant: f32,
}

/// The error bounds for the triangles of one block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockErrorBounds {
    /// Bound on the error of u, v and scaled w.
    pub edge_function: f32,
    /// Bound on the error of the depth c·n.
    pub depth: f32,
    /// The sign of a determinant is certain beyond this.
    pub min_determinant: f32,
}

impl EdgeFunctionBounds {
    /// Bounds for directions no longer than `max_direction` and vertices no farther than `max_distance` from ray
    /// origins. `rounded_origin` is the magnitude of origins that were rounded to f32, or 0 where they were not.
    #[inline(always)]
    pub fn new(max_direction: f64, max_distance: f64, rounded_origin: f64) -> EdgeFunctionBounds {
        // Where f32 products could overflow, nothing is proven in f32 and all is left to f64. Edge functions are
        // products of two lengths; the depth is one of three, and intermediate results of c·n reach
        // 12·max_distance³. The depth is only used where the determinant is certain.
        let edge_functions_fit = max_direction.max(1.0) * max_distance.max(1e-6) * max_distance < 1e36;
        let depth_fits = edge_functions_fit && max_distance * max_distance * max_distance < 1e37;
        let epsilon = f64::from(EPSILON) * (1.0 + 1e-5);
        let k = 6.0 * epsilon * max_direction;
        let or_infinite = |x: f64, fits: bool| if fits { x as f32 } else { f32::INFINITY };
        EdgeFunctionBounds {
            per_edge: or_infinite(k * (max_distance + rounded_origin), edge_functions_fit),
            per_area: (0.5 * k) as f32,
            floor: (1e-34 * max_direction.max(1.0)) as f32,
            per_depth: or_infinite(16.0 * epsilon * (max_distance + rounded_origin), depth_fits),
            per_determinant: or_infinite(1.1 * GRAZING_DETERMINANT * max_direction, depth_fits),
        }
    }

    /// Bounds for triangles whose edges are no longer than `max_edge`.
    #[inline(always)]
    pub fn for_max_edge(&self, max_edge: f32) -> BlockErrorBounds {
        BlockErrorBounds {
            edge_function: max_edge * (self.per_edge + max_edge * self.per_area) + self.floor,
            depth: max_edge * max_edge * (self.per_depth + max_edge * (16.0 * EPSILON)) + self.floor,
            min_determinant: max_edge * max_edge * self.per_determinant + self.floor,
        }
    }
}
