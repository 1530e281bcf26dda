//! EXT_lights_area.

use std::f32::consts::PI;

use glam::Vec3;
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use blinn_scene::{AreaLight, AreaLightShape, LightUnits, PoseSettings, PosedAreaLight, pose};

const NAME: &str = "EXT_lights_area";

/// A triangle, and a node for each light.
fn with_lights(lights: &[Value]) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"] = json!({NAME: {"lights": lights}});
    fixture.json["extensionsUsed"] = json!([NAME]);
    for i in 0..lights.len() {
        fixture.node(json!({"extensions": {NAME: {"light": i}}}));
    }
    fixture
}

fn posed(fixture: &Fixture) -> Vec<PosedAreaLight> {
    let scene = fixture.load().0;
    let centre = Some(glam::DVec3::ZERO);
    let settings = PoseSettings { centre, ..PoseSettings::default() };
    pose(&scene, &settings).unwrap().area_lights(LightUnits::Unitless, 1.0)
}

#[test]
fn rectangles_and_discs_are_read_with_their_defaults() {
    let fixture = with_lights(&[
        json!({"name": "Key", "type": "rect", "color": [1, 0.5, 0], "intensity": 7, "size": 2, "rect": {"aspect": 1.5}}),
        json!({"type": "disk", "size": 3, "rect": {"aspect": 2}}),
        json!({"type": "rect", "rect": {}}),
    ]);
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let light = |node, shape, size| AreaLight {
        name: String::new(),
        node,
        shape,
        size,
        color: Vec3::ONE,
        intensity: 1000.0,
    };
    let key = AreaLight {
        name: "Key".into(),
        color: Vec3::new(1.0, 0.5, 0.0),
        intensity: 7.0,
        ..light(1, AreaLightShape::Rect, [3.0, 2.0])
    };
    let disk = light(2, AreaLightShape::Disk, [3.0, 3.0]);
    assert_eq!(scene.area_lights, [key, disk, light(3, AreaLightShape::Rect, [1.0, 1.0])]);
    let areas: Vec<f32> = posed(&fixture).iter().map(PosedAreaLight::area).collect();
    assert_eq!(areas, [6.0, PI * 1.5 * 1.5, 1.0]);
}

/// The largest component of the node's scale counts for both sides.
#[test]
fn nodes_place_and_scale_their_lights() {
    let mut fixture = with_lights(&[json!({"type": "rect", "rect": {"aspect": 2}})]);
    // A quarter turn about +X points −Z down.
    let half = 0.5f64.sqrt();
    fixture.json["nodes"][1]["rotation"] = json!([-half, 0, 0, half]);
    fixture.json["nodes"][1]["translation"] = json!([1, 2, 3]);
    fixture.json["nodes"][1]["scale"] = json!([0.5, -3, 1]);
    fixture.node(json!({"extensions": {NAME: {"light": 0}}}));
    let [first, second] = posed(&fixture)[..] else { panic!() };
    assert!(first.normal.abs_diff_eq(Vec3::NEG_Y, 1e-6), "{}", first.normal);
    assert_eq!(first.centre, Vec3::new(1.0, 2.0, 3.0));
    assert!((first.area() - 18.0).abs() < 1e-4 && (first.half_x.length() - 3.0).abs() < 1e-5);
    // Two nodes share a light.
    assert_eq!((second.area(), second.normal), (2.0, Vec3::NEG_Z));
    assert_eq!(second.radiance, Vec3::splat(1000.0));
}

#[test]
fn hidden_nodes_hide_their_lights() {
    let mut fixture = with_lights(&[json!({"type": "disk"}), json!({"type": "disk"})]);
    fixture.json["nodes"][1]["extensions"]["KHR_node_visibility"] = json!({"visible": false});
    assert_eq!(posed(&fixture).len(), 1);
}

#[test]
fn invalid_values_are_warnings_and_defaults_apply() {
    let check = |light: Value, expected: &str, size: [f32; 2], intensity: f32| {
        let (scene, warnings) = with_lights(std::slice::from_ref(&light)).load();
        assert!(warnings.iter().any(|warning| warning.starts_with(expected)), "{light}: {warnings:?}");
        let [light] = &scene.area_lights[..] else { panic!("{light}") };
        assert_eq!((light.size, light.intensity), (size, intensity), "{expected}");
        assert!(light.color.is_finite() && light.color.min_element() >= 0.0, "{expected}");
    };
    let at = |member: &str| format!("extensions.{NAME}.lights[0].{member}: ");
    let square = [1.0; 2];
    check(json!({"type": "rect", "size": -1}), &(at("size") + "ignored value -1"), square, 1000.0);
    check(json!({"type": "rect", "size": 0}), &(at("size") + "ignored value 0"), square, 1000.0);
    check(json!({"type": "rect", "size": "big"}), &(at("size") + "ignored 'size'"), square, 1000.0);
    check(json!({"type": "rect", "size": 1e300}), "extensions.", square, 1000.0);
    check(json!({"type": "disk", "intensity": -2}), &(at("intensity") + "ignored negative"), square, 0.0);
    check(json!({"type": "disk", "intensity": {}}), &(at("intensity") + "ignored"), square, 1000.0);
    check(json!({"type": "rect", "rect": {"aspect": -3}}), &(at("rect.aspect") + "ignored"), square, 1000.0);
    check(json!({"type": "rect", "rect": {"aspect": "x"}}), &at("rect.aspect"), square, 1000.0);
    check(json!({"type": "rect", "rect": 3}), &(at("rect") + "ignored 'rect'"), square, 1000.0);
    check(json!({"type": "RECT"}), &(at("type") + "read 'RECT' as 'rect'"), square, 1000.0);
    check(json!({"type": "disk", "color": [1, 1]}), &at("color"), square, 1000.0);
    check(json!({"type": "disk", "color": [1, 0, 0, 1]}), &(at("color") + "4 numbers"), square, 1000.0);
    check(json!({"type": "disk", "color": [-1, 0, 0]}), &(at("color") + "used 0"), square, 1000.0);
    check(json!({"type": "disk", "color": "red"}), &at("color"), square, 1000.0);
    check(json!({"type": "disk", "name": [3]}), &at("name").replace(": ", ": repaired"), square, 1000.0);
    let text = with_lights(&[json!({"type": "disk", "intensity": 17})]).json.to_string();
    let (scene, warnings) =
        with_lights(&[json!({"type": "disk", "intensity": 17})]).load_replaced("17", "NaN").unwrap();
    assert!(text.contains("17") && scene.area_lights[0].intensity == 1000.0 && !warnings.is_empty());
}

#[test]
fn lights_that_cannot_be_read_are_ignored() {
    let check = |edit: &dyn Fn(&mut Fixture), expected: &str| {
        let mut fixture = with_lights(&[json!({"type": "rect"})]);
        edit(&mut fixture);
        let (scene, warnings) = fixture.load();
        assert!(warnings.iter().any(|warning| warning.starts_with(expected)), "{expected}: {warnings:?}");
        assert!(scene.area_lights.is_empty(), "{expected}");
    };
    let unknown = format!("extensions.{NAME}.lights[0].type: ignored area light without a known type");
    check(&|f| f.json["extensions"][NAME]["lights"][0] = json!({}), &unknown);
    check(&|f| f.json["extensions"][NAME]["lights"][0]["type"] = json!("sphere"), &unknown);
    check(&|f| f.json["extensions"][NAME]["lights"][0]["type"] = json!(3), "extensions.");
    check(&|f| f.json["extensions"][NAME]["lights"][0] = json!(null), "extensions.");
    check(&|f| f.json["extensions"][NAME]["lights"][0] = json!(4), &unknown);
    check(
        &|f| {
            f.json["extensions"][NAME]["lights"][0] =
                json!({"type": "rect", "size": 3e38, "rect": {"aspect": 3e38}})
        },
        &format!("extensions.{NAME}.lights[0].rect.aspect: ignored area light that is too wide"),
    );
    let missing = format!("nodes[1].extensions.{NAME}.light: ignored area light");
    check(&|f| f.json["nodes"][1]["extensions"][NAME]["light"] = json!(7), &format!("{missing} 7, which"));
    check(
        &|f| f.json["extensions"][NAME]["lights"] = json!([]),
        &format!("{missing} 0, which does not exist"),
    );
    check(&|f| f.json["extensions"] = json!({}), &missing);
    check(&|f| f.json["extensions"][NAME] = json!(3), &format!("extensions.{NAME}: ignored invalid value 3"));
    check(&|f| f.json["extensions"][NAME]["lights"] = json!({}), &format!("extensions.{NAME}: ignored"));
    let no_index = format!("nodes[1].extensions.{NAME}: ignored light without an index");
    check(&|f| f.json["nodes"][1]["extensions"][NAME] = json!({}), &no_index);
    check(&|f| f.json["nodes"][1]["extensions"][NAME]["light"] = json!(-1), &no_index);
    check(&|f| f.json["nodes"][1]["extensions"][NAME]["light"] = json!("0"), &no_index);
    check(&|f| f.json["nodes"][1]["extensions"][NAME] = json!([0]), &no_index);
}

#[test]
fn colour_and_intensity_can_be_animated() {
    let mut fixture = with_lights(&[json!({"type": "rect"})]);
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let intensities = fixture.floats("SCALAR", 1, &[1.0, 3.0]);
    let colors = fixture.vec3(&[[1.0, 1.0, 1.0], [0.0, 1.0, -1.0]]);
    let channel = |sampler: usize, member: &str| {
        let pointer = format!("/extensions/{NAME}/lights/0/{member}");
        json!({"sampler": sampler, "target": {"path": "pointer",
            "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}})
    };
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": intensities}, {"input": times, "output": colors}],
            "channels": [channel(0, "intensity"), channel(1, "color"), channel(0, "size")]}),
    );
    let (scene, warnings) = fixture.load();
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("lights/0/size"), "{warning}");
    let at = |time| {
        let posed = pose(&scene, &PoseSettings { time, ..PoseSettings::default() }).unwrap();
        posed.area_lights(LightUnits::Unitless, 1.0)[0].radiance
    };
    assert_eq!((at(0.0), at(1.0)), (Vec3::ONE, Vec3::new(0.0, 3.0, 0.0)));
}
