//! What Blender's exporter writes otherwise than glTF means it.

use glam::{DMat3, DMat4, DVec3, Vec3, Vec4};
use serde_json::json;

use super::super::fixture::Fixture;
use super::looks::textured;
use super::motion::skinned;
use crate::scene::pose;
use crate::scene::{LightUnits, Mesh, PoseSettings, PosedLightKind, Scene};

/// The same file by Blender and by another program.
fn by_both(mut fixture: Fixture) -> [Scene; 2] {
    ["Khronos glTF Blender I/O v5.0.21", ""].map(|generator| {
        fixture.json["asset"]["generator"] = json!(generator);
        fixture.load().0
    })
}

fn near(found: &[Vec3], expected: &[Vec3]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-5))
}

/// A triangle under an armature that is scaled, turned and sheared, with a target that turns its normal: the
/// exporter takes normals of the armature's frame to the world as it takes places there.
#[test]
fn normals_of_skinned_meshes_are_those_of_the_bent_surface() {
    let turn = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.4);
    let armature = DMat3::from_diagonal(DVec3::new(1.2, 0.8, 1.0))
        * turn
        * DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.8));
    let inside = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, -0.6), Vec3::Z];
    let target = [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::Z];
    let through = |by: DMat3| move |n: &Vec3| (by * n.as_dvec3()).normalize().as_vec3();
    let written = inside.map(|n| through(armature)(&n));
    let deltas: Vec<Vec3> = target.iter().zip(written).map(|(n, base)| through(armature)(n) - base).collect();

    let mut fixture = skinned();
    let normals = fixture.vec3(&written.map(|n| n.to_array()));
    let deltas = fixture.vec3(&deltas.iter().map(|n| n.to_array()).collect::<Vec<_>>());
    fixture.primitive()["attributes"]["NORMAL"] = json!(normals);
    fixture.primitive()["targets"] = json!([{"NORMAL": deltas}]);
    // Whatever the bones' own axes.
    let bones = [DMat3::from_rotation_z(1.0), DMat3::from_rotation_y(2.0)];
    let bind = bones.map(|bone| DMat4::from_mat3(armature * bone).inverse().as_mat4().to_cols_array());
    let bind = fixture.floats("MAT4", 16, bind.as_flattened());
    fixture.json["skins"][0]["inverseBindMatrices"] = json!(bind);

    let [blender, other] = by_both(fixture);
    let morphed = |mesh: &Mesh| -> Vec<Vec3> {
        mesh.normals.iter().zip(&mesh.morph_targets[0].normals).map(|(n, d)| *n + *d).collect()
    };
    let right = through(armature.inverse().transpose());
    assert!(near(&blender.meshes[0].normals, &inside.map(|n| right(&n))));
    assert!(near(&morphed(&blender.meshes[0]), &target.map(|n| right(&n))));
    assert!(near(&other.meshes[0].normals, &written));
}

/// Blender's own normal maps take no notice of them, and they are not along every map's coordinates.
#[test]
fn written_tangents_do_not_count() {
    let mut fixture = textured(json!({"normalTexture": {"index": 0}}));
    let tangents = fixture.vec4(&[[0.0, 1.0, 0.0, -1.0]; 3]);
    fixture.primitive()["attributes"]["TANGENT"] = json!(tangents);
    let deltas = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
    fixture.primitive()["targets"] = json!([{"TANGENT": deltas}]);
    let [blender, other] = by_both(fixture);
    assert_eq!(blender.meshes[0].tangents, [Vec4::new(1.0, 0.0, 0.0, -1.0); 3]);
    assert_eq!(other.meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]);
    assert_eq!([&blender, &other].map(|s| s.meshes[0].morph_targets[0].tangents.len()), [0, 3]);
}

/// By nodes that share it or by instancing; but not what is bent for each.
#[test]
fn a_shared_mesh_is_smoothed_in_its_own_frame() {
    let own = |fixture: &Fixture| by_both(fixture.clone()).map(|s| s.meshes[0].interpolate_normals_locally);
    assert_eq!(own(&Fixture::triangle()), [false; 2]);
    let mut twice = Fixture::triangle();
    twice.node(json!({"mesh": 0, "scale": [1, 3, 1]}));
    assert_eq!(own(&twice), [true, false]);
    let mut crowd = Fixture::triangle();
    let places = crowd.vec3(&[[0.0; 3], [2.0; 3]]);
    crowd.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    assert_eq!(own(&crowd), [true, false]);
    let deltas = twice.vec3(&[[0.0; 3]; 3]);
    twice.primitive()["targets"] = json!([{"POSITION": deltas}]);
    assert_eq!(own(&twice), [false; 2]);
}

/// Of colours that no material uses it writes white ones as the first set.
#[test]
fn more_colours_than_one_set_are_a_loss_in_other_files_alone() {
    let mut fixture = Fixture::triangle();
    let colors = fixture.vec3(&[[1.0; 3]; 3]);
    for set in ["COLOR_0", "COLOR_1"] {
        fixture.primitive()["attributes"][set] = json!(colors);
    }
    let lost = "vertex colours beyond the first set (COLOR_1 and on) are not shown";
    for (generator, told) in [("Khronos glTF Blender I/O v5.0.21", vec![]), ("", vec![lost])] {
        fixture.json["asset"]["generator"] = json!(generator);
        assert_eq!(fixture.load().1, told, "{generator}");
    }
}

/// A spot of 0.8 with a blend of .25 from the file's first key to its second, by keys of cones and blends under the
/// exporter's names; and its cones then by Blender and by another program.
#[test]
fn blends_of_spots_are_shares_of_their_cones() {
    for (keys, by_blender, by_another) in [
        // The blend alone, the size alone, and both.
        (vec![("inner", [0.25, 0.75])], [0.2, 0.8], [0.75, 0.8]),
        (vec![("outer", [0.8, 0.4])], [0.3, 0.4], [0.6, 0.4]),
        (vec![("inner", [0.25, 0.75]), ("outer", [0.8, 0.4])], [0.1, 0.4], [0.75, 0.4]),
        (vec![("outer", [0.8, 0.4]), ("inner", [0.25, 0.75])], [0.1, 0.4], [0.75, 0.4]),
        // Angles, as glTF has them.
        (vec![("inner", [0.6, 0.3]), ("outer", [0.8, 0.4])], [0.3, 0.4], [0.3, 0.4]),
    ] {
        let moving = by_both(spot([0.6, 0.8], &keys)).map(|scene| cone(&scene));
        let right = [by_blender, by_another].map(|cones| by_both(spot(cones, &[])));
        assert_eq!(moving, [cone(&right[0][0]), cone(&right[1][1])], "{keys:?}");
    }
}

fn spot([inner, outer]: [f32; 2], keys: &[(&str, [f32; 2])]) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot",
        "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}]}});
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let (mut samplers, mut channels) = (vec![], vec![]);
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

/// What a scene's one spot lets through a second after its start, in parts of a million.
fn cone(scene: &Scene) -> [i32; 2] {
    let last = pose(scene, &PoseSettings { time: 1.0, ..PoseSettings::default() }).unwrap();
    let PosedLightKind::Spot { cone, .. } = last.lights(LightUnits::Raw, 1.0)[0].kind else { panic!() };
    [cone.cos_outer, cone.width].map(|v| (v * 1e6).round() as i32)
}
