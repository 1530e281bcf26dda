//! Angular falloff of spot lights: KHR_lights_punctual's and Blender's.

/// The cone of a spot light. The falloff is a polynomial of
/// s = (cos − cos_outer) / width, clamped to 0…1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCone {
    /// Cosine of the outer half angle, beyond which the light is 0.
    pub cos_outer: f32,
    /// Difference of cosines over which the light rises to full intensity.
    pub width: f32,
    /// The falloff is s²(falloff[0] + falloff[1]·s).
    falloff: [f32; 2],
}

impl SpotCone {
    /// No cone: emits in all directions.
    pub(super) const NONE: SpotCone = SpotCone { cos_outer: -2.0, width: 0.0, falloff: [1.0, 0.0] };

    /// Returns KHR_lights_punctual's cone, s², from its half angles in radians.
    pub fn new(inner: f32, outer: f32) -> SpotCone {
        let cos_outer = libm::cosf(outer);
        SpotCone { cos_outer, width: libm::cosf(inner) - cos_outer, falloff: [1.0, 0.0] }
    }

    /// Returns Blender's cone, smoothstep(s), from the half angles that its exporter writes: `inner` is
    /// `outer·(1 − blend)`. The width is the blend's share of the cosines within the cone.
    pub fn blender(inner: f32, outer: f32) -> SpotCone {
        let cos_outer = libm::cosf(outer);
        let blend = if outer > 0.0 { 1.0 - inner / outer } else { 0.0 };
        SpotCone { cos_outer, width: (1.0 - cos_outer) * blend, falloff: [3.0, -2.0] }
    }

    /// Returns the falloff, 0…1, for the cosine of an angle to the axis. Equal half angles give a step,
    /// as Blender writes them.
    #[inline(always)]
    pub fn falloff(&self, cos_angle: f32) -> f32 {
        let step = if cos_angle >= self.cos_outer { 1.0 } else { 0.0 };
        let s = ((cos_angle - self.cos_outer) / self.width).clamp(0.0, 1.0);
        if self.width <= 0.0 { step } else { s * s * (self.falloff[0] + self.falloff[1] * s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_falls_off_between_the_half_angles_and_equal_angles_are_a_step() {
        let cone = SpotCone::new(0.5, 1.0);
        assert_eq!(cone.falloff(0.999), 1.0);
        assert_eq!(cone.falloff(0.5), 0.0);
        let middle = cone.cos_outer + 0.5 * cone.width;
        assert!((cone.falloff(middle) - 0.25).abs() < 1e-6);
        let step = SpotCone::new(0.7, 0.7);
        assert_eq!((step.falloff(0.9), step.falloff(0.5)), (1.0, 0.0));
    }

    /// Blender 5.0: smoothstep((cos − cos_outer) / ((1 − cos_outer)·blend)).
    #[test]
    fn blenders_cones_fall_off_as_in_blender() {
        let (outer, blend) = (0.5f32, 0.4);
        let cone = SpotCone::blender(outer * (1.0 - blend), outer);
        for degrees in 0..40 {
            let cos = libm::cosf((degrees as f32).to_radians());
            let s = ((cos - libm::cosf(outer)) / ((1.0 - libm::cosf(outer)) * blend)).clamp(0.0, 1.0);
            assert!((cone.falloff(cos) - s * s * (3.0 - 2.0 * s)).abs() < 1e-5, "{degrees}");
        }
        let step = SpotCone::blender(0.7, 0.7);
        assert_eq!((step.falloff(0.9), step.falloff(0.5)), (1.0, 0.0));
    }
}
