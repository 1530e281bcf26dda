//! Regression tests of OBJ geometry and text.

use std::fs;

use super::{SQUARE, error, load_with, png, read, scene};
use crate::{LoadError, LoadOptions, NormalMode, load};
use glam::Vec3;

#[test]
fn faces_without_corners_are_counted() {
    let (scene, warnings) = read(format!("{SQUARE}f\nf 1\nf 1 2 3\n"), &[]).unwrap();
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert_eq!(warnings, ["ignored 2 faces with fewer than three vertices"]);
}

#[test]
fn non_finite_vertices_are_kept() {
    for number in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND", "inf", "1e999"] {
        let (scene, _) = read(format!("{SQUARE}v {number} 0 0\nf 1 2 3\nf 1 2 5\n"), &[]).unwrap();
        assert_eq!(scene.meshes[0].triangles.len(), 2, "{number}");
        assert!(!scene.meshes[0].positions[3].is_finite(), "{number}");
    }
}

#[test]
fn texture_coordinates_that_are_not_finite_are_0() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0.5\nvt 1 inf\nvt 0.25 1\nf 1/1 2/2 3/3\n";
    let (scene, warnings) = read(obj, &[]).unwrap();
    assert!(scene.meshes[0].uvs[0].iter().all(|uv| uv.is_finite()), "{:?}", scene.meshes[0].uvs);
    assert_eq!(scene.meshes[0].uvs[0].len(), 3);
    assert_eq!(warnings, ["2 texture coordinates are not finite; used 0"]);
}

#[test]
fn zero_normals_are_replaced_by_face_normals() {
    // A zero vn, a NaN vn, and a smoothing group whose faces cancel.
    for vn in ["0 0 0", "nan 0 0"] {
        let scene = scene(&format!("{SQUARE}vn {vn}\nf 1//1 2//2 3//1\n"));
        assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3], "{vn}");
    }
    let cancel = scene(&format!("{SQUARE}s 1\nf 1 2 3\nf 3 2 1\n"));
    let mesh = &cancel.meshes[0];
    assert_eq!(
        (mesh.positions.len(), &mesh.normals[..3], &mesh.normals[3..]),
        (6, &[Vec3::Z; 3][..], &[-Vec3::Z; 3][..])
    );
}

#[test]
fn smoothing_groups_do_not_split_meshes() {
    let mut obj = String::new();
    for i in 0..300 {
        obj += &format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\ns {}\nf -3 -2 -1\n", i + 1);
    }
    let scene = scene(&obj);
    assert_eq!((scene.meshes.len(), scene.meshes[0].triangles.len()), (1, 300));
}

#[test]
fn the_instance_limit_is_checked_before_allocation() {
    let obj: String = (0..10).map(|i| format!("o {i}\nf 1 2 3\n")).collect();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, format!("{SQUARE}{obj}")).unwrap();
    let with = |instances| {
        let mut options = LoadOptions::default();
        options.limits.instances = instances;
        load(&path, &options)
    };
    assert!(with(10).is_ok());
    assert!(matches!(with(9), Err(LoadError::Limit { name: "instances", .. })));
}

#[test]
fn locations_are_those_of_the_original_file() {
    for (obj, expected) in [
        ("v 0 0 0\nf 1 1 \\\n  9 1\n", "line 3, column 3, at '9'"),
        ("v 0 0 0\r\n\tf 1 é 1\r\n", "line 2, column 6, at 'é'"),
        ("v 0 0 0\rf 1 1 9\r", "line 2, column 7, at '9'"),
        ("\u{feff}v 0 0 x\n", "line 1, column 7, at 'x'"),
    ] {
        let error = error(obj);
        assert!(error.contains(expected), "{obj:?}: {error}");
    }
}

#[test]
fn encodings_and_line_ends_do_not_change_the_scene() {
    let text = format!("# Maker 1.0\n{SQUARE}o caf\u{e9}\nf 1 2 3\nf 1 3 4");
    let utf16 = |to: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to).collect::<Vec<u8>>();
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let forms: [(Vec<u8>, usize); 9] = [
        (text.clone().into_bytes(), 0),
        (format!("\u{feff}{text}").into_bytes(), 0),
        (text.replace('\n', "\r\n").into_bytes(), 0),
        (text.replace('\n', "\r").into_bytes(), 0),
        (text.replacen("\nf", "\rf", 1).into_bytes(), 0),
        (utf16(u16::to_le_bytes), 0),
        (utf16(u16::to_be_bytes), 0),
        ([b"\xff\xfe".to_vec(), utf16(u16::to_le_bytes)].concat(), 0),
        (latin, 1),
    ];
    for (bytes, warning_count) in forms {
        let (scene, warnings) = read(&bytes, &[]).unwrap();
        assert_eq!((scene.objects, scene.meshes[0].triangles.len()), (vec!["café".to_string()], 2));
        assert_eq!((scene.source.generator.as_str(), warnings.len()), ("Maker 1.0", warning_count));
    }
}

#[test]
fn zbrush_polypaint_is_read() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000ff00ff00\n#MRGB ff0000ff\nf 1 2 3\n";
    let scene = scene(obj);
    let red_green_blue = [Vec3::X, Vec3::Y, Vec3::Z].map(|c| c.extend(1.0));
    assert_eq!(scene.meshes[0].colors, red_green_blue);
}

#[test]
fn vertex_colours_of_blender_are_srgb_and_unused_by_its_materials() {
    let obj = "# Blender 5.0.1\nmtllib a.mtl\nv 0 0 0 .7353569 0 0\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nf 1 2 3\nusemtl m\nf 1 2 3\n";
    let (scene, warnings) = read(obj, &[("a.mtl", b"# Blender 5.0.1 MTL File\nnewmtl m\n")]).unwrap();
    assert!((scene.meshes[0].colors[0].x - 0.5).abs() < 1e-5);
    assert!(scene.meshes[1].colors.is_empty() && warnings.len() == 1, "{warnings:?}");
    // Colours of other exporters are used with materials.
    let (scene, _) = read(&obj[16..], &[("a.mtl", b"newmtl m\n")]).unwrap();
    assert!(scene.meshes[1].colors[0].x > 0.49);
}

/// assimp writes colours for all vertices of a file if one mesh has some.
#[test]
fn black_colours_are_ignored_if_other_meshes_have_colours() {
    let vertices = |color: &str| format!("v 0 0 0 {color}\nv 1 0 0 {color}\nv 0 1 0 {color}\n");
    let faces = "g a\nf 1 2 3\ng b\nf 4 5 6\ng c\nf 3 4 6\n";
    let (scene, warnings) = read(vertices("1 .5 0") + &vertices("0 0 0") + faces, &[]).unwrap();
    let has: Vec<bool> = scene.meshes.iter().map(|m| !m.colors.is_empty()).collect();
    assert_eq!(has, [true, false, true]);
    let message =
        "ignored the vertex colours of 1 meshes: they are all 0 0 0 while other meshes have colours";
    assert_eq!(warnings, [message]);
    // If all colours are black, they are used.
    for others in ["0 0 0", ""] {
        let (scene, warnings) = read(vertices(others) + &vertices("0 0 0") + faces, &[]).unwrap();
        assert!(scene.meshes[1].colors[0].x == 0.0 && warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn the_crease_angle_overrides_smoothing_groups_and_normals() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    let roof = "v 0 0 1\nv 0 0 -1\nv -1 -1 1\nv -1 -1 -1\nv 1 -1 1\nv 1 -1 -1\nvn 1 0 0\n";
    fs::write(&path, format!("{roof}s 1\nf 1 2 4 3\nusemtl b\nf 2//1 1//1 5//1 6//1\n")).unwrap();
    let normals = |normals| {
        let (scene, _) = load(&path, &LoadOptions { normals, ..Default::default() }).unwrap();
        scene.meshes.iter().map(|m| m.normals.clone()).collect::<Vec<_>>()
    };
    assert!(normals(NormalMode::Flat).iter().all(Vec::is_empty));
    assert_eq!(normals(NormalMode::Auto)[1], [Vec3::X; 4]);
    assert_eq!(normals(NormalMode::File)[1], [Vec3::X; 4]);
    let smooth = normals(NormalMode::CreaseAngle(100.0));
    assert!(smooth.iter().all(|n| n.iter().any(|n| n.abs_diff_eq(Vec3::Y, 1e-6))));
    let sharp = normals(NormalMode::CreaseAngle(80.0));
    assert!(sharp.iter().all(|n| n.iter().all(|n| (n.y - 0.5f32.sqrt()).abs() < 1e-6)));
}

#[test]
fn normal_maps_on_flat_faces_have_tangents() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 2] =
        [("a.mtl", b"newmtl m\nnorm n.png\n"), ("n.png", &png([128, 128, 255, 255]))];
    let (scene, _) = read(obj, &files).unwrap();
    assert_eq!((scene.meshes[0].normals.len(), scene.meshes[0].tangents.len()), (3, 3));
}

/// Three squares, of which those in `with` have `kinds` ("vt", "vn" or both), numbered as their vertices.
fn squares_numbered_by_vertices(with: [bool; 3], kinds: &[&str]) -> String {
    let mut obj = String::new();
    for (i, has) in with.into_iter().enumerate() {
        let z = i as f32;
        obj += &format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n");
        let all = ["vt", "vn"].map(|kind| has && kinds.contains(&kind));
        if all[1] {
            obj += &format!("vn {i} 0 1\n").repeat(4);
        }
        if all[0] {
            (0..4).for_each(|k| obj += &format!("vt {i} 0.{k}\n"));
        }
        let corner = |k: usize| match all {
            [true, true] => format!(" {k}/{k}/{k}"),
            [true, false] => format!(" {k}/{k}"),
            [false, true] => format!(" {k}//{k}"),
            [false, false] => format!(" {k}"),
        };
        let corners: String = (4 * i + 1..=4 * i + 4).map(corner).collect();
        obj += &format!("g grp{i}\nf{corners}\n");
    }
    obj
}

/// VTK and trimesh count vertices alone.
#[test]
fn attributes_numbered_by_vertices_are_those_of_the_vertices() {
    for with in [[false, true, true], [true, false, true], [false, false, true]] {
        for (kinds, what) in [
            (&["vt", "vn"][..], "texture coordinates and normals"),
            (&["vt"], "texture coordinates"),
            (&["vn"], "normals"),
        ] {
            let (scene, warnings) = read(squares_numbered_by_vertices(with, kinds), &[]).unwrap();
            assert_eq!(warnings, [format!("faces number {what} by vertices: used those of the vertices")]);
            for (i, mesh) in scene.meshes.iter().enumerate() {
                let normal = Vec3::new(i as f32, 0.0, 1.0).normalize();
                let expected = if with[i] && kinds.contains(&"vn") { vec![normal; 4] } else { Vec::new() };
                assert_eq!(mesh.normals, expected, "{with:?} {kinds:?}, object {i}");
                let uvs: Vec<f32> = mesh.uvs.iter().flatten().map(|uv| uv.x).collect();
                let expected = if with[i] && kinds.contains(&"vt") { vec![i as f32; 4] } else { Vec::new() };
                assert_eq!(uvs, expected, "{with:?} {kinds:?}, object {i}");
            }
        }
    }
}

/// Numbers beyond the end that do not repeat those of vertices, or of objects with fewer normals than vertices, are missing.
#[test]
fn other_numbers_beyond_the_end_are_missing() {
    let numbered = squares_numbered_by_vertices([false, true, true], &["vn"]);
    for obj in [numbered.replace("f 5//5", "f 5//6"), numbered.replacen("vn 2 0 1\n", "", 1)] {
        let (_, warnings) = read(&obj, &[]).unwrap();
        assert!(warnings[0].contains("ignored missing texture coordinates or normals"), "{warnings:?}");
    }
}

/// IfcOpenShell and OpenCTM write `s 1` for everything: their edges are sharp above 30 degrees. Files of other programs, and
/// with normals, keep theirs.
#[test]
fn smoothing_groups_of_programs_that_smooth_everything_are_replaced_by_a_crease_angle() {
    // Two walls at a right angle, and a third that turns by 10 degrees, as of a round tower.
    let walls = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\nv 2 0 .1763\nv 2 1 .1763\ns 1\n\
                 f 1 2 3 4\nf 5 1 4 6\nf 2 7 8 3\n";
    let normal_at_corners = |head: &str, mode: NormalMode| -> Vec<Vec3> {
        let obj = format!("# {head}\n{walls}");
        let options = LoadOptions { normals: mode, ..LoadOptions::default() };
        let scene = load_with(&obj, &options);
        let mesh = &scene.meshes[0];
        mesh.triangles.as_flattened().iter().map(|&v| mesh.normals[v as usize]).collect()
    };
    let is_flat_at_corner = |normals: &[Vec3]| (normals[0] - Vec3::Z).length() < 1e-5;
    for head in ["File generated by IfcOpenShell 0.9.0post1+b5e509b", "Created by OpenCTM 1.0.3"] {
        let normals = normal_at_corners(head, NormalMode::Auto);
        assert!(is_flat_at_corner(&normals), "{head}: {normals:?}");
        // Across the edge of 10 degrees it stays smooth.
        assert!(normals[1].x < -0.05 && normals[1].z > 0.9, "{head}: {normals:?}");
        assert!(!is_flat_at_corner(&normal_at_corners(head, NormalMode::File)), "{head}");
    }
    assert!(!is_flat_at_corner(&normal_at_corners("Created by hand", NormalMode::Auto)));
    let with_normals =
        "# File generated by IfcOpenShell 0.9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 1\ns 1\nf 1//1 2//1 3//1\n";
    assert!((scene(with_normals).meshes[0].normals[0].x - 0.5f32.sqrt()).abs() < 1e-5);
}
