//! Options of materials and of the visible objects.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::edge_options::EdgeOptions;
use crate::options::BackFaceCulling;
use crate::round_sizes::RoundWidth;
use crate::values::{self, whole};
use blinn_render::HiddenEdges;
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

const HIDDEN_EDGES: Choices<HiddenEdges, 3> =
    [("off", HiddenEdges::Off), ("dashed", HiddenEdges::Dashed), ("faint", HiddenEdges::Faint)];

pub static SHADING: &[OptionDef] = &[
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
               `background`. Unlit materials, points and lines show it",
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
        name: "edges",
        value_name: "KINDS",
        is_repeatable: true,
        help: "Draw edges over the picture: feature (sharp edges and borders), silhouette, boundary (borders of open \
               surfaces), all (of polygons), or several as a list\n\n\
               Edges change the picture and no layers. Transparent surfaces do not hide them.",
        effect: Effect::Value(|options, text| options.edges.add_kinds(text)),
        ..BASE
    },
    OptionDef {
        name: "edge-angle",
        value_name: "DEGREES",
        requires: Some("edges"),
        help: "Angle by which the surface turns at sharp edges, at least; 30 by default",
        effect: Effect::Value(|options, text| {
            store(&mut options.edges.angle, EdgeOptions::parse_angle(text))
        }),
        ..BASE
    },
    OptionDef {
        name: "edge-color",
        value_name: "COLOR",
        requires: Some("edges"),
        help: "Colour of edges: as for `background`; by default the colour that a glTF file has for them, or black",
        effect: Effect::Value(|options, text| store(&mut options.edges.color, values::color(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "edge-width",
        value_name: "WIDTH",
        requires: Some("edges"),
        help: "Width of edges: pixels such as 2px, metres such as .01, or auto (the default) for a pixel; at most 100 pixels",
        effect: Effect::Value(|options, text| {
            store(&mut options.edges.width, EdgeOptions::parse_width(text))
        }),
        ..BASE
    },
    OptionDef {
        name: "hidden-edges",
        value_name: "STYLE",
        choices: &names(&HIDDEN_EDGES),
        requires: Some("edges"),
        help: "Edges behind surfaces: not drawn (off, the default), as dashes (dashed), or transparent (faint)",
        effect: Effect::Value(|options, text| choose(&mut options.edges.hidden, text, &HIDDEN_EDGES)),
        ..BASE
    },
    OptionDef {
        name: "edges-only",
        requires: Some("edges"),
        help: "Draw the edges alone, on a transparent background unless `background` sets one",
        effect: Effect::Flag(|options| options.edges.alone = true),
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
