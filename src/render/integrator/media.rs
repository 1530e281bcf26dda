//! The solids (bodies) of glass or liquid that a path is inside of.

use blinn_core::geometry::Rgb;

/// The inside of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    /// Identifies the body.
    pub body: u32,
    /// Index of refraction, in green light.
    pub ior: f32,
    /// Its decrease in red light and its increase in blue light (KHR_materials_dispersion).
    pub half_spread: f32,
    /// Absorption coefficient per metre, by colour: after t metres, exp(−σ t) of the light is left.
    pub absorption: Rgb,
}

/// The share of light that is left behind an optical depth (Beer-Lambert law), by colour.
pub(crate) fn beer_lambert(depth: Rgb) -> Rgb {
    Rgb::from_array(depth.to_array().map(|x| if x > 0.0 { libm::expf(-x) } else { 1.0 }))
}

/// The colours of light that a ray carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Wavelength {
    /// All three.
    #[default]
    White,
    /// One channel: 0 for red, 1 for green, 2 for blue.
    Channel(u8),
}

impl Wavelength {
    /// One of each channel.
    pub const CHANNELS: [Wavelength; 3] =
        [Wavelength::Channel(0), Wavelength::Channel(1), Wavelength::Channel(2)];

    /// White light of these colours.
    pub fn mask(self) -> Rgb {
        match self {
            Wavelength::White => Rgb::ONE,
            Wavelength::Channel(0) => Rgb::X,
            Wavelength::Channel(1) => Rgb::Y,
            Wavelength::Channel(_) => Rgb::Z,
        }
    }
}

impl Medium {
    /// The index of refraction for light of a wavelength, at least 1.
    fn ior_at(&self, wavelength: Wavelength) -> f64 {
        let ior = match wavelength {
            Wavelength::White | Wavelength::Channel(1) => self.ior,
            Wavelength::Channel(0) => (self.ior - self.half_spread).max(self.ior.min(1.0)),
            Wavelength::Channel(_) => self.ior + self.half_spread,
        };
        f64::from(ior)
    }
}

/// The space around all bodies, where eye rays start.
const OUTSIDE: Medium = Medium { body: u32::MAX, ior: 1.0, half_spread: 0.0, absorption: Rgb::ZERO };

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
    pub fn cross(mut self, medium: Medium, entering: bool, wavelength: Wavelength) -> Crossing {
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
            return Crossing::new(front, medium, self, wavelength);
        }
        let front = if inside.is_some() { before } else { medium };
        Crossing::new(front, around.current(), around, wavelength)
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
    /// True if `eta` depends on the wavelength.
    pub disperses: bool,
}

impl Crossing {
    /// A surface between the media `front` and `back`.
    fn new(front: Medium, back: Medium, behind: MediumStack, wavelength: Wavelength) -> Crossing {
        Crossing {
            behind,
            eta: back.ior_at(wavelength) / front.ior_at(wavelength),
            disperses: front.half_spread > 0.0 || back.half_spread > 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(body: u32, ior: f32) -> Medium {
        Medium { body, ior, half_spread: 0.0, absorption: Rgb::ZERO }
    }

    #[test]
    fn a_liquid_that_overlaps_its_glass_refracts_once() {
        let [glass, liquid] = [medium(1, 1.5), medium(2, 1.33)];
        let in_glass = MediumStack::EMPTY.cross(glass, true, Wavelength::White).behind;
        let into_liquid = in_glass.cross(liquid, true, Wavelength::White);
        assert_eq!(into_liquid.behind.current(), liquid);
        assert_eq!(into_liquid.eta, f64::from(1.33f32) / 1.5);
        let in_liquid = into_liquid.behind.cross(glass, false, Wavelength::White);
        assert_eq!(in_liquid.behind.current(), liquid);
        assert_eq!(in_liquid.eta, 1.0, "the glass ends inside the liquid: nothing changes");
        let out = in_liquid.behind.cross(liquid, false, Wavelength::White);
        assert_eq!(out.behind.depth, 0);
        assert_eq!(out.behind.current(), OUTSIDE);
    }

    /// The eyes of Blender's monkey are parts of its mesh that reach into the head.
    #[test]
    fn overlapping_parts_of_a_body_refract_as_in_blender() {
        let glass = medium(1, 1.5);
        let head = MediumStack::EMPTY.cross(glass, true, Wavelength::White);
        let eye = head.behind.cross(glass, true, Wavelength::White);
        assert_eq!((eye.behind, eye.eta), (head.behind, 1.5), "it is entered once, and refracts twice");
        let left_eye = eye.behind.cross(glass, false, Wavelength::White);
        assert_eq!((left_eye.behind.current(), left_eye.eta), (OUTSIDE, 1.0 / 1.5));
        let left_head = left_eye.behind.cross(glass, false, Wavelength::White);
        assert_eq!((left_head.behind.current(), left_head.eta), (OUTSIDE, 1.0 / 1.5));
    }

    /// In water, the parts refract between glass and water.
    #[test]
    fn overlapping_parts_see_what_is_around_their_body() {
        let [water, glass] = [medium(1, 1.33), medium(2, 1.5)];
        let in_water = MediumStack::EMPTY.cross(water, true, Wavelength::White).behind;
        let eye = in_water.cross(glass, true, Wavelength::White).behind.cross(glass, true, Wavelength::White);
        assert_eq!(eye.eta, 1.5 / f64::from(1.33f32));
    }

    #[test]
    fn leaving_a_body_that_was_never_entered_leaves_the_others() {
        let inside = MediumStack::EMPTY.cross(medium(3, 1.2), true, Wavelength::White).behind;
        assert_eq!(inside.cross(medium(4, 2.0), false, Wavelength::White).behind, inside);
        let full = (0..9)
            .fold(MediumStack::EMPTY, |stack, i| stack.cross(medium(i, 1.5), true, Wavelength::White).behind);
        assert_eq!(full.current().body, MAX_DEPTH as u32 - 1);
    }

    /// At an Abbe number of 20, a dispersion of 1, the indices of red and blue light differ by (n − 1)/20.
    #[test]
    fn indices_depend_on_the_wavelength() {
        let flint = Medium { half_spread: 0.015, ..medium(1, 1.6) };
        let eta = |wavelength| MediumStack::EMPTY.cross(flint, true, wavelength);
        let [red, green, blue] = Wavelength::CHANNELS.map(|wavelength| eta(wavelength).eta);
        assert!(eta(Wavelength::White).disperses && green == eta(Wavelength::White).eta);
        assert!(((green - 1.0) / (blue - red) - 20.0).abs() < 1e-3, "{red} {green} {blue}");
        let back = eta(Wavelength::White).behind.cross(flint, false, Wavelength::Channel(2));
        assert!((back.eta * blue - 1.0).abs() < 1e-12);
        assert!(!MediumStack::EMPTY.cross(medium(1, 1.6), true, Wavelength::White).disperses);
        let vast = Medium { half_spread: 3.0, ..flint };
        assert_eq!(MediumStack::EMPTY.cross(vast, true, Wavelength::Channel(0)).eta, 1.0);
    }
}
