//! STL files as text and binary, with colours and with defects.

use std::path::Path;

use glam::{DVec3, Vec4};

use crate::{Limits, LoadError, LoadOptions, Warning, load_bytes};
use blinn_scene::{Scene, SourceFormat};

fn load(bytes: &[u8]) -> Result<(Scene, Vec<Warning>), LoadError> {
    load_bytes(bytes, Path::new("a.stl"), &LoadOptions::default())
}

/// Two triangles of a square as text.
const SQUARE: &str = "solid lid of a box\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   \
    vertex 1 1 0\n  endloop\n endfacet\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 -0.0\n   vertex 1 1 0\n   \
    vertex 0 1 0\n  endloop\n endfacet\nendsolid lid of a box\n";

/// A binary file of triangles with these attributes.
fn binary(header: &[u8], attributes: &[u16]) -> Vec<u8> {
    let mut file = header.to_vec();
    file.resize(80, 0);
    file.extend((attributes.len() as u32).to_le_bytes());
    for (i, attribute) in attributes.iter().enumerate() {
        let corners = [[0.0, 0.0, i as f32], [1.0, 0.0, i as f32], [0.0, 1.0, i as f32]];
        for number in [[0.0f32; 3]].iter().chain(&corners).flatten() {
            file.extend(number.to_le_bytes());
        }
        file.extend(attribute.to_le_bytes());
    }
    file
}

#[test]
fn text_has_a_part_for_each_solid() {
    let (scene, warnings) = load(SQUARE.as_bytes()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(
        (scene.objects.as_slice(), scene.source.format),
        (&["lid of a box".to_string()][..], SourceFormat::Stl)
    );
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.as_slice()), (4, &[[0, 1, 2], [0, 2, 3]][..]));
    assert_eq!(scene.nodes[0].local.affine().transform_point3(DVec3::Z), DVec3::Y);
    let two = format!("{SQUARE}{}", SQUARE.replace("lid of a box", "").to_uppercase());
    let (scene, _) = load(two.replace('\n', "\r\n").as_bytes()).unwrap();
    assert_eq!(scene.objects, ["lid of a box", "default"]);
    assert_eq!((scene.meshes.len(), scene.instances[1].object), (2, 2));
}

#[test]
fn binary_files_may_begin_with_solid() {
    let (scene, warnings) = load(&binary(b"solid facet by some program", &[0, 0, 0])).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].colors.len()), (3, 0));
    assert_eq!(scene.source.generator, "solid facet by some program");
    // Without a name, the size is the mark.
    let (scene, _) = load_bytes(&binary(b"", &[0]), Path::new("bytes"), &LoadOptions::default()).unwrap();
    assert_eq!(scene.source.format, SourceFormat::Stl);
}

#[test]
fn facets_have_colours_of_viscam_or_of_magics() {
    let red = |first: u16, shift: u32| first | 31 << shift;
    let (scene, _) = load(&binary(b"", &[red(1 << 15, 10), 31 << 10])).unwrap();
    let color = |scene: &Scene, triangle: usize| {
        scene.meshes[0].colors[scene.meshes[0].triangles[triangle][0] as usize]
    };
    assert_eq!([color(&scene, 0), color(&scene, 1)], [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::ONE]);
    let (scene, _) = load(&binary(b"COLOR=\0\0\xff\xff", &[red(0, 0), 1 << 15])).unwrap();
    assert_eq!(
        [color(&scene, 0), color(&scene, 1)],
        [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)]
    );
}

#[test]
fn files_that_end_early_have_their_first_triangles() {
    let file = binary(b"", &[0, 0]);
    let (scene, warnings) = load(&file[..file.len() - 9]).unwrap();
    assert_eq!(
        (scene.meshes[0].triangles.len(), warnings[0].message.as_str()),
        (1, "the file ends after 1 of 2 triangles")
    );
    let mut piped = file.clone();
    piped[80] = 0;
    assert_eq!(load(&piped).unwrap().0.meshes[0].triangles.len(), 2);
    let (scene, warnings) = load(&SQUARE.as_bytes()[..SQUARE.len() - 60]).unwrap();
    assert_eq!((scene.meshes[0].triangles.len(), warnings.len()), (1, 1));
}

#[test]
fn defects_are_errors() {
    for (file, message) in [
        (&b"solid a\nendsolid a\n"[..], "the file has no faces to render"),
        (b"hello", "neither text that begins with 'solid' and has facets, nor a binary file"),
        (
            b"solid\nfacet\nvertex 1 2\nendfacet",
            "STL, line 3: expected a vertex with three numbers, not 'vertex 1 2'",
        ),
        (&[0; 84], "the file has no faces to render"),
    ] {
        let error = load(file).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    let limits = Limits { triangles: 1, ..Limits::default() };
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let error = load_bytes(&binary(b"", &[0, 0]), Path::new("a.stl"), &options).unwrap_err();
    assert!(matches!(error, LoadError::Limit { .. }), "{error}");
}

#[test]
fn text_may_have_decimal_commas() {
    let commas =
        SQUARE.replace("vertex 1 1 0", "vertex 1,5 1,25e+00 0").replace("vertex 1 0 0", "vertex ,5 0 0");
    let (scene, warnings) = load(commas.as_bytes()).unwrap();
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["STL, line 5: numbers have decimal commas: read as decimal points"]);
    assert!(scene.meshes[0].positions.len() == 4);
    let points = commas.replace(',', ".");
    assert_eq!(load(points.as_bytes()).unwrap().0.meshes[0].positions, scene.meshes[0].positions);
    for vertex in ["1,2,3", "1, 2, 3", "1.234,5 0 0", "1,2,3 0 0"] {
        let error = load(SQUARE.replace("vertex 1 1 0", &format!("vertex {vertex}")).as_bytes()).unwrap_err();
        assert!(error.to_string().contains("expected a vertex with three numbers"), "{vertex}: {error}");
    }
}

#[test]
fn text_may_be_utf16() {
    let (expected, _) = load(SQUARE.as_bytes()).unwrap();
    let little = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let big = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<u8>>();
    let marked = format!("\u{feff}{SQUARE}");
    for bytes in [little(&marked), big(&marked), little(SQUARE), big(&SQUARE.replace("solid", "SOLID"))] {
        for name in ["a.stl", "bytes"] {
            let (scene, warnings) = load_bytes(&bytes, Path::new(name), &LoadOptions::default()).unwrap();
            assert!(warnings.is_empty(), "{warnings:?}");
            assert_eq!(scene.meshes[0].positions, expected.meshes[0].positions);
            assert_eq!(scene.objects, expected.objects);
        }
    }
    let error = load(&little("\u{feff}no triangles")).unwrap_err();
    assert!(error.to_string().contains("neither text that begins with 'solid'"), "{error}");
}

/// Text is charged by the facets that it has, and vertices before they are added.
#[test]
fn memory_is_charged_by_what_a_file_has() {
    let facet = |i: usize| {
        format!(
            "facet normal 0.000000e+00 0.000000e+00 1.000000e+00\n outer loop\n  vertex {i} 0 0\n  \
             vertex {i} 1.000000e+00 0\n  vertex {i}.500000 0.000000e+00 0\n endloop\nendfacet\n"
        )
    };
    let text = format!("solid\n{}endsolid\n", (0..4000).map(facet).collect::<String>());
    let with = |more: usize, taken_bytes: u64| {
        let limits = Limits { memory_bytes: (text.len() + more) as u64, taken_bytes, ..Limits::default() };
        load_bytes(text.as_bytes(), Path::new("a.stl"), &LoadOptions { limits, ..LoadOptions::default() })
    };
    assert_eq!(with(1_000_000, 0).unwrap().0.meshes[0].triangles.len(), 4000);
    assert!(matches!(with(100_000, 0), Err(LoadError::Limit { .. })));
    assert!(matches!(with(1_000_000, 900_000), Err(LoadError::Limit { .. })));
}
