//! Units of the light intensities in files, and their conversion to the lecture's.

use super::{LightKind, Source};

/// Luminous efficacy in lumens per watt, by which Blender's exporter converts.
pub const LUMENS_PER_WATT: f64 = 683.0;

/// The unit of a file's light intensities.
///
/// The lecture's k_d has no factor 1/π, so photometric and radiometric values are divided by π. Then
/// k_d·(I/r²)·n·l is the physical radiance ρ/π·E.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize)]
pub enum LightUnits {
    /// The unit that the file names, else `Standard` for files written by Blender, `Unitless` for others.
    #[default]
    Auto,
    /// Candela and lux: v/(683π).
    Standard,
    /// W/sr and W/m²: v/π.
    Unitless,
    /// Blender's watts: v/(4π²) for point and spot lights, v/π for suns.
    Raw,
}

impl LightUnits {
    /// Replaces `Auto` by the unit for files from `source`.
    pub fn resolve(self, source: &Source) -> LightUnits {
        match self {
            LightUnits::Auto => source.light_units.unwrap_or(match source.is_blender() {
                true => LightUnits::Standard,
                false => LightUnits::Unitless,
            }),
            given => given,
        }
    }

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            LightUnits::Auto => "auto",
            LightUnits::Standard => "standard",
            LightUnits::Unitless => "unitless",
            LightUnits::Raw => "raw",
        }
    }

    /// Returns true if the light intensities of a file from `source`, with these units, are photometric: candela, lux and
    /// nits, as glTF has them, unless the file names another unit or these units do.
    pub fn is_photometric(self, source: &Source) -> bool {
        match self {
            LightUnits::Auto => source.light_units.is_none_or(|units| units == LightUnits::Standard),
            given => given == LightUnits::Standard,
        }
    }

    /// Returns the factor from a file's value to the lecture's I, or to E for a directional light.
    pub fn factor(self, kind: LightKind) -> f32 {
        use std::f64::consts::PI;
        let factor = match (self, kind) {
            (LightUnits::Standard, _) => 1.0 / (LUMENS_PER_WATT * PI),
            (LightUnits::Raw, LightKind::Point | LightKind::Spot { .. } | LightKind::Photometric { .. }) => {
                1.0 / (4.0 * PI * PI)
            }
            _ => 1.0 / PI,
        };
        factor as f32
    }

    /// Returns the factor from the radiance of an area light in a file to that of the scene.
    pub fn radiance_factor(self) -> f32 {
        match self {
            LightUnits::Standard => (1.0 / LUMENS_PER_WATT) as f32,
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// glTF's own units are photometric, whoever wrote the file. Others are named.
    #[test]
    fn units_without_a_name_are_photometric() {
        let named = |light_units| Source { light_units, ..Source::default() };
        assert!(LightUnits::Auto.is_photometric(&named(None)));
        assert!(LightUnits::Auto.is_photometric(&named(Some(LightUnits::Standard))));
        for radiometric in [LightUnits::Unitless, LightUnits::Raw] {
            assert!(!LightUnits::Auto.is_photometric(&named(Some(radiometric))));
            assert!(!radiometric.is_photometric(&named(None)));
        }
    }

    #[test]
    fn blenders_export_modes_give_the_same_intensity() {
        // A lamp of 1,000 W: 54,351 cd in Standard, 1,000 in Raw, 1,000/4π in Unitless.
        let by = |units: LightUnits, v: f64| v as f32 * units.factor(LightKind::Point);
        let expected = (1000.0 / (4.0 * std::f64::consts::PI.powi(2))) as f32;
        let standard = 1000.0 * 683.0 / (4.0 * std::f64::consts::PI);
        for (units, v) in [
            (LightUnits::Standard, standard),
            (LightUnits::Raw, 1000.0),
            (LightUnits::Unitless, standard / 683.0),
        ] {
            assert!((by(units, v) / expected - 1.0).abs() < 1e-5, "{units:?}");
        }
    }
}
