//! `blinn info`: prints the contents of a scene, as text or JSON.

use std::collections::HashSet;
use std::path::Path;

use anyhow::Result;
use serde_json::{Map, Value, json};

use super::args::{InfoArgs, named_options};
use super::console::{print_error, print_stdout, print_warning, scene_error, single_line, strict_error};
use super::exporters::{self, Exporter, version_of};
use super::plan::scene_list;
use super::run::panics;
use super::scene_file::load_scene_file;
use super::summary::Summary;
use super::usage::UsageError;
use super::warning_filter::WarningFilter;
use super::{file_cameras, light_sources, material_info, part_info};
use blinn_accel::BuildReport;
use blinn_import::{GlassMode, LoadOptions, Warning, refracts_if_closed};
use blinn_scene::pose;
use blinn_scene::{AnimationChoice, PoseSettings, PosedScene, Scene, SourceFormat};
use blinn_session::{Options, ignored_primitives, load_limits, without_error_codes};

/// Properties of a scene by name, in the order in which they are printed.
type Properties = Map<String, Value>;

pub fn run(args: &InfoArgs) -> Result<Summary, UsageError> {
    let named = named_options([&args.scene.options.given, &args.common.files.given])?;
    let Options { load, blender, .. } = named.finish()?;
    let options = LoadOptions { limits: load_limits(None), ..load };
    let scenes = scene_list(&args.scene.scenes)?;
    if !args.common.quiet {
        for (folder, text) in scenes.left_out() {
            print_warning(&format!("{}: {text}", folder.display()));
        }
    }
    let mut summary = Summary::default();
    let mut all = Vec::new();
    for path in scenes.iter() {
        let path = &path?;
        match panics::catch(|| read_properties(path, &options, blender.as_deref(), args)) {
            Ok(properties) => {
                all.push(Value::Object(properties));
                summary.add_scene(None);
            }
            Err(error) => {
                let line = single_line(&scene_error(path, &error));
                print_error(&line);
                if args.json {
                    all.push(json!({"file": path.to_string_lossy(), "error": line}));
                }
                summary.add_scene(Some(line));
            }
        }
    }
    let text = if !args.json {
        all.iter().map(to_text).collect::<Vec<_>>().join("\n")
    } else if scenes.len() == 1 {
        all.first().map(|value| format!("{value:#}\n")).unwrap_or_default()
    } else {
        format!("{:#}\n", Value::Array(all))
    };
    summary.record(print_stdout(text.as_bytes()));
    Ok(summary)
}

/// Reads a scene and returns its properties.
fn read_properties(
    path: &Path,
    options: &LoadOptions,
    blender: Option<&Path>,
    args: &InfoArgs,
) -> Result<Properties> {
    let (scene, warnings) = load_scene_file(path, options, blender)?;
    let posed = pose(&scene, &PoseSettings { animation: AnimationChoice::Rest, ..Default::default() })?;
    let report = BuildReport::count_degenerate(&posed);
    let warnings: Vec<Warning> = warnings
        .into_iter()
        .chain(
            ignored_primitives(&report)
                .map(|notice| Warning { location: String::new(), message: notice.to_string() }),
        )
        .collect();
    if args.common.strict
        && let Some(warning) = warnings.first()
    {
        return Err(strict_error(warning));
    }
    let warnings = if args.json { all_lines(&warnings) } else { bounded_lines(&warnings) };
    let mut properties = properties(&posed, &report, &warnings, options.glass);
    properties.insert("file".into(), json!(path.to_string_lossy()));
    if args.json {
        properties.extend(aov_ids(&scene));
        properties.insert("parts".into(), part_info::parts(&posed).into());
    }
    Ok(properties)
}

/// The transmissive objects: whether each is solid or a thin wall, and why.
fn glass(scene: &Scene, mode: GlassMode) -> Vec<Value> {
    let mut known = HashSet::new();
    let mut glass = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let material = &scene.materials[mesh.material as usize];
        if !material.transmits() || !known.insert((instance.object, material.name.as_str())) {
            continue;
        }
        let is_blender = scene.source.is_blender();
        let because = match (mesh.is_body, material.volume.is_some()) {
            _ if mode != GlassMode::Auto => "--glass",
            (true, true) => "volume",
            (true, false) if is_blender => "closed or curved surface",
            (true, false) => "closed surface",
            (false, _) if material.thin_wall => "thin wall of the material",
            (false, _) if is_blender => "flat surface",
            (false, _) if refracts_if_closed(scene, material) => "open surface",
            (false, _) => "no volume",
        };
        let object = (instance.object as usize).checked_sub(1).and_then(|i| scene.objects.get(i));
        let kind = if mesh.is_body { "solid" } else { "thin" };
        glass.push(json!({"object": object, "material": material.name, "kind": kind, "because": because}));
    }
    glass
}

fn all_lines(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(|warning| without_error_codes(&warning.to_string())).collect()
}

/// The first few warnings of each kind, and how many there are beyond.
fn bounded_lines(warnings: &[Warning]) -> Vec<String> {
    let mut filter = WarningFilter::default();
    let admitted = warnings.iter().filter(|warning| filter.admit(&warning.message));
    let mut lines: Vec<String> = admitted.map(|warning| without_error_codes(&warning.to_string())).collect();
    lines.extend(filter.summary("use --json to print all"));
    lines
}

/// Properties of a scene that do not depend on its file name and on the order of its objects, without what follows from
/// the generator.
pub fn comparable_properties(scene: &Scene, warnings: &[Warning], mode: GlassMode) -> Result<Value> {
    let posed = pose(scene, &PoseSettings { animation: AnimationChoice::Rest, ..Default::default() })?;
    let report = BuildReport::count_degenerate(&posed);
    let mut all = properties(&posed, &report, &all_lines(warnings), mode);
    for key in ["file", "exporters", "quirks", "up", "size_in_file", "unit"] {
        all.remove(key);
    }
    // They follow from the other fields of a material.
    for material in all.get_mut("materials").and_then(Value::as_array_mut).into_iter().flatten() {
        material.as_object_mut().map(|fields| fields.remove("phong"));
    }
    Ok(Value::Object(all))
}

/// Properties of a posed scene with the ids of its AOVs.
pub fn scene_properties(posed: &PosedScene, warnings: &[String], mode: GlassMode) -> Value {
    let mut all = properties(posed, &BuildReport::count_degenerate(posed), warnings, mode);
    all.remove("file");
    all.extend(aov_ids(posed.scene));
    Value::Object(all)
}

fn properties(posed: &PosedScene, report: &BuildReport, warnings: &[String], mode: GlassMode) -> Properties {
    let scene = posed.scene;
    let bounds = posed.bounds();
    let corner = |v: glam::DVec3| if bounds.is_empty() { Value::Null } else { json!(v.to_array()) };
    let exporters = exporters::candidates(&scene.source);
    let stored: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
    let value = json!({
        "file": "",
        "format": match scene.source.format {
            SourceFormat::Gltf => "glTF",
            SourceFormat::Obj => "OBJ",
            SourceFormat::Stl => "STL",
            SourceFormat::Ply => "PLY",
        },
        "generator": scene.source.generator,
        "exporters": exporters.iter().map(|exporter| json!({
            "name": exporter.name, "version": version_of(&scene.source.generator), "section": exporter.section(),
        })).collect::<Vec<_>>(),
        "quirks": quirks(&exporters, posed),
        "scenes": scene.source.scenes,
        "nodes": scene.nodes.len(),
        "objects": scene.objects.len(),
        "meshes": scene.meshes.len(),
        "instances": scene.instances.len(),
        "triangles": scene.instanced_triangle_count(),
        "triangles_stored": stored,
        "triangles_without_area": report.zero_area,
        "bounds": {"min": corner(bounds.min), "max": corner(bounds.max)},
        // Bounds have y up.
        "up": scene.source.up.name(),
        "size_in_file": corner(scene.source.up.size_in_file(bounds.extent())),
        "unit": if scene.source.format == SourceFormat::Gltf { json!("metre") } else { Value::Null },
        "materials": scene.materials.iter().map(material_info::material).collect::<Vec<_>>(),
        "glass": glass(scene, mode),
        "images": scene.images.iter().map(|i| json!({
            "name": i.name, "width": i.width, "height": i.height
        })).collect::<Vec<_>>(),
        "lights": light_sources::lights(posed),
        "emissive_materials": light_sources::emissive_materials(posed),
        "environments": scene.environment.iter().map(|environment| json!({
            "mean_radiance": environment.in_world().mean().to_array(),
        })).collect::<Vec<_>>(),
        "probable_area_lights": light_sources::lost_lights(posed),
        "cameras": file_cameras::cameras(posed),
        "animations": scene.animations.iter().map(|a| json!({
            "name": a.name, "channels": a.channels.len(), "seconds": a.duration()
        })).collect::<Vec<_>>(),
        "skins": scene.skins.len(),
        "variants": scene.source.variants,
        "extensions": scene.source.extensions,
        "warnings": warnings,
    });
    let mut all = value.as_object().cloned().unwrap_or_default();
    // Few files have them.
    for (key, count) in [
        ("points", scene.instanced_point_count()),
        ("lines", scene.instanced_line_count()),
        ("loose_vertices", scene.source.loose_vertices),
    ] {
        if count > 0 {
            all.insert(key.into(), json!(count));
        }
    }
    all
}

/// Lists known facts about the files of exporters that may apply to a scene. Of several exporters, only one wrote it.
fn quirks(exporters: &[&Exporter], posed: &PosedScene) -> Vec<String> {
    let lines = exporters.iter().flat_map(|exporter| {
        let prefix =
            if exporters.len() > 1 { format!("if written by {}: ", exporter.name) } else { String::new() };
        let quirks = exporter.quirks.iter().filter(move |quirk| quirk.may_apply(posed));
        quirks.map(move |quirk| format!("{prefix}{}", quirk.line()))
    });
    lines.collect()
}

/// The objects and materials behind the numbers of id AOVs.
fn aov_ids(scene: &Scene) -> Properties {
    let numbered = |names: &mut dyn Iterator<Item = &String>| -> Value {
        names.enumerate().map(|(i, name)| json!({"id": i + 1, "name": name})).collect()
    };
    Properties::from_iter([
        ("object_ids".into(), numbered(&mut scene.objects.iter())),
        ("material_ids".into(), numbered(&mut scene.materials.iter().map(|material| &material.name))),
    ])
}

/// Properties as lines of text.
fn to_text(properties: &Value) -> String {
    let mut out = String::new();
    let Value::Object(properties) = properties else { return out };
    for (key, value) in properties {
        match value {
            value if is_empty(value) => {}
            Value::Array(list) if !list.iter().all(Value::is_number) => {
                out.push_str(&format!("{key} ({}):\n", list.len()));
                for item in list {
                    out.push_str(&format!("  {}\n", inline(&shortened(item))));
                }
            }
            Value::String(axis) if key == "up" => {
                let turned = if axis == "y" {
                    ""
                } else {
                    " in the file, turned to y: bounds, cameras and lights have y up"
                };
                out.push_str(&format!("up: {axis}{turned}\n"));
            }
            other => out.push_str(&format!("{key}: {}\n", inline(&shortened(other)))),
        }
    }
    out
}

/// True for what says nothing.
fn is_empty(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::String(text) => text.is_empty(),
        Value::Array(list) => list.is_empty(),
        Value::Object(map) => map.is_empty(),
        Value::Bool(_) | Value::Number(_) => false,
    }
}

/// The value with numbers of the precision of f32, which most numbers of scene files have.
fn shortened(value: &Value) -> Value {
    match value {
        Value::Number(n) if n.is_f64() => json!(n.as_f64().unwrap_or_default() as f32),
        Value::Array(list) => list.iter().map(shortened).collect(),
        Value::Object(map) => map.iter().map(|(key, value)| (key.clone(), shortened(value))).collect(),
        other => other.clone(),
    }
}

/// A value on one line.
pub(super) fn inline(value: &Value) -> String {
    match value {
        Value::String(s) => s.chars().map(|c| if c.is_control() { ' ' } else { c }).collect(),
        Value::Object(map) => {
            let shown = map.iter().filter(|(_, v)| !is_empty(v));
            shown.map(|(k, v)| format!("{k} {}", inline(v))).collect::<Vec<_>>().join(", ")
        }
        Value::Array(list) => list.iter().map(inline).collect::<Vec<_>>().join(" "),
        // A factor of .6 in the file is printed as 0.6, not as 0.6000000238.
        Value::Number(n) => match n.as_f64().filter(|x| n.is_f64() && f64::from(*x as f32) == *x) {
            Some(x) => (x as f32).to_string(),
            None => n.to_string(),
        },
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgb;
    use blinn_scene::{Instance, Light, LightKind, LightUnits, LocalTransform, Material, Mesh, Node};
    use glam::Vec3;

    #[test]
    fn exporters_and_their_quirks_are_listed() {
        let mut scene = Scene::default();
        let properties = |scene: &Scene| {
            let posed = pose(scene, &PoseSettings::default()).unwrap();
            scene_properties(&posed, &[], GlassMode::Auto)
        };
        assert_eq!(
            (properties(&scene)["exporters"].clone(), properties(&scene)["quirks"].clone()),
            (json!([]), json!([]))
        );
        scene.source.generator = "Open CASCADE Technology 7.9 [dev.opencascade.org]".into();
        let several = properties(&scene);
        let names = ["build123d (OCCT 8.0)", "CadQuery (OCCT 7.9)", "cascadio (OCCT 8.0)"];
        for (exporter, name) in several["exporters"].as_array().unwrap().iter().zip(names) {
            assert_eq!((&exporter["name"], &exporter["version"]), (&json!(name), &json!("7.9")));
        }
        let up = "if written by cascadio (OCCT 8.0): Z stays up and no node turns it: --up z";
        let scale =
            "if written by CadQuery (OCCT 7.9): lengths are millimetres written as metres: --scale 0.001";
        let has = |several: &Value, line: &str| several["quirks"].as_array().unwrap().contains(&json!(line));
        assert!(has(&several, up) && !has(&several, scale), "{several}");
        let turned = LocalTransform::Matrix(glam::DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2));
        scene.nodes.push(Node { local: turned, visible: true, ..Node::default() });
        scene.materials.push(Material::default());
        let positions = vec![Vec3::ZERO, Vec3::X * 30.0, Vec3::Y];
        scene.meshes.push(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() });
        scene.instances.push(Instance { object: 1, ..Instance::default() });
        scene.objects.push("part".into());
        let turned = properties(&scene);
        assert!(!has(&turned, up) && has(&turned, scale), "{turned}");
        scene.source.generator = "Babylon.js v9.28.0".into();
        let one = properties(&scene);
        let section = "docs/reference/exporters.md#babylon-js-gltf";
        assert_eq!(
            one["exporters"],
            json!([{"name": "Babylon.js", "version": "9.28.0", "section": section}])
        );
        let text = to_text(&one);
        assert!(
            text.contains("\n  hidden meshes (isVisible, setEnabled, visibility 0) are written"),
            "{text}"
        );
    }

    /// Advice about Blender's export dialog is for files that lack lights or cameras, and not for converted .blend files.
    #[test]
    fn files_with_lights_and_cameras_have_no_advice_about_exporting_them() {
        let mut scene = Scene::default();
        scene.source.generator = "Khronos glTF Blender I/O v5.0.21".into();
        let quirks = |scene: &Scene| {
            let posed = pose(scene, &PoseSettings::default()).unwrap();
            scene_properties(&posed, &[], GlassMode::Auto)["quirks"].to_string()
        };
        let lists =
            |scene: &Scene| ["tick Cameras", "--light-units"].map(|text| quirks(scene).contains(text));
        assert_eq!(lists(&scene), [true, false]);
        scene.nodes.push(Node::default());
        let kind = LightKind::Point;
        let name = "Lamp".to_string();
        let range = f32::INFINITY;
        scene.lights.push(Light { name, node: 0, kind, color: Rgb::ONE, intensity: 1.0, range, radius: 0.0 });
        assert_eq!(lists(&scene), [true, true]);
        scene.source.light_units = Some(LightUnits::Standard);
        assert_eq!(lists(&scene), [false, false]);
    }

    #[test]
    fn numbers_are_as_short_as_in_the_file() {
        let value = json!({"base": [0.6f32, 1.0f32, 0.25f32], "count": 3, "seconds": 0.1f64});
        assert_eq!(inline(&value), "base 0.6 1 0.25, count 3, seconds 0.1");
    }
}
