//! Transmittance of shadow rays through translucent surfaces.

use blinn_core::geometry::{Hit, Rgb};

/// A transmittance below this counts as zero.
const MIN_TRANSMITTANCE: f32 = 1.0 / (1 << 17) as f32;

/// A translucent surface on a shadow ray.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    hit: Hit,
    transmittance: Rgb,
    /// The absorption coefficient behind the surface minus that in front of it, per unit of t.
    absorption_step: Rgb,
}

/// The translucent surfaces that a shadow ray passes through, in the order in which traversal finds them.
#[derive(Clone, Debug)]
pub(crate) struct Transmittance {
    crossings: Vec<Crossing>,
    /// The product of all transmittances, in the order found.
    product: Rgb,
}

impl Default for Transmittance {
    fn default() -> Self {
        Transmittance { crossings: Vec::new(), product: Rgb::ONE }
    }
}

impl Transmittance {
    /// Resets to a ray that passes through nothing.
    pub fn clear(&mut self) {
        self.crossings.clear();
        self.product = Rgb::ONE;
    }

    /// Multiplies by the transmittance of a surface, at which the absorption coefficient changes by `absorption_step`.
    /// Returns true if no light is left, whatever else the ray passes through.
    pub fn attenuate(&mut self, hit: Hit, transmittance: Rgb, absorption_step: Rgb) -> bool {
        if transmittance != Rgb::ONE || absorption_step != Rgb::ZERO {
            self.crossings.push(Crossing { hit, transmittance, absorption_step });
            self.product *= transmittance;
        }
        // The product in another order differs by rounding only, by far less than a factor of two.
        self.product.max_element() < 0.5 * MIN_TRANSMITTANCE
    }

    /// Returns the transmittance of the whole ray, which ends at `t_max`. Surfaces are sorted first, because a product of
    /// floats depends on the order of its factors, and the result must not depend on the order in which a BVH finds them.
    pub fn of_ray(&mut self, t_max: f32) -> Rgb {
        let order = |a: &Hit, b: &Hit| a.t.total_cmp(&b.t).then(a.id.cmp(&b.id));
        self.crossings.sort_unstable_by(|a, b| order(&a.hit, &b.hit));
        let product = self.crossings.iter().fold(Rgb::ONE, |product, c| product * c.transmittance);
        let left = product * exp_minus(self.optical_depth(t_max));
        if left.max_element() < MIN_TRANSMITTANCE { Rgb::ZERO } else { left }
    }

    /// The integral of the absorption coefficient over t. The medium at the ray's start is unknown: what the ray leaves more
    /// often than it enters has been there from t = 0 on.
    fn optical_depth(&self, t_max: f32) -> Rgb {
        let (mut depth, mut at_end) = (Rgb::ZERO, Rgb::ZERO);
        for crossing in &self.crossings {
            depth -= crossing.absorption_step * crossing.hit.t;
            at_end += crossing.absorption_step;
        }
        // The end of a ray without end is outside of everything, although open meshes look different.
        if t_max.is_finite() { depth + at_end.max(Rgb::ZERO) * t_max } else { depth }
    }
}

/// e^−x for each channel; 1 where x ≤ 0.
fn exp_minus(x: Rgb) -> Rgb {
    let exp = |x: f32| if x > 0.0 { libm::expf(-x) } else { 1.0 };
    Rgb::new(exp(x.x), exp(x.y), exp(x.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::HitId;

    fn transmittance(crossings: &[(f32, f32)], t_max: f32) -> f32 {
        let mut ray = Transmittance::default();
        for (i, &(t, step)) in crossings.iter().enumerate() {
            let id = HitId { instance: 0, triangle: i as u32 };
            assert!(!ray.attenuate(Hit { t, id }, Rgb::ONE, Rgb::splat(step)));
        }
        ray.of_ray(t_max).x
    }

    #[test]
    fn media_absorb_by_the_distance_inside() {
        let exp = |x: f32| libm::expf(-x);
        let cases: [(&str, &[(f32, f32)], f32, f32); 6] = [
            ("outside", &[], 1.0, 1.0),
            ("through", &[(0.25, 2.0), (0.75, -2.0)], 1.0, exp(1.0)),
            ("found in another order", &[(0.75, -2.0), (0.25, 2.0)], 1.0, exp(1.0)),
            ("from the inside", &[(0.5, -2.0)], f32::INFINITY, exp(1.0)),
            ("to the inside", &[(0.5, 2.0)], 1.0, exp(1.0)),
            ("an open surface to a sun", &[(0.5, 2.0)], f32::INFINITY, 1.0),
        ];
        for (name, crossings, t_max, expected) in cases {
            let got = transmittance(crossings, t_max);
            assert!((got - expected).abs() < 1e-6, "{name}: {got}, not {expected}");
        }
    }
}
