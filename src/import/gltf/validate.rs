//! Replaces or removes property values that the specification does not allow, each with a warning.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Display;

use ::gltf::json::Camera;
use ::gltf::json::extensions::scene::khr_lights_punctual::Light;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use serde_path_to_error::Segment;

use super::area_light::JsonAreaLight;
use super::json_tree::{Object, as_objects, objects, primitives};
use super::{
    anisotropy, area_light, clearcoat, diffuse_transmission, dispersion, iridescence, material_schema,
    ranges, sheen,
};
use crate::error::Warnings;
use crate::files::escape::printable;
use blinn_scene::is_blender_generator;

/// Optional indices, which some exporters write as −1 for none.
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

/// Boolean properties, which some exporters write as 0 or 1.
const BOOLEANS: [(&str, &str); 2] = [("materials", "doubleSided"), ("accessors", "normalized")];

/// Repairs all invalid values that would otherwise be errors, and warns of those that the importer handles.
pub(super) fn validate(root: &mut Value, warnings: &mut Warnings) {
    remove_negative_indices(root, warnings);
    convert_booleans(root, warnings);
    check_morph_targets(root, warnings);
    for (i, object) in objects(root, "materials") {
        let location = format!("materials[{i}]");
        let modes = ["OPAQUE", "MASK", "BLEND"].map(Value::from);
        check_choice(object, "alphaMode", &modes, &location, warnings);
        material_schema::repair(object, &location, warnings);
        clearcoat::repair(object, &location, warnings);
        anisotropy::repair(object, &location, warnings);
        sheen::repair(object, &location, warnings);
        iridescence::repair(object, &location, warnings);
        dispersion::repair(object, &location, warnings);
        diffuse_transmission::repair(object, &location, warnings);
        ranges::repair_material(object, &location, warnings);
    }
    for (i, object) in objects(root, "samplers") {
        for key in ["wrapS", "wrapT"] {
            let modes = [10497, 33071, 33648].map(Value::from);
            check_choice(object, key, &modes, format_args!("samplers[{i}]"), warnings);
        }
    }
    for (i, animation) in objects(root, "animations") {
        for (j, object) in as_objects(animation.get_mut("samplers")) {
            let kinds = ["LINEAR", "STEP", "CUBICSPLINE"].map(Value::from);
            let location = format_args!("animations[{i}].samplers[{j}]");
            check_choice(object, "interpolation", &kinds, location, warnings);
        }
    }
    for (i, object) in objects(root, "accessors") {
        let types = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"];
        correct_case(object, "type", &types, format_args!("accessors[{i}]"), warnings);
    }
    for (i, object) in objects(root, "cameras") {
        let kinds = ["perspective", "orthographic"];
        correct_case(object, "type", &kinds, format_args!("cameras[{i}]"), warnings);
        remove_untypable::<Camera>(object, &format!("cameras[{i}]"), warnings);
        if let Some(Value::Object(perspective)) = object.get_mut("perspective") {
            ranges::repair_perspective(perspective, &format!("cameras[{i}].perspective"), warnings);
        }
        for kind in kinds {
            if let Some(object) = object.get(kind).and_then(Value::as_object) {
                check_clipping(object, &format!("cameras[{i}].{kind}"), warnings);
            }
        }
    }
    let generator = root.pointer("/asset/generator").and_then(Value::as_str).unwrap_or_default();
    let is_blender = is_blender_generator(generator);
    if let Some(lights) = root.pointer_mut("/extensions/KHR_lights_punctual") {
        for (i, object) in objects(lights, "lights") {
            let location = format!("extensions.KHR_lights_punctual.lights[{i}]");
            repair_light(object, is_blender, &location, warnings);
        }
    }
    if let Some(lights) = area_light::lights_mut(root) {
        for (i, object) in objects(lights, "lights") {
            let location = format!("extensions.{}.lights[{i}]", area_light::NAME);
            repair_area_light(object, is_blender, &location, warnings);
        }
    }
}

fn remove_negative_indices(root: &mut Value, warnings: &mut Warnings) {
    let mut remove = |object: &mut Object, key: &str, location: &dyn Display| {
        if object.get(key).and_then(Value::as_i64).is_some_and(|i| i < 0) {
            warnings.add(location, "ignored negative index");
            object.remove(key);
        }
    };
    if let Some(root) = root.as_object_mut() {
        remove(root, "scene", &"scene");
    }
    for (array, key) in INDICES {
        for (i, object) in objects(root, array) {
            remove(object, key, &format_args!("{array}[{i}].{key}"));
        }
    }
    for (i, mesh) in objects(root, "meshes") {
        for (j, object) in primitives(mesh) {
            for key in ["indices", "material"] {
                remove(object, key, &format_args!("meshes[{i}].primitives[{j}].{key}"));
            }
        }
    }
}

fn convert_booleans(root: &mut Value, warnings: &mut Warnings) {
    for (array, key) in BOOLEANS {
        for (i, object) in objects(root, array) {
            let Some(number) = number(object, key) else { continue };
            let value = number != 0.0;
            warnings
                .add(format_args!("{array}[{i}].{key}"), format_args!("read the number {number} as {value}"));
            object.insert(key.into(), json!(value));
        }
    }
}

fn number(object: &Object, key: &str) -> Option<f64> {
    object.get(key).and_then(Value::as_f64)
}

/// Corrects the case of a value that is among the `allowed` ones but for its case.
fn correct_case(
    object: &mut Object,
    key: &str,
    allowed: &[&str],
    location: impl Display,
    warnings: &mut Warnings,
) {
    let Some(Value::String(text)) = object.get_mut(key) else { return };
    if let Some(value) =
        allowed.iter().find(|value| value.eq_ignore_ascii_case(text.trim()) && *value != text)
    {
        warnings
            .add(format_args!("{location}.{key}"), format_args!("read '{}' as '{value}'", printable(text)));
        *text = value.to_string();
    }
}

/// Corrects the case of a value, and replaces one that is not among the `allowed` ones by their first.
fn check_choice(
    object: &mut Object,
    key: &str,
    allowed: &[Value],
    location: impl Display,
    warnings: &mut Warnings,
) {
    let texts: Vec<&str> = allowed.iter().filter_map(Value::as_str).collect();
    correct_case(object, key, &texts, &location, warnings);
    let Some(value) = object.get_mut(key).filter(|v| v.is_string() || v.is_number()) else { return };
    if !allowed.contains(value) {
        let default = allowed.first().cloned().unwrap_or_default();
        let list = allowed.iter().map(Value::to_string).collect::<Vec<_>>().join(", ");
        let invalid = printable(&value.to_string());
        let message = format!("ignored invalid value {invalid} (expected one of {list}); used {default}");
        warnings.add(format_args!("{location}.{key}"), message.replace('"', "'"));
        *value = default;
    }
}

/// Warns of weights that do not match the morph targets, and of invalid nodes.
fn check_morph_targets(root: &mut Value, warnings: &mut Warnings) {
    let targets: Vec<usize> = objects(root, "meshes").map(|(_, mesh)| count_morph_targets(mesh)).collect();
    for ((i, mesh), &targets) in objects(root, "meshes").zip(&targets) {
        check_weights(mesh, targets, format_args!("meshes[{i}].weights"), warnings);
    }
    for (i, object) in objects(root, "nodes") {
        let mesh = object.get("mesh").and_then(Value::as_u64).and_then(|m| targets.get(m as usize));
        if let Some(&targets) = mesh {
            check_weights(object, targets, format_args!("nodes[{i}].weights"), warnings);
        }
        check_node(object, &format!("nodes[{i}]"), warnings);
    }
}

fn count_morph_targets(mesh: &Object) -> usize {
    let primitives = mesh.get("primitives").and_then(Value::as_array).into_iter().flatten();
    let targets = primitives.filter_map(|p| p.get("targets")?.as_array().map(Vec::len));
    targets.max().unwrap_or(0)
}

fn check_weights(object: &Object, targets: usize, location: impl Display, warnings: &mut Warnings) {
    let Some(count) = object.get("weights").and_then(Value::as_array).map(Vec::len) else { return };
    if count > targets {
        warnings.add(location, format_args!("{count} weights for {targets} morph targets; ignored the last"));
    } else if count < targets {
        warnings
            .add(location, format_args!("{count} weights for {targets} morph targets; used 0 for the last"));
    }
}

fn check_node(object: &Object, location: &str, warnings: &mut Warnings) {
    const INSTANCING: &str = "EXT_mesh_gpu_instancing";
    const TRANSFORMS: [&str; 3] = ["TRANSLATION", "ROTATION", "SCALE"];
    let rotation = object.get("rotation").and_then(Value::as_array);
    if rotation.is_some_and(|r| !r.is_empty() && r.iter().all(|v| v.as_f64() == Some(0.0))) {
        warnings.add(format_args!("{location}.rotation"), "ignored quaternion of length 0");
    }
    if let Some(extension) = object.get("extensions").and_then(|e| e.get(INSTANCING)) {
        let attributes = extension.get("attributes");
        if !TRANSFORMS.iter().any(|name| attributes.and_then(|a| a.get(name)).is_some()) {
            let message = "ignored instancing without TRANSLATION, ROTATION and SCALE";
            warnings.add(format_args!("{location}.extensions.{INSTANCING}"), message);
        }
    }
}

/// Warns of clipping distances that the importer replaces.
fn check_clipping(object: &Object, location: &str, warnings: &mut Warnings) {
    let near = number(object, "znear").unwrap_or(0.0);
    if near < 0.0 {
        warnings.add(format_args!("{location}.znear"), format_args!("ignored negative value {near}; used 0"));
    }
    if let Some(far) = number(object, "zfar").filter(|&far| far <= near.max(0.0)) {
        let message = format!("ignored value {far}, which is not greater than znear; used infinity");
        warnings.add(format_args!("{location}.zfar"), message);
    }
}

/// Removes members that cannot be typed as part of a `T`, and inserts an empty `type` if there is none. The
/// reader then ignores the object or uses defaults, instead of the whole file being an error.
fn remove_untypable<T: DeserializeOwned>(object: &mut Object, location: &str, warnings: &mut Warnings) {
    loop {
        object.entry("type").or_insert_with(|| json!(""));
        let Err(error) = serde_path_to_error::deserialize::<_, T>(Value::Object(object.clone())) else {
            return;
        };
        let Some(Segment::Map { key }) = error.path().iter().next() else { return };
        if object.remove(key).is_none() {
            return;
        }
        let message = format!("ignored '{}': {}", printable(key), error.inner());
        warnings.add(format_args!("{location}.{}", error.path()), message);
    }
}

/// Removes an alpha from the colour of a light.
fn truncate_color(object: &mut Object, location: &str, warnings: &mut Warnings) {
    if let Some(color) = object.get_mut("color").and_then(Value::as_array_mut).filter(|c| c.len() > 3) {
        let message = format!("{} numbers instead of 3; used the first 3", color.len());
        warnings.add(format_args!("{location}.color"), message);
        color.truncate(3);
    }
}

fn repair_area_light(object: &mut Object, is_blender: bool, location: &str, warnings: &mut Warnings) {
    truncate_color(object, location, warnings);
    correct_case(object, "type", &area_light::TYPES, location, warnings);
    remove_untypable::<JsonAreaLight>(object, location, warnings);
    ranges::repair_area_light(object, is_blender, location, warnings);
}

fn repair_light(object: &mut Object, is_blender: bool, location: &str, warnings: &mut Warnings) {
    truncate_color(object, location, warnings);
    correct_case(object, "type", &["directional", "point", "spot"], location, warnings);
    remove_untypable::<Light>(object, location, warnings);
    ranges::repair_light(object, is_blender, location, warnings);
    let Some(spot) = object.get_mut("spot").and_then(Value::as_object_mut) else { return };
    // π/2 rounded to f32 is slightly larger than π/2.
    for key in ["innerConeAngle", "outerConeAngle"] {
        if let Some(angle) = number(spot, key).filter(|a| !(0.0..=FRAC_PI_2 + 1e-6).contains(a)) {
            let nearest = angle.clamp(0.0, FRAC_PI_2);
            let message = format!("ignored angle {angle} outside of 0 to π/2; used {nearest:.4}");
            warnings.add(format_args!("{location}.spot.{key}"), message);
            spot.insert(key.into(), json!(nearest));
        }
    }
}
