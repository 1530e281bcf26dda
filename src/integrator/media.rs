//! The solids (bodies) of glass or liquid that a path is inside of.

use crate::geometry::Rgb;

/// The inside of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    /// Identifies the body.
    pub body: u32,
    /// Index of refraction.
    pub ior: f32,
    /// Absorption coefficient per metre, by colour: after t metres, exp(−σ t) of the light is left.
    pub absorption: Rgb,
}

/// Air, or whatever the camera is in.
const OUTSIDE: Medium = Medium { body: u32::MAX, ior: 1.0, absorption: Rgb::ZERO };

/// Maximum number of bodies that are inside each other; further ones are ignored.
const MAX_DEPTH: usize = 4;

/// The bodies around a path, in the order in which it entered them. The last one entered fills the space, so that a
/// liquid that overlaps its glass a little refracts once at their border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MediumStack {
    media: [Medium; MAX_DEPTH],
    depth: u8,
}

impl MediumStack {
    /// Outside of all bodies.
    pub const EMPTY: MediumStack = MediumStack { media: [OUTSIDE; MAX_DEPTH], depth: 0 };

    /// The medium that fills the space.
    pub fn current(&self) -> Medium {
        match self.depth {
            0 => OUTSIDE,
            depth => self.media[usize::from(depth) - 1],
        }
    }

    /// The bodies behind a surface of `medium`, which the path meets from the outside if it is `entering`.
    pub fn behind(mut self, medium: Medium, entering: bool) -> MediumStack {
        let depth = usize::from(self.depth);
        if entering {
            if depth < MAX_DEPTH {
                self.media[depth] = medium;
                self.depth += 1;
            }
            return self;
        }
        // The latest entry of this body.
        if let Some(i) = self.media[..depth].iter().rposition(|inside| inside.body == medium.body) {
            self.media.copy_within(i + 1..depth, i);
            self.depth -= 1;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(body: u32, ior: f32) -> Medium {
        Medium { body, ior, absorption: Rgb::ZERO }
    }

    #[test]
    fn a_liquid_that_overlaps_its_glass_refracts_once() {
        let [glass, liquid] = [medium(1, 1.5), medium(2, 1.33)];
        let in_glass = MediumStack::EMPTY.behind(glass, true);
        let in_both = in_glass.behind(liquid, true);
        assert_eq!(in_both.current(), liquid);
        let in_liquid = in_both.behind(glass, false);
        assert_eq!(in_liquid.current(), liquid, "the glass ends inside the liquid: nothing changes");
        assert_eq!(
            in_liquid.behind(liquid, false),
            MediumStack { depth: 0, ..in_liquid.behind(liquid, false) }
        );
        assert_eq!(in_liquid.behind(liquid, false).current(), OUTSIDE);
    }

    #[test]
    fn leaving_a_body_that_was_never_entered_changes_nothing() {
        let inside = MediumStack::EMPTY.behind(medium(3, 1.2), true);
        assert_eq!(inside.behind(medium(4, 2.0), false), inside);
        let full = (0..9).fold(MediumStack::EMPTY, |stack, i| stack.behind(medium(i, 1.5), true));
        assert_eq!(full.current().body, MAX_DEPTH as u32 - 1);
    }
}
