//! Numbers outside of their range in materials, vertex colours, lights and cameras.

use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use super::super::fixture::{Fixture, bytes_of};
use blinn_scene::{
    AnimationChoice, FileProjection, LightUnits, Material, PoseSettings, Reflectance, Scene, pose,
};

fn with_material(material: Value) -> (Material, Vec<String>) {
    let mut fixture = Fixture::triangle();
    fixture.push("materials", material);
    fixture.primitive()["material"] = json!(0);
    let (scene, warnings) = fixture.load();
    (scene.materials[0].clone(), warnings)
}

#[test]
fn colours_below_0_and_of_bytes_are_repaired() {
    let byte = 94.0f64 / 255.0;
    for (factor, color, alpha) in [
        (json!([94, 94, 94, 255]), Vec3::splat(byte as f32), 1.0),
        (json!([-0.5, 0.5, 0.5, 1]), Vec3::new(0.0, 0.5, 0.5), 1.0),
        (json!([0.5, 0.5, 0.5, -1]), Vec3::splat(0.5), 0.0),
        (json!([1.5, 1, 1, 1]), Vec3::new(1.5, 1.0, 1.0), 1.0),
    ] {
        let (material, warnings) =
            with_material(json!({"pbrMetallicRoughness": {"baseColorFactor": factor}}));
        assert_eq!((material.base_color.factor, material.alpha.factor), (color, alpha));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(
            warnings[0].starts_with("materials[0].pbrMetallicRoughness.baseColorFactor: "),
            "{warnings:?}"
        );
    }
    let (material, _) = with_material(json!({"emissiveFactor": [-1, 0.5, 255]}));
    assert_eq!(material.emission.factor, Vec3::new(0.0, 0.5, 255.0));
    let (material, _) = with_material(json!({"emissiveFactor": [0, 51, 255]}));
    assert_eq!(material.emission.factor, Vec3::new(0.0, 0.2, 1.0));
}

#[test]
fn fractions_are_clamped() {
    for (value, expected) in [(-0.5, 0.0), (1.5, 1.0), (50.0, 1.0)] {
        let (material, warnings) = with_material(json!({
            "pbrMetallicRoughness": {"metallicFactor": value, "roughnessFactor": value},
            "extensions": {"KHR_materials_specular": {"specularFactor": value, "specularColorFactor": [-1, 2, 1]},
                "KHR_materials_transmission": {"transmissionFactor": value},
                "KHR_materials_clearcoat": {"clearcoatFactor": value, "clearcoatRoughnessFactor": value}}}));
        let Reflectance::MetallicRoughness { metallic, roughness, dielectric } = &material.reflectance else {
            panic!()
        };
        let found = [
            metallic.factor,
            roughness.factor,
            dielectric.specular.factor,
            material.transmission.factor,
            material.clearcoat.factor.factor,
            material.clearcoat.roughness.factor,
        ];
        assert_eq!(found, [expected as f32; 6]);
        assert_eq!(dielectric.specular_color.factor, Vec3::new(0.0, 2.0, 1.0));
        assert_eq!(warnings.len(), 7, "{warnings:?}");
    }
}

/// The specification bounds the reflectance that follows, not the factor.
#[test]
fn colours_of_specular_reflection_are_never_bytes() {
    for factor in [[25.0, 25.0, 25.0], [255.0, 0.0, 51.0], [12.5, 30.0, 1.0], [1e4, 1.0, 0.0]] {
        let (material, warnings) =
            with_material(json!({"extensions": {"KHR_materials_specular": {"specularColorFactor": factor}}}));
        let Reflectance::MetallicRoughness { dielectric, .. } = &material.reflectance else { panic!() };
        assert_eq!(dielectric.specular_color.factor, Vec3::from(factor.map(|v: f64| v as f32)));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn other_numbers_of_materials_have_the_nearest_valid_value() {
    let (material, warnings) = with_material(json!({"alphaMode": "MASK", "alphaCutoff": -1,
        "extensions": {"KHR_materials_ior": {"ior": 0.5}, "KHR_materials_emissive_strength": {"emissiveStrength": -2},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": -1, "attenuationColor": [255, 0, 51]}}}));
    let Reflectance::MetallicRoughness { dielectric, .. } = &material.reflectance else { panic!() };
    let volume = material.volume.unwrap();
    assert_eq!((dielectric.ior, material.emission_strength), (1.0, 0.0));
    assert_eq!(volume.attenuation_color, Vec3::new(1.0, 0.0, 0.2));
    assert_eq!((volume.attenuation_distance, warnings.len()), (f32::INFINITY, 5), "{warnings:?}");
    let (material, warnings) = with_material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor": [-1, 0, 0, 2], "specularFactor": [51, 51, 51], "glossinessFactor": 7}}}));
    let Reflectance::SpecularGlossiness { specular, glossiness } = &material.reflectance else { panic!() };
    assert_eq!((material.base_color.factor, material.alpha.factor), (Vec3::ZERO, 1.0));
    assert_eq!(
        (specular.factor, glossiness.factor, warnings.len()),
        (Vec3::splat(0.2), 1.0, 4),
        "{warnings:?}"
    );
}

#[test]
fn float_colours_of_vertices_are_bytes_or_clamped() {
    let colors = |values: &[[f32; 4]; 3]| {
        let mut fixture = Fixture::triangle();
        let colors = fixture.vec4(values);
        fixture.primitive()["attributes"]["COLOR_0"] = json!(colors);
        let (scene, warnings) = fixture.load();
        (scene.meshes[0].colors.clone(), warnings.len())
    };
    let bytes = [[255.0, 0.0, 51.0, 255.0], [0.0, 0.0, 0.0, 255.0], [127.5, 1.0, 2.0, 1.0]];
    let (found, warnings) = colors(&bytes);
    assert_eq!((found[0], found[1], warnings), (Vec4::new(1.0, 0.0, 0.2, 1.0), Vec4::W, 1));
    assert_eq!((found[2].x, found[2].w), (0.5, 1.0));
    let (found, warnings) = colors(&[[-1.0, 0.5, 1.5, 1.0], [1.0; 4], [0.0; 4]]);
    assert_eq!((found[0], warnings), (Vec4::new(0.0, 0.5, 1.0, 1.0), 2));
    let rounded = 1.0 + f32::EPSILON;
    let (found, warnings) = colors(&[[rounded, 0.5, -1e-9, 1.0], [1.0; 4], [0.0; 4]]);
    assert_eq!((found[0], warnings), (Vec4::new(1.0, 0.5, 0.0, 1.0), 0));
}

#[test]
fn signed_normalized_colours_are_not_negative() {
    let mut fixture = Fixture::triangle();
    let colors = fixture.accessor(5122, "VEC4", 3, &bytes_of(&[-32767i16, 32767, 0, 32767].repeat(3)));
    fixture.json["accessors"][colors]["normalized"] = json!(true);
    fixture.primitive()["attributes"]["COLOR_0"] = json!(colors);
    assert_eq!(fixture.load().0.meshes[0].colors[0], Vec4::new(0.0, 1.0, 0.0, 1.0));
}

#[test]
fn lights_and_cameras_are_repaired() {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "point", "color": [255, 51, 0], "intensity": -3}, {"type": "point", "color": [-1, 0, 1]}]);
    for light in 0..2 {
        fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": light}}}));
    }
    fixture.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 45, "znear": 0.1, "aspectRatio": -1}}),
    );
    fixture.node(json!({"camera": 0}));
    let (scene, warnings) = fixture.load();
    assert_eq!((scene.lights[0].color, scene.lights[0].intensity), (Vec3::new(1.0, 0.2, 0.0), 0.0));
    assert_eq!(scene.lights[1].color, Vec3::Z);
    let FileProjection::Perspective { yfov, aspect } = scene.cameras[0].projection else { panic!() };
    assert!((yfov - 45f64.to_radians()).abs() < 1e-6 && aspect.is_none(), "{yfov} {aspect:?}");
    assert_eq!(warnings.len(), 5, "{warnings:?}");
}

fn posed(scene: &Scene, time: f64) -> (Material, Vec3) {
    let settings = PoseSettings { time, animation: AnimationChoice::All, centre: None };
    let posed = pose(scene, &settings).unwrap();
    (posed.materials[0].clone(), posed.lights(LightUnits::Raw, 1.0)[0].intensity)
}

/// A spline overshoots its keys.
#[test]
fn animated_factors_stay_in_their_range() {
    let mut fixture = Fixture::triangle();
    fixture.push("materials", json!({}));
    fixture.primitive()["material"] = json!(0);
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "point"}]);
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let color = fixture.vec4(&[[-1.0; 4], [2.0; 4]]);
    let vector = fixture.vec3(&[[-1.0; 3], [2.0; 3]]);
    let number = fixture.floats("SCALAR", 1, &[-1.0, 2.0]);
    let mut channels = Vec::new();
    let mut samplers = Vec::new();
    for (pointer, output) in [
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", color),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", number),
        ("/materials/0/emissiveFactor", vector),
        ("/extensions/KHR_lights_punctual/lights/0/color", vector),
        ("/extensions/KHR_lights_punctual/lights/0/intensity", number),
    ] {
        channels.push(json!({"sampler": samplers.len(), "target": {"path": "pointer",
            "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}}));
        samplers.push(json!({"input": times, "output": output}));
    }
    fixture.push("animations", json!({"channels": channels, "samplers": samplers}));
    let (scene, _) = fixture.load();
    let (material, light) = posed(&scene, 0.0);
    let Reflectance::MetallicRoughness { metallic, .. } = &material.reflectance else { panic!() };
    assert_eq!((material.base_color.factor, material.alpha.factor, metallic.factor), (Vec3::ZERO, 0.0, 0.0));
    assert_eq!((material.emission.factor, light), (Vec3::ZERO, Vec3::ZERO));
    let (material, light) = posed(&scene, 1.0);
    assert!(light.x > 0.0 && light.is_finite(), "{light}");
    let Reflectance::MetallicRoughness { metallic, .. } = &material.reflectance else { panic!() };
    assert_eq!(
        (material.base_color.factor, material.alpha.factor, metallic.factor),
        (Vec3::splat(2.0), 1.0, 1.0)
    );
}

#[test]
fn texture_coordinates_that_are_not_finite_are_0() {
    let mut fixture = Fixture::triangle();
    let uvs = fixture.vec2(&[[f32::NAN, 0.5], [1.0, f32::INFINITY], [0.25, 0.75]]);
    fixture.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    let (scene, warnings) = fixture.load();
    let found: Vec<[f32; 2]> = scene.meshes[0].uvs[0].iter().map(|uv| uv.to_array()).collect();
    assert_eq!(found, [[0.0, 0.5], [1.0, 0.0], [0.25, 0.75]]);
    let warning =
        "meshes[0].primitives[0].attributes.TEXCOORD_0: 2 texture coordinates are not finite; used 0";
    assert_eq!(warnings, [warning]);
}
