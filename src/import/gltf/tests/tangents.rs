//! Tangents of the file that are not usable: 0, not finite, or parallel to the normal.

use glam::Vec3;
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use super::materials::textured;
use blinn_scene::{GeneratedFrames, PoseSettings, Scene, pose};

/// A normal-mapped triangle whose tangent by its texture coordinates is +x, with these tangents.
fn with_tangents(tangents: &[[f32; 4]; 3]) -> Fixture {
    let mut fixture = textured(json!({"normalTexture": {"index": 0}}));
    let tangents = fixture.vec4(tangents);
    fixture.primitive()["attributes"]["TANGENT"] = json!(tangents);
    fixture
}

fn tangents(scene: &Scene) -> Vec<Vec3> {
    scene.meshes[0].tangents.iter().map(|t| t.truncate()).collect()
}

const Y: [f32; 4] = [0.0, 1.0, 0.0, 1.0];

#[test]
fn unusable_tangents_are_generated() {
    for bad in [
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 0.0],
        [f32::NAN, 0.0, 0.0, 1.0],
        [f32::INFINITY, 0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0, 1.0],
        [0.0, 0.0, -3.0, -1.0],
        [1e-30, 0.0, 0.0, 1.0],
        [1e-5, 0.0, 1.0, 1.0],
    ] {
        let (scene, _) = with_tangents(&[bad; 3]).load();
        assert_eq!(tangents(&scene), [Vec3::X; 3], "{bad:?}");
        assert_eq!(scene.meshes[0].generated_frames, GeneratedFrames::Tangents);
        // The others are kept.
        let (scene, _) = with_tangents(&[Y, bad, Y]).load();
        assert_eq!(tangents(&scene), [Vec3::Y, Vec3::X, Vec3::Y], "{bad:?}");
        assert_eq!(scene.meshes[0].generated_frames, GeneratedFrames::None);
    }
}

#[test]
fn usable_tangents_are_kept() {
    let (scene, _) = with_tangents(&[Y; 3]).load();
    assert_eq!(tangents(&scene), [Vec3::Y; 3]);
    // They need not be perpendicular to the normal, nor of length 1.
    let (scene, _) = with_tangents(&[[0.0, 3.0, 4.0, 1.0]; 3]).load();
    assert_eq!(tangents(&scene), [Vec3::new(0.0, 0.6, 0.8); 3]);
}

#[test]
fn morph_targets_of_unusable_tangents_have_no_effect() {
    let mut fixture = with_tangents(&[[0.0; 4]; 3]);
    let delta = fixture.vec3(&[[0.0, 1.0, 0.0]; 3]);
    let targets: Value = json!([{"TANGENT": delta}]);
    fixture.primitive()["targets"] = targets;
    fixture.json["meshes"][0]["weights"] = json!([1]);
    let (scene, _) = fixture.load();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    assert!(
        posed.tangents(0).iter().all(|t| t.truncate().abs_diff_eq(Vec3::X, 1e-6)),
        "{:?}",
        posed.tangents(0)
    );
}

#[test]
fn a_vertex_with_an_unusable_tangent_is_split_where_its_triangles_differ() {
    let mut fixture = with_tangents(&[[0.0; 4]; 3]);
    // A second triangle with mirrored texture coordinates shares two vertices.
    let positions = fixture.vec3(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
    let normals = fixture.vec3(&[[0.0, 0.0, 1.0]; 4]);
    let uvs = fixture.vec2(&[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0]]);
    let tangents = fixture.vec4(&[[0.0; 4], [1.0, 0.0, 0.0, 1.0], [0.0; 4], [-1.0, 0.0, 0.0, -1.0]]);
    let indices = fixture.indices(&[0, 1, 2, 0, 2, 3]);
    let primitive = fixture.primitive();
    primitive["attributes"] =
        json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "TANGENT": tangents});
    primitive["indices"] = json!(indices);
    let (scene, _) = fixture.load();
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.tangents.len()), (6, 6));
    for (t, sign) in mesh.triangles.iter().zip([1.0, -1.0]) {
        assert!(t.iter().all(|&v| mesh.tangents[v as usize].x == sign), "{:?}", mesh.tangents);
    }
}
