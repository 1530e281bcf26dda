//! Datasets of many scenes: views, categories and models of each.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::program::*;
use crate::shards::members;

const SMALL: &str = "--size 48x36 -s 1 -q";

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// A file with a triangle for each name.
fn write_triangles(folder: &Path, names: &[&str]) {
    for (i, name) in names.iter().enumerate() {
        let file = folder.join(name).with_extension("obj");
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, format!("v 0 0 0\nv {} 0 0\nv 0 1 0\nf 1 2 3\n", i + 1)).unwrap();
    }
}

/// Each scene of a batch has random views of its own, which do not depend on the other scenes.
#[test]
fn scenes_have_random_views_of_their_own() {
    let (_dir, at) = folder();
    for name in ["a/one", "a/two", "b/one"] {
        fs::create_dir_all(at.join("in").join(name).parent().unwrap()).unwrap();
        fs::copy(model("tests/cube.obj"), at.join(format!("in/{name}.obj"))).unwrap();
    }
    let flags = "--views 3 --on random --distance-range 1x,2x --random-lights --seed 5 --dataset nerf,coco";
    let line = format!("turntable in {SMALL} {flags} --random-per-scene");
    runs(&at, &format!("{line} -o whole/{{parent}}-{{stem}}/#.png"));
    let whole = files(&at.join("whole"));
    let scenes = ["a-one", "a-two", "b-one"];
    let all = scenes.map(|scene| json(&at.join("whole").join(scene), "transforms.json"));
    for (i, scene) in all.iter().enumerate() {
        for other in &all[..i] {
            assert_ne!(scene["view_sampling"]["seed"], other["view_sampling"]["seed"]);
            for k in 0..3 {
                for key in ["transform_matrix", "light_rotation"] {
                    assert_ne!(scene["frames"][k][key], other["frames"][k][key], "{key}");
                }
            }
        }
    }
    // Shares, another order and place, interruptions.
    for share in 1..=3 {
        runs(&at, &format!("{line} -o parts/{{parent}}-{{stem}}/#.png --chunk {share}/3"));
    }
    assert!(files(&at.join("parts")) == whole);
    fs::remove_file(at.join("parts/a-two/2.png")).unwrap();
    runs(&at, &format!("{line} -o parts/{{parent}}-{{stem}}/#.png --resume"));
    assert!(files(&at.join("parts")) == whole);
    let listed = ["b/one", "a/two", "a/one"]
        .map(|name| format!("{}\n", at.join("in").join(name).with_extension("obj").display()));
    fs::write(at.join("list"), listed.concat()).unwrap();
    let line_of_list = line.replacen("turntable in", "turntable @list", 1);
    runs(&at, &format!("{line_of_list} -o list-out/{{parent}}-{{stem}}/#.png"));
    assert!(files(&at.join("list-out")) == whole);
    // The seed in the file has the same cameras for the scene alone.
    let seed = &all[1]["view_sampling"]["seed"];
    let alone = format!("turntable in/a/two.obj {SMALL} {flags} -o alone/#.png")
        .replace("--seed 5", &format!("--seed {seed}"));
    runs(&at, &alone);
    assert_eq!(json(&at.join("alone"), "transforms.json")["frames"], all[1]["frames"]);
    // Without the option, all have the same views.
    runs(&at, &format!("{} -o same/{{parent}}-{{stem}}/#.png", line.replace(" --random-per-scene", "")));
    let same = scenes.map(|scene| json(&at.join("same").join(scene), "transforms.json")["frames"].clone());
    assert!(same[0] == same[1] && same[1] == same[2] && same[0] != all[0]["frames"]);
    for (flags, message) in [
        ("--views 3 --random-per-scene", "--random-per-scene: nothing is random"),
        ("--views 3 --random-per-scene --distance-range 2", "--random-per-scene: nothing is random"),
        ("--random-per-scene", "--random-per-scene applies only to datasets"),
    ] {
        refused(&at, &format!("turntable in/a/one.obj {flags}"), message);
    }
}

/// Archives of scenes with random views of their own are recognised by --resume and by the ledger.
#[test]
fn archives_of_scenes_with_views_of_their_own_are_resumed() {
    let (_dir, at) = folder();
    write_triangles(&at.join("objects"), &["a", "b", "c", "d", "e", "f"]);
    let line = format!(
        "turntable objects {SMALL} --views 2 --on random --shard-size 4 -o s/{{shard}}.tar --random-per-scene"
    );
    runs(&at, &format!("{line} --ledger l"));
    let first = files(&at.join("s"));
    let cameras: Vec<Value> = members(&at.join("s/0.tar"))
        .into_iter()
        .filter(|(name, _)| name.ends_with("-0001.json"))
        .map(|(_, bytes)| serde_json::from_slice::<Value>(&bytes).unwrap()["transform_matrix"].clone())
        .collect();
    assert!(cameras.len() == 2 && cameras[0] != cameras[1]);
    for flags in ["", "--ledger l"] {
        let output = blinn(&at, &format!("{line} --resume {flags}").replace(" -q", ""));
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && !text.contains("wrote"), "{flags}: {text}");
    }
    runs(&at, &format!("{line} --resume --seed 1"));
    assert!(files(&at.join("s")) != first);
    runs(&at, &format!("{line} --resume --seed 0"));
    assert!(files(&at.join("s")) == first);
}

/// The folders of scenes are categories, as in collections with a folder for each.
#[test]
fn categories_follow_the_names_of_scenes() {
    let (_dir, at) = folder();
    for (file, from) in
        [("chairs/a", "tests/cube.obj"), ("lamps/b", "tests/cube.obj"), ("chairs/c", "tests/cube.obj")]
    {
        let file = at.join("in").join(file).with_extension("obj");
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::copy(model(from), file).unwrap();
    }
    let line = format!("turntable in --views 1 {SMALL} --dataset coco");
    let merged = |flags: &str| {
        runs(&at, &format!("{line} {flags} --merge -o out/"));
        let data = json(&at.join("out"), "annotations.json");
        let names: Vec<String> = data["categories"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| row["name"].as_str().unwrap().into())
            .collect();
        // The category of each image; all its objects have the same.
        let mut of_image = vec![None; 3];
        for row in data["annotations"].as_array().unwrap() {
            let image = row["image_id"].as_u64().unwrap() as usize - 1;
            let category = row["category_id"].as_u64().unwrap() as usize - 1;
            assert!(of_image[image].is_none_or(|known| known == category));
            of_image[image] = Some(category);
        }
        of_image.into_iter().map(|category| category.map(|i: usize| names[i].clone())).collect::<Vec<_>>()
    };
    let some = |names: [&str; 3]| names.map(|name| (!name.is_empty()).then(|| name.to_string())).to_vec();
    // In the order of files: chairs/a, chairs/c, lamps/b.
    assert_eq!(merged("--category folder"), some(["chairs", "chairs", "lamps"]));
    assert_eq!(
        merged("--category seat=scene:chairs/* --category rest=scene:*"),
        some(["seat", "seat", "rest"])
    );
    assert_eq!(merged("--category x=scene:[ab]"), some(["x", "", "x"]));
    let one = format!("turntable in/lamps/b.obj --views 1 {SMALL} --dataset coco -o one/");
    runs(&at, &format!("{one} --category x=scene:b"));
    let output = blinn(&at, &format!("{one} --category x=scene:chairs/*"));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && text.contains("name does not match 'chairs/*'"), "{text}");
}

/// A category has one id in all archives, whichever share writes them; where it cannot, a warning says so once.
#[test]
fn categories_have_the_same_ids_in_all_archives() {
    let (_dir, at) = folder();
    write_triangles(&at.join("in"), &["lamps/a", "chairs/b", "lamps/c", "chairs/d"]);
    let small = SMALL.trim_end_matches(" -q");
    let line = format!("turntable in {small} --progress none --views 1 --dataset coco --shard-size 2");
    let categories = |folder: &str| -> BTreeMap<String, String> {
        let archives = files(&at.join(folder)).into_keys().collect::<Vec<_>>();
        let members = archives.iter().flat_map(|file| members(&at.join(folder).join(file)));
        let samples = members.filter(|(name, _)| name.ends_with(".coco.json"));
        samples
            .map(|(name, bytes)| {
                let data: Value = serde_json::from_slice(&bytes).unwrap();
                for annotation in data["annotations"].as_array().unwrap() {
                    assert_eq!(annotation["category_id"], data["categories"][0]["id"]);
                }
                (name, data["categories"].to_string().replace(",\"supercategory\":\"\"", ""))
            })
            .collect()
    };
    let output = blinn(&at, &format!("{line} --category folder -o whole/{{shard}}.tar"));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !text.contains("warning"), "{text}");
    // In the order of files: chairs/b, chairs/d, lamps/a, lamps/c.
    let found = categories("whole");
    let ids: Vec<&String> = found.values().collect();
    let (chairs, lamps) = (r#"[{"id":1,"name":"chairs"}]"#, r#"[{"id":2,"name":"lamps"}]"#);
    assert_eq!(ids, [chairs, chairs, lamps, lamps]);
    for share in [2, 1] {
        runs(&at, &format!("{line} --category folder -o parts/{{shard}}.tar --chunk {share}/2"));
    }
    assert!(files(&at.join("parts")) == files(&at.join("whole")));
    let resumed = runs(&at, &format!("{line} --category folder -o parts/{{shard}}.tar --resume"));
    assert!(!resumed.contains("wrote"), "{resumed}");
    runs(&at, &format!("{line} --category scene -o scenes/{{shard}}.tar"));
    let found = categories("scenes");
    assert!(
        (1..).zip(found.values()).all(|(id, list)| list.starts_with(&format!("[{{\"id\":{id},"))),
        "{found:?}"
    );
    for flags in ["", "--category x=scene:a --category material"] {
        let output = blinn(&at, &format!("{line} {flags} -o differing/{{shard}}.tar"));
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(text.matches("ids of categories differ between scenes").count(), 1, "{text}");
        assert!(output.status.success() && text.contains("--category NAME=GLOB"), "{text}");
    }
}

/// A glTF file of nodes with one mesh each: a translation, a rotation about y in degrees, a scale and the height of a triangle.
fn write_nodes(file: &Path, nodes: &[([f32; 3], f32, f32, f32)]) {
    let mut bytes = Vec::new();
    let (mut meshes, mut accessors, mut views, mut list) = (vec![], vec![], vec![], vec![]);
    for (i, (translation, degrees, scale, height)) in nodes.iter().enumerate() {
        let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, *height, 0.0];
        views.push(serde_json::json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": 36}));
        bytes.extend(positions.iter().flat_map(|x: &f32| x.to_le_bytes()));
        accessors.push(serde_json::json!({
            "bufferView": i, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, height, 0.25]
        }));
        meshes.push(serde_json::json!({"primitives": [{"attributes": {"POSITION": i}}]}));
        let half = degrees.to_radians() / 2.0;
        list.push(serde_json::json!({
            "mesh": i, "translation": translation, "rotation": [0.0, half.sin(), 0.0, half.cos()],
            "scale": [scale, scale, scale]
        }));
    }
    let bin = file.with_extension("bin");
    fs::write(&bin, &bytes).unwrap();
    let all: Vec<usize> = (0..nodes.len()).collect();
    let gltf = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": all}], "nodes": list, "meshes": meshes,
        "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": bytes.len(), "uri": bin.file_name().unwrap().to_str().unwrap()}],
    });
    fs::write(file, gltf.to_string()).unwrap();
}

/// Objects with the same mesh and size have one model, wherever they are.
#[test]
fn scenes_of_bop_share_models() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("in")).unwrap();
    let same = ([0.0, 0.0, 0.0], 0.0, 1.0, 1.0);
    write_nodes(
        &at.join("in/a.gltf"),
        &[same, ([2.0, 0.3, 0.7], 33.0, 1.0, 1.0), ([-2.0, 0.0, 0.0], 0.0, 1.0, 1.5)],
    );
    write_nodes(
        &at.join("in/b.gltf"),
        &[([0.1, -5.3, 9.7], 101.0, 1.0, 1.0), ([3.0, 0.0, 0.0], 0.0, 0.5, 1.0)],
    );
    let line = format!("turntable in --views 2 {SMALL} --dataset bop --share-models");
    runs(&at, &format!("{line} --merge -o whole/"));
    let ids = |number: u32| -> Vec<u64> {
        let scene = at.join(format!("whole/train/{number:06}"));
        let models = json(&scene, "models_info.json");
        let ids: Vec<u64> = models.as_object().unwrap().keys().map(|id| id.parse().unwrap()).collect();
        let images = json(&scene, "scene_gt.json");
        let shown: Vec<u64> = images
            .as_object()
            .unwrap()
            .values()
            .flat_map(|rows| rows.as_array().unwrap())
            .map(|row| row["obj_id"].as_u64().unwrap())
            .collect();
        assert!(!shown.is_empty() && shown.iter().all(|id| ids.contains(id)), "{shown:?} {ids:?}");
        ids
    };
    let (a, b) = (ids(1), ids(2));
    assert_eq!((a.len(), b.len()), (2, 2), "the first has two objects of one model");
    let common: Vec<&u64> = a.iter().filter(|id| b.contains(id)).collect();
    assert_eq!(common.len(), 1, "{a:?} {b:?}");
    let models = json(&at.join("whole"), "models/models_info.json");
    assert_eq!(models.as_object().unwrap().len(), 3);
    let plys = names(&at.join("whole")).into_iter().filter(|name| name.ends_with(".ply")).count();
    assert_eq!(plys, 3);
    // The numbers do not depend on shares, order or the form of the dataset.
    for share in [2, 1] {
        runs(&at, &format!("{line} --merge -o parts/ --chunk {share}/2"));
    }
    let whole = files(&at.join("whole"));
    assert!(files(&at.join("parts")) == whole);
    runs(&at, &format!("{line} --merge -o parts/ --resume"));
    assert!(files(&at.join("parts")) == whole);
    runs(&at, &format!("{line} -o web/train/{{shard}}.tar"));
    let web = files(&at.join("web"));
    let is_model = |name: &&String| name.starts_with("models/obj_") || *name == "models/models_info.json";
    for name in whole.keys().filter(is_model) {
        assert!(web[name] == whole[name], "{name}");
    }
    // Another model of the same number is not overwritten.
    let ply = format!("models/obj_{:06}.ply", common[0]);
    fs::write(at.join("parts").join(&ply), "ply").unwrap();
    let output = blinn(&at, &format!("{line} --merge -o parts/"));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(1) && text.contains("is another model with the same number"),
        "{text}"
    );
    assert_eq!(fs::read(at.join("parts").join(&ply)).unwrap(), b"ply");
    for (flags, message) in [
        ("--dataset bop --share-models -o x/", "add --merge, or write archives"),
        ("--dataset coco --merge --share-models -o x/", "applies only to --dataset bop"),
        ("--share-models -o x/", "--dataset"),
    ] {
        refused(&at, &format!("turntable in --views 2 {flags}"), message);
    }
}
