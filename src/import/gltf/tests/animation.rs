//! Animations and skins.

use glam::{DAffine3, DVec3, Vec3};
use serde_json::{Value, json};

use super::super::fixture::{Fixture, bytes_of};
use super::materials::textured;
use blinn_scene::pose;
use blinn_scene::{ChannelTarget, Interpolation, Keyframes, PoseSettings};

/// A triangle with one channel on node 0, two keys.
fn animated(path: &str, interpolation: &str, kind: &str, width: usize, values: &[f32]) -> Fixture {
    let mut fixture = Fixture::triangle();
    let times = fixture.floats("SCALAR", 1, &[0.5, 1.5]);
    let values = fixture.floats(kind, width, values);
    let channels = json!([{"sampler": 0, "target": {"node": 0, "path": path}}]);
    let samplers = json!([{"input": times, "output": values, "interpolation": interpolation}]);
    fixture.push("animations", json!({"name": "clip", "channels": channels, "samplers": samplers}));
    fixture
}

#[test]
fn every_path_and_interpolation_is_read() {
    let cases: [(&str, &str, &str, usize, ChannelTarget); 5] = [
        ("translation", "LINEAR", "VEC3", 3, ChannelTarget::Translation(0)),
        ("scale", "STEP", "VEC3", 3, ChannelTarget::Scale(0)),
        ("rotation", "CUBICSPLINE", "VEC4", 4, ChannelTarget::Rotation(0)),
        ("weights", "LINEAR", "SCALAR", 1, ChannelTarget::Weights(0)),
        ("weights", "CUBICSPLINE", "SCALAR", 1, ChannelTarget::Weights(0)),
    ];
    for (path, interpolation, kind, width, target) in cases {
        let parts = if interpolation == "CUBICSPLINE" { 3 } else { 1 };
        // Two weights per keyframe.
        let numbers = if path == "weights" { 2 } else { width };
        let values: Vec<f32> = (0..2 * parts * numbers).map(|i| i as f32).collect();
        let (scene, warnings) = animated(path, interpolation, kind, width, &values).load();
        let [channel] = &scene.animations[0].channels[..] else { panic!("{path} {warnings:?}") };
        assert_eq!(channel.target, target);
        let keys = &channel.keyframes;
        assert_eq!((&keys.times[..], &keys.values, keys.width), (&[0.5, 1.5][..], &values, numbers));
        let expected = match interpolation {
            "STEP" => Interpolation::Step,
            "CUBICSPLINE" => Interpolation::CubicSpline,
            _ => Interpolation::Linear,
        };
        assert_eq!(keys.interpolation, expected);
    }
}

#[test]
fn normalized_integers_are_converted() {
    let mut fixture = animated("rotation", "LINEAR", "VEC4", 4, &[0.0; 8]);
    let output = fixture.accessor(5122, "VEC4", 2, &bytes_of(&[0i16, 0, 0, 32767, 0, 0, 32767, 0]));
    fixture.json["accessors"][output]["normalized"] = json!(true);
    fixture.json["animations"][0]["samplers"][0]["output"] = json!(output);
    let (scene, _) = fixture.load();
    assert_eq!(scene.animations[0].channels[0].keyframes.values, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
}

#[test]
fn an_invalid_channel_is_ignored_with_a_warning() {
    type Break = fn(&mut Value);
    let breaks: [Break; 6] = [
        |a| a["samplers"][0]["output"] = json!(2), // not vectors
        |a| a["samplers"][0]["input"] = json!(0),  // not scalars
        |a| a["samplers"][0]["input"] = json!(4),  // no numbers
        |a| a["channels"][0]["sampler"] = json!(5),
        |a| a["channels"][0]["target"]["path"] = json!("colour"),
        |a| a["samplers"][0]["output"] = json!(5), // beyond its buffer
    ];
    for (i, break_it) in breaks.iter().enumerate() {
        let mut fixture = animated("translation", "LINEAR", "VEC3", 3, &[0.0; 6]);
        fixture.floats("SCALAR", 1, &[f32::NAN, f32::INFINITY]);
        fixture.floats("VEC3", 3, &[0.0; 3]);
        fixture.json["accessors"][5]["count"] = json!(2);
        let good = json!({"sampler": 1, "target": {"node": 0, "path": "scale"}});
        let sampler = fixture.json["animations"][0]["samplers"][0].clone();
        fixture.json["animations"][0]["samplers"].as_array_mut().unwrap().push(sampler);
        fixture.json["animations"][0]["channels"].as_array_mut().unwrap().push(good);
        break_it(&mut fixture.json["animations"][0]);
        let (scene, warnings) = fixture.load();
        let targets: Vec<ChannelTarget> = scene.animations[0].channels.iter().map(|c| c.target).collect();
        assert_eq!(targets, [ChannelTarget::Scale(0)], "{i}");
        assert!(warnings.iter().any(|w| w.starts_with("animations[0].channels[0]: ")), "{i} {warnings:?}");
    }
    // The specification ignores channels without a node.
    let mut fixture = animated("translation", "LINEAR", "VEC3", 3, &[0.0; 6]);
    fixture.json["animations"][0]["channels"][0]["target"].as_object_mut().unwrap().remove("node");
    let (scene, warnings) = fixture.load();
    assert!(scene.animations[0].channels.is_empty() && warnings.is_empty());
}

/// The keyframes of a channel on node 0, and the warnings.
fn keyframes(
    path: &str,
    interpolation: &str,
    kind: &str,
    times: &[f32],
    values: &[f32],
) -> (Keyframes, Vec<String>) {
    let width = if kind == "SCALAR" { 1 } else { 3 };
    let mut fixture = animated(path, interpolation, kind, width, values);
    let times = fixture.floats("SCALAR", 1, times);
    fixture.json["animations"][0]["samplers"][0]["input"] = json!(times);
    let up = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
    fixture.primitive()["targets"] = json!([{"POSITION": up}, {"POSITION": up}]);
    let (scene, warnings) = fixture.load();
    (scene.animations[0].channels[0].keyframes.clone(), warnings)
}

#[test]
fn the_good_keyframes_of_a_channel_are_kept() {
    const NAN: f32 = f32::NAN;
    let spline: Vec<f32> = (0..18).map(|i| i as f32).collect();
    let swapped: Vec<f32> = [&spline[9..], &spline[..9]].concat();
    let broken: Vec<f32> = spline.iter().map(|&v| if v == 2.0 { NAN } else { v }).collect();
    let order = "keyframe times do not ascend; sorted the keyframes";
    for (path, interpolation, kind, times, values, kept, expected, message) in [
        (
            "translation",
            "LINEAR",
            "VEC3",
            &[1.0, 0.0][..],
            &[3.0, 4.0, 5.0, 0.0, 1.0, 2.0][..],
            &[0.0, 1.0][..],
            &spline[..6],
            order,
        ),
        ("translation", "CUBICSPLINE", "VEC3", &[1.0, 0.0], &swapped, &[0.0, 1.0], &spline, order),
        (
            "scale",
            "STEP",
            "VEC3",
            &[NAN, 1.0],
            &[9.0, 9.0, 9.0, 0.0, 1.0, 2.0],
            &[1.0],
            &spline[..3],
            "ignored 1 of 2 keyframes, which are not finite",
        ),
        (
            "scale",
            "CUBICSPLINE",
            "VEC3",
            &[0.0, 1.0],
            &broken,
            &[1.0],
            &spline[9..],
            "ignored 1 of 2 keyframes, which are not finite",
        ),
        (
            "scale",
            "LINEAR",
            "VEC3",
            &[0.0],
            &spline[..9],
            &[0.0],
            &spline[..3],
            "3 values for 1 keyframes; ignored the last values",
        ),
        (
            "scale",
            "LINEAR",
            "VEC3",
            &[0.0, 1.0, 2.0],
            &spline[..6],
            &[0.0, 1.0],
            &spline[..6],
            "values for 2 of 3 keyframes; ignored the last keyframes",
        ),
        (
            "weights",
            "LINEAR",
            "SCALAR",
            &[0.0, 1.0],
            &spline[..5],
            &[0.0, 1.0],
            &spline[..4],
            "2 values for 2 keyframes; ignored the last values",
        ),
        (
            "weights",
            "LINEAR",
            "SCALAR",
            &[0.0, 1.0, 2.0],
            &spline[..5],
            &[0.0, 1.0],
            &spline[..4],
            "values for 2 of 3 keyframes; ignored the last keyframes",
        ),
    ] {
        let (keyframes, warnings) = keyframes(path, interpolation, kind, times, values);
        assert_eq!((&keyframes.times[..], &keyframes.values[..]), (kept, expected), "{message}");
        assert_eq!(warnings, [format!("animations[0].channels[0]: {message}")]);
    }
}

#[test]
fn a_node_that_is_a_root_and_a_child_is_animated_below_its_parent() {
    let mut fixture = animated("translation", "LINEAR", "VEC3", 3, &[0.0; 6]);
    fixture.node(json!({"children": [0]}));
    let (scene, _) = fixture.load();
    let targets: Vec<ChannelTarget> = scene.animations[0].channels.iter().map(|c| c.target).collect();
    assert_eq!(targets, [ChannelTarget::Translation(1)]);
}

#[test]
fn pointers_become_targets() {
    let mut fixture = animated("pointer", "STEP", "SCALAR", 1, &[1.0, 0.0]);
    let load_pointer = |fixture: &mut Fixture, pointer: &str| {
        fixture.json["animations"][0]["channels"][0]["target"] =
            json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
        fixture.load()
    };
    let (scene, _) = load_pointer(&mut fixture, "/nodes/0/extensions/KHR_node_visibility/visible");
    assert_eq!(scene.animations[0].channels[0].target, ChannelTarget::Visibility(0));
    let (scene, _) = load_pointer(&mut fixture, "/nodes/0/weights");
    assert_eq!(scene.animations[0].channels[0].target, ChannelTarget::Weights(0));
    let (scene, _) = load_pointer(&mut fixture, "/meshes/0/weights/1");
    assert_eq!(scene.animations[0].channels[0].target, ChannelTarget::Weight(0, 1));
    // Materials, lights and cameras outside the scene are not targets.
    let (scene, warnings) = load_pointer(&mut fixture, "/materials/0/alphaCutoff");
    assert!(scene.animations[0].channels.is_empty() && warnings.is_empty());
    // Unsupported properties are warnings.
    for pointer in ["/materials/0/extensions/KHR_materials_fuzz/fuzzFactor", "/x", "", "nodes/0/scale"] {
        let (scene, warnings) = load_pointer(&mut fixture, pointer);
        assert!(scene.animations[0].channels.is_empty());
        assert_eq!(
            warnings,
            [format!("animations[0].channels[0]: ignored channel: '{pointer}' cannot be animated")]
        );
    }
}

/// A body that an animation makes thinner stays a body. The transform of a thickness texture, which rays replace, changes nothing.
#[test]
fn thickness_is_animated() {
    let mut fixture = animated("pointer", "LINEAR", "SCALAR", 1, &[2.0, 0.0]);
    fixture.push("materials", json!({"extensions": {"KHR_materials_volume": {"thicknessFactor": 1}}}));
    fixture.primitive()["material"] = json!(0);
    let volume = "/materials/0/extensions/KHR_materials_volume";
    let mut load = |pointer: String| {
        fixture.json["animations"][0]["channels"][0]["target"] =
            json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
        let (scene, warnings) = fixture.load();
        assert!(warnings.is_empty(), "{warnings:?}");
        let thickness = |time: f64| {
            let posed = pose(&scene, &PoseSettings { time, ..PoseSettings::default() }).unwrap();
            posed.materials[0].volume.as_ref().map(|volume| volume.thickness)
        };
        (thickness(1.0), thickness(1.5))
    };
    let (middle, end) = load(format!("{volume}/thicknessFactor"));
    assert!(middle == Some(1.0) && end.is_some_and(|thickness| thickness > 0.0), "{middle:?} {end:?}");
    let (middle, _) = load(format!("{volume}/thicknessTexture/extensions/KHR_texture_transform/rotation"));
    assert_eq!(middle, Some(1.0));
}

/// The metallic-roughness parameters of such a material are a fallback for importers without the extension.
#[test]
fn pointers_to_specular_glossiness_parameters_animate_the_material() {
    let mut fixture = animated("pointer", "STEP", "VEC4", 4, &[0.25, 0.25, 0.25, 0.5].repeat(2));
    let glossy = "KHR_materials_pbrSpecularGlossiness";
    fixture.push("materials", json!({"extensions": {glossy: {}}}));
    fixture.primitive()["material"] = json!(0);
    let mut posed_base = |pointer: &str| {
        fixture.json["animations"][0]["channels"][0]["target"] = json!({"path": "pointer",
            "extensions": {"KHR_animation_pointer": {"pointer": format!("/materials/0/{pointer}")}}});
        let (scene, warnings) = fixture.load();
        assert!(warnings.is_empty(), "{warnings:?}");
        let posed = pose(&scene, &PoseSettings { time: 1.0, ..PoseSettings::default() }).unwrap();
        (posed.materials[0].base_color.factor, posed.materials[0].alpha.factor)
    };
    assert_eq!(posed_base("pbrMetallicRoughness/baseColorFactor"), (Vec3::ONE, 1.0));
    assert_eq!(posed_base(&format!("extensions/{glossy}/diffuseFactor")), (Vec3::splat(0.25), 0.5));
}

/// Lights of 80 W (or W/m²) at the first keyframe, the time of the export, and of 800 at the second.
#[test]
fn animated_intensities_of_blender_files_are_converted_to_the_lights_unit() {
    let four_pi = 4.0 * std::f32::consts::PI;
    for (kind, intensity, keys, expected) in [
        ("point", 80.0 * 683.0 / four_pi, [80.0 * 683.0, 800.0 * 683.0], 800.0 * 683.0 / four_pi),
        ("point", 80.0 / four_pi, [80.0, 800.0], 800.0 / four_pi),
        ("directional", 80.0 * 683.0, [80.0, 800.0], 800.0 * 683.0),
        // Correct, or ambiguous.
        ("point", 80.0, [80.0, 800.0], 800.0),
        ("directional", 80.0, [80.0, 800.0], 800.0),
        ("point", 5.0, [80.0, 800.0], 800.0),
        ("point", 0.0, [0.0, 800.0], 800.0),
    ] {
        for (generator, expected) in [("Khronos glTF Blender I/O v5.0.21", expected), ("", keys[1])] {
            let mut fixture = animated("pointer", "LINEAR", "SCALAR", 1, &keys);
            fixture.json["asset"]["generator"] = json!(generator);
            fixture.json["extensions"]["KHR_lights_punctual"]["lights"] =
                json!([{"type": kind, "intensity": intensity}]);
            fixture.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(0);
            fixture.json["animations"][0]["channels"][0]["target"] = json!({"path": "pointer", "extensions":
                {"KHR_animation_pointer": {"pointer": "/extensions/KHR_lights_punctual/lights/0/intensity"}}});
            let last = fixture.load().0.animations[0].channels[0].keyframes.values[1];
            assert!(
                (last / expected - 1.0).abs() < 1e-5,
                "{kind} {intensity} {generator}: {last}, not {expected}"
            );
        }
    }
}

/// A triangle with a skin of two joints.
pub(super) fn skinned() -> Fixture {
    let mut fixture = Fixture::triangle();
    let joints = fixture.accessor(5121, "VEC4", 3, &[0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0]);
    let weights = fixture.vec4(&[[0.5, 0.5, 0.0, 0.0]; 3]);
    let attributes = &mut fixture.primitive()["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    let a = fixture.node(json!({"translation": [0, 0, 1]}));
    let b = fixture.node(json!({"translation": [0, 0, 3]}));
    fixture.push("skins", json!({"name": "skin", "joints": [a, b]}));
    fixture.json["nodes"][0]["skin"] = json!(0);
    fixture
}

#[test]
fn skins_have_joints_and_inverse_bind_matrices() {
    let (scene, warnings) = skinned().load();
    let skin = &scene.skins[0];
    assert_eq!((skin.name.as_str(), &skin.joints[..]), ("skin", &[1, 2][..]));
    assert_eq!((skin.inverse_bind[1], scene.instances[0].skin), (DAffine3::IDENTITY, Some(0)));
    assert!(warnings.is_empty());

    let mut fixture = skinned();
    let mut matrix = [0.0; 16];
    [0, 5, 10, 15].iter().for_each(|&i| matrix[i] = 1.0);
    matrix[14] = -1.0;
    let matrices = fixture.floats("MAT4", 16, &matrix);
    fixture.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
    let (scene, warnings) = fixture.load();
    let expected = [DAffine3::from_translation(DVec3::NEG_Z), DAffine3::IDENTITY];
    assert_eq!((&scene.skins[0].inverse_bind[..], warnings.len()), (&expected[..], 1));
}

/// A blend of rotations is not a rotation. Viewers transform normals by the blend, not by its inverse
/// transpose.
#[test]
fn skinning_transforms_normals_like_vectors() {
    let mut fixture = skinned();
    let normals = fixture.vec3(&[[0.6, 0.0, 0.8]; 3]);
    fixture.primitive()["attributes"]["NORMAL"] = json!(normals);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // A rotation by 90° around z.
    fixture.json["nodes"][2]["rotation"] = json!([0, 0, half, half]);
    let (scene, _) = fixture.load();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let expected = Vec3::new(0.3, 0.3, 0.8).normalize();
    assert!(posed.normals(0)[0].abs_diff_eq(expected, 1e-6), "{}", posed.normals(0)[0]);
}

#[test]
fn skins_that_do_not_match_are_warnings() {
    let mut fixture = skinned();
    fixture.json["scenes"][0]["nodes"] = json!([0, 1]);
    let (scene, warnings) = fixture.load();
    assert_eq!((scene.instances[0].skin, warnings.len()), (None, 1), "{warnings:?}");
    let mut fixture = skinned();
    fixture.json["skins"][0]["joints"] = json!([1]);
    let (_, warnings) = fixture.load();
    assert_eq!(warnings, ["nodes[0].skin: the mesh refers to joint 1, but the skin has only 1 joints"]);
}

/// Tangent frames that the file lacks are those of the deformed mesh, as the specification requires.
#[test]
fn generated_tangent_frames_follow_morph_targets() {
    // Without normals; with normals that a target does not change; with normals and tangents.
    for (own, normal, tangent) in [
        (&[][..], Vec3::NEG_Y, Vec3::X),
        (&["NORMAL"], Vec3::Z, Vec3::X),
        (&["NORMAL", "TANGENT"], Vec3::Z, Vec3::Y),
    ] {
        let mut fixture = textured(json!({"normalTexture": {"index": 0}}));
        let upright = fixture.vec3(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 1.0]]);
        let tangents = fixture.vec4(&[[0.0, 1.0, 0.0, 1.0]; 3]);
        let primitive = fixture.primitive();
        primitive["targets"] = json!([{"POSITION": upright}]);
        primitive["attributes"]["TANGENT"] = json!(tangents);
        let attributes = primitive["attributes"].as_object_mut().unwrap();
        attributes.retain(|name, _| own.contains(&&name[..]) || !["NORMAL", "TANGENT"].contains(&&name[..]));
        fixture.json["meshes"][0]["weights"] = json!([1]);
        let (scene, _) = fixture.load();
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        for (n, t) in posed.normals(0).iter().zip(posed.tangents(0)) {
            assert!(
                n.abs_diff_eq(normal, 1e-6) && t.truncate().abs_diff_eq(tangent, 1e-6),
                "{own:?}: {n} {t}"
            );
        }
    }
}
