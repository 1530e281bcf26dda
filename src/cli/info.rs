//! `blinn info`: what is in a scene.

use serde_json::{Value, json};

use super::args::InfoArgs;
use super::console::{print, tell};
use super::{Summary, Usage, one_line};
use crate::accel::BuildReport;
use crate::cli::plan::memory;
use crate::cli::plan::{load_options, scene_list};
use crate::cli::run::panics::caught;
use crate::cli::run::session::left_out;
use crate::import::{LoadOptions, load};
use crate::scene::pose;
use crate::scene::{
    AnimationChoice, FileProjection, PoseSettings, PosedScene, Reflectance, Scene, SourceFormat,
};

pub(super) fn run(args: &InfoArgs) -> Result<Summary, Usage> {
    let options = LoadOptions { limits: memory::limits(None), ..load_options(&args.scene, &args.common) };
    let scenes = scene_list(&args.scene.scenes)?;
    let mut summary = Summary::default();
    let mut all = Vec::new();
    for path in &scenes {
        let outcome = caught(|| {
            let (scene, warnings) = load(path, &options)?;
            let posed =
                pose(&scene, &PoseSettings { animation: AnimationChoice::Rest, ..Default::default() })?;
            let warnings = warnings.iter().map(ToString::to_string);
            let cleaned = BuildReport::count_degenerate(&posed);
            let warnings: Vec<String> = warnings.chain(left_out(&cleaned)).collect();
            if args.common.strict
                && let Some(warning) = warnings.first()
            {
                anyhow::bail!("{warning} (an error because of --strict)");
            }
            let mut facts = describe(&posed, &cleaned, &warnings);
            facts.insert("file".into(), json!(path.to_string_lossy()));
            if args.json {
                facts.extend(ids(&scene));
            }
            Ok(facts)
        });
        match outcome {
            Ok(facts) => {
                all.push(Value::Object(facts));
                summary.add(None);
            }
            Err(e) => {
                let line = one_line(&super::describe(path, &e));
                tell(&format!("blinn: {line}"));
                if args.json {
                    all.push(json!({"file": path.to_string_lossy(), "error": line}));
                }
                summary.add(Some(line));
            }
        }
    }
    let text = if !args.json {
        all.iter().map(text).collect::<Vec<_>>().join("\n")
    } else if scenes.len() == 1 {
        all.first().map(|v| format!("{v:#}\n")).unwrap_or_default()
    } else {
        format!("{:#}\n", Value::Array(all))
    };
    summary.note(print(text.as_bytes()));
    Ok(summary)
}

type Facts = serde_json::Map<String, Value>;

fn describe(posed: &PosedScene, cleaned: &BuildReport, warnings: &[String]) -> Facts {
    let scene = posed.scene;
    let bounds = posed.bounds();
    let corner = |v: glam::DVec3| if bounds.is_empty() { Value::Null } else { json!(v.to_array()) };
    let node = |n: u32| &scene.nodes[n as usize].name;
    let stored: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
    let value = json!({
        "file": "",
        "format": match scene.source.format { SourceFormat::Gltf => "glTF", SourceFormat::Obj => "OBJ" },
        "generator": scene.source.generator,
        "scenes": scene.source.scenes,
        "nodes": scene.nodes.len(),
        "objects": scene.objects.len(),
        "meshes": scene.meshes.len(),
        "instances": scene.instances.len(),
        "triangles": scene.instanced_triangle_count(),
        "triangles_stored": stored,
        "triangles_without_area": cleaned.zero_area,
        "bounds": {"min": corner(bounds.min), "max": corner(bounds.max)},
        "materials": scene.materials.iter().map(|m| json!({
            "name": m.name,
            "kind": match m.reflectance {
                Reflectance::Mtl(_) => "MTL",
                Reflectance::MetallicRoughness { .. } => "metallic-roughness",
                Reflectance::SpecularGlossiness { .. } => "specular-glossiness",
                Reflectance::Unlit => "unlit",
            },
            "base": m.base_color.factor.to_array(),
            "textured": m.base_color.texture.is_some(),
            "double_sided": m.double_sided,
        })).collect::<Vec<_>>(),
        "images": scene.images.iter().map(|i| json!({
            "name": i.name, "width": i.width, "height": i.height
        })).collect::<Vec<_>>(),
        "lights": scene.lights.iter().map(|l| json!({
            "name": l.name,
            "node": node(l.node),
            "kind": l.kind.name(),
            "color": l.color.to_array(),
            "intensity": l.intensity,
        })).collect::<Vec<_>>(),
        "cameras": scene.cameras.iter().map(|c| {
            let (kind, yfov, ymag) = match c.projection {
                FileProjection::Perspective { yfov, .. } => ("perspective", Some(yfov.to_degrees()), None),
                FileProjection::Orthographic { ymag, .. } => ("orthographic", None, Some(ymag)),
            };
            json!({
                "name": node(c.node), "kind": kind, "yfov_degrees": yfov, "ymag": ymag,
                "aspect": c.aspect(), "znear": c.znear, "zfar": c.zfar.is_finite().then_some(c.zfar),
            })
        }).collect::<Vec<_>>(),
        "animations": scene.animations.iter().map(|a| json!({
            "name": a.name, "channels": a.channels.len(), "seconds": a.duration()
        })).collect::<Vec<_>>(),
        "skins": scene.skins.len(),
        "variants": scene.source.variants,
        "extensions": scene.source.extensions,
        "warnings": warnings,
    });
    value.as_object().cloned().unwrap_or_default()
}

/// What the numbers in layers stand for.
fn ids(scene: &Scene) -> Facts {
    let named = |names: &mut dyn Iterator<Item = &String>| -> Value {
        names.enumerate().map(|(i, name)| json!({"id": i + 1, "name": name})).collect()
    };
    Facts::from_iter([
        ("object_ids".into(), named(&mut scene.objects.iter())),
        ("material_ids".into(), named(&mut scene.materials.iter().map(|material| &material.name))),
    ])
}

/// The same facts for people.
fn text(facts: &Value) -> String {
    let mut out = String::new();
    let Value::Object(facts) = facts else { return out };
    for (key, value) in facts {
        match value {
            Value::Array(list) if list.is_empty() => {}
            Value::Array(list) => {
                out.push_str(&format!("{key} ({}):\n", list.len()));
                for item in list {
                    out.push_str(&format!("  {}\n", inline(item)));
                }
            }
            other => out.push_str(&format!("{key}: {}\n", inline(other))),
        }
    }
    out
}

fn inline(value: &Value) -> String {
    match value {
        Value::String(s) => s.chars().map(|c| if c.is_control() { ' ' } else { c }).collect(),
        Value::Object(map) => {
            let shown = map.iter().filter(|(_, v)| !v.is_null());
            shown.map(|(k, v)| format!("{k} {}", inline(v))).collect::<Vec<_>>().join(", ")
        }
        Value::Array(list) => list.iter().map(inline).collect::<Vec<_>>().join(" "),
        // A factor that the file gives as .6 is not .6000000238 to people.
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

    #[test]
    fn numbers_are_as_short_as_they_were_given() {
        let value = json!({"base": [0.6f32, 1.0f32, 0.25f32], "count": 3, "seconds": 0.1f64});
        assert_eq!(inline(&value), "base 0.6 1 0.25, count 3, seconds 0.1");
    }
}
