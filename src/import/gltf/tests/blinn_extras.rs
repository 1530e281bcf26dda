//! extras.blinn, as the Blender extension writes it.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, Vec3};
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use blinn_scene::{AreaLightShape, FileFrames, FileSettings, LightUnits, PictureRegion, Scene, ThinLens};

fn with_scene_extras(blinn: Value) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["scenes"][0]["extras"] = json!({"blinn": blinn});
    fixture
}

/// A scene that is read without a warning.
fn load(fixture: &Fixture) -> Scene {
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    scene
}

/// A picture of the world that is red towards +X, where its middle is, and black elsewhere.
fn red_towards_x() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    let pixel = |i: usize| if (6..10).contains(&(i % 16)) { [128, 0, 0, 129] } else { [0; 4] };
    bytes.extend((0..128).flat_map(pixel));
    bytes
}

#[test]
fn render_settings_are_read() {
    let scene = load(&with_scene_extras(json!({
        "version": 1, "resolution": [1921, 1080], "percentage": 50, "pixelAspect": 1.5,
        "region": {"min": [0.25, 0], "max": [0.5, 1]},
        "frames": {"start": 1, "end": 40, "step": 2, "current": 7, "rate": 29.97},
        "view": {"transform": "AgX", "look": "AgX - Punchy", "exposure": -1.5, "gamma": 1.25, "filmExposure": 2},
        "filmTransparent": true, "indirect": 4, "caustics": false, "lightUnits": "raw",
    })));
    let expected = FileSettings {
        size: Some((960, 540)),
        pixel_aspect: Some(1.5),
        region: Some(PictureRegion { min: [0.25, 0.0], max: [0.5, 1.0] }),
        frames: Some(FileFrames { start: 1, end: 40, step: 2, rate: 29.97 }),
        view_transform: Some("AgX".into()),
        look: Some("AgX - Punchy".into()),
        gamma: Some(1.25),
        exposure: Some(-0.5),
        film_transparent: Some(true),
        indirect: Some(4),
        caustics: Some(false),
        camera: None,
    };
    assert_eq!(scene.settings, expected);
    assert_eq!(scene.source.light_units, Some(LightUnits::Raw));
    assert_eq!(load(&Fixture::triangle()).settings, FileSettings::default());
}

#[test]
fn settings_are_those_of_the_selected_scene() {
    let mut fixture = with_scene_extras(json!({"indirect": 1}));
    fixture.push("scenes", json!({"name": "other", "nodes": [0], "extras": {"blinn": {"indirect": 2}}}));
    assert_eq!(load(&fixture).settings.indirect, Some(1));
    fixture.json["scene"] = json!(1);
    assert_eq!(load(&fixture).settings.indirect, Some(2));
}

#[test]
fn wrong_values_are_ignored_each_with_one_warning() {
    for (blinn, place) in [
        (json!(7), ""),
        (json!({"resolution": [640]}), ".resolution"),
        (json!({"resolution": [0, 480]}), ".resolution"),
        (json!({"resolution": ["640", 480]}), ".resolution"),
        (json!({"resolution": [65536, 65536]}), ".resolution"),
        (json!({"resolution": [60000, 10], "percentage": 32767}), ".resolution"),
        (json!({"percentage": -1, "resolution": [8, 8]}), ".percentage"),
        (json!({"pixelAspect": 0}), ".pixelAspect"),
        (json!({"region": []}), ".region"),
        (json!({"region": {"min": [0.5, 0], "max": [0.5, 1]}}), ".region"),
        (json!({"region": {"min": [-1, 0], "max": [1, 1]}}), ".region.min"),
        (json!({"frames": {"start": 9, "end": 1, "rate": 24}}), ".frames"),
        (json!({"frames": {"start": 1, "end": 1e300, "rate": 24}}), ".frames.end"),
        (json!({"frames": {"start": 1, "end": 2, "rate": 0}}), ".frames.rate"),
        (json!({"frames": {"start": 1, "end": 2, "step": 0, "rate": 24}}), ".frames.step"),
        (json!({"view": "AgX"}), ".view"),
        (json!({"view": {"transform": 3}}), ".view.transform"),
        (json!({"view": {"exposure": 1e9}}), ".view.exposure"),
        (json!({"view": {"filmExposure": 0}}), ".view.filmExposure"),
        (json!({"view": {"gamma": "1"}}), ".view.gamma"),
        (json!({"view": {"gamma": 0}}), ".view.gamma"),
        (json!({"view": {"look": 1}}), ".view.look"),
        (json!({"filmTransparent": 1}), ".filmTransparent"),
        (json!({"indirect": -1}), ".indirect"),
        (json!({"indirect": 1.5}), ".indirect"),
        (json!({"caustics": "yes"}), ".caustics"),
        (json!({"lightUnits": "lumens"}), ".lightUnits"),
        (json!({"world": 1}), ".world"),
        (json!({"world": {"color": [1, -1, 0]}}), ".world.color"),
        (json!({"world": {"bufferView": -1}}), ".world.bufferView"),
        (json!({"world": {"bufferView": 99}}), ".world.bufferView"),
        (json!({"world": {"bufferView": 0}}), ".world.bufferView"),
    ] {
        let (scene, warnings) = with_scene_extras(blinn.clone()).load();
        assert_eq!(warnings.len(), 1, "{blinn}: {warnings:?}");
        let place = format!("scenes[0].extras.blinn{place}: ");
        assert!(warnings[0].starts_with(&place), "{blinn}: {warnings:?}");
        let mut settings = scene.settings;
        settings.size = settings.size.filter(|size| *size != (8, 8));
        settings.frames = settings.frames.filter(|frames| (frames.start, frames.step) != (1, 1));
        assert_eq!(settings, FileSettings::default(), "{blinn}");
        assert!(scene.environment.is_none() && scene.source.light_units.is_none(), "{blinn}");
    }
}

#[test]
fn long_values_are_shortened_in_warnings() {
    let (_, warnings) = with_scene_extras(json!({"view": {"exposure": "é".repeat(1000)}})).load();
    assert!(warnings[0].ends_with(&format!("ignored invalid value \"{}…", "é".repeat(59))), "{warnings:?}");
}

#[test]
fn a_world_of_one_colour_replaces_the_ambient_light() {
    let scene = load(&with_scene_extras(json!({"world": {"color": [0.5, 0, 2]}})));
    assert_eq!(scene.environment.unwrap().in_world().as_uniform(), Some(Vec3::new(0.5, 0.0, 2.0)));
}

#[test]
fn a_picture_of_the_world_is_turned_and_scaled() {
    let mut fixture = Fixture::triangle();
    let view = fixture.view(&red_towards_x());
    let half = FRAC_PI_2 / 2.0;
    for (rotation, bright) in [
        (json!([0, 0, 0, 1]), Vec3::X),
        // A quarter turn about +Y takes +X to −Z.
        (json!([0, half.sin(), 0, half.cos()]), Vec3::NEG_Z),
        (json!([0, 0, half.sin(), half.cos()]), Vec3::Y),
    ] {
        let world = json!({"bufferView": view, "strength": 3, "rotation": rotation});
        fixture.json["scenes"][0]["extras"] = json!({"blinn": {"world": world}});
        let environment = load(&fixture).environment.unwrap().in_world();
        assert!((environment.radiance(bright, 0.0).x - 3.0).abs() < 0.02, "{rotation}");
        assert!(environment.radiance(-bright, 0.0).x < 0.02, "{rotation}");
    }
}

#[test]
fn the_lens_and_the_active_camera_are_read() {
    let mut fixture = Fixture::triangle();
    let perspective = json!({"yfov": 1, "znear": 0.1});
    let dof = json!({"focusDistance": 2, "apertureRadius": 0.01, "blades": 6, "rotation": 0.5, "ratio": 2});
    let extras = json!({"blinn": {"shift": [0.25, -0.5], "depthOfField": dof}});
    fixture.push("cameras", json!({"type": "perspective", "perspective": perspective}));
    fixture.push("cameras", json!({"type": "perspective", "perspective": perspective, "extras": extras}));
    fixture.node(json!({"camera": 0}));
    assert_eq!(load(&fixture).default_camera(), Some(0));
    fixture.node(json!({"camera": 1, "extras": {"blinn": {"activeCamera": true}}}));
    fixture.node(json!({"camera": 0, "extras": {"blinn": {"activeCamera": true}}}));
    let scene = load(&fixture);
    assert_eq!(scene.default_camera(), Some(1));
    let lens = |i: usize| (scene.cameras[i].shift, scene.cameras[i].lens);
    assert_eq!(lens(0), (DVec2::ZERO, None));
    let thin = ThinLens { blades: 6, rotation: 0.5, ratio: 2.0, ..ThinLens::round(0.01, 2.0) };
    assert_eq!(lens(1), (DVec2::new(0.25, -0.5), Some(thin)));

    fixture.json["cameras"][1]["extras"]["blinn"] = json!({"shift": 1, "depthOfField": true});
    fixture.json["nodes"][2]["extras"]["blinn"] = json!({"activeCamera": "yes"});
    let warnings = fixture.load().1;
    let places = ["cameras[1].extras.blinn.shift", "cameras[1].extras.blinn.depthOfField"];
    let places = places.into_iter().chain(["nodes[2].extras.blinn.activeCamera"]);
    assert_eq!(warnings.len(), 3);
    for (warning, place) in warnings.iter().zip(places) {
        assert!(warning.starts_with(&format!("{place}: ignored ")), "{warning}");
    }
}

/// A triangle with one light of KHR_lights_punctual, in a file with lights in `units`.
fn with_light(light: Value, units: &str) -> Fixture {
    let mut fixture = with_scene_extras(json!({"lightUnits": units}));
    fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
    fixture.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    fixture
}

#[test]
fn suns_have_their_true_strength_colour_and_angle() {
    let blinn = json!({"angle": FRAC_PI_2, "strength": 2.5, "color": [4, 1, 0.5]});
    let sun = json!({"type": "directional", "intensity": 683, "extras": {"blinn": blinn}});
    for (units, intensity) in [("standard", 2.5 * 683.0), ("unitless", 2.5), ("raw", 2.5)] {
        let scene = load(&with_light(sun.clone(), units));
        let light = &scene.lights[0];
        assert_eq!((light.intensity, light.color), (intensity, Vec3::new(4.0, 1.0, 0.5)), "{units}");
        assert!((f64::from(light.radius) - (0.5 * FRAC_PI_2).tan()).abs() < 1e-6);
    }
}

#[test]
fn points_and_spots_have_their_radius_and_nothing_of_a_sun() {
    for kind in ["point", "spot"] {
        let blinn = json!({"radius": 0.5, "strength": 9, "angle": 1});
        let mut light = json!({"type": kind, "intensity": 3, "extras": {"blinn": blinn, "radius": 7}});
        let scene = load(&with_light(light.clone(), "standard"));
        assert_eq!((scene.lights[0].radius, scene.lights[0].intensity), (0.5, 3.0));
        light["extras"]["blinn"]["radius"] = json!(-1);
        let (scene, warnings) = with_light(light, "standard").load();
        assert_eq!(scene.lights[0].radius, 7.0);
        let warning =
            "extensions.KHR_lights_punctual.lights[0].extras.blinn.radius: ignored invalid value -1";
        assert_eq!(warnings, [warning]);
    }
}

#[test]
fn discs_may_be_ellipses_of_the_same_area() {
    let mut fixture = Fixture::triangle();
    let light = json!({"type": "disk", "size": 2, "extras": {"blinn": {"aspect": 4}}});
    fixture.json["extensions"] = json!({"EXT_lights_area": {"lights": [light]}});
    fixture.json["extensionsUsed"] = json!(["EXT_lights_area"]);
    fixture.node(json!({"extensions": {"EXT_lights_area": {"light": 0}}}));
    let scene = load(&fixture);
    assert_eq!((scene.area_lights[0].shape, scene.area_lights[0].size), (AreaLightShape::Disk, [4.0, 1.0]));
}

#[test]
fn thin_walls_of_blender_are_read() {
    let mut fixture = super::materials::textured(json!({
        "pbrMetallicRoughness": {"metallicFactor": 0}, "extras": {"blinn": {"thinWall": true}},
    }));
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.2.41");
    assert!(load(&fixture).materials[0].thin_wall);
    fixture.json["materials"][0]["extras"]["blinn"]["thinWall"] = json!(1);
    let (scene, warnings) = fixture.load();
    assert!(!scene.materials[0].thin_wall);
    assert_eq!(warnings, ["materials[0].extras.blinn.thinWall: ignored invalid value 1"]);
}
