//! Values that the format has not: each is told, with what was taken instead.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

use ::gltf::json::Camera;
use ::gltf::json::extensions::scene::khr_lights_punctual::Light;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use serde_path_to_error::Segment;

use crate::import::error::Warnings;
use crate::import::files::escape::printable;
use crate::import::gltf::material_schema;
use crate::import::gltf::repair::items;

type Object = Map<String, Value>;

/// Tells them, and mends those that the readers would not understand.
pub(crate) fn mend(root: &mut Value, warnings: &mut Warnings) {
    if let Some(root) = root.as_object_mut() {
        index(root, "scene", "scene", warnings);
    }
    for (list, key) in INDICES {
        for (i, object) in items(root, list) {
            index(object, key, format_args!("{list}[{i}].{key}"), warnings);
        }
    }
    for (i, mesh) in items(root, "meshes") {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut).into_iter().flatten();
        for (j, object) in primitives.enumerate().filter_map(|(j, p)| Some((j, p.as_object_mut()?))) {
            for key in ["indices", "material"] {
                index(object, key, format_args!("meshes[{i}].primitives[{j}].{key}"), warnings);
            }
        }
    }
    for (list, key) in FLAGS {
        for (i, object) in items(root, list) {
            flag(object, key, &format!("{list}[{i}]"), warnings);
        }
    }
    let targets: Vec<usize> = items(root, "meshes").map(|(_, mesh)| morph_targets(mesh)).collect();
    for (i, mesh) in items(root, "meshes") {
        still_attributes(mesh, &format!("meshes[{i}]"), warnings);
    }
    for ((i, mesh), &targets) in items(root, "meshes").zip(&targets) {
        weights(mesh, targets, format_args!("meshes[{i}].weights"), warnings);
    }
    for (i, object) in items(root, "nodes") {
        let mesh = object.get("mesh").and_then(Value::as_u64).and_then(|m| targets.get(m as usize));
        if let Some(&targets) = mesh {
            weights(object, targets, format_args!("nodes[{i}].weights"), warnings);
        }
        node(object, &format!("nodes[{i}]"), warnings);
    }
    for (i, object) in items(root, "materials") {
        let place = format!("materials[{i}]");
        let modes = ["OPAQUE", "MASK", "BLEND"].map(Value::from);
        choice(object, "alphaMode", &modes, &place, warnings);
        material_schema::mend(object, &place, warnings);
    }
    for (i, object) in items(root, "samplers") {
        for key in ["wrapS", "wrapT"] {
            let modes = [10497, 33071, 33648].map(Value::from);
            choice(object, key, &modes, format_args!("samplers[{i}]"), warnings);
        }
    }
    for (i, animation) in items(root, "animations") {
        let samplers = animation.get_mut("samplers").and_then(Value::as_array_mut).into_iter().flatten();
        for (j, object) in samplers.enumerate().filter_map(|(j, s)| Some((j, s.as_object_mut()?))) {
            let kinds = ["LINEAR", "STEP", "CUBICSPLINE"].map(Value::from);
            choice(object, "interpolation", &kinds, format_args!("animations[{i}].samplers[{j}]"), warnings);
        }
    }
    for (i, object) in items(root, "cameras") {
        sensible::<Camera>(object, &format!("cameras[{i}]"), warnings);
        for kind in ["perspective", "orthographic"] {
            if let Some(object) = object.get(kind).and_then(Value::as_object) {
                clips(object, &format!("cameras[{i}].{kind}"), warnings);
            }
        }
    }
    if let Some(lights) = root.pointer_mut("/extensions/KHR_lights_punctual") {
        for (i, object) in items(lights, "lights") {
            light(object, &format!("extensions.KHR_lights_punctual.lights[{i}]"), warnings);
        }
    }
}

/// Indices that an object can do without: some write −1 for none.
const INDICES: [(&str, &str); 8] = [
    ("nodes", "mesh"),
    ("nodes", "skin"),
    ("nodes", "camera"),
    ("images", "bufferView"),
    ("textures", "source"),
    ("textures", "sampler"),
    ("skins", "inverseBindMatrices"),
    ("skins", "skeleton"),
];

fn index(object: &mut Object, key: &str, place: impl std::fmt::Display, warnings: &mut Warnings) {
    if object.get(key).and_then(Value::as_i64).is_some_and(|i| i < 0) {
        warnings.add(place, "is below zero; taken as none");
        object.remove(key);
    }
}

/// What is true or false, and some write as 1 or 0.
const FLAGS: [(&str, &str); 2] = [("materials", "doubleSided"), ("accessors", "normalized")];

fn flag(object: &mut Object, key: &str, place: &str, warnings: &mut Warnings) {
    if let Some(number) = number(object, key) {
        let meant = number != 0.0;
        warnings.add(format_args!("{place}.{key}"), format_args!("{number} is a number; taken as {meant}"));
        object.insert(key.into(), json!(meant));
    }
}

fn number(object: &Object, key: &str) -> Option<f64> {
    object.get(key).and_then(Value::as_f64)
}

/// One of a few words or numbers; the first stands in for what is none of them.
fn choice(
    object: &mut Object,
    key: &str,
    known: &[Value],
    place: impl std::fmt::Display,
    warnings: &mut Warnings,
) {
    let Some(value) = object.get_mut(key).filter(|v| v.is_string() || v.is_number()) else { return };
    if !known.contains(value) {
        let list = known.iter().map(Value::to_string).collect::<Vec<_>>().join(", ");
        let what = format!("{} is none of {list}; the first is taken", printable(&value.to_string()));
        warnings.add(format_args!("{place}.{key}"), what.replace('"', "'"));
        *value = known.first().cloned().unwrap_or_default();
    }
}

/// Tells what morph targets move and the picture does not: the typed JSON has no place for it.
fn still_attributes(mesh: &Object, place: &str, warnings: &mut Warnings) {
    const MOVED: [&str; 3] = ["POSITION", "NORMAL", "TANGENT"];
    let primitives = mesh.get("primitives").and_then(Value::as_array).into_iter().flatten();
    for (i, primitive) in primitives.enumerate() {
        let targets = primitive.get("targets").and_then(Value::as_array).into_iter().flatten();
        let names = targets.filter_map(Value::as_object).flat_map(Object::keys);
        // Names with an underscore are a program's own.
        let still: BTreeSet<&String> =
            names.filter(|name| !MOVED.contains(&name.as_str()) && !name.starts_with('_')).collect();
        for name in still {
            let place = format!("{place}.primitives[{i}].targets");
            warnings
                .add(place, format_args!("{} does not morph, and stays as the mesh has it", printable(name)));
        }
    }
}

/// How many morph targets a mesh has.
fn morph_targets(mesh: &Object) -> usize {
    let primitives = mesh.get("primitives").and_then(Value::as_array).into_iter().flatten();
    let targets = primitives.filter_map(|p| p.get("targets")?.as_array().map(Vec::len));
    targets.max().unwrap_or(0)
}

fn weights(object: &Object, targets: usize, place: impl std::fmt::Display, warnings: &mut Warnings) {
    let Some(count) = object.get("weights").and_then(Value::as_array).map(Vec::len) else { return };
    if count > targets {
        warnings.add(place, format_args!("{count} for {targets} morph targets; the last have no effect"));
    } else if count < targets {
        warnings.add(place, format_args!("{count} for {targets} morph targets; the last are taken as 0"));
    }
}

fn node(object: &Object, place: &str, warnings: &mut Warnings) {
    let rotation = object.get("rotation").and_then(Value::as_array);
    if rotation.is_some_and(|r| !r.is_empty() && r.iter().all(|v| v.as_f64() == Some(0.0))) {
        warnings.add(format_args!("{place}.rotation"), "is a quaternion of no length; taken as no rotation");
    }
    const INSTANCING: &str = "EXT_mesh_gpu_instancing";
    if let Some(extension) = object.get("extensions").and_then(|e| e.get(INSTANCING)) {
        let attributes = extension.get("attributes");
        let places = ["TRANSLATION", "ROTATION", "SCALE"];
        if !places.iter().any(|name| attributes.and_then(|a| a.get(name)).is_some()) {
            let what = "has no TRANSLATION, ROTATION or SCALE; its mesh is drawn once";
            warnings.add(format_args!("{place}.extensions.{INSTANCING}"), what);
        }
    }
}

fn clips(object: &Object, place: &str, warnings: &mut Warnings) {
    let near = number(object, "znear").unwrap_or(0.0);
    if near < 0.0 {
        warnings.add(format_args!("{place}.znear"), format_args!("{near} is below zero; taken as 0"));
    }
    if let Some(far) = number(object, "zfar").filter(|&far| far <= near.max(0.0)) {
        let what = format!("{far} is not beyond znear; taken as infinite");
        warnings.add(format_args!("{place}.zfar"), what);
    }
}

/// Leaves out members that cannot be read as a `T`, of a kind that is no kind where there is none: what
/// remains is the reader's to judge, and nothing else in the file suffers.
fn sensible<T: DeserializeOwned>(object: &mut Object, place: &str, warnings: &mut Warnings) {
    loop {
        object.entry("type").or_insert_with(|| json!(""));
        let Err(error) = serde_path_to_error::deserialize::<_, T>(Value::Object(object.clone())) else {
            return;
        };
        let Some(Segment::Map { key }) = error.path().iter().next() else { return };
        if object.remove(key).is_none() {
            return;
        }
        let what = format!("{}; '{}' is left out", error.inner(), printable(key));
        warnings.add(format_args!("{place}.{}", error.path()), what);
    }
}

fn light(object: &mut Object, place: &str, warnings: &mut Warnings) {
    if let Some(color) = object.get_mut("color").and_then(Value::as_array_mut).filter(|c| c.len() > 3) {
        let what = format!("{} numbers where a colour has 3; the first are taken", color.len());
        warnings.add(format_args!("{place}.color"), what);
        color.truncate(3);
    }
    sensible::<Light>(object, place, warnings);
    if let Some(intensity) = number(object, "intensity").filter(|&i| i < 0.0) {
        warnings
            .add(format_args!("{place}.intensity"), format_args!("{intensity} is below zero; taken as 0"));
        object.insert("intensity".into(), json!(0));
    }
    if let Some(range) = number(object, "range").filter(|&r| r <= 0.0) {
        warnings
            .add(format_args!("{place}.range"), format_args!("{range} is not above zero; taken as infinite"));
    }
    let Some(spot) = object.get_mut("spot").and_then(Value::as_object_mut) else { return };
    // A right angle as f32 is a little more than one.
    for key in ["innerConeAngle", "outerConeAngle"] {
        if let Some(angle) = number(spot, key).filter(|a| !(0.0..=FRAC_PI_2 + 1e-6).contains(a)) {
            let nearest = angle.clamp(0.0, FRAC_PI_2);
            let what = format!("{angle} is not between 0 and a right angle; taken as {nearest:.4}");
            warnings.add(format_args!("{place}.spot.{key}"), what);
            spot.insert(key.into(), json!(nearest));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(mut root: Value) -> (Value, Vec<String>) {
        let mut warnings = Warnings::default();
        mend(&mut root, &mut warnings);
        (root, warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn what_the_format_has_passes_in_silence() {
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
        assert_eq!(told(good.clone()), (good, Vec::new()));
    }

    #[test]
    fn what_it_has_not_is_told_and_mended() {
        let (mended, words) = told(json!({
            "nodes": [{"rotation": [0, 0, 0, 0], "weights": [1, 1], "mesh": 0},
                {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"_ID": 0}}}}],
            "meshes": [{"weights": [], "primitives": [{"material": -1,
                "targets": [{"POSITION": 0, "COLOR_0": 0, "_X": 0}]}]}],
            "materials": [{"alphaMode": "blend"}, {"doubleSided": 1}],
            "textures": [{"sampler": -1, "source": 0}],
            "samplers": [{"wrapS": 5}],
            "animations": [{"samplers": [{}, {"interpolation": "SMOOTH"}]}],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": -1, "zfar": 0}}],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": -2, "range": 0,
                "spot": {"innerConeAngle": -1, "outerConeAngle": 4}}]}},
        }));
        let light = "extensions.KHR_lights_punctual.lights[0]";
        assert_eq!(
            words,
            [
                "textures[0].sampler: is below zero; taken as none",
                "meshes[0].primitives[0].material: is below zero; taken as none",
                "materials[1].doubleSided: 1 is a number; taken as true",
                "meshes[0].primitives[0].targets: COLOR_0 does not morph, and stays as the mesh has it",
                "meshes[0].weights: 0 for 1 morph targets; the last are taken as 0",
                "nodes[0].weights: 2 for 1 morph targets; the last have no effect",
                "nodes[0].rotation: is a quaternion of no length; taken as no rotation",
                "nodes[1].extensions.EXT_mesh_gpu_instancing: has no TRANSLATION, ROTATION or SCALE; its mesh is \
                 drawn once",
                "materials[0].alphaMode: 'blend' is none of 'OPAQUE', 'MASK', 'BLEND'; the first is taken",
                "samplers[0].wrapS: 5 is none of 10497, 33071, 33648; the first is taken",
                "animations[0].samplers[1].interpolation: 'SMOOTH' is none of 'LINEAR', 'STEP', 'CUBICSPLINE'; \
                 the first is taken",
                "cameras[0].perspective.znear: -1 is below zero; taken as 0",
                "cameras[0].perspective.zfar: 0 is not beyond znear; taken as infinite",
                &*format!("{light}.intensity: -2 is below zero; taken as 0"),
                &*format!("{light}.range: 0 is not above zero; taken as infinite"),
                &*format!(
                    "{light}.spot.innerConeAngle: -1 is not between 0 and a right angle; taken as 0.0000"
                ),
                &*format!(
                    "{light}.spot.outerConeAngle: 4 is not between 0 and a right angle; taken as 1.5708"
                ),
            ]
        );
        assert_eq!(mended["materials"], json!([{"alphaMode": "OPAQUE"}, {"doubleSided": true}]));
        assert_eq!(mended["textures"], json!([{"source": 0}]));
        assert_eq!(mended["samplers"][0]["wrapS"], 10497);
        assert_eq!(mended["animations"][0]["samplers"][1]["interpolation"], "LINEAR");
        assert_eq!(mended["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"], 0);
    }

    #[test]
    fn lights_and_cameras_that_make_no_sense_cost_no_file() {
        let (mended, words) = told(json!({
            "cameras": [{"perspective": {"yfov": 1, "znear": 1}}, {"type": 5},
                {"type": "perspective", "perspective": {"yfov": "wide"}}],
            "extensions": {"KHR_lights_punctual": {"lights": [{"intensity": 3}, {"type": "point", "intensity": "3"},
                {"type": "point", "color": [1, 0.5, 0.25, 1]}, {"type": "point", "color": [1]}]}},
        }));
        let left = "is left out";
        assert_eq!(words.len(), 5, "{words:?}");
        assert!(words[0].starts_with("cameras[1].type: ") && words[0].ends_with(&format!("'type' {left}")));
        assert!(words[1].starts_with("cameras[2].perspective.yfov: "), "{words:?}");
        let lights = "extensions.KHR_lights_punctual.lights";
        assert!(words[2].starts_with(&format!("{lights}[1].intensity: ")), "{words:?}");
        assert_eq!(
            words[3],
            format!("{lights}[2].color: 4 numbers where a colour has 3; the first are taken")
        );
        assert!(words[4].starts_with(&format!("{lights}[3].color")) && words[4].ends_with(left), "{words:?}");
        assert_eq!(mended["cameras"][0]["type"], "");
        let kept = json!([{"intensity": 3, "type": ""}, {"type": "point"},
            {"type": "point", "color": [1, 0.5, 0.25]}, {"type": "point"}]);
        assert_eq!(mended["extensions"]["KHR_lights_punctual"]["lights"], kept);
    }
}
