//! EXT_lights_image_based.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use crate::{Limits, LoadOptions};
use blinn_core::geometry::Rgb;
use blinn_scene::{PoseSettings, UpAxis, pose};

const NAME: &str = "EXT_lights_image_based";

/// A PNG of 2 × 2 pixels of one colour.
fn png(pixel: [u8; 4]) -> Vec<u8> {
    encoded(image::RgbaImage::from_pixel(2, 2, image::Rgba(pixel)).into(), image::ImageFormat::Png)
}

fn encoded(picture: image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A triangle lit by an environment with these faces.
fn with_faces(faces: &[Vec<u8>], mime: &str) -> Fixture {
    let mut fixture = Fixture::triangle();
    let mut indices = Vec::new();
    for face in faces {
        let view = fixture.view(face);
        indices.push(fixture.push("images", json!({"bufferView": view, "mimeType": mime})));
    }
    let light = json!({"specularImageSize": 2, "specularImages": [indices],
        "irradianceCoefficients": vec![vec![0.0; 3]; 9]});
    fixture.json["extensions"] = json!({NAME: {"lights": [light]}});
    fixture.json["scenes"][0]["extensions"] = json!({NAME: {"light": 0}});
    fixture.json["extensionsUsed"] = json!([NAME]);
    fixture
}

/// Faces of RGBD that are bright towards +X alone: white over an alpha of 51 is 5.
fn bright_towards_x() -> Fixture {
    let face = |i: usize| png(if i == 0 { [255, 255, 255, 51] } else { [0, 0, 0, 255] });
    with_faces(&(0..6).map(face).collect::<Vec<_>>(), "image/png")
}

fn light(fixture: &mut Fixture) -> &mut Value {
    &mut fixture.json["extensions"][NAME]["lights"][0]
}

#[test]
fn rgbd_faces_are_radiance_and_intensity_and_rotation_apply() {
    let mut fixture = bright_towards_x();
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let environment = scene.environment.unwrap().in_world();
    let along = |d: Vec3| environment.radiance(d, 0.0).x;
    assert!((along(Vec3::X) - 5.0).abs() < 1e-3 && along(Vec3::NEG_X) == 0.0 && along(Vec3::Z) == 0.0);
    // A quarter turn about +Y takes +Z to +X, and +X to −Z.
    let half = 0.5f64.sqrt();
    light(&mut fixture)["rotation"] = json!([0.0, half, 0.0, half]);
    light(&mut fixture)["intensity"] = json!(2.0);
    let environment = fixture.load().0.environment.unwrap().in_world();
    assert!((environment.radiance(Vec3::NEG_Z, 0.0).x - 10.0).abs() < 0.01);
    assert!(environment.radiance(Vec3::X, 0.0).x < 0.01);
}

/// The environment turns with everything in the file: +Y of the file is −Z of the world.
#[test]
fn up_z_turns_the_environment() {
    let face = |i: usize| png(if i == 2 { [255; 4] } else { [0, 0, 0, 255] });
    let fixture = with_faces(&(0..6).map(face).collect::<Vec<_>>(), "image/png");
    let options = LoadOptions { up: Some(UpAxis::Z), ..LoadOptions::default() };
    let environment = fixture.load_with(&options).0.environment.unwrap().in_world();
    assert!((environment.radiance(Vec3::NEG_Z, 0.0).x - 1.0).abs() < 0.01);
}

#[test]
fn pictures_without_alpha_are_srgb() {
    let grey: image::DynamicImage = image::RgbImage::from_pixel(2, 2, image::Rgb([188; 3])).into();
    for (format, mime) in [(image::ImageFormat::Png, "image/png"), (image::ImageFormat::Jpeg, "image/jpeg")] {
        let faces = vec![encoded(grey.clone(), format); 6];
        let environment = with_faces(&faces, mime).load().0.environment.unwrap().in_world();
        let found = environment.radiance(Vec3::Y, 0.0);
        assert!(found.abs_diff_eq(Rgb::splat(0.5), 0.01), "{mime}: {found}");
    }
}

/// The irradiance of a light from +Z, E = π (½ + ½ z).
#[test]
fn irradiance_coefficients_give_the_ambient_light() {
    let mut fixture = bright_towards_x();
    let (constant, first) = (0.5 * PI / 0.282_095, 0.5 * PI / 0.488_603);
    light(&mut fixture)["irradianceCoefficients"][0] = json!([constant, constant, constant]);
    light(&mut fixture)["irradianceCoefficients"][2] = json!([first, first, first]);
    let sky = fixture.load().0.environment.unwrap().in_world().irradiance();
    for (n, expected) in [(DVec3::Z, 1.0), (DVec3::NEG_Z, 0.0), (DVec3::X, 0.5), (DVec3::Y, 0.5)] {
        assert!((sky.ambient(n).x - expected).abs() < 1e-4, "{n}: {}", sky.ambient(n));
    }
}

#[test]
fn damaged_lights_are_warnings() {
    let check = |edit: &dyn Fn(&mut Fixture), expected: &str, has_environment: bool| {
        let mut fixture = bright_towards_x();
        edit(&mut fixture);
        let (scene, warnings) = fixture.load();
        assert!(warnings.iter().any(|warning| warning.contains(expected)), "{expected}: {warnings:?}");
        assert_eq!(scene.environment.is_some(), has_environment, "{expected}");
    };
    let missing = "the environment light is missing";
    check(&|f| f.json["scenes"][0]["extensions"][NAME]["light"] = json!(7), missing, false);
    check(&|f| f.json["extensions"] = json!({}), missing, false);
    check(&|f| light(f)["specularImages"] = json!([[0, 1, 2]]), "does not begin with six images", false);
    check(&|f| light(f)["specularImages"] = json!("x"), "does not begin with six images", false);
    check(&|f| light(f)["specularImages"][0][3] = json!(99), "there is no image 99", false);
    check(&|f| f.json["images"][4] = json!({"uri": "missing.png"}), missing, false);
    check(&|f| light(f)["irradianceCoefficients"] = json!([[1]]), "are not 9 × 3 numbers", true);
    check(&|f| light(f)["intensity"] = json!(-1), "the intensity is not a positive number", true);
    check(&|f| light(f)["intensity"] = json!("bright"), "the intensity is not a positive number", true);
    check(&|f| light(f)["rotation"] = json!([1, 2]), "the rotation is no quaternion", true);
    let wide = encoded(image::RgbImage::new(4, 2).into(), image::ImageFormat::Png);
    check(
        &|f| {
            let view = f.view(&wide);
            f.json["images"][5] = json!({"bufferView": view, "mimeType": "image/png"});
        },
        "the faces must be squares of one size",
        false,
    );
}

#[test]
fn a_light_that_no_scene_uses_is_not_shown() {
    let mut fixture = bright_towards_x();
    fixture.json["scenes"][0]["extensions"] = json!({});
    let (scene, warnings) = fixture.load();
    assert!(scene.environment.is_none() && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn faces_count_as_textures_in_limits() {
    let options = |limits| LoadOptions { limits, ..LoadOptions::default() };
    let fixture = bright_towards_x();
    let limits = Limits { texture_bytes: 15, ..Limits::default() };
    assert!(
        fixture
            .try_load_with(&options(limits))
            .unwrap_err()
            .to_string()
            .contains("bytes of decoded textures")
    );
}

/// A quarter turn about +Y within a second takes the light from +X to −Z, while it becomes three times as bright.
#[test]
fn intensity_and_rotation_are_animated() {
    let half = 0.5f32.sqrt();
    let mut fixture = bright_towards_x();
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let rotations = fixture.floats("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]);
    let intensities = fixture.floats("SCALAR", 1, &[1.0, 3.0]);
    let channel = |sampler: usize, member: &str| {
        let pointer = format!("/extensions/{NAME}/lights/0/{member}");
        json!({"sampler": sampler, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}})
    };
    fixture.json["animations"] = json!([{
        "samplers": [{"input": times, "output": rotations}, {"input": times, "output": intensities}],
        "channels": [channel(0, "rotation"), channel(1, "intensity")],
    }]);
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let radiance = |time: f64, d: Vec3| {
        let posed = pose(&scene, &PoseSettings { time, ..PoseSettings::default() }).unwrap();
        posed.environment.unwrap().radiance(d, 0.0).x
    };
    let (middle, end) = (Vec3::new(half, 0.0, -half), Vec3::NEG_Z);
    for (time, towards, expected) in [(0.0, Vec3::X, 5.0), (0.5, middle, 10.0), (1.0, end, 15.0)] {
        assert!((radiance(time, towards) - expected).abs() < 0.02, "{time}: {}", radiance(time, towards));
    }
    assert!(radiance(1.0, Vec3::X) < 0.02);
}

/// Another light than the scene's is no target.
#[test]
fn animations_of_other_lights_are_ignored() {
    let mut fixture = bright_towards_x();
    let light = light(&mut fixture).clone();
    fixture.json["extensions"][NAME]["lights"].as_array_mut().unwrap().push(light);
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    fixture.json["animations"] = json!([{
        "samplers": [{"input": times, "output": times}],
        "channels": [{"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer":
            {"pointer": format!("/extensions/{NAME}/lights/1/intensity")}}}}],
    }]);
    let (scene, warnings) = fixture.load();
    assert!(scene.animations[0].channels.is_empty() && warnings.is_empty(), "{warnings:?}");
}
