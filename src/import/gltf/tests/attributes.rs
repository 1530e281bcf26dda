//! Primitives: triangles and vertex attributes.

use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use super::super::fixture::{Fixture, bytes_of};
use crate::LoadOptions;
use blinn_scene::{Mesh, Reflectance};

#[test]
fn a_triangle_is_loaded() {
    let (scene, warnings) = Fixture::triangle().load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.name, "mesh");
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!((scene.objects.as_slice(), scene.instances[0].object), (&["node".to_string()][..], 1));
}

#[test]
fn every_index_type_is_read() {
    for (component, bytes) in
        [(5121, vec![2u8, 1, 0]), (5123, bytes_of(&[2u16, 1, 0])), (5125, bytes_of(&[2u32, 1, 0]))]
    {
        let mut fixture = Fixture::triangle();
        let indices = fixture.accessor(component, "SCALAR", 3, &bytes);
        fixture.primitive()["indices"] = json!(indices);
        assert_eq!(fixture.load().0.meshes[0].triangles, [[2, 1, 0]]);
    }
}

#[test]
fn an_index_out_of_range_is_an_error() {
    let mut fixture = Fixture::triangle();
    let indices = fixture.indices(&[0, 1, 3]);
    fixture.primitive()["indices"] = json!(indices);
    let expected = "meshes[0].primitives[0].indices: element 2 is index 3, but there are only 3 vertices";
    assert_eq!(fixture.error(), expected);
}

#[test]
fn unused_vertices_are_removed_from_large_buffers() {
    let mut fixture = Fixture::triangle();
    let many: Vec<[f32; 3]> = (0..100).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let positions = fixture.vec3(&many);
    let indices = fixture.indices(&[90, 7, 30]);
    *fixture.primitive() = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let mesh = &fixture.load().0.meshes[0];
    assert_eq!(mesh.triangles, [[2, 0, 1]]);
    assert_eq!(mesh.positions.iter().map(|p| p.x).collect::<Vec<_>>(), [7.0, 30.0, 90.0]);
}

#[test]
fn points_and_lines_are_read_in_every_mode() {
    let mut fixture = Fixture::triangle();
    let indices = fixture.indices(&[2, 0, 2]);
    for mode in [0, 1, 2, 3] {
        let primitive = json!({"attributes": {"POSITION": 0}, "mode": mode});
        fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive.clone());
        let mut indexed = primitive;
        indexed["indices"] = json!(indices);
        fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(indexed);
    }
    let (scene, warnings) = fixture.load();
    let [triangle, rounds @ ..] = &scene.meshes[..] else { panic!() };
    let counts = |mesh: &Mesh| (mesh.positions.len(), mesh.point_count(), mesh.lines().len());
    let expected = [(3, 3, 0), (3, 3, 0), (2, 0, 1), (2, 0, 1), (3, 0, 3), (2, 0, 3), (3, 0, 2), (2, 0, 2)];
    assert_eq!(rounds.iter().map(counts).collect::<Vec<_>>(), expected);
    assert_eq!(rounds[5].lines(), [[1, 0], [0, 1], [1, 1]]);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("ignored the last of 3 vertices, which forms no line"), "{warnings:?}");
    // The triangle keeps its material.
    let material = |mesh: &Mesh| scene.materials[mesh.material as usize].reflectance;
    assert!(rounds.iter().all(|mesh| material(mesh) == Reflectance::Unshaded));
    assert_ne!(material(triangle), Reflectance::Unshaded);
}

#[test]
fn points_and_lines_with_indices_out_of_range_are_errors() {
    for mode in [0, 1, 2, 3] {
        let mut fixture = Fixture::triangle();
        let indices = fixture.indices(&[0, 3]);
        *fixture.primitive() = json!({"attributes": {"POSITION": 0}, "indices": indices, "mode": mode});
        let error = fixture.try_load_with(&LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("is index 3, but there are only 3 vertices"), "{error}");
    }
}

#[test]
fn primitives_without_positions_or_triangles_are_ignored() {
    let mut fixture = Fixture::triangle();
    let primitives = json!([{"attributes": {"NORMAL": 1}}, {"attributes": {"POSITION": 0}, "indices": 2}]);
    fixture.indices(&[0, 1]);
    fixture.json["meshes"][0]["primitives"] = primitives;
    let (scene, warnings) = fixture.load();
    assert!(scene.meshes.is_empty() && scene.instances.is_empty());
    assert_eq!(warnings.len(), 3, "{warnings:?}");
}

#[test]
fn tangents_are_normalized_and_ignored_without_normals() {
    let mut fixture = Fixture::triangle();
    let tangents = fixture.vec4(&[[2.0, 0.0, 0.0, -1.0]; 3]);
    fixture.primitive()["attributes"]["TANGENT"] = json!(tangents);
    assert_eq!(fixture.load().0.meshes[0].tangents, [Vec4::new(1.0, 0.0, 0.0, -1.0); 3]);
    fixture.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let mesh = &fixture.load().0.meshes[0];
    assert!(mesh.normals.is_empty() && mesh.tangents.is_empty());
}

#[test]
fn quantized_attributes_are_read() {
    let mut fixture = Fixture::triangle();
    let positions = fixture.accessor(5122, "VEC3", 3, &bytes_of(&[0i16, 0, 0, 300, 0, 0, 0, 300, 0]));
    let normals = fixture.accessor(5120, "VEC3", 3, &bytes_of(&[0i8, 0, 127, 0, 0, 127, 0, 0, 127]));
    let uvs = fixture.accessor(5123, "VEC2", 3, &bytes_of(&[0u16, 65535, 65535, 0, 0, 0]));
    fixture.json["accessors"][normals]["normalized"] = json!(true);
    fixture.json["accessors"][uvs]["normalized"] = json!(true);
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs});
    fixture.primitive()["attributes"] = attributes;
    fixture.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let mesh = &fixture.load().0.meshes[0];
    assert_eq!(mesh.positions[1], Vec3::new(300.0, 0.0, 0.0));
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.uvs, [vec![Vec2::Y, Vec2::X, Vec2::ZERO]]);
}

#[test]
fn texture_coordinates_of_high_sets_are_read_up_to_a_limit() {
    let mut fixture = Fixture::triangle();
    let uvs = fixture.vec2(&[[0.5, 0.25]; 3]);
    fixture.primitive()["attributes"]["TEXCOORD_3"] = json!(uvs);
    fixture.primitive()["attributes"]["TEXCOORD_4000000000"] = json!(uvs);
    let (scene, warnings) = fixture.load();
    let lengths: Vec<usize> = scene.meshes[0].uvs.iter().map(Vec::len).collect();
    assert_eq!(lengths, [0, 0, 0, 3]);
    assert_eq!(warnings.len(), 1);
}

#[test]
fn vertex_colours_of_every_type_are_read() {
    let kinds: [(u32, &str, Vec<u8>, f32); 4] = [
        (5126, "VEC3", bytes_of(&[1.0f32; 9]), 1.0),
        (5126, "VEC4", bytes_of(&[1.0f32; 12]), 1.0),
        (5121, "VEC4", vec![51; 12], 0.2),
        (5123, "VEC4", bytes_of(&[13107u16; 12]), 0.2),
    ];
    for (component, kind, bytes, alpha) in kinds {
        let mut fixture = Fixture::triangle();
        let colors = fixture.accessor(component, kind, 3, &bytes);
        fixture.json["accessors"][colors]["normalized"] = json!(component != 5126);
        fixture.primitive()["attributes"]["COLOR_0"] = json!(colors);
        assert_eq!(fixture.load().0.meshes[0].colors, [Vec4::splat(alpha); 3], "{component} {kind}");
    }
}

/// Unnormalized bytes would be reflectances up to 255.
#[test]
fn integer_colours_are_normalized_even_if_not_marked() {
    let mut fixture = Fixture::triangle();
    let kinds = [(5121, vec![51; 9]), (5123, bytes_of(&[13107u16; 9])), (5121, vec![1; 9])];
    for ((component, bytes), value) in kinds.into_iter().zip([0.2, 0.2, 1.0]) {
        let colors = fixture.accessor(component, "VEC3", 3, &bytes);
        fixture.primitive()["attributes"]["COLOR_0"] = json!(colors);
        let (scene, warnings) = fixture.load();
        assert_eq!(scene.meshes[0].colors, [Vec3::splat(value).extend(1.0); 3], "{component}");
        let warning = "meshes[0].primitives[0].attributes.COLOR_0: integer colours are not marked as \
                       normalized; used them as normalized";
        assert_eq!(warnings, if value < 1.0 { vec![warning] } else { vec![] }, "{component}");
    }
}

#[test]
fn joint_weights_sum_to_one() {
    let mut fixture = Fixture::triangle();
    let joints = fixture.accessor(5121, "VEC4", 3, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    let more = fixture.accessor(5123, "VEC4", 3, &bytes_of(&[300u16; 12]));
    let weights = fixture.vec4(&[[2.0, 2.0, 0.0, 0.0], [0.0; 4], [f32::NAN, 1.0, -5.0, 0.0]]);
    let others = fixture.vec4(&[[4.0, 0.0, 0.0, 0.0], [0.0; 4], [0.0, 0.0, 0.0, 3.0]]);
    let attributes = &mut fixture.primitive()["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    let four = &fixture.load().0.meshes[0].influences;
    assert_eq!((four.per_vertex, &four.joints[4..8]), (4, &[4, 5, 6, 7][..]));
    assert_eq!(four.weights, [0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let attributes = &mut fixture.primitive()["attributes"];
    attributes["JOINTS_1"] = json!(more);
    attributes["WEIGHTS_1"] = json!(others);
    let eight = &fixture.load().0.meshes[0].influences;
    assert_eq!((eight.per_vertex, &eight.joints[4..9]), (8, &[300, 300, 300, 300, 4][..]));
    assert_eq!(eight.weights[..8], [0.25, 0.25, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]);
}

/// A NaN in a colour would be a NaN in the image.
#[test]
fn non_finite_colours_become_1() {
    let mut fixture = Fixture::triangle();
    let colors =
        fixture.vec4(&[[f32::NAN, 0.5, 0.25, f32::INFINITY], [0.5; 4], [0.0, f32::NEG_INFINITY, 0.0, 1.0]]);
    fixture.primitive()["attributes"]["COLOR_0"] = json!(colors);
    let (scene, warnings) = fixture.load();
    let expected = [Vec4::new(1.0, 0.5, 0.25, 1.0), Vec4::splat(0.5), Vec4::new(0.0, 1.0, 0.0, 1.0)];
    assert_eq!(scene.meshes[0].colors, expected);
    let warning = "meshes[0].primitives[0].attributes.COLOR_0: 2 colours have non-finite components; used 1";
    assert_eq!(warnings, [warning]);
}

#[test]
fn attributes_of_the_wrong_size_are_ignored() {
    let mut fixture = Fixture::triangle();
    let short = fixture.vec3(&[[0.0, 0.0, 1.0]; 2]);
    fixture.primitive()["attributes"]["NORMAL"] = json!(short);
    fixture.primitive()["attributes"]["TEXCOORD_0"] = json!(0);
    let (scene, warnings) = fixture.load();
    assert!(scene.meshes[0].normals.is_empty() && scene.meshes[0].uvs.is_empty());
    assert_eq!(warnings.len(), 2, "{warnings:?}");
}

/// Encoders write such streams if every attribute is sparse, with indices truncated to eight bits.
#[test]
fn a_draco_stream_without_attributes_is_replaced_by_the_uncompressed_data() {
    let mut fixture = Fixture::triangle();
    fixture.primitive()["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    let indices = fixture.indices(&[0, 1, 2]);
    fixture.primitive()["indices"] = json!(indices);
    let indices = fixture.view(&[1]);
    let values = fixture.view(&bytes_of(&[2.0f32, 0.0, 0.0]));
    fixture.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let (scene, warnings) = fixture.load();
    assert_eq!(scene.meshes[0].positions[1], Vec3::new(2.0, 0.0, 0.0));
    assert!(warnings[0].ends_with("; used the uncompressed data"), "{warnings:?}");
    // The file has no uncompressed indices.
    fixture.json["accessors"][2].as_object_mut().unwrap().remove("bufferView");
    let error = fixture.error();
    assert!(error.ends_with("attributes are missing; save the file without Draco compression"), "{error}");
}

#[test]
fn joints_without_weights_are_ignored_with_a_warning() {
    let mut fixture = Fixture::triangle();
    let joints = fixture.accessor(5121, "VEC4", 3, &[0; 12]);
    fixture.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    let (scene, warnings) = fixture.load();
    let warning = "meshes[0].primitives[0].attributes.JOINTS_0: ignored attribute without WEIGHTS_0";
    assert_eq!((scene.meshes[0].influences.per_vertex, warnings), (0, vec![warning.to_string()]));
}
