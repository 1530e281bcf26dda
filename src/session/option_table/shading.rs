//! Options of materials and of the visible objects.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::options::BackFaceCulling;
use crate::round_sizes::RoundWidth;
use crate::values::{self, whole};
use blinn_render::integrator::Stage;

const BASE: OptionDef = OptionDef { heading: Heading::Shading, ..OptionDef::BASE };

const INTEGRATORS: Choices<Stage, 4> = [
    ("phong", Stage::Phong),
    ("shadow", Stage::Shadow),
    ("diffuse", Stage::Diffuse),
    ("color", Stage::Color),
];
const CULLING: Choices<BackFaceCulling, 3> =
    [("auto", BackFaceCulling::SingleSided), ("back", BackFaceCulling::All), ("off", BackFaceCulling::Off)];

pub static SHADING: [OptionDef; 10] = [
    OptionDef {
        name: "integrator",
        value_name: "INTEGRATOR",
        choices: &names(&INTEGRATORS),
        default: Some("phong"),
        help: "Terms of the lecture's shading: color (unlit), diffuse (Lambert), shadow (Lambert with shadows), phong (all)",
        effect: Effect::Value(|options, text| choose(&mut options.stage, text, &INTEGRATORS)),
        ..BASE
    },
    OptionDef {
        name: "kd",
        value_name: "COLOR",
        help: "Diffuse coefficient k_d of all materials: R,G,B or one number, linear; or a displayed colour, as for \
               `background`",
        effect: Effect::Value(|options, text| {
            store(&mut options.overrides.k_d, values::color(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "ks",
        value_name: "COLOR",
        help: "Specular coefficient k_s of all materials: as `kd`",
        effect: Effect::Value(|options, text| {
            store(&mut options.overrides.k_s, values::color(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "shininess",
        value_name: "P",
        help: "Specular exponent p of all materials",
        effect: Effect::Value(|options, text| {
            store(&mut options.overrides.shininess, values::positive(text).map(|p| Some(p as f32)))
        }),
        ..BASE
    },
    OptionDef {
        name: "only-objects",
        value_name: "GLOB",
        help: "Render only the objects that match GLOB, and their children (repeatable)\n\n\
               GLOB matches names, or paths from the root such as car/wheels/*.",
        is_repeatable: true,
        effect: Effect::Value(|options, text| {
            options.selection.only.push(values::glob(text)?);
            Ok(())
        }),
        ..BASE
    },
    OptionDef {
        name: "hide",
        value_name: "GLOB",
        help: "Hide the objects and lights that match GLOB (repeatable)",
        is_repeatable: true,
        effect: Effect::Value(|options, text| {
            options.selection.hide.push(values::glob(text)?);
            Ok(())
        }),
        ..BASE
    },
    OptionDef {
        name: "bounces",
        value_name: "N",
        // DEFAULT_BOUNCES of the renderer; a test compares them.
        default: Some("4"),
        help: "Maximum reflections along a path, and three times as many surfaces of glass; 0 disables reflections and \
               refraction",
        effect: Effect::Value(|options, text| store(&mut options.bounces, whole(text, 0..=64))),
        ..BASE
    },
    OptionDef {
        name: "point-size",
        value_name: "SIZE",
        default: Some("auto"),
        help: "Diameter of points: pixels such as 3px, metres such as .01, auto for what closes the gaps of the cloud, or off",
        effect: Effect::Value(|options, text| store(&mut options.point_size, RoundWidth::parse(text))),
        ..BASE
    },
    OptionDef {
        name: "line-width",
        value_name: "WIDTH",
        default: Some("auto"),
        help: "Width of lines: pixels such as 2px, metres such as .01, auto for a pixel, or off",
        effect: Effect::Value(|options, text| store(&mut options.line_width, RoundWidth::parse(text))),
        ..BASE
    },
    OptionDef {
        name: "cull",
        value_name: "CULL",
        choices: &names(&CULLING),
        default: Some("auto"),
        help: "Back faces that the camera sees through: those of single-sided materials (auto), of all materials (back), \
               or none (off)\n\n\
               OBJ materials are double-sided. back removes the backs of doubled faces, and shows rooms from outside.",
        effect: Effect::Value(|options, text| choose(&mut options.cull, text, &CULLING)),
        ..BASE
    },
];
