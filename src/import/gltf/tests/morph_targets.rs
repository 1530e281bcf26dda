//! Morph targets: displacements of vertex attributes.

use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::super::fixture::{Fixture, bytes_of};
use super::super::target_attributes::{TargetAttributes, find};
use super::materials::textured;
use crate::error::Warnings;
use blinn_scene::{MorphTarget, PoseSettings, Scene, pose};

#[test]
fn morph_targets_have_names_weights_and_sparse_positions() {
    let mut fixture = Fixture::triangle();
    let deltas = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
    let indices = fixture.view(&[1]);
    let values = fixture.view(&bytes_of(&[1.0f32, 2.0, 3.0]));
    let sparse = fixture.push(
        "accessors",
        json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": {"count": 1,
            "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}}}),
    );
    fixture.primitive()["targets"] = json!([{"POSITION": deltas, "NORMAL": deltas}, {"POSITION": sparse}]);
    fixture.json["meshes"][0]["weights"] = json!([0.5]);
    fixture.json["meshes"][0]["extras"] = json!({"targetNames": ["up", "odd"]});
    fixture.json["nodes"][0]["weights"] = json!([0.25, 1.0]);
    let (scene, _) = fixture.load();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.morph_targets.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["up", "odd"]);
    assert_eq!(mesh.morph_targets[0].normals, [Vec3::Z; 3]);
    assert_eq!(mesh.morph_targets[1].positions, [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO]);
    assert_eq!(mesh.morph_weights, [0.5, 0.0]);
    assert_eq!(scene.nodes[0].weights, [0.25, 1.0]);
}

/// A triangle with texture coordinates and colours, and one morph target of weight 0.5.
fn morphed(target: impl FnOnce(&mut Fixture) -> Value) -> Fixture {
    let mut fixture = Fixture::triangle();
    let uvs = fixture.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let colors = fixture.vec4(&[[0.5, 0.25, 0.75, 1.0]; 3]);
    let attributes = &mut fixture.primitive()["attributes"];
    attributes["TEXCOORD_0"] = json!(uvs);
    attributes["TEXCOORD_1"] = json!(uvs);
    attributes["COLOR_0"] = json!(colors);
    let target = target(&mut fixture);
    fixture.primitive()["targets"] = json!([target]);
    fixture.json["meshes"][0]["weights"] = json!([0.5]);
    fixture
}

fn target_of(scene: &Scene) -> &MorphTarget {
    &scene.meshes[0].morph_targets[0]
}

#[test]
fn texture_coordinates_and_colours_are_displaced_at_rest() {
    let fixture = morphed(|fixture| {
        let uvs = fixture.vec2(&[[1.0, 0.0], [0.5, -0.5], [0.0, 0.0]]);
        let colors = fixture.vec4(&[[0.5, 0.0, 1.0, -0.5], [0.0; 4], [-2.0, 0.0, 0.0, 0.0]]);
        json!({"TEXCOORD_1": uvs, "COLOR_0": colors})
    });
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let rest = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let displaced = [Vec2::new(0.5, 0.0), Vec2::new(1.25, -0.25), Vec2::Y];
    assert_eq!(posed.uvs(0), [rest, displaced]);
    // The third red, 0.5 - 1, and the first blue, 0.75 + 0.5, are clamped.
    let expected =
        [Vec4::new(0.75, 0.25, 1.0, 0.75), Vec4::new(0.5, 0.25, 0.75, 1.0), Vec4::new(0.0, 0.25, 0.75, 1.0)];
    assert_eq!(posed.colors(0), expected);
}

#[test]
fn texture_coordinates_and_colours_follow_animated_weights() {
    let mut fixture = morphed(|fixture| {
        let uvs = fixture.vec2(&[[1.0, -2.0]; 3]);
        let colors = fixture.vec3(&[[0.25, -0.25, 0.0]; 3]);
        json!({"TEXCOORD_0": uvs, "COLOR_0": colors})
    });
    let times = fixture.floats("SCALAR", 1, &[0.0, 2.0]);
    let weights = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let channels = json!([{"sampler": 0, "target": {"node": 0, "path": "weights"}}]);
    fixture
        .push("animations", json!({"channels": channels, "samplers": [{"input": times, "output": weights}]}));
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    for (time, w) in [(0.0, 0.0), (0.5, 0.25), (2.0, 1.0)] {
        let posed = pose(&scene, &PoseSettings { time, ..PoseSettings::default() }).unwrap();
        let expected = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|uv| uv + Vec2::new(w, -2.0 * w));
        assert_eq!(posed.uvs(0)[0], expected, "{time}");
        assert_eq!(posed.colors(0), [Vec4::new(0.5 + 0.25 * w, 0.25 - 0.25 * w, 0.75, 1.0); 3], "{time}");
    }
}

#[test]
fn displacements_of_all_types_are_read() {
    let types = [
        (5120, bytes_of(&[-127i8, 127, 0, 0, 0, 127]), bytes_of(&[-127i8; 9])),
        (5122, bytes_of(&[-32767i16, 32767, 0, 0, 0, 32767]), bytes_of(&[-32767i16; 9])),
    ];
    for (component, uvs, colors) in types {
        let fixture = morphed(|fixture| {
            // Elements of the specification's types are aligned to four bytes; these are packed, as some files have them.
            let uvs = fixture.accessor(component, "VEC2", 3, &uvs);
            let colors = fixture.accessor(component, "VEC3", 3, &colors);
            for accessor in [uvs, colors] {
                fixture.json["accessors"][accessor]["normalized"] = json!(true);
            }
            json!({"TEXCOORD_0": uvs, "COLOR_0": colors})
        });
        let (scene, warnings) = fixture.load();
        assert!(warnings.is_empty(), "{warnings:?}");
        let target = target_of(&scene);
        assert_eq!(target.uvs, [[Vec2::new(-1.0, 1.0), Vec2::ZERO, Vec2::Y]], "{component}");
        assert_eq!(target.colors, [Vec4::new(-1.0, -1.0, -1.0, 0.0); 3], "{component}");
    }
    // Integers that are not normalized: offsets in units of KHR_mesh_quantization, and colours that should be marked.
    let fixture = morphed(|fixture| {
        let uvs = fixture.accessor(5122, "VEC2", 3, &bytes_of(&[-300i16, 2, 0, 0, 0, 0]));
        let colors = fixture.accessor(5120, "VEC3", 3, &bytes_of(&[127i8, -127, 0, 0, 0, 0, 0, 0, 0]));
        json!({"TEXCOORD_0": uvs, "COLOR_0": colors})
    });
    let (scene, warnings) = fixture.load();
    assert_eq!(target_of(&scene).uvs[0][0], Vec2::new(-300.0, 2.0));
    assert_eq!(target_of(&scene).colors[0], Vec4::new(1.0, -1.0, 0.0, 0.0));
    let warning = "meshes[0].primitives[0].targets[0].COLOR_0: integer colours are not marked as normalized; \
                   used them as normalized";
    assert_eq!(warnings, [warning]);
}

#[test]
fn sparse_displacements_without_a_base_are_zero_elsewhere() {
    let fixture = morphed(|fixture| {
        let mut sparse = |kind: &str, value: &[f32]| {
            let (indices, values) = (fixture.view(&[2]), fixture.view(&bytes_of(value)));
            let sparse = json!({"count": 1, "indices": {"bufferView": indices, "componentType": 5121},
                "values": {"bufferView": values}});
            fixture
                .push("accessors", json!({"componentType": 5126, "type": kind, "count": 3, "sparse": sparse}))
        };
        json!({"TEXCOORD_0": sparse("VEC2", &[0.5, 0.25]), "COLOR_0": sparse("VEC4", &[1.0, 0.0, 0.0, 0.5])})
    });
    let (scene, warnings) = fixture.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let target = target_of(&scene);
    assert_eq!(target.uvs, [[Vec2::ZERO, Vec2::ZERO, Vec2::new(0.5, 0.25)]]);
    assert_eq!(target.colors, [Vec4::ZERO, Vec4::ZERO, Vec4::new(1.0, 0.0, 0.0, 0.5)]);
}

#[test]
fn displacements_that_do_not_match_the_mesh_are_ignored() {
    let fixture = morphed(|fixture| {
        let short = fixture.vec2(&[[1.0, 0.0]; 2]);
        let scalars = fixture.floats("SCALAR", 1, &[1.0; 3]);
        let colors = fixture.vec4(&[[f32::NAN, 0.0, 0.0, 0.0], [1.0; 4], [0.0, 0.0, f32::INFINITY, 0.0]]);
        json!({"TEXCOORD_0": short, "TEXCOORD_1": scalars, "TEXCOORD_2": 0, "COLOR_0": colors, "COLOR_1": 0})
    });
    let (scene, warnings) = fixture.load();
    assert!(target_of(&scene).uvs.is_empty());
    assert_eq!(target_of(&scene).colors, [Vec4::ZERO, Vec4::ONE, Vec4::ZERO]);
    let targets = "meshes[0].primitives[0].targets";
    let expected = [
        format!("{targets}: ignored morph target attribute COLOR_1"),
        format!("{targets}[0].TEXCOORD_0: ignored attribute with 2 elements for 3 vertices"),
        format!("{targets}[0].TEXCOORD_1: ignored attribute with 1 components per element"),
        format!("{targets}[0].TEXCOORD_2: ignored displacements of TEXCOORD_2, which the mesh lacks"),
        format!("{targets}[0].COLOR_0: 2 displacements are not finite; used 0"),
    ];
    assert_eq!(warnings, expected);
    let out_of_range = morphed(|_| json!({"TEXCOORD_0": 99}));
    assert!(out_of_range.error().starts_with(&format!("{targets}[0].TEXCOORD_0: 99 is out of range")));
}

/// MikkTSpace splits vertices; their displacements go with them. Normal maps turn with displaced coordinates.
#[test]
fn generated_tangents_follow_displaced_coordinates() {
    let mut fixture = textured(json!({"normalTexture": {"index": 0}}));
    let count = fixture.json["accessors"][0]["count"].as_u64().unwrap() as usize;
    // From (u, v) to (1 - u, v): the image is mirrored.
    let (scene, _) = fixture.load();
    let rest: Vec<Vec2> = scene.meshes[0].uvs[0].clone();
    let mirrored: Vec<[f32; 2]> = rest.iter().map(|uv| [1.0 - 2.0 * uv.x, 0.0]).collect();
    assert_eq!(mirrored.len(), count);
    let uvs = fixture.vec2(&mirrored);
    fixture.primitive()["targets"] = json!([{"TEXCOORD_0": uvs}]);
    let tangents = |fixture: &Fixture, weight: f64| {
        let mut fixture = fixture.clone();
        fixture.json["meshes"][0]["weights"] = json!([weight]);
        let (scene, _) = fixture.load();
        pose(&scene, &PoseSettings::default()).unwrap().tangents(0).to_vec()
    };
    let (at_rest, displaced) = (tangents(&fixture, 0.0), tangents(&fixture, 1.0));
    assert!(!at_rest.is_empty());
    for (rest, displaced) in at_rest.iter().zip(&displaced) {
        assert!((*displaced + *rest).abs().max_element() < 1e-6, "{rest} {displaced}");
    }
}

#[test]
fn attributes_of_targets_are_found_by_name() {
    let mut warnings = Warnings::default();
    let target = json!({"POSITION": 0, "COLOR_0": 1, "TEXCOORD_0": 2, "TEXCOORD_31": 3, "TEXCOORD_32": 4, "_X": 5,
        "TEXCOORD_1": "x", "JOINTS_0": 6});
    let mut root = json!({"meshes": [{}, {"primitives": [{}, {"targets": [{"POSITION": 0}, target]}]}]});
    let found = find(&mut root, &mut warnings);
    let expected = TargetAttributes { uvs: [(0, 2), (31, 3)].into(), colors: Some(1) };
    assert_eq!(found.into_iter().collect::<Vec<_>>(), [([1, 1, 1], expected)]);
    assert_eq!(
        warnings.into_lines(),
        [
            "meshes[1].primitives[1].targets[1].TEXCOORD_1: ignored invalid value 'x'; expected the index of an accessor",
            "meshes[1].primitives[1].targets: ignored morph target attribute JOINTS_0",
            "meshes[1].primitives[1].targets: ignored morph target attribute TEXCOORD_32",
        ]
    );
}
