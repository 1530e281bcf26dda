//! Corrections of files from Blender's exporter.

use glam::{DMat3, DMat4, DVec3, Vec3, Vec4};
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use super::animation::skinned;
use super::materials::{textured, textured_with};
use crate::LoadOptions;
use blinn_scene::pose;
use blinn_scene::{AnisotropyModel, LightUnits, Mesh, PoseSettings, PosedLightKind, Scene, SheenModel};

/// The same file loaded as Blender's and as another program's.
fn load_both(mut fixture: Fixture) -> [Scene; 2] {
    ["Khronos glTF Blender I/O v5.0.21", ""].map(|generator| {
        fixture.json["asset"]["generator"] = json!(generator);
        fixture.load().0
    })
}

fn nearly_equal(actual: &[Vec3], expected: &[Vec3]) -> bool {
    actual.len() == expected.len() && actual.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-5))
}

/// A triangle below an armature that is scaled, rotated and sheared, with a morph target that rotates its
/// normal. The exporter transforms normals like positions.
#[test]
fn normals_of_skinned_meshes_are_corrected() {
    let rotation = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.4);
    let armature = DMat3::from_diagonal(DVec3::new(1.2, 0.8, 1.0))
        * rotation
        * DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.8));
    let local = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, -0.6), Vec3::Z];
    let target = [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::Z];
    let through = |by: DMat3| move |n: &Vec3| (by * n.as_dvec3()).normalize().as_vec3();
    let written = local.map(|n| through(armature)(&n));
    let deltas: Vec<Vec3> = target.iter().zip(written).map(|(n, base)| through(armature)(n) - base).collect();

    let mut fixture = skinned();
    let normals = fixture.vec3(&written.map(|n| n.to_array()));
    let deltas = fixture.vec3(&deltas.iter().map(|n| n.to_array()).collect::<Vec<_>>());
    fixture.primitive()["attributes"]["NORMAL"] = json!(normals);
    fixture.primitive()["targets"] = json!([{"NORMAL": deltas}]);
    // The correction does not depend on the bones' axes.
    let bones = [DMat3::from_rotation_z(1.0), DMat3::from_rotation_y(2.0)];
    let bind = bones.map(|bone| DMat4::from_mat3(armature * bone).inverse().as_mat4().to_cols_array());
    let bind = fixture.floats("MAT4", 16, bind.as_flattened());
    fixture.json["skins"][0]["inverseBindMatrices"] = json!(bind);

    let [blender, other] = load_both(fixture);
    let morphed = |mesh: &Mesh| -> Vec<Vec3> {
        mesh.normals.iter().zip(&mesh.morph_targets[0].normals).map(|(n, d)| *n + *d).collect()
    };
    let correct = through(armature.inverse().transpose());
    assert!(nearly_equal(&blender.meshes[0].normals, &local.map(|n| correct(&n))));
    assert!(nearly_equal(&morphed(&blender.meshes[0]), &target.map(|n| correct(&n))));
    assert!(nearly_equal(&other.meshes[0].normals, &written));
}

/// Blender's normal maps do not use them, and they may follow other coordinates than the map's.
#[test]
fn tangents_in_the_file_are_ignored() {
    let mut fixture = textured_with([128, 128, 255, 255], json!({"normalTexture": {"index": 0}}));
    let tangents = fixture.vec4(&[[0.0, 1.0, 0.0, -1.0]; 3]);
    fixture.primitive()["attributes"]["TANGENT"] = json!(tangents);
    let deltas = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
    fixture.primitive()["targets"] = json!([{"TANGENT": deltas}]);
    let [blender, other] = load_both(fixture);
    assert_eq!(blender.meshes[0].tangents, [Vec4::new(1.0, 0.0, 0.0, -1.0); 3]);
    assert_eq!(other.meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]);
    assert_eq!([&blender, &other].map(|s| s.meshes[0].morph_targets[0].tangents.len()), [0, 3]);
}

/// Shared by nodes or by instancing, but not if each object is deformed.
#[test]
fn a_shared_mesh_is_smoothed_in_object_space() {
    let own = |fixture: &Fixture| load_both(fixture.clone()).map(|s| s.meshes[0].interpolate_normals_locally);
    assert_eq!(own(&Fixture::triangle()), [false; 2]);
    let mut twice = Fixture::triangle();
    twice.node(json!({"mesh": 0, "scale": [1, 3, 1]}));
    assert_eq!(own(&twice), [true, false]);
    let mut instanced = Fixture::triangle();
    let translations = instanced.vec3(&[[0.0; 3], [2.0; 3]]);
    instanced.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translations}}});
    assert_eq!(own(&instanced), [true, false]);
    let deltas = twice.vec3(&[[0.0; 3]; 3]);
    twice.primitive()["targets"] = json!([{"POSITION": deltas}]);
    assert_eq!(own(&twice), [false; 2]);
}

/// If no material uses the colours, the exporter writes white as the first set.
#[test]
fn further_colour_sets_are_a_warning_only_in_other_files() {
    let mut fixture = Fixture::triangle();
    let colors = fixture.vec3(&[[1.0; 3]; 3]);
    for set in ["COLOR_0", "COLOR_1"] {
        fixture.primitive()["attributes"][set] = json!(colors);
    }
    let warning = "ignored vertex colours beyond the first set (COLOR_1 and above)";
    for (generator, expected) in [("Khronos glTF Blender I/O v5.0.21", vec![]), ("", vec![warning])] {
        fixture.json["asset"]["generator"] = json!(generator);
        assert_eq!(fixture.load().1, expected, "{generator}");
    }
}

/// A spot light with a cone of 0.8 and a blend of 0.25, animated with the exporter's pointers for cones and
/// blends, and the expected cones in Blender and in another program.
#[test]
fn blends_of_spot_lights_are_fractions_of_their_cones() {
    for (keys, by_blender, by_another) in [
        // Only the blend, only the size, and both.
        (vec![("inner", [0.25, 0.75])], [0.2, 0.8], [0.75, 0.8]),
        (vec![("outer", [0.8, 0.4])], [0.3, 0.4], [0.6, 0.4]),
        (vec![("inner", [0.25, 0.75]), ("outer", [0.8, 0.4])], [0.1, 0.4], [0.75, 0.4]),
        (vec![("outer", [0.8, 0.4]), ("inner", [0.25, 0.75])], [0.1, 0.4], [0.75, 0.4]),
        // Inner angles, as specified.
        (vec![("inner", [0.6, 0.3]), ("outer", [0.8, 0.4])], [0.3, 0.4], [0.3, 0.4]),
    ] {
        let animated = load_both(spot([0.6, 0.8], &keys)).map(|scene| cone(&scene));
        let expected = [by_blender, by_another].map(|cones| load_both(spot(cones, &[])));
        assert_eq!(animated, [cone(&expected[0][0]), cone(&expected[1][1])], "{keys:?}");
    }
}

fn spot([inner, outer]: [f32; 2], keys: &[(&str, [f32; 2])]) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot",
        "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}]}});
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let mut samplers = vec![];
    let mut channels = vec![];
    for (cone, values) in keys {
        let values = fixture.floats("SCALAR", 1, values);
        let pointer = format!("/extensions/KHR_lights_punctual/lights/0/spot.{cone}ConeAngle");
        channels.push(json!({"sampler": samplers.len(), "target": {"path": "pointer",
            "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}}));
        samplers.push(json!({"input": times, "output": values}));
    }
    if !keys.is_empty() {
        fixture.push("animations", json!({"samplers": samplers, "channels": channels}));
    }
    fixture
}

/// The cone of the scene's spot light after one second, in millionths.
fn cone(scene: &Scene) -> [i32; 2] {
    let last = pose(scene, &PoseSettings { time: 1.0, ..PoseSettings::default() }).unwrap();
    let PosedLightKind::Spot { cone, .. } = last.lights(LightUnits::Raw, 1.0)[0].kind else { panic!() };
    [cone.cos_outer, cone.width].map(|v| (v * 1e6).round() as i32)
}

/// Blender 5.1 and 5.2 write 683 lx, or 1, for every sun of a scene whose engine is Cycles.
#[test]
fn suns_that_lost_their_strength_are_named_in_one_warning() {
    let warned = |version: &str, lights: Value| {
        let mut fixture = Fixture::triangle();
        fixture.json["asset"]["generator"] = json!(format!("Khronos glTF Blender I/O v{version}"));
        for i in 0..lights.as_array().unwrap().len() {
            fixture.node(
                json!({"name": format!("node {i}"), "extensions": {"KHR_lights_punctual": {"light": i}}}),
            );
        }
        fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
        fixture.load().1
    };
    let light = |kind: &str, intensity: f64| json!({"type": kind, "intensity": intensity, "name": "Sonne"});
    for (version, intensity, count) in [
        ("5.1.20", 683.0, 1),
        ("5.2.41", 683.0, 1),
        ("5.2.41", 1.0, 1),
        ("5.2.41", 2049.0, 0),
        ("5.0.21", 683.0, 0),
        ("5.3.43", 683.0, 0),
        ("6.1.0", 683.0, 0),
    ] {
        let warnings = warned(version, json!([light("directional", intensity), light("point", 683.0)]));
        assert_eq!(warnings.len(), count, "{version} {intensity}: {warnings:?}");
        assert!(warnings.iter().all(|w| w.contains("sun 'Sonne' has")), "{warnings:?}");
    }
    let nameless = json!({"type": "directional", "intensity": 683});
    let warnings = warned("5.2.41", json!(vec![nameless; 7]));
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].starts_with("suns 'node 0', 'node 1', 'node 2', 'node 3', 'node 4', and 2 more have")
    );
}

/// Blender 5.2 and 5.3 write collections in instanced collections more than once.
#[test]
fn meshes_that_lie_on_equal_ones_are_counted_in_one_warning() {
    let warned = |generator: &str, copies: Value| {
        let mut fixture = Fixture::triangle();
        fixture.json["asset"]["generator"] = json!(generator);
        for node in copies.as_array().unwrap() {
            fixture.node(node.clone());
        }
        fixture.load().1
    };
    let blender = "Khronos glTF Blender I/O v5.2.41";
    let copy = json!({"name": "copy", "mesh": 0});
    let beside = json!({"mesh": 0, "translation": [1, 0, 0]});
    assert!(warned(blender, json!([beside])).is_empty());
    assert!(warned("", json!([copy])).is_empty());
    let one = warned(blender, json!([copy, beside]));
    assert_eq!(one.len(), 1, "{one:?}");
    assert!(one[0].starts_with("mesh 'copy' lies on an equal one: Blender writes"), "{one:?}");
    let more = warned(blender, json!([copy, copy, beside, beside]));
    assert!(more[0].starts_with("3 meshes lie on equal ones, such as 'copy': Blender writes"), "{more:?}");
}

/// The colour of a light is multiplied by that of its temperature, 1.04 at 6500 K and 5.41 at 800 K.
#[test]
fn colours_of_lights_may_exceed_1() {
    let bright = json!([12, 1.5, -0.5]);
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"] = json!({
        "KHR_lights_punctual": {"lights": [{"type": "point", "color": bright}]},
        "EXT_lights_area": {"lights": [{"type": "rect", "color": bright}]}});
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    fixture.node(json!({"extensions": {"EXT_lights_area": {"light": 0}}}));
    let warnings = fixture.load().1;
    assert_eq!(warnings.iter().filter(|w| w.contains("expected 0 to 1 or bytes")).count(), 2, "{warnings:?}");
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.2.41");
    let (scene, warnings) = fixture.load();
    assert_eq!(scene.lights[0].color, Vec3::new(12.0, 1.5, 0.0));
    assert_eq!(scene.area_lights[0].color, Vec3::new(12.0, 1.5, 0.0));
    assert!(warnings.len() == 2 && warnings.iter().all(|w| w.contains("negative value")), "{warnings:?}");
}

/// The exporter writes the image of a Bump node as a normal map.
#[test]
fn normal_maps_of_heights_have_the_default_relief() {
    for (texel, is_map) in [([140, 140, 140, 255], false), ([120, 140, 250, 255], true)] {
        let mut fixture = textured_with(texel, json!({"normalTexture": {"index": 0, "scale": 0.3}}));
        let other = fixture.load();
        assert!(other.0.materials[0].normal.is_some() && other.1.is_empty(), "{:?}", other.1);
        fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v4.5.51");
        // A second material with the same image, and a second object of twice the size, which both materials have.
        let second = fixture.json["materials"][0].clone();
        fixture.push("materials", second);
        let mut primitive = fixture.primitive().clone();
        primitive["material"] = json!(1);
        fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
        fixture.node(json!({"mesh": 0, "scale": [2, 2, 2]}));
        let (scene, warnings) = fixture.load();
        let maps: Vec<_> = scene.materials.iter().map(|m| m.normal.unwrap()).collect();
        assert_eq!(maps[0], maps[1]);
        let expected = "normal map 'red' holds heights";
        assert_eq!(warnings.iter().filter(|w| w.starts_with(expected)).count(), usize::from(!is_map));
        if is_map {
            assert_eq!((maps[0].scale, maps[0].scale_is_strength, scene.images.len()), (0.3, true, 1));
            continue;
        }
        // Level heights are normals along z, in an image of their own.
        let image = &scene.images[scene.textures[maps[0].texture.texture as usize].image as usize];
        assert!((image.stored(0).truncate() * 2.0 - 1.0).abs_diff_eq(Vec3::Z, 1e-4));
        assert_eq!((scene.images.len(), scene.textures.len()), (2, 2));
        // Two triangles of 0.5 m² and 2 m² for 0.5 of the coordinates each; the image is twice as wide as high.
        let width = (2.5_f32 * 2.0).sqrt();
        assert!((maps[0].scale * width - 0.1).abs() < 1e-6 && !maps[0].scale_is_strength, "{:?}", maps[0]);
    }
}

/// An image in the file's lengths has the relief of the file's unit.
#[test]
fn reliefs_of_heights_are_independent_of_the_scale_option() {
    let mut fixture = textured_with([140, 140, 140, 255], json!({"normalTexture": {"index": 0}}));
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    let scale = |scene: &Scene| scene.materials[0].normal.unwrap().scale;
    let whole = scale(&fixture.load().0);
    let scaled = fixture.load_with(&LoadOptions { scale: Some(0.01), ..LoadOptions::default() }).0;
    assert!((scale(&scaled) / whole - 1.0).abs() < 1e-5, "{whole}");
}

/// A surface whose texture coordinates are all one shows one height.
#[test]
fn heights_without_an_extent_are_level() {
    let mut fixture = textured_with([140, 140, 140, 255], json!({"normalTexture": {"index": 0}}));
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    let uvs = fixture.vec2(&[[0.5, 0.5]; 3]);
    fixture.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    assert_eq!(fixture.load().0.materials[0].normal, None);
}

/// The exporter multiplies a light's colour by that of its temperature (here 2500 K), but not the keys of the colour.
#[test]
fn keys_of_a_colour_get_the_lights_temperature() {
    let load = |color: [f32; 3], generator: &str| {
        let mut fixture = Fixture::triangle();
        fixture.json["asset"]["generator"] = json!(generator);
        let light = json!({"type": "point", "color": color, "name": "Lamp"});
        fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
        let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
        let colors = fixture.vec3(&[[0.2, 0.4, 0.6], [1.0, 0.5, 0.0]]);
        let pointer = json!({"pointer": "/extensions/KHR_lights_punctual/lights/0/color"});
        let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": pointer}});
        fixture.push(
            "animations",
            json!({"samplers": [{"input": times, "output": colors}],
                "channels": [{"sampler": 0, "target": target}]}),
        );
        let (scene, warnings) = fixture.load();
        (scene.animations[0].channels[0].keyframes.values.clone(), warnings)
    };
    let blender = "Khronos glTF Blender I/O v5.2.41";
    let near = |values: &[f32], expected: [f32; 6]| {
        values.iter().zip(expected).all(|(v, expected)| (v - expected).abs() < 0.01)
    };
    let written = [0.2, 0.4, 0.6, 1.0, 0.5, 0.0];
    let warm = [0.4135, 0.3077, 0.0836, 2.0676, 0.3847, 0.0];
    // The colour at the first and at the last key.
    for color in [[0.4135, 0.3077, 0.0836], [2.0676, 0.3847, 0.0]] {
        let (values, warnings) = load(color, blender);
        assert!(near(&values, warm) && warnings.is_empty(), "{values:?} {warnings:?}");
        assert!(near(&load(color, "").0, written));
    }
    // Without a temperature, between two keys, and with a colour that no temperature explains.
    for (color, count) in [([0.2, 0.4, 0.6], 0), ([0.6, 0.45, 0.3], 0), ([0.5, 3.0, 0.5], 1)] {
        let (values, warnings) = load(color, blender);
        assert!(near(&values, written), "{values:?}");
        assert_eq!(
            warnings.iter().filter(|w| w.starts_with("light 'Lamp': ")).count(),
            count,
            "{warnings:?}"
        );
    }
}

/// Blender shows a sheen by the fibres of Cycles, which are another model than that of the specification.
#[test]
fn sheens_have_microfibres() {
    let models = |material: Value| load_both(textured(material)).map(|scene| scene.materials[0].sheen.model);
    let sheen = json!({"sheenColorFactor": [0.5, 0.25, 0.5], "sheenRoughnessFactor": 0.5});
    let cloth = json!({"name": "cloth", "extensions": {"KHR_materials_sheen": sheen}});
    assert_eq!(models(cloth), [SheenModel::Microfibres, SheenModel::Charlie]);
    // Others are equal to those that another program writes.
    assert_eq!(models(json!({"name": "clay"})), [SheenModel::Charlie; 2]);
}

/// The exporter writes the anisotropy of the Principled BSDF as the strength of the extension.
#[test]
fn anisotropies_are_those_of_the_principled_bsdf() {
    let anisotropy = json!({"anisotropyStrength": 0.5, "anisotropyRotation": 0.25});
    let steel = json!({"name": "steel", "extensions": {"KHR_materials_anisotropy": anisotropy}});
    let read = load_both(textured(steel)).map(|scene| scene.materials[0].anisotropy.unwrap());
    assert_eq!(read.map(|a| a.model), [AnisotropyModel::Principled, AnisotropyModel::Gltf]);
    assert!(read.iter().all(|a| (a.strength, a.rotation) == (0.5, 0.25)));
}
