//! Options of light sources, shadows and environments.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::options::{EnvironmentSource, Options};
use crate::values;
use blinn_scene::{GroundKind, LightUnits, UserLight};

const BASE: OptionDef = OptionDef { heading: Heading::Lights, ..OptionDef::BASE };

const UNITS: Choices<LightUnits, 4> = [
    ("auto", LightUnits::Auto),
    ("standard", LightUnits::Standard),
    ("unitless", LightUnits::Unitless),
    ("raw", LightUnits::Raw),
];
const GROUNDS: Choices<Option<GroundKind>, 2> =
    [("shadow", Some(GroundKind::ShadowCatcher)), ("plane", Some(GroundKind::Plane))];

pub static LIGHTS: &[OptionDef] = &[
    OptionDef {
        name: "lights",
        value_name: "LIST",
        help: "Light sources: file, headlight, three-point (a list), or none [default: file, else three-point]\n\n\
               Surfaces of the file that glow brighter than white are among its lights.",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.sets, values::lights(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "point-light",
        value_name: "X,Y,Z,I[,COLOR]",
        help: "Add a point light at X,Y,Z with intensity I (repeatable)",
        is_repeatable: true,
        effect: Effect::Value(|options, text| add_light(options, values::point_light(text)?)),
        ..BASE
    },
    OptionDef {
        name: "sun",
        value_name: "DX,DY,DZ,E[,COLOR]",
        help: "Add a directional light that travels along DX,DY,DZ with irradiance E (repeatable)",
        is_repeatable: true,
        effect: Effect::Value(|options, text| add_light(options, values::sun(text)?)),
        ..BASE
    },
    OptionDef {
        name: "area-light",
        value_name: "X,Y,Z,DX,DY,DZ,W,H,L[,COLOR]",
        help: "Add an area light at X,Y,Z that faces DX,DY,DZ, W by H metres, with radiance L (repeatable)\n\n\
               It emits on the side that it faces, and its lower edge is horizontal. Reflections show it, the camera does \
               not.",
        is_repeatable: true,
        effect: Effect::Value(|options, text| add_light(options, values::area_light(text)?)),
        ..BASE
    },
    OptionDef {
        name: "light-units",
        value_name: "LIGHT_UNITS",
        choices: &names(&UNITS),
        default: Some("auto"),
        help: "Unit of the file's light intensities, named as Blender's glTF export names them: `standard` is candela, lux \
               and nits (683 lm/W), `unitless` W/sr and W/m², `raw` Blender's watts. `auto` takes the unit that the file \
               names, else `standard` for files from Blender and `unitless` for others",
        effect: Effect::Value(|options, text| choose(&mut options.lighting.units, text, &UNITS)),
        ..BASE
    },
    OptionDef {
        name: "light-scale",
        value_name: "F",
        help: "Multiply the intensity of the file's lights by F [default: 1]",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.scale, values::positive(text).map(|scale| scale as f32))
        }),
        ..BASE
    },
    OptionDef {
        name: "ambient",
        value_name: "COLOR",
        help: "Ambient light I_a: R,G,B or one number, linear; or a displayed colour, as for `background`",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.ambient, values::color(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "light-radius",
        value_name: "R",
        help: "Soft shadows: radius of the lights in metres, 0 for hard shadows [default: that of \
               the file's lights, else 0]\n\n\
               Point and spot lights are discs that face the shaded point; suns are discs at a distance of 1 m, with \
               R = 0.0047 for the real sun.",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.radius, values::radius(text).map(|radius| Some(radius as f32)))
        }),
        ..BASE
    },
    OptionDef {
        name: "ao",
        value_name: "SAMPLES[,DISTANCE]",
        help: "Ambient occlusion with SAMPLES rays per pixel, up to DISTANCE metres or inf [default DISTANCE: a quarter \
               of the scene's diagonal]\n\n\
               Without `ambient`, I_a is at least a fifth of the light of all lights.",
        effect: Effect::Value(|options, text| {
            options.lighting.boost_ambient = true;
            store(&mut options.ao, values::ao(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "indirect",
        value_name: "N",
        help: "Trace up to N diffuse bounces of light between surfaces, in place of the ambient light\n\n\
               All glowing surfaces light others then, not only those brighter than white.\n\n\
               [default: the file's, or 0]",
        conflicts: &["ao"],
        effect: Effect::Value(|options, text| {
            store(&mut options.indirect, values::whole(text, 0..=64).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "caustics",
        help: "With indirect light, add the light that mirrors and glass send to matte surfaces\n\n\
               It needs hundreds of samples. Without it, solid glass casts shadows, as in Blender without caustics; thin \
               glass lets light through.",
        effect: Effect::Flag(|options| options.caustics = Some(true)),
        ..BASE
    },
    OptionDef {
        name: "ground",
        value_name: "GROUND",
        choices: &names(&GROUNDS),
        help: "Add a ground below the scene: a grey plane, or a shadow catcher (shadow)\n\n\
               The ground is at the scene's lowest point. A shadow catcher shows only shadows, also on a transparent \
               background.",
        effect: Effect::Value(|options, text| choose(&mut options.ground, text, &GROUNDS)),
        ..BASE
    },
    OptionDef {
        name: "hdri",
        value_name: "FILE|studio|sky",
        help: "Light the scene with an environment map: .hdr or .exr, twice as wide as high; or with soft boxes (studio) \
               or a clear sky (sky)\n\n\
               It replaces the ambient light, and is the only light unless the file or flags have lights. `background \
               hdri` shows it. A file of the name studio or sky is ./studio or ./sky.",
        conflicts: &["ambient"],
        effect: Effect::Path(|options, path| options.environment = Some(EnvironmentSource::new(path))),
        ..BASE
    },
    OptionDef {
        name: "hdri-rotate",
        value_name: "DEGREES",
        help: "Turn the environment about the vertical: counterclockwise seen from above [default: 0]",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.environment_rotation, values::angle(text))
        }),
        ..BASE
    },
    OptionDef {
        name: "hdri-strength",
        value_name: "X",
        help: "Multiply the light of the environment by X [default: 1]",
        effect: Effect::Value(|options, text| {
            store(&mut options.lighting.environment_strength, values::strength(text).map(|x| x as f32))
        }),
        ..BASE
    },
    OptionDef {
        name: "no-shadows",
        help: "Disable shadows",
        effect: Effect::Flag(|options| options.shadows = false),
        ..BASE
    },
];

/// Adds a light. Suns come after point lights, and area lights after both, so that the order of the options decides nothing else.
fn add_light(options: &mut Options, light: UserLight) -> Result<(), String> {
    options.lighting.user_lights.push(light);
    options.lighting.user_lights.sort_by_key(|light| match light {
        UserLight::Point { .. } => 0,
        UserLight::Sun { .. } => 1,
        UserLight::Area { .. } => 2,
    });
    Ok(())
}
