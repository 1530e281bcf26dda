//! Transmittance of shadow rays through translucent surfaces.

use crate::geometry::{Hit, Rgb};

/// A transmittance below this counts as zero.
const MIN_TRANSMITTANCE: f32 = 1.0 / (1 << 17) as f32;

/// The translucent surfaces that a shadow ray passes through, in the order in which traversal finds them.
#[derive(Clone, Debug)]
pub(crate) struct Transmittance {
    surfaces: Vec<(Hit, Rgb)>,
    /// The product of all transmittances, in the order found.
    product: Rgb,
}

impl Default for Transmittance {
    fn default() -> Self {
        Transmittance { surfaces: Vec::new(), product: Rgb::ONE }
    }
}

impl Transmittance {
    /// Resets to a ray that passes through nothing.
    pub fn clear(&mut self) {
        self.surfaces.clear();
        self.product = Rgb::ONE;
    }

    /// Multiplies by the transmittance of a surface. Returns true where no light is left, whatever else the ray
    /// passes through.
    pub fn attenuate(&mut self, hit: Hit, transmittance: Rgb) -> bool {
        if transmittance != Rgb::ONE {
            self.surfaces.push((hit, transmittance));
            self.product *= transmittance;
        }
        // The product in another order differs by rounding only, by far less than a factor of two.
        self.product.max_element() < 0.5 * MIN_TRANSMITTANCE
    }

    /// Returns the transmittance of the whole ray. Surfaces are sorted first, because a product of floats depends on
    /// the order of its factors, and the result must not depend on the order in which a BVH finds them.
    pub fn sorted_product(&mut self) -> Rgb {
        self.surfaces.sort_unstable_by(|(a, _), (b, _)| a.t.total_cmp(&b.t).then(a.id.cmp(&b.id)));
        let product =
            self.surfaces.iter().fold(Rgb::ONE, |product, (_, transmittance)| product * *transmittance);
        if product.max_element() < MIN_TRANSMITTANCE { Rgb::ZERO } else { product }
    }
}
