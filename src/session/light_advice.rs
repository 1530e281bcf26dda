//! Advice about a picture that is too dark: the options that help, without those that are in force.

use std::fmt;

use blinn_core::geometry::Rgb;
use blinn_core::option_words::word_options;
use blinn_core::worded;
use blinn_scene::{LightSet, ResolvedLighting};

/// Facts about the light of a dark picture, from which advice follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightAdvice {
    /// True if some light is seen, so that a longer exposure and bounces show more of it.
    pub is_lit: bool,
    /// True if the exposure depends on the light already.
    pub is_metered: bool,
    /// True if light bounces between surfaces, in place of the ambient term.
    pub is_indirect: bool,
    /// True if the lights of the camera are in use.
    pub has_rig: bool,
    /// True if surfaces are on all sides of the camera: light from outside does not arrive.
    pub is_enclosed: bool,
    /// True if an environment lights the scene.
    pub has_environment: bool,
    /// True if there is an ambient term.
    pub has_ambient: bool,
}

impl LightAdvice {
    /// The advice about light that a picture or metering has not found.
    pub fn of_lighting(lit: &ResolvedLighting) -> LightAdvice {
        LightAdvice {
            has_rig: lit.sets.contains(&LightSet::ThreePoint),
            has_environment: lit.rig.sky.is_some() || lit.rig.environment.is_some(),
            has_ambient: lit.rig.ambient != Rgb::ZERO,
            ..LightAdvice::default()
        }
    }
}

impl fmt::Display for LightAdvice {
    /// Writes `` use `exposure auto`, `hdri studio` or `ambient` ``.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let LightAdvice { is_lit, is_metered, is_indirect, .. } = *self;
        let LightAdvice { has_rig, is_enclosed, has_environment, has_ambient, .. } = *self;
        let is_closed = !is_lit && is_enclosed;
        let options = [
            (is_closed, "`point-light` or `area-light` inside the scene"),
            (is_lit && !is_metered, "`exposure auto`"),
            (is_lit && !is_indirect, "`indirect 4`"),
            (!is_lit && !has_rig && !is_closed, "`lights three-point`"),
            (!has_environment && !is_closed, "`hdri studio`"),
            // Traced light takes its place.
            (!is_indirect && !has_ambient, "`ambient`"),
        ];
        let helpful: Vec<String> =
            options.into_iter().filter(|(helps, _)| *helps).map(|(_, names)| word_options(names)).collect();
        match helpful.split_last() {
            None => f.write_str(&worded!("use a greater `exposure` or `light-scale`")),
            Some((last, [])) => write!(f, "use {last}"),
            Some((last, others)) => write!(f, "use {} or {last}", others.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_in_force_are_not_advised() {
        let none = LightAdvice::default();
        let metered = LightAdvice { is_metered: true, ..none };
        for (advice, text) in [
            (metered, "use `lights three-point`, `hdri studio` or `ambient`"),
            (
                LightAdvice { is_lit: true, ..none },
                "use `exposure auto`, `indirect 4`, `hdri studio` or `ambient`",
            ),
            (
                LightAdvice { is_enclosed: true, ..metered },
                "use `point-light` or `area-light` inside the scene or `ambient`",
            ),
            (
                LightAdvice { has_rig: true, is_enclosed: true, is_indirect: true, ..none },
                "use `point-light` or `area-light` inside the scene",
            ),
            (
                LightAdvice {
                    is_lit: true,
                    is_metered: true,
                    is_indirect: true,
                    has_environment: true,
                    has_ambient: true,
                    has_rig: true,
                    is_enclosed: true,
                },
                "use a greater `exposure` or `light-scale`",
            ),
        ] {
            assert_eq!(advice.to_string(), text);
        }
    }
}
