//! Tests of whole OBJ scenes.

mod decimal_commas;
mod differential;
mod material_regressions;
mod materials;
mod regressions;
mod truncated;

use std::fs;
use std::path::Path;

use super::super::{LoadError, LoadOptions, load};
use blinn_core::geometry::Rgb;
use blinn_scene::{LocalTransform, Material, Mesh, Scene, UpAxis};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

/// Loads `obj` with other files in the same folder.
fn read(obj: impl AsRef<[u8]>, beside: &[(&str, &[u8])]) -> Result<(Scene, Vec<String>), LoadError> {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in beside {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let path = dir.path().join("scene.obj");
    fs::write(&path, obj).unwrap();
    let (scene, warnings) = load(&path, &LoadOptions::default())?;
    Ok((scene, warnings.iter().map(ToString::to_string).collect()))
}

fn load_with(obj: &str, options: &LoadOptions) -> Scene {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.obj");
    fs::write(&path, obj).unwrap();
    load(&path, options).unwrap().0
}

fn scene(obj: &str) -> Scene {
    let (scene, warnings) = read(obj, &[]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    scene
}

fn error(obj: &str) -> String {
    read(obj, &[]).unwrap_err().to_string()
}

/// Loads the material of an MTL and returns it with the warnings.
fn with_mtl(mtl: &str) -> (Material, Vec<String>) {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let png = png([255, 128, 0, 255]);
    let (scene, warnings) = read(obj, &[("a.mtl", mtl.as_bytes()), ("tex/t 1.png", &png)]).unwrap();
    (scene.materials[0].clone(), warnings)
}

fn png(texel: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba(texel));
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n";

#[test]
fn statements_without_effect_cause_no_warning() {
    // `vp` selects the lenient parser.
    for other in ["", "vp 1 2\n"] {
        let ignored = "usemap wood\nlod 2\nbevel on\nc_interp off\nshadow_obj a.obj\nmg 1 .5\n";
        let scene = scene(&format!("{SQUARE}{other}{ignored}f 1 2 3\n\u{1a}"));
        assert_eq!(scene.meshes[0].triangles.len(), 1);
    }
}

#[test]
fn all_vertex_formats_are_read() {
    for (faces, uvs, normals) in [
        ("f 1 2 3 4", false, false),
        ("f 1/1 2/2 3/3 4/4", true, false),
        ("f 1//1 2//1 3//1 4//1", false, true),
        ("f 1/1/1 2/2/1 3/3/1 4/4/1", true, true),
        ("f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1", true, true),
    ] {
        let scene = scene(&format!("{SQUARE}{faces}"));
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2), "{faces}");
        assert_eq!((mesh.uvs.len() == 1, !mesh.normals.is_empty()), (uvs, normals));
        if uvs {
            assert_eq!(mesh.uvs[0], [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO]);
        }
    }
}

#[test]
fn negative_indices_are_relative_to_the_elements_so_far() {
    let scene = scene("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n");
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions[3], Vec3::new(5.0, 0.0, 0.0));
    assert_eq!(mesh.triangles.len(), 2);
}

#[test]
fn faces_with_different_vertex_formats_keep_their_attributes() {
    let scene = scene(&format!("{SQUARE}f 1/1 2/2 3/3\nf 1 3 4\nf 1//1 2//1 4//1\nf 2/2 3/3 4/4\n"));
    let uv_of = |m: &Mesh| m.uvs.first().map(Vec::len);
    assert_eq!(scene.meshes.len(), 3);
    assert_eq!(scene.meshes.iter().map(uv_of).collect::<Vec<_>>(), [Some(4), None, None]);
    for mesh in &scene.meshes {
        let by_position = mesh.positions.iter().zip(mesh.uvs.iter().flatten());
        assert!(by_position.into_iter().all(|(p, uv)| (p.x, 1.0 - p.y) == (uv.x, uv.y)));
    }
}

#[test]
fn o_starts_objects_or_else_g_does() {
    let by_o = scene(&format!("{SQUARE}o a\ng x\nf 1 2 3\ng y\nf 1 3 4\no a\nf 1 2 4\n"));
    assert_eq!((by_o.objects.len(), by_o.meshes.len()), (2, 2));
    assert_eq!(by_o.instances.iter().map(|i| i.object).collect::<Vec<_>>(), [1, 2]);
    let by_g = scene(&format!("{SQUARE}g x\nf 1 2 3\ng y z\nf 1 3 4\ng x\nf 1 2 4\n"));
    assert_eq!(by_g.objects, ["x", "y z"]);
    assert_eq!(scene(&format!("{SQUARE}f 1 2 3\n")).objects, ["default"]);
}

#[test]
fn smoothing_groups_average_normals_within_the_group() {
    // A roof: two faces that meet at an edge.
    let roof = "v 0 0 1\nv 0 0 -1\nv -1 -1 1\nv -1 -1 -1\nv 1 -1 1\nv 1 -1 -1\n";
    let faces = "f 1 2 4 3\nf 2 1 5 6\n";
    let smooth = scene(&format!("{roof}s 1\n{faces}"));
    let at_edge = |m: &Mesh| m.positions.iter().position(|p| p.x == 0.0).map(|i| m.normals[i]).unwrap();
    assert!(at_edge(&smooth.meshes[0]).abs_diff_eq(Vec3::Y, 1e-6));
    for flat in ["s off\n", "s 0\n", "s\n", ""] {
        assert!(scene(&format!("{roof}{flat}{faces}")).meshes[0].normals.is_empty());
    }
    let apart = scene(&format!("{roof}s 1\nf 1 2 4 3\ns 2\nf 2 1 5 6\n"));
    // Two vertices at each end of the edge, in one mesh.
    assert_eq!((apart.meshes.len(), apart.meshes[0].positions.len()), (1, 8));
    assert!(at_edge(&apart.meshes[0]).abs_diff_eq(Vec3::new(-1.0, 1.0, 0.0).normalize(), 1e-6));
    // A material change does not split a smoothing group.
    let (two, _) = read(format!("{roof}s 1\nusemtl a\nf 1 2 4 3\nusemtl b\nf 2 1 5 6\n"), &[]).unwrap();
    assert!(two.meshes.iter().all(|m| at_edge(m).abs_diff_eq(Vec3::Y, 1e-6)));
}

#[test]
fn vertex_colours_may_be_on_all_or_some_vertices() {
    let (all, _) = read("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3", &[]).unwrap();
    assert_eq!(all.meshes[0].colors[1], Vec4::new(0.0, 1.0, 0.0, 1.0));
    let (some, _) = read("v 0 0 0\nv 1 0 0 0 1 0 .5\nv 0 1 0 1.0\nf 1 2 3", &[]).unwrap();
    assert_eq!(some.meshes[0].colors, [Vec4::ONE, Vec4::new(0.0, 1.0, 0.0, 0.5), Vec4::ONE]);
}

/// Millions of metres from the origin, f32 has steps of half a metre.
#[test]
fn geometry_far_from_the_origin_keeps_its_precision() {
    let faces = "f 1 2 3\nf 1 3 4\n";
    // The continued line selects the lenient parser.
    for more in ["", "f 1 2 \\\n3\n"] {
        let text = format!(
            "v 500000.125 5300000.001 7\nv 500001.25 5300000 7.5\nv 500001 5300000.75 8\n\
             v 500000.000 5300001.000 7.125\n{faces}{more}"
        );
        let (scene, warnings) = read(&text, &[]).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        let LocalTransform::Matrix(to_world) = scene.nodes[0].local else { panic!("a matrix") };
        let first = to_world.transform_point3(scene.meshes[0].positions[0].as_dvec3());
        assert!(first.abs_diff_eq(DVec3::new(500000.125, 5300000.001, 7.0), 1e-7), "{first}");
        let options = LoadOptions { up: Some(UpAxis::Z), ..LoadOptions::default() };
        let turned = load_with(&text, &options).nodes[0].local.affine();
        let first = turned.transform_point3(scene.meshes[0].positions[0].as_dvec3());
        assert!(first.abs_diff_eq(DVec3::new(500000.125, 7.0, -5300000.001), 1e-7), "{first}");
    }
    // A scale multiplies what is turned.
    let options = LoadOptions { up: Some(UpAxis::Z), scale: Some(0.001), ..LoadOptions::default() };
    let scaled = load_with("v 1000 0 3000\nv 2000 0 3000\nv 1000 2000 3000\nf 1 2 3\n", &options);
    let to_world = scaled.nodes[0].local.affine();
    let points = scaled.meshes[0].positions.iter().map(|p| to_world.transform_point3(p.as_dvec3()));
    assert!(points.clone().any(|p| p.abs_diff_eq(DVec3::new(1.0, 3.0, -2.0), 1e-9)), "{points:?}");
    // With a face near the origin nothing is recentred.
    let near = "v 0.1 0 0\nv 1e6 0 0\nv 1e6 1e6 0\nf 2 3 1\nf 1 2 3\n";
    let scene = scene(near);
    assert_eq!(scene.nodes[0].local.affine(), DAffine3::IDENTITY);
    assert!(scene.meshes[0].positions.contains(&Vec3::new(0.1, 0.0, 0.0)));
}

#[test]
fn smooth_normals_do_not_depend_on_the_triangulation() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 .5\nv 0 1 0\ns 1\n";
    // Twice the vector area: (v3 − v1) × (v4 − v2).
    let n = Vec3::new(1.0, 1.0, 0.5).cross(Vec3::new(-1.0, 1.0, 0.0)).normalize();
    for face in ["f 1 2 3 4", "f 2 3 4 1"] {
        let (scene, _) = read(format!("{corners}{face}\n"), &[]).unwrap();
        let normals = &scene.meshes[0].normals;
        assert!(normals.len() == 4 && normals.iter().all(|m| m.distance(n) < 1e-6), "{face}: {normals:?}");
    }
}

/// Both parsers read points and lines by material, with absolute, relative and textured vertices.
#[test]
fn points_and_lines_are_read_without_faces() {
    let text =
        "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\no a\nl 1/1 2/1 3/1\nusemtl red\nl -2 -1\np 1 3\nl 2\n";
    for text in [text.to_string(), text.replace("\nl 2\n", "\nl \\\n2\n")] {
        let (scene, warnings) = read(text, &[]).unwrap();
        assert_eq!(warnings, ["the file names 1 material and no MTL: used matte white instead"]);
        let [plain, red, dots] = &scene.meshes[..] else { panic!("{} meshes", scene.meshes.len()) };
        assert_eq!((plain.lines(), red.lines()), (&[[0, 1], [1, 2]][..], &[[0, 1], [0, 0]][..]));
        assert_eq!((dots.point_count(), dots.colors.len(), red.colors[1].z), (2, 2, 1.0));
        assert_eq!(scene.materials[red.material as usize].reflectance, blinn_scene::Reflectance::Unshaded);
        assert_eq!((red.material, plain.name.as_str()), (dots.material, "a"));
    }
    for wrong in ["l 1 4\n", "p 0\n", "l one\n", "p -4\n"] {
        assert!(read(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{wrong}"), &[]).is_err(), "{wrong}");
    }
}

/// VTK's exporter writes no blanks between the vertices of lines with texture coordinates.
#[test]
fn lines_of_vtk_are_read() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nl 1/12/23/3\n";
    for text in [text.to_string(), text.replace("l 1", "l \\\n1")] {
        let (scene, warnings) = read(text, &[]).unwrap();
        assert_eq!((scene.meshes[0].lines(), warnings.len()), (&[[0, 1], [1, 2]][..], 0));
    }
    let error = error("v 0 0 0\nv 1 0 0\nl 2/23/3\n");
    assert!(error.contains("vertex 3 does not exist"), "{error}");
}

/// trimesh, MeshLab and scanners write clouds as vertices alone, with colours or normals.
#[test]
fn vertices_alone_are_points() {
    for other in ["", "vp 1 2\n"] {
        let (scene, warnings) =
            read(format!("# a scan\n{other}v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n"), &[]).unwrap();
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.point_count(), mesh.colors[1].y, warnings.len()), (3, 1.0, 0));
        assert_eq!(scene.objects, ["default"]);
        assert_eq!(scene.materials[mesh.material as usize].reflectance, blinn_scene::Reflectance::Unshaded);
        let text = format!("{other}o scan\nvn 0 0 2\nv 5000000 0 0\nvn 0 3 0\nv 5000000.25 0 0\n");
        let (scene, _) = read(text, &[]).unwrap();
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.normals.as_slice(), mesh.name.as_str()), (&[Vec3::Z, Vec3::Y][..], "scan"));
        assert_eq!((mesh.positions[1] - mesh.positions[0]).x, 0.25);
        assert_ne!(scene.materials[mesh.material as usize].reflectance, blinn_scene::Reflectance::Unshaded);
    }
    // Control points of curves, and vertices of faces that are missing.
    for other in ["curv 0 1 1 2\n", "f 1 2\n", "l\n", "frobnicate 1\n"] {
        let error = error(&format!("v 0 0 0\nv 1 0 0\n{other}"));
        assert!(error.contains("no faces, lines or points"), "{error}");
    }
}

/// A triangle that uses a vertex twice is left out without a warning.
#[test]
fn degenerate_faces_are_counted_and_lines_and_points_read() {
    let (scene, warnings) = read(format!("{SQUARE}l 1 2 3\np 1\nf 1 2\nf 1 1 2\nf 1 2 3\n"), &[]).unwrap();
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert_eq!(scene.meshes[1].lines(), [[0, 1], [1, 2]]);
    assert_eq!((scene.meshes[1].positions.len(), scene.meshes[2].point_count()), (3, 1));
    let mut expected = vec!["ignored 1 faces with fewer than three vertices"];
    assert_eq!(warnings, expected);
    // Curves, as Blender writes them, and surfaces.
    let curve =
        "cstype bspline\ndeg 2\ncurv 1.0 5.0 -1 -2 -3\nparm u 0.0 1.0\nend\nsurf 0 1 0 1 1/1 2/2\nend\n";
    let (_, warnings) = read(format!("{SQUARE}{curve}l 1 2 3\np 1\nf 1 2\nf 1 2 3\n"), &[]).unwrap();
    expected.insert(0, "ignored 2 curves and surfaces: not supported");
    assert_eq!(warnings, expected);
}

/// assimp's test file of number formats has such numbers.
#[test]
fn malformed_exponents_are_ignored() {
    let text = "v 0 0 0\nv 1 0 3.1+e2\nv 0 -2-e1 0\nf 1 2 3\n";
    let (scene, warnings) = read(text, &[]).unwrap();
    let p = &scene.meshes[0].positions;
    assert_eq!((p[1], p[2]), (Vec3::new(1.0, 0.0, 3.1), Vec3::new(0.0, -2.0, 0.0)));
    assert!(
        warnings.len() == 1 && warnings[0].starts_with("line 2, column 7, at '3.1+e2': "),
        "{warnings:?}"
    );
    assert!(error("v 0 0 1,5x\n").contains("'1.5x' is not a number"));
}

#[test]
fn errors_name_line_column_and_word() {
    for (obj, expected) in [
        ("v 0 0\n", "line 1, column 1, at 'v': v needs 3 numbers"),
        ("v 0 0 zero\n", "'zero' is not a number"),
        ("# c\n\nv 0 0 0\nf 1 2 3\n", "line 4, column 5, at '2': vertex 2 does not exist"),
        ("v 0 0 0\nf 1 1 0\n", "vertex 0 does not exist"),
        ("v 0 0 0\nf -2 1 1\n", "vertex -2 does not exist"),
        ("v 0 0 0\nf x 1 1\n", "'x' is not a vertex index"),
        ("v 0 0 0\nf /1 1 1\n", "has no vertex index"),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "is not a vertex index"),
        ("# empty\n", "use a .gltf, .glb, .obj, .stl or .ply file"),
        ("w 0 0 0\nh 1 1 1\n", "use a .gltf, .glb, .obj, .stl or .ply file"),
        ("v 0 0 0\nl 1 3\n", "line 2, column 5, at '3': vertex 3 does not exist: the file has 1 vertices"),
        ("v 0 0 0\np 1 one\n", "line 2, column 5, at 'one': 'one' is not a vertex index"),
        ("v 0 0 0\nl /1 1\n", "'' is not a vertex index"),
        ("v 0 0 0\nl\np\n", "no faces, lines or points to render"),
    ] {
        let error = error(obj);
        assert!(error.contains(expected), "{obj:?}: {error}");
    }
}

#[test]
fn z_up_rotates_the_scene() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, "v 1 2 3\nv 2 2 3\nv 1 3 3\nf 1 2 3\n").unwrap();
    let (scene, _) = load(&path, &LoadOptions { up: Some(UpAxis::Z), ..Default::default() }).unwrap();
    let p = scene.nodes[0].local.affine().transform_point3(scene.meshes[0].positions[0].as_dvec3());
    assert_eq!(p, glam::DVec3::new(1.0, 3.0, -2.0));
}

/// The text of an archive stays in memory while it is parsed; a file is read in pieces.
#[test]
fn text_in_memory_is_charged_beside_the_lists() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\n".repeat(1000) + "f 1 2 3\n";
    let file = dir.path().join("a.obj");
    fs::write(&file, &text).unwrap();
    let least = |loads: &dyn Fn(&LoadOptions) -> bool| {
        let fits = |memory_bytes: u64| {
            let mut options = LoadOptions::default();
            options.limits.memory_bytes = memory_bytes;
            loads(&options)
        };
        (0..2000).map(|i| 1000 * i).find(|bytes| fits(*bytes)).unwrap()
    };
    let of_file = least(&|options| load(&file, options).is_ok());
    let of_memory = least(&|options| crate::load_bytes(text.as_bytes(), &file, options).is_ok());
    assert!(of_memory.abs_diff(of_file + text.len() as u64) <= 1000, "{of_memory} {of_file}");
}

#[test]
fn limits_are_checked_before_allocation() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    let with = |vertices, triangles| {
        let mut options = LoadOptions::default();
        (options.limits.vertices, options.limits.triangles) = (vertices, triangles);
        load(&path, &options)
    };
    assert!(with(4, 2).is_ok());
    assert!(matches!(with(3, 2), Err(LoadError::Limit { name: "vertices", .. })));
    assert!(matches!(with(4, 1), Err(LoadError::Limit { name: "triangles", .. })));
}

#[test]
fn mutated_files_do_not_panic() {
    let obj = format!(
        "# c\n{SQUARE}o a\nmtllib a.mtl\nusemtl m\ns 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf -1 -2 -3\\\n -4\n"
    );
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.obj");
    let mut tried = 0;
    let mut try_load = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let _ = load(&path, &LoadOptions::default());
        tried += 1;
    };
    for end in 0..obj.len() {
        try_load(&obj.as_bytes()[..end]);
    }
    for at in 0..obj.len() {
        for byte in [0, b' ', b'\n', b'/', b'-', b'9', b'#', b'\\', 0x80, 0xff] {
            let mut mutant = obj.clone().into_bytes();
            mutant[at] = byte;
            try_load(&mutant);
        }
    }
    assert_eq!(tried, 11 * obj.len());
}

#[test]
fn the_models_of_the_repository_load_without_warnings() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    for (name, triangles, objects) in
        [("tests/cube.obj", 12, 1), ("cornell/cornell.obj", 4206, 0), ("lecture/lecture.obj", 3438, 0)]
    {
        let (scene, warnings) = load(&models.join(name), &LoadOptions::default()).unwrap();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        assert_eq!(scene.instanced_triangle_count(), triangles, "{name}");
        assert!(scene.objects.len() >= objects);
    }
}

#[test]
fn faces_may_precede_their_vertices() {
    let scene = scene("f 1//1 2//1 3//1\nvn 0 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].normals.len()), (1, 3));
}

#[test]
fn indices_of_missing_attributes_are_ignored() {
    let (scene, warnings) = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3/-3\n", &[]).unwrap();
    assert!(scene.meshes[0].uvs.is_empty() && scene.meshes[0].normals.is_empty());
    assert!(warnings.len() == 1 && warnings[0].contains("line 4"), "{warnings:?}");
}

#[test]
fn keywords_may_be_in_capitals() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let shout = |line: &str| match line.split_once(' ') {
        Some((keyword, rest)) => format!("{} {rest}\n", keyword.to_uppercase()),
        None => format!("{line}\n"),
    };
    let (scene, warnings) =
        read(obj.lines().map(shout).collect::<String>(), &[("a.mtl", b"newmtl m\nKd 0 1 0\n")]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((scene.instanced_triangle_count(), scene.materials[0].base_color.factor), (1, Rgb::Y));
}
