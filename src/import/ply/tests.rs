//! PLY files of every encoding, with every attribute, and with defects.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use crate::{Limits, LoadError, LoadOptions, Warning, load_bytes};
use blinn_scene::{AlphaMode, Reflectance, Scene, SourceFormat, UpAxis};

fn load_with(bytes: &[u8], options: &LoadOptions) -> Result<(Scene, Vec<Warning>), LoadError> {
    load_bytes(bytes, Path::new("a.ply"), options)
}

fn load(bytes: &[u8]) -> (Scene, Vec<Warning>) {
    load_with(bytes, &LoadOptions::default()).unwrap()
}

#[track_caller]
fn error(text: &str, message: &str) {
    let error = load_with(text.as_bytes(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(message), "{error}");
}

const SQUARE: &str = "ply\nformat ascii 1.0\ncomment made by a test\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

#[test]
fn a_square_lies_flat_with_z_up() {
    let (scene, warnings) = load(SQUARE.as_bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((scene.source.format, scene.source.generator.as_str()), (SourceFormat::Ply, "made by a test"));
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(scene.objects, ["default"]);
    let to_world = |scene: &Scene| scene.nodes[0].local.affine().transform_point3(glam::DVec3::Z);
    assert_eq!(to_world(&scene), glam::DVec3::Y);
    let as_stored = LoadOptions { up: Some(UpAxis::Y), ..LoadOptions::default() };
    assert_eq!(to_world(&load_with(SQUARE.as_bytes(), &as_stored).unwrap().0), glam::DVec3::Z);
}

/// The header of a triangle with every attribute of vertices and faces, and its bytes in one byte order.
fn binary(is_big: bool) -> Vec<u8> {
    let mut file = format!(
        "ply\r\nformat binary_{}_endian 1.0\r\nobj_info a scan\r\nelement vertex 3\r\nproperty double x\r\n\
         property float y\r\nproperty short z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n\
         property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nproperty uchar alpha\r\n\
         property float s\r\nproperty float t\r\nproperty list ushort float quality\r\nelement face 1\r\n\
         property uchar flags\r\nproperty list uint ushort vertex_index\r\nelement edge 1\r\n\
         property int vertex1\r\nend_header\r\n",
        if is_big { "big" } else { "little" }
    )
    .into_bytes();
    let mut put = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if is_big {
            bytes.reverse();
        }
        file.extend(bytes);
    };
    for i in 0..3u8 {
        put(&f64::from(i == 1).to_le_bytes());
        put(&f32::from(u8::from(i == 2)).to_le_bytes());
        put(&(-2i16).to_le_bytes());
        [0.0f32, 0.0, 2.0].iter().for_each(|n| put(&n.to_le_bytes()));
        [255, 0, 188, 128].iter().for_each(|byte| put(&[*byte]));
        [0.25f32, 0.75].iter().for_each(|uv| put(&uv.to_le_bytes()));
        put(&2u16.to_le_bytes());
        [1.0f32, 2.0].iter().for_each(|quality| put(&quality.to_le_bytes()));
    }
    put(&[7]);
    put(&3u32.to_le_bytes());
    [0u16, 1, 2].iter().for_each(|index| put(&index.to_le_bytes()));
    put(&5i32.to_le_bytes());
    file
}

#[test]
fn binary_files_have_either_byte_order_and_every_attribute() {
    for is_big in [false, true] {
        let (scene, warnings) = load(&binary(is_big));
        assert!(warnings.is_empty(), "{warnings:?}");
        let mesh = &scene.meshes[0];
        assert_eq!(
            mesh.positions,
            [Vec3::new(0.0, 0.0, -2.0), Vec3::new(1.0, 0.0, -2.0), Vec3::new(0.0, 1.0, -2.0)]
        );
        assert_eq!((mesh.normals[0], mesh.uvs[0][0]), (Vec3::Z, Vec2::new(0.25, 0.25)));
        assert!(
            mesh.colors[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.5029, 128.0 / 255.0), 1e-3),
            "{}",
            mesh.colors[0]
        );
        assert_eq!(scene.materials[0].alpha_mode, AlphaMode::Blend);
    }
}

#[test]
fn faces_have_colours_and_corners_have_texture_coordinates() {
    let text = SQUARE
        .replace("element face 1\n", "element face 2\n")
        .replace("vertex_indices\n", "vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n")
        .replace("4 0 1 2 3\n", "3 0 1 2 6 0 0 1 0 1 1 255 0 0\n3 0 2 3 6 0 0 1 1 0 1 0 0 255\n");
    let (scene, warnings) = load(text.as_bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.colors[mesh.triangles[1][2] as usize], Vec4::new(0.0, 0.0, 1.0, 1.0));
    assert_eq!(mesh.uvs[0][mesh.triangles[0][2] as usize], Vec2::new(1.0, 0.0));
}

#[test]
fn images_of_comments_are_textures() {
    let dir = tempfile::tempdir().unwrap();
    let text = SQUARE
        .replace("comment made by a test", "comment VCGLIB generated\ncomment TextureFile no such.png")
        .replace("property float z\n", "property float z\nproperty float u\nproperty float v\n")
        .replace("0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n");
    let path = dir.path().join("a.ply");
    std::fs::write(&path, &text).unwrap();
    let (_, warnings) = crate::load(&path, &LoadOptions::default()).unwrap();
    assert!(warnings.len() == 1 && warnings[0].message.contains("no such.png"), "{warnings:?}");
    image::RgbImage::new(2, 2).save(dir.path().join("no such.png")).unwrap();
    let (scene, warnings) = crate::load(&path, &LoadOptions::default()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(scene.materials[0].base_color.texture.is_some() && scene.images.len() == 1);
    assert_eq!(scene.source.generator, "VCGLIB generated");
}

#[test]
fn strips_turn_every_other_triangle() {
    let text = SQUARE
        .replace(
            "element face 1\nproperty list uchar int vertex_indices",
            "element tristrips 1\nproperty list int int vertex_indices",
        )
        .replace("4 0 1 2 3\n", "9 0 1 3 2 -1 0 1 2 -1\n");
    let (scene, _) = load(text.as_bytes());
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
}

#[test]
fn files_that_end_early_have_their_first_faces() {
    let file = binary(false);
    let (scene, warnings) = load(&file[..file.len() - 2]);
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert_eq!(warnings[0].message, "the file ends after 0 of 1 rows of 'edge'");
    let cut = "the file has no faces to render; the file ends after 3 of 4 rows of 'vertex'";
    error(&SQUARE[..SQUARE.len() - 14], cut);
    let empty = SQUARE
        .split_once("end_header\n")
        .unwrap()
        .0
        .replace("vertex 4", "vertex 0")
        .replace("face 1", "face 0");
    error(&(empty + "end_header\n"), "the file has no vertices");
}

#[test]
fn vertices_without_faces_are_points() {
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let text = SQUARE.replace("element face", &format!("{colors}element face")).replace("face 1", "face 0");
    let text = text.replace(
        "\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n",
        "\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 0\n0 1 0 9 9 9\n",
    );
    let (scene, warnings) = load(text.as_bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.point_count(), mesh.colors[1]), (4, Vec4::new(0.0, 1.0, 0.0, 1.0)));
    assert_eq!(scene.materials[mesh.material as usize].reflectance, Reflectance::Unshaded);
    // Normals are lit by.
    let text = SQUARE.replace(
        "property float z\n",
        "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n",
    );
    let text =
        text.replace("face 1", "face 0").replace(" 0\n", " 0 0 0 2\n").replace("face 0 0 0 2", "face 0");
    let (scene, _) = load(text.as_bytes());
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 4]);
    assert_ne!(scene.materials[0].reflectance, Reflectance::Unshaded);
}

/// Open3D writes line sets as edges with colours, Blender loose edges beside faces.
#[test]
fn edges_are_lines() {
    let header = "element edge 2\nproperty int vertex1\nproperty int vertex2\n";
    let both = SQUARE.replace("end_header", &format!("{header}end_header")) + "0 2\n3 1\n";
    let (scene, warnings) = load(both.as_bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[1].lines()), (2, &[[0, 2], [3, 1]][..]));
    let reflectance = |mesh: usize| &scene.materials[scene.meshes[mesh].material as usize].reflectance;
    assert_eq!((reflectance(0) == reflectance(1), reflectance(1)), (false, &Reflectance::Unshaded));
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let alone = both
        .replace("end_header", &format!("{colors}end_header"))
        .replace("face 1", "face 0")
        .replace("4 0 1 2 3\n0 2\n3 1\n", "0 2 255 0 0\n3 1 0 255 0\n");
    let (scene, _) = load(alone.as_bytes());
    let [mesh] = &scene.meshes[..] else { panic!("{} meshes", scene.meshes.len()) };
    assert_eq!((mesh.lines(), mesh.positions[2]), (&[[0, 1], [2, 3]][..], Vec3::Y));
    assert_eq!(mesh.colors[1..3], [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0)]);
    for (wrong, message) in [("3 4\n", "edges: vertex index 4 is out of range"), ("3 one\n", "edge 1: 'one'")]
    {
        error(&both.replace("3 1\n", wrong), message);
    }
    let limits = Limits { vertices: 7, ..Limits::default() };
    let error = load_with(both.as_bytes(), &LoadOptions { limits, ..LoadOptions::default() }).unwrap_err();
    assert!(matches!(error, LoadError::Limit { .. }), "{error}");
}

#[test]
fn defects_are_errors_that_name_the_row() {
    error(
        &SQUARE.replace("4 0 1 2 3", "4 0 1 2 4"),
        "vertex index 4 is out of range: the file has 4 vertices",
    );
    error(&SQUARE.replace("4 0 1 2 3", "4 0 1 2 -1"), "is out of range");
    error(&SQUARE.replace("1 1 0\n", "1 one 0\n"), "line 13, vertex 2: 'one' is not a number");
    error(
        &SQUARE.replace("4 0 1 2 3", "-4 0 1 2 3"),
        "line 15, face 0: 'a list of -4 items' is not a number",
    );
    let with_pairs = SQUARE.replace("1 1 0\n", "1 one 0\n").replace('\n', "\r\n");
    error(&with_pairs, "line 13, vertex 2: 'one' is not a number");
    let splats = SQUARE
        .replace("face 1", "face 0")
        .replace("property float z\n", "property float z\nproperty float f_dc_0\nproperty float rot_0\n");
    error(&splats, "Gaussian splats");
}

#[test]
fn decimal_commas_are_read_with_a_warning_and_a_mark_before_utf8_is_skipped() {
    let expected = load(SQUARE.replace("1 1 0\n", "1 1.5 0\n").as_bytes()).0;
    for mark in ["", "\u{feff}"] {
        let (scene, warnings) = load(format!("{mark}{SQUARE}").replace("1 1 0\n", "1 1,5 0,0\n").as_bytes());
        assert_eq!(scene.meshes[0].positions, expected.meshes[0].positions);
        let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings, ["PLY, line 13: numbers have decimal commas: read as decimal points"]);
    }
    error(&SQUARE.replace("1 1 0\n", "1 1,0,5 0\n"), "line 13, vertex 2: '1,0,5' is not a number");
}

#[test]
fn numbers_in_the_header_allocate_nothing_that_the_file_cannot_have() {
    let huge = SQUARE.replace("vertex 4", "vertex 18446744073709551615").replace("face 1", "face 4294967295");
    let error = load_with(huge.as_bytes(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("is not a number") || error.contains("no faces"), "{error}");
    let empty = "ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nend_header\n";
    assert!(load_with(empty.as_bytes(), &LoadOptions::default()).is_err());
    let limits = Limits { vertices: 3, ..Limits::default() };
    let error = load_with(SQUARE.as_bytes(), &LoadOptions { limits, ..LoadOptions::default() }).unwrap_err();
    assert!(matches!(error, LoadError::Limit { .. }), "{error}");
}

#[test]
fn coordinates_far_from_the_origin_keep_their_digits() {
    let text = SQUARE.replace("float", "double").replace("1 1 0\n", "5000001.25 4000001 0\n");
    let text = text
        .replace("0 0 0\n1 0 0\n", "5000000 4000000 0\n5000001 4000000 0\n")
        .replace("0 1 0\n4", "5000000 4000001 0\n4");
    let (scene, _) = load(text.as_bytes());
    let [a, b] = [0, 2].map(|vertex| scene.meshes[0].positions[vertex]);
    assert_eq!((b - a).x, 1.25);
}

#[test]
fn alpha_that_is_zero_everywhere_is_ignored() {
    let text = SQUARE
        .replace(
            "property float z\n",
            "property float z\nproperty uchar r\nproperty uchar g\nproperty uchar b\nproperty uchar a\n",
        )
        .replace(
            "0 0 0\n1 0 0\n1 1 0\n0 1 0\n",
            "0 0 0 9 9 9 0\n1 0 0 9 9 9 0\n1 1 0 9 9 9 0\n0 1 0 9 9 9 0\n",
        );
    let (scene, warnings) = load(text.as_bytes());
    assert_eq!((scene.materials[0].alpha_mode, scene.meshes[0].colors[0].w), (AlphaMode::Opaque, 1.0));
    assert_eq!(warnings.len(), 1);
}

/// Blender joins objects into one mesh.
#[test]
fn objects_of_blender_without_colours_are_white() {
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    let text = SQUARE.replace("element face", &format!("{colors}element face")).replace(
        "\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n",
        "\n0 0 0 255 0 0 255\n1 0 0 0 0 0 255\n1 1 0 0 0 0 0\n0 1 0 0 0 0 0\n",
    );
    let alpha = |text: &str| load(text.as_bytes()).0.meshes[0].colors.clone();
    let blender = text.replace("element vertex", "comment Created in Blender version 5.0.1\nelement vertex");
    let (red, black) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 0.0, 1.0));
    assert_eq!(alpha(&blender), [red, black, Vec4::ONE, Vec4::ONE]);
    assert_eq!(alpha(&text), [red, black, Vec4::ZERO, Vec4::ZERO]);
}

#[test]
fn scalar_fields_are_named_where_there_are_no_colours() {
    let cloud = |properties: &str, row: &str| {
        let header =
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
        let text = format!("{header}{properties}end_header\n0 0 0 {row}\n");
        let (_, warnings) = load(text.as_bytes());
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let fields = "property float scalar_Intensity\nproperty float scalar_Time\n";
    let warnings = cloud(fields, "1 2");
    let expected =
        "the scalar fields of the vertices are not shown: Intensity, Time; convert them to colours";
    assert!(warnings.len() == 1 && warnings[0].starts_with(expected), "{warnings:?}");
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    assert_eq!(cloud(&format!("{fields}{colors}"), "1 2 255 0 0"), [""; 0]);
}
