//! Validation of property values.

use serde_json::{Value, json};

use super::super::validate::validate;
use crate::error::Warnings;

fn validated(mut root: Value) -> (Value, Vec<String>) {
    let mut warnings = Warnings::default();
    validate(&mut root, &mut warnings);
    (root, warnings.into_lines())
}

#[test]
fn valid_values_are_unchanged() {
    let good = json!({
        "nodes": [{"rotation": [0, 0, 0, 1], "weights": [1], "mesh": 0}, {"rotation": [0, 1, 0, 0]},
            {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": 0}}}}],
        "meshes": [{"weights": [0.5], "primitives": [{"targets": [{}]}]}],
        "materials": [{"alphaMode": "BLEND"}, {}],
        "samplers": [{"wrapS": 33071, "wrapT": 10497}],
        "animations": [{"samplers": [{"interpolation": "STEP"}, {}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "zfar": 9}},
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 0, "range": 2,
            "spot": {"innerConeAngle": 0, "outerConeAngle": std::f32::consts::FRAC_PI_2}}]}},
    });
    assert_eq!(validated(good.clone()), (good, Vec::new()));
}

#[test]
fn invalid_values_are_replaced_with_a_warning() {
    let (root, warnings) = validated(json!({
        "nodes": [{"rotation": [0, 0, 0, 0], "weights": [1, 1], "mesh": 0},
            {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"_ID": 0}}}}],
        "meshes": [{"weights": [], "primitives": [{"material": -1,
            "targets": [{"POSITION": 0}]}]}],
        "materials": [{"alphaMode": "HALF"}, {"doubleSided": 1}],
        "textures": [{"sampler": -1, "source": 0}],
        "samplers": [{"wrapS": 5}],
        "animations": [{"samplers": [{}, {"interpolation": "SMOOTH"}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": -1, "zfar": 0}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": -2, "range": 0,
            "spot": {"innerConeAngle": -1, "outerConeAngle": 4}}]}},
    }));
    let light = "extensions.KHR_lights_punctual.lights[0]";
    assert_eq!(
        warnings,
        [
            "textures[0].sampler: ignored negative index",
            "meshes[0].primitives[0].material: ignored negative index",
            "materials[1].doubleSided: read the number 1 as true",
            "meshes[0].weights: 0 weights for 1 morph targets; used 0 for the last",
            "nodes[0].weights: 2 weights for 1 morph targets; ignored the last",
            "nodes[0].rotation: ignored quaternion of length 0",
            "nodes[1].extensions.EXT_mesh_gpu_instancing: ignored instancing without TRANSLATION, ROTATION and \
             SCALE",
            "materials[0].alphaMode: ignored invalid value 'HALF' (expected one of 'OPAQUE', 'MASK', 'BLEND'); used 'OPAQUE'",
            "samplers[0].wrapS: ignored invalid value 5 (expected one of 10497, 33071, 33648); used 10497",
            "animations[0].samplers[1].interpolation: ignored invalid value 'SMOOTH' (expected one of \
             'LINEAR', 'STEP', 'CUBICSPLINE'); used 'LINEAR'",
            "cameras[0].perspective.znear: ignored negative value -1; used 0",
            "cameras[0].perspective.zfar: ignored value 0, which is not greater than znear; used infinity",
            &*format!("{light}.intensity: ignored negative value -2; used 0"),
            &*format!("{light}.range: ignored value 0, which is not positive; used infinity"),
            &*format!("{light}.spot.innerConeAngle: ignored angle -1 outside of 0 to π/2; used 0.0000"),
            &*format!("{light}.spot.outerConeAngle: ignored angle 4 outside of 0 to π/2; used 1.5708"),
        ]
    );
    assert_eq!(root["materials"], json!([{"alphaMode": "OPAQUE"}, {"doubleSided": true}]));
    assert_eq!(root["textures"], json!([{"source": 0}]));
    assert_eq!(root["samplers"][0]["wrapS"], 10497);
    assert_eq!(root["animations"][0]["samplers"][1]["interpolation"], "LINEAR");
    assert_eq!(root["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"], 0);
}

#[test]
fn invalid_lights_and_cameras_are_warnings() {
    let (root, warnings) = validated(json!({
        "cameras": [{"perspective": {"yfov": 1, "znear": 1}}, {"type": 5},
            {"type": "perspective", "perspective": {"yfov": "wide"}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"intensity": 3}, {"type": "point", "intensity": "3"},
            {"type": "point", "color": [1, 0.5, 0.25, 1]}, {"type": "point", "color": [1]}]}},
    }));
    assert_eq!(warnings.len(), 5, "{warnings:?}");
    assert!(warnings[0].starts_with("cameras[1].type: ignored 'type': "), "{warnings:?}");
    assert!(warnings[1].starts_with("cameras[2].perspective.yfov: "), "{warnings:?}");
    let lights = "extensions.KHR_lights_punctual.lights";
    assert!(warnings[2].starts_with(&format!("{lights}[1].intensity: ")), "{warnings:?}");
    assert_eq!(warnings[3], format!("{lights}[2].color: 4 numbers instead of 3; used the first 3"));
    assert!(
        warnings[4].starts_with(&format!("{lights}[3].color")) && warnings[4].contains(": ignored 'color': "),
        "{warnings:?}"
    );
    assert_eq!(root["cameras"][0]["type"], "");
    let expected = json!([{"intensity": 3, "type": ""}, {"type": "point"},
        {"type": "point", "color": [1, 0.5, 0.25]}, {"type": "point"}]);
    assert_eq!(root["extensions"]["KHR_lights_punctual"]["lights"], expected);
}

#[test]
fn choices_are_read_in_any_case() {
    let (root, warnings) = validated(json!({
        "materials": [{"alphaMode": "blend"}, {"alphaMode": "Mask"}],
        "animations": [{"samplers": [{"interpolation": "cubicSpline"}]}],
        "accessors": [{"type": "vec3"}],
        "cameras": [{"type": "Perspective"}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "POINT"}]}},
    }));
    assert_eq!(root["materials"], json!([{"alphaMode": "BLEND"}, {"alphaMode": "MASK"}]));
    assert_eq!(root["animations"][0]["samplers"][0]["interpolation"], "CUBICSPLINE");
    assert_eq!(root["accessors"][0]["type"], "VEC3");
    assert_eq!(root["cameras"][0]["type"], "perspective");
    assert_eq!(root["extensions"]["KHR_lights_punctual"]["lights"][0]["type"], "point");
    assert_eq!(warnings.len(), 6, "{warnings:?}");
    assert_eq!(warnings[0], "materials[0].alphaMode: read 'blend' as 'BLEND'");
}
