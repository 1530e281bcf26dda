//! The description of a scene for the page.

use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::start_flags::StartFlags;
use super::state::ViewState;
use blinn_core::geometry::Aabb;
use blinn_scene::{FileProjection, PosedScene, Scene};

/// Instances that one task measures.
const TASK_INSTANCES: usize = 64;

/// A drawn object.
#[derive(Clone, Copy)]
struct ObjectSize {
    triangles: u64,
    bounds: Aabb,
}

/// Describes a scene at the start of its clip.
pub fn describe(
    posed: &PosedScene,
    file: &str,
    warnings: &[String],
    start: &StartFlags,
    generation: u64,
) -> Value {
    let scene = posed.scene;
    let sizes = object_sizes(posed);
    let node = |n: u32| &scene.nodes[n as usize].name;
    let light = |name: &String, n: u32, kind: &str| {
        let name = if name.is_empty() { node(n) } else { name };
        json!({"name": name, "kind": kind})
    };
    let lights = scene.lights.iter().map(|l| light(&l.name, l.node, l.kind.name()));
    let lights = lights.chain(scene.area_lights.iter().map(|l| light(&l.name, l.node, l.shape.name())));
    let lights: Vec<Value> = lights.collect();
    json!({
        "type": "scene",
        "generation": generation,
        "file": file,
        "triangles": scene.instanced_triangle_count(),
        "bounds": corners(&posed.bounds()),
        "up": [0.0, 1.0, 0.0],
        "objects": scene.objects.iter().zip(&sizes).map(|(name, size)| json!({
            "name": name, "triangles": size.triangles, "bounds": corners(&size.bounds),
        })).collect::<Vec<_>>(),
        "cameras": scene.cameras.iter().map(|camera| json!({
            "name": node(camera.node),
            "kind": match camera.projection {
                FileProjection::Perspective { .. } => "perspective",
                FileProjection::Orthographic { .. } => "orthographic",
            },
        })).collect::<Vec<_>>(),
        "variants": scene.source.variants,
        "animations": scene.animations.iter().map(|animation| json!({
            "name": animation.name, "seconds": animation.duration(),
        })).collect::<Vec<_>>(),
        "lights": lights,
        "materials": scene.materials.iter().map(|material| json!({"name": material.name})).collect::<Vec<_>>(),
        "warnings": warnings,
        "choices": choices(scene, start),
    })
}

/// Adds a state to the description of a scene.
pub fn with_view(scene: &Value, view: &ViewState) -> String {
    let mut scene = scene.clone();
    scene["view"] = json!(view);
    scene.to_string()
}

/// The values that fields of a view may have.
fn choices(scene: &Scene, start: &StartFlags) -> Value {
    let has_file_lights =
        !scene.lights.is_empty() || !scene.area_lights.is_empty() || scene.environment.is_some();
    let mut lights = vec!["headlight", "three-point", "none"];
    if has_file_lights {
        lights.insert(0, "file");
    }
    let mut hdri = vec!["none", "studio", "sky"];
    let mut backgrounds = vec!["#383838", "#ffffff", "transparent", "hdri"];
    for (choices, given) in [
        (&mut lights, start.all.value("lights")),
        (&mut hdri, start.all.value("hdri")),
        (&mut backgrounds, start.all.value("background")),
    ] {
        if let Some(value) = given.and_then(|value| value.to_str()).filter(|value| !choices.contains(value)) {
            choices.push(value);
        }
    }
    json!({
        "lights": lights,
        "view_transforms": ["auto", "standard", "agx", "filmic", "pbr-neutral", "raw"],
        "hdri": hdri,
        "backgrounds": backgrounds,
    })
}

fn corners(bounds: &Aabb) -> Value {
    if bounds.is_empty() {
        return Value::Null;
    }
    json!({"min": bounds.min.to_array(), "max": bounds.max.to_array()})
}

/// Triangles and bounds of each object.
fn object_sizes(posed: &PosedScene) -> Vec<ObjectSize> {
    let scene = posed.scene;
    let measure = |i: usize| {
        let transform = &posed.instances[i].transform;
        let mut bounds = Aabb::EMPTY;
        for p in posed.positions(i as u32) {
            bounds.extend(transform.point(*p).as_dvec3() + posed.centre);
        }
        bounds
    };
    let count = scene.instances.len().min(posed.instances.len());
    let boxes: Vec<Aabb> = (0..count).into_par_iter().with_min_len(TASK_INSTANCES).map(measure).collect();
    let none = ObjectSize { triangles: 0, bounds: Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY } };
    let mut sizes = vec![none; scene.objects.len()];
    for (instance, bounds) in scene.instances.iter().zip(&boxes) {
        let object = instance.object.checked_sub(1).and_then(|object| sizes.get_mut(object as usize));
        if let Some(size) = object {
            size.triangles += scene.meshes[instance.mesh as usize].triangles.len() as u64;
            size.bounds.extend_box(bounds);
        }
    }
    sizes
}
