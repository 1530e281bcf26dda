//! The solids (bodies) of glass or liquid that a path is inside of.

use blinn_core::geometry::Rgb;

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

/// The space around all bodies, where eye rays start.
const OUTSIDE: Medium = Medium { body: u32::MAX, ior: 1.0, absorption: Rgb::ZERO };

/// Maximum number of nested bodies; further ones are ignored.
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

    /// Crosses a surface of `medium`, which the path meets from the outside if it is `entering`.
    ///
    /// A body counts once: where parts of it overlap, the first part that is left ends it. The surfaces inside still refract,
    /// from what is around the body to the body or back, as they do in Blender.
    pub fn cross(mut self, medium: Medium, entering: bool) -> Crossing {
        let depth = usize::from(self.depth);
        let before = self.current();
        let inside = self.media[..depth].iter().position(|inside| inside.body == medium.body);
        let around = inside.map_or(self, |i| self.without(i));
        if entering {
            let front = around.current();
            if inside.is_none() && depth < MAX_DEPTH {
                self.media[depth] = medium;
                self.depth += 1;
            }
            return Crossing { behind: self, eta: f64::from(medium.ior) / f64::from(front.ior) };
        }
        let front = if inside.is_some() { before } else { medium };
        Crossing { behind: around, eta: f64::from(around.current().ior) / f64::from(front.ior) }
    }

    /// The bodies except for number `i`.
    fn without(mut self, i: usize) -> MediumStack {
        self.media.copy_within(i + 1..usize::from(self.depth), i);
        self.depth -= 1;
        self
    }
}

/// A surface of a body that a path crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// The bodies behind the surface.
    pub behind: MediumStack,
    /// Index of refraction behind the surface over that in front of it.
    pub eta: f64,
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
        let in_glass = MediumStack::EMPTY.cross(glass, true).behind;
        let into_liquid = in_glass.cross(liquid, true);
        assert_eq!(into_liquid.behind.current(), liquid);
        assert_eq!(into_liquid.eta, f64::from(1.33f32) / 1.5);
        let in_liquid = into_liquid.behind.cross(glass, false);
        assert_eq!(in_liquid.behind.current(), liquid);
        assert_eq!(in_liquid.eta, 1.0, "the glass ends inside the liquid: nothing changes");
        let out = in_liquid.behind.cross(liquid, false);
        assert_eq!(out.behind.depth, 0);
        assert_eq!(out.behind.current(), OUTSIDE);
    }

    /// The eyes of Blender's monkey are parts of its mesh that reach into the head.
    #[test]
    fn overlapping_parts_of_a_body_refract_as_in_blender() {
        let glass = medium(1, 1.5);
        let head = MediumStack::EMPTY.cross(glass, true);
        let eye = head.behind.cross(glass, true);
        assert_eq!((eye.behind, eye.eta), (head.behind, 1.5), "it is entered once, and refracts twice");
        let left_eye = eye.behind.cross(glass, false);
        assert_eq!((left_eye.behind.current(), left_eye.eta), (OUTSIDE, 1.0 / 1.5));
        let left_head = left_eye.behind.cross(glass, false);
        assert_eq!((left_head.behind.current(), left_head.eta), (OUTSIDE, 1.0 / 1.5));
    }

    /// In water, the parts refract between glass and water.
    #[test]
    fn overlapping_parts_see_what_is_around_their_body() {
        let [water, glass] = [medium(1, 1.33), medium(2, 1.5)];
        let in_water = MediumStack::EMPTY.cross(water, true).behind;
        let eye = in_water.cross(glass, true).behind.cross(glass, true);
        assert_eq!(eye.eta, 1.5 / f64::from(1.33f32));
    }

    #[test]
    fn leaving_a_body_that_was_never_entered_leaves_the_others() {
        let inside = MediumStack::EMPTY.cross(medium(3, 1.2), true).behind;
        assert_eq!(inside.cross(medium(4, 2.0), false).behind, inside);
        let full = (0..9).fold(MediumStack::EMPTY, |stack, i| stack.cross(medium(i, 1.5), true).behind);
        assert_eq!(full.current().body, MAX_DEPTH as u32 - 1);
    }
}
