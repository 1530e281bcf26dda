//! What the public scenes of `blinn bench --scenes` require of a loader: a small file of our own for each quirk of
//! the manifest.

use std::fs;
use std::path::Path;

use blinn::import::{LoadOptions, load};
use blinn::scene::{PoseSettings, Scene, pose};
use blinn_bench::manifest::{Manifest, find_scene_file};
use serde_json::json;

use crate::common::gltf_fixture::Fixture;

/// A square of two triangles in z = 0 with texture coordinates, as one face of four corners.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

/// A file of one quirk, and a check of what is loaded from it.
struct Quirk {
    name: &'static str,
    write: fn(&Path),
    check: fn(&Scene),
}

const QUIRKS: [Quirk; 8] = [
    Quirk {
        name: "mtl-backslashes",
        write: |folder| {
            write_obj(folder, "map_Kd textures\\sub\\wood.png\n", &format!("{SQUARE}usemtl m\n{FACE}"))
        },
        check: |scene| assert_eq!(scene.images.len(), 1),
    },
    Quirk {
        name: "map-d",
        write: |folder| {
            write_obj(folder, "map_d textures/sub/wood.png\n", &format!("{SQUARE}usemtl m\n{FACE}"))
        },
        check: |scene| assert!(scene.materials.iter().any(|material| material.alpha.texture.is_some())),
    },
    Quirk {
        name: "map-bump",
        write: |folder| {
            write_obj(
                folder,
                "map_bump -bm 0.5 textures/sub/wood.png\n",
                &format!("{SQUARE}usemtl m\n{FACE}"),
            );
        },
        check: |scene| assert!(scene.materials.iter().any(|material| material.normal.is_some())),
    },
    Quirk {
        name: "quads",
        write: |folder| {
            let pentagon = "v 0 0 1\nv 1 0 1\nv 1.5 1 1\nv 0.5 2 1\nv -0.5 1 1\nf 5 6 7 8 9\n";
            write_obj(folder, "", &format!("{SQUARE}{FACE}{pentagon}"));
        },
        check: |scene| assert_eq!(scene.instanced_triangle_count(), 2 + 3),
    },
    Quirk {
        name: "centimetres",
        write: |folder| {
            write_obj(
                folder,
                "",
                "v -1920.95 -126.44 0\nv 1799.91 -126.44 0\nv 1799.91 1429.43 0\nf 1 2 3\n",
            );
        },
        check: |scene| {
            let posed = pose(scene, &PoseSettings::default()).unwrap();
            let extent = posed.bounds().extent();
            assert!((extent.x - 3720.86).abs() < 1e-3 && (extent.y - 1555.87).abs() < 1e-3, "{extent}");
        },
    },
    Quirk {
        name: "no-materials",
        write: |folder| fs::write(folder.join("scene.obj"), format!("{SQUARE}{FACE}")).unwrap(),
        check: |scene| assert_eq!((scene.instanced_triangle_count(), scene.images.len()), (2, 0)),
    },
    Quirk {
        name: "separate-files",
        write: |folder| write_gltf(folder, 1),
        check: |scene| assert_eq!((scene.instanced_triangle_count(), scene.images.len()), (1, 1)),
    },
    Quirk {
        name: "shared-meshes",
        write: |folder| write_gltf(folder, 3),
        check: |scene| assert_eq!((scene.instanced_triangle_count(), scene.meshes.len()), (3, 1)),
    },
];

/// Writes `scene.obj` with a material `m` of these lines, and a texture.
fn write_obj(folder: &Path, material: &str, obj: &str) {
    fs::create_dir_all(folder.join("textures/sub")).unwrap();
    let texture = image::RgbaImage::from_pixel(2, 2, image::Rgba([200, 100, 50, 255]));
    texture.save(folder.join("textures/sub/wood.png")).unwrap();
    fs::write(folder.join("scene.mtl"), format!("newmtl m\nKd 0.8 0.8 0.8\n{material}")).unwrap();
    fs::write(folder.join("scene.obj"), format!("mtllib scene.mtl\n{obj}")).unwrap();
}

/// Writes `scene.gltf` with its buffer and a texture in files beside it: a triangle that `nodes` nodes share.
fn write_gltf(folder: &Path, nodes: usize) {
    let mut file = Fixture::empty();
    let positions = file.vec3(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let uvs = file.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}}]}));
    file.push("images", json!({"uri": "wood.png"}));
    file.push("textures", json!({"source": 0}));
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    for i in 0..nodes {
        file.node(json!({"mesh": 0, "translation": [2.0 * i as f64, 0.0, 0.0]}));
    }
    let (saved, path) = file.save();
    fs::copy(path, folder.join("scene.gltf")).unwrap();
    fs::copy(saved.path().join("scene.bin"), folder.join("scene.bin")).unwrap();
    image::RgbaImage::from_pixel(2, 2, image::Rgba([1, 2, 3, 255])).save(folder.join("wood.png")).unwrap();
}

#[test]
fn every_quirk_of_the_manifest_has_a_fixture_that_loads() {
    let manifest = Manifest::built_in().unwrap();
    let mut names: Vec<&str> = QUIRKS.iter().map(|quirk| quirk.name).collect();
    let mut listed: Vec<&str> = manifest.quirks.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    listed.sort_unstable();
    assert_eq!(names, listed);
    for quirk in &QUIRKS {
        let folder = tempfile::tempdir().unwrap();
        (quirk.write)(folder.path());
        let file = ["scene.obj", "scene.gltf"].map(|name| folder.path().join(name));
        let file = file.iter().find(|file| file.is_file()).unwrap();
        let (scene, warnings) = load(file, &LoadOptions::default()).unwrap();
        assert!(warnings.is_empty(), "{}: {warnings:?}", quirk.name);
        (quirk.check)(&scene);
    }
}

/// The layouts of the sources' archives are found, and no scene takes the file of another.
#[test]
fn scenes_are_found_where_their_archives_put_them() {
    let folder = tempfile::tempdir().unwrap();
    let files = [
        ("Sponza (Crytek)", "sponza/sponza.obj"),
        ("San Miguel", "San_Miguel/san-miguel.obj"),
        ("Bistro, exterior", "bistro/Exterior/exterior.obj"),
        ("Bistro, interior", "bistro/Interior/interior.obj"),
        ("Hairball", "hairball/hairball.obj"),
        ("Sibenik", "sibenik/sibenik.obj"),
        ("Breakfast Room", "breakfast_room/breakfast_room.obj"),
        ("Stanford bunny", "bunny/bunny.obj"),
        ("Stanford bunny (69k)", "data/stanford-bunny.obj"),
        ("Stanford dragon", "dragon/dragon.obj"),
        ("Happy Buddha", "buddha/buddha.obj"),
        ("Sponza (glTF)", "Models/Sponza/glTF/Sponza.gltf"),
        ("Flight Helmet", "Models/FlightHelmet/glTF/FlightHelmet.gltf"),
        ("Lantern", "Models/Lantern/glTF-Binary/Lantern.glb"),
        ("A Beautiful Game", "Models/ABeautifulGame/glTF/ABeautifulGame.gltf"),
    ];
    for (_, file) in files {
        let file = folder.path().join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "").unwrap();
    }
    let manifest = Manifest::built_in().unwrap();
    assert_eq!(manifest.scenes.len(), files.len());
    for scene in &manifest.scenes {
        let found = find_scene_file(folder.path(), scene);
        let (_, expected) = files.iter().find(|(name, _)| *name == scene.name).unwrap();
        assert_eq!(found, Some(folder.path().join(expected)), "{}", scene.name);
    }
}
