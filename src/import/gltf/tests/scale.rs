//! `LoadOptions::scale`.

use std::path::Path;

use glam::DVec3;
use serde_json::json;

use super::super::fixture::Fixture;
use crate::{LoadOptions, load_bytes};
use blinn_scene::{FileProjection, PoseSettings, pose};

#[test]
fn lengths_of_gltf_files_are_scaled_and_intensities_are_not() {
    let mut file = Fixture::triangle();
    file.json["nodes"][0]["translation"] = json!([1000, 0, 0]);
    let volume = json!({"thicknessFactor": 10, "attenuationDistance": 50});
    file.push("materials", json!({"extensions": {"KHR_materials_volume": volume}}));
    file.primitive()["material"] = json!(0);
    file.push(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 200, "ymag": 100, "znear": 10, "zfar": 3000}}),
    );
    file.node(json!({"camera": 0, "translation": [0, 0, 2000]}));
    let radius = json!({"shadow_soft_size": 40});
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 80, "range": 5000, "extras": radius}, {"type": "directional"}]}});
    file.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let options = LoadOptions { scale: Some(0.001), ..LoadOptions::default() };
    let (scene, _) = load_bytes(&file.glb(), Path::new("a.glb"), &options).unwrap();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let (min, max) = (posed.bounds().min, posed.bounds().max);
    assert!(min.abs_diff_eq(DVec3::X, 1e-7), "{min}");
    assert!(max.abs_diff_eq(DVec3::new(1.001, 0.001, 0.0), 1e-7), "{max}");
    let camera = &scene.cameras[0];
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * b, "{a} {b}");
    close(camera.znear, 0.01);
    close(camera.zfar, 3.0);
    let FileProjection::Orthographic { xmag, ymag } = camera.projection else { panic!("orthographic") };
    close(xmag, 0.2);
    close(ymag, 0.1);
    let light = &scene.lights[0];
    close(light.range.into(), 5.0);
    close(light.radius.into(), 0.04);
    assert_eq!(light.intensity, 80.0);
    let volume = scene.materials[scene.meshes[0].material as usize].volume.unwrap();
    close(volume.thickness.into(), 0.01);
    close(volume.attenuation_distance.into(), 0.05);
}
