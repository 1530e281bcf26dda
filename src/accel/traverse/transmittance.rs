//! How much light is left of a segment's behind what it passes through.

use crate::accel::traverse::query::RayContext;
use crate::geometry::{Hit, Rgb};

/// Less than this share of a light is none.
const DARK: f32 = 1.0 / (1 << 17) as f32;

/// The translucent surfaces on a segment, in the order that they are found in.
#[derive(Clone, Debug)]
pub(crate) struct Transmittance {
    found: Vec<(Hit, Rgb)>,
    /// What they all let through, but for rounding.
    left: Rgb,
}

impl Default for Transmittance {
    fn default() -> Self {
        Transmittance { found: Vec::new(), left: Rgb::ONE }
    }
}

impl Transmittance {
    /// Begins anew.
    pub fn clear(&mut self) {
        self.found.clear();
        self.left = Rgb::ONE;
    }

    /// Takes a surface in. True where nothing is left, whatever else there may be.
    pub fn pass(&mut self, hit: Hit, asked: RayContext<'_>) -> bool {
        let passes = asked.cutouts.transmittance(hit.id, asked.o, asked.d);
        if passes != Rgb::ONE {
            self.found.push((hit, passes));
            self.left *= passes;
        }
        // What comes out of rounding in another order is not twice as much.
        self.left.max_element() < 0.5 * DARK
    }

    /// What is left behind all of them. They are sorted first: products of floats depend on their order,
    /// and the order in which a tree finds them must not show.
    pub fn light(&mut self) -> Rgb {
        self.found.sort_unstable_by(|(a, _), (b, _)| a.t.total_cmp(&b.t).then(a.id.cmp(&b.id)));
        let light = self.found.iter().fold(Rgb::ONE, |light, (_, passes)| light * *passes);
        if light.max_element() < DARK { Rgb::ZERO } else { light }
    }
}
