//! `turntable --views --dataset`: the formats of COLMAP, BOP and COCO. `.ci/datasets.py` reads them with other programs.

use serde_json::Value;

use crate::common::program::*;

const SMALL: &str = "--size 48x36 -s 1 -q";

fn json(folder: &std::path::Path, file: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// All tasks of a farm together write what one run writes, and interrupted runs are completed.
#[test]
fn shares_and_resumed_runs_equal_the_whole() {
    let (_dir, at) = folder();
    let scene = model("assembly/assembly.glb");
    let line = format!("turntable {scene} --views 4 {SMALL} --dataset nerf,colmap,bop,coco");
    let images = |folder: &str| format!("{folder}/train/000001/rgb/######.png");
    runs(&at, &format!("{line} -o {} --ledger ledger", images("whole")));
    let whole = files(&at.join("whole"));
    // Masks, models and descriptions count, too.
    let ledger = json(&at, "ledger");
    let bytes: usize = whole.values().map(Vec::len).sum();
    assert_eq!(
        (ledger["files"].as_u64(), ledger["bytes"].as_u64()),
        (Some(whole.len() as u64), Some(bytes as u64))
    );
    for file in [
        "models/models_info.json",
        "models/obj_000001.ply",
        "train/000001/scene_camera.json",
        "train/000001/scene_gt.json",
        "train/000001/scene_gt_info.json",
        "train/000001/depth/000004.png",
        "train/000001/mask/000001_000000.png",
        "train/000001/mask_visib/000001_000000.png",
        "train/000001/layers/000002.depth.png",
        "train/000001/layers/000002.mask.png",
        "train/000001/layers/000002.normal.png",
        "train/000001/rgb/000002.png",
        "train/000001/rgb/annotations.json",
        "train/000001/rgb/sparse/0/points3D.txt",
        "train/000001/rgb/transforms.json",
    ] {
        assert!(whole.contains_key(file), "{file} is missing: {:?}", whole.keys());
    }
    // BOP's tools take each picture in this folder as an image.
    let is_image = |name: &&String| name.starts_with("train/000001/rgb/") && name.ends_with(".png");
    assert_eq!(whole.keys().filter(is_image).count(), 4);
    let transforms = String::from_utf8_lossy(&whole["train/000001/rgb/transforms.json"]).into_owned();
    assert!(transforms.contains("\"../layers/000002.depth.png\""), "{transforms}");
    for share in ["--chunk 1/2 --no-overwrite", "--chunk 2/2 --no-overwrite"] {
        runs(&at, &format!("{line} -o {} {share}", images("parts")));
    }
    assert!(files(&at.join("parts")) == whole);
    // A killed run may lack any file.
    for lost in ["train/000001/scene_gt.json", "train/000001/mask/000002_000001.png", "models/obj_000002.ply"]
    {
        std::fs::remove_file(at.join("parts").join(lost)).unwrap();
    }
    std::fs::remove_file(at.join("parts/train/000001/rgb/000003.png")).unwrap();
    runs(&at, &format!("{line} -o {} --resume", images("parts")));
    assert!(files(&at.join("parts")) == whole);
    let dry = blinn(&at, &format!("{line} -o {} --dry-run", images("x"))).stdout;
    let dry = String::from_utf8(dry).unwrap();
    assert!(dry.contains("x/train/000001/scene_gt.json\n") && dry.contains("x/models/models_info.json\n"));
}

/// Without `--dataset`, only `transforms.json` is written; with another format, only that.
#[test]
fn only_the_formats_in_the_list_are_written() {
    let (_dir, at) = folder();
    let line = format!("turntable {} --views 2 {SMALL}", model("tests/cube.obj"));
    let shared = |folder: &str| {
        let all = names(&at.join(folder)).into_iter().filter(|name| !name.ends_with(".png"));
        all.collect::<Vec<_>>()
    };
    runs(&at, &format!("{line} -o default/#.png"));
    runs(&at, &format!("{line} -o nerf/#.png --dataset nerf"));
    assert_eq!(shared("default"), ["transforms.json"]);
    assert!(files(&at.join("default")) == files(&at.join("nerf")));
    runs(&at, &format!("{line} -o coco/#.png --dataset coco"));
    assert_eq!(shared("coco"), ["annotations.json"]);
    runs(&at, &format!("{line} -o splat/images/#.exr --dataset colmap"));
    let model = ["cameras.txt", "images.txt", "points3D.txt"].map(|name| format!("sparse/0/{name}"));
    assert_eq!(shared("splat")[2..], model);
    runs(&at, &format!("{line} -o binary/#.png --dataset colmap-bin"));
    let model = ["cameras.bin", "images.bin", "points3D.bin"].map(|name| format!("sparse/0/{name}"));
    assert_eq!(shared("binary"), model);
    // Readers would take the binary model.
    let text = format!("{line} -o binary/#.png --dataset colmap");
    let words: Vec<&str> = text.split_whitespace().collect();
    fails(&at, &words, 1, "readers would prefer binary/sparse/0/cameras.bin to the text files");
}

#[test]
fn categories_follow_rules() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let info: Value = serde_json::from_slice(&blinn(&at, &format!("info --json {scene}")).stdout).unwrap();
    let name = info["object_ids"][0]["name"].as_str().unwrap().to_string();
    let annotated = |flags: &str| {
        runs(&at, &format!("turntable {scene} --views 2 {SMALL} --dataset coco -o a/#.png {flags}"));
        json(&at.join("a"), "annotations.json")
    };
    let categories = |data: &Value| {
        let rows = data["categories"].as_array().unwrap().iter();
        rows.map(|row| row["name"].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    let by_object = annotated("");
    assert!(categories(&by_object).contains(&name));
    let rules = annotated(&format!("--category first={name} --category rest=*"));
    assert_eq!(categories(&rules), ["first", "rest"]);
    for annotation in rules["annotations"].as_array().unwrap() {
        let is_first = annotation["name"] == name.as_str();
        assert_eq!(annotation["category_id"], if is_first { 1 } else { 2 });
    }
    // The same objects, and no others, without a rule for the rest.
    let some = annotated(&format!("--category first={name}"));
    assert!(some["annotations"].as_array().unwrap().iter().all(|row| row["name"] == name.as_str()));
    let materials = annotated("--category material");
    assert_eq!(
        materials["annotations"].as_array().unwrap().len(),
        by_object["annotations"].as_array().unwrap().len()
    );
    // A list of rules serves many scenes.
    let tower = model("tower/tower.glb");
    runs(
        &at,
        &format!("turntable {scene} {tower} --views 1 {SMALL} --dataset coco --category first={name} -o c/"),
    );
    let second = json(&at.join("c"), "tower/annotations.json");
    assert_eq!(
        (categories(&second), second["annotations"].as_array().unwrap().len()),
        (vec!["first".into()], 0)
    );
    let line = format!("turntable {scene} --views 1 {SMALL} --dataset coco -o b/#.png");
    for (rule, message) in
        [("x=nothing", "no node or object matches"), ("x=material:nothing", "no material matches")]
    {
        let output = blinn(&at, &format!("{line} --category {rule}"));
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(1) && text.contains(message), "{text}");
    }
}

/// A folder is enough for the formats to place their files.
#[test]
fn formats_lay_out_their_folders() {
    let (_dir, at) = folder();
    let (cube, tower) = (model("tests/cube.obj"), model("tower/tower.glb"));
    for (scenes, flags, expected) in [
        (
            "1",
            "bop -o a/",
            "a/train/000001/rgb/000001.png a/train/000001/scene_gt.json a/models/models_info.json",
        ),
        (
            "1",
            "coco,bop,nerf,colmap -o b",
            "b/train/000001/rgb/annotations.json b/train/000001/rgb/sparse/0/images.txt",
        ),
        ("1", "colmap,nerf -o c/", "c/images/0001.png c/images/transforms.json c/sparse/0/images.txt"),
        ("1", "coco -o d/", "d/cube_0001.png d/annotations.json"),
        ("2", "coco -o e/", "e/cube/0001.png e/tower/annotations.json"),
        ("2", "colmap -o f/", "f/cube/images/0001.png f/tower/sparse/0/images.txt"),
        ("2", "bop -o h/", "h/cube/train/000001/rgb/000001.png h/tower/models/models_info.json"),
        ("1", "nerf -o g/", "g/cube_0001.png g/transforms.json"),
    ] {
        let scenes = if scenes == "1" { cube.clone() } else { format!("{cube} {tower}") };
        runs(&at, &format!("turntable {scenes} --views 1 {SMALL} --dataset {flags}"));
        let names = names(&at);
        for file in expected.split(' ') {
            assert!(names.iter().any(|name| name == file), "{flags}: {file} is missing: {names:?}");
        }
    }
}

/// Scenes of a folder in one dataset, rendered at once, in shares, or after a failure.
/// A folder that is named after its scene has no other one below it.
#[test]
fn the_folder_of_a_scene_may_be_named() {
    let (_dir, at) = folder();
    let scene = model("assembly/assembly.glb");
    for folder in ["x/{stem}/", "x/"] {
        let output =
            blinn(&at, &format!("turntable {scene} missing.glb --views 2 {SMALL} --dry-run -o {folder}"));
        let listed = String::from_utf8(output.stdout).unwrap();
        assert!(listed.contains("x/assembly/0001.png\n"), "{folder}: {listed}");
    }
}

#[test]
fn scenes_are_merged_into_one_dataset() {
    let (_dir, at) = folder();
    std::fs::create_dir(at.join("in")).unwrap();
    for (file, from) in
        [("a.glb", "tower/tower.glb"), ("b.obj", "tests/cube.obj"), ("c.glb", "assembly/assembly.glb")]
    {
        std::fs::copy(model(from), at.join("in").join(file)).unwrap();
    }
    let small = SMALL.trim_end_matches("-q");
    let line = format!("turntable in --views 2 {small}--dataset coco,colmap,nerf --category scene --merge");
    let listed = String::from_utf8(blinn(&at, &format!("{line} -o whole/ --dry-run")).stdout).unwrap();
    assert!(listed.ends_with("whole/annotations.json\n"), "{listed}");
    runs(&at, &format!("{line} -o whole/"));
    let coco = json(&at.join("whole"), "annotations.json");
    let column = |list: &str, key: &str| -> Vec<Value> {
        coco[list].as_array().unwrap().iter().map(|row| row[key].clone()).collect()
    };
    assert_eq!(column("images", "id"), [1, 2, 3, 4, 5, 6]);
    assert_eq!(column("images", "file_name")[3], "images/b/0002.png");
    assert_eq!(column("categories", "name"), ["a", "b", "c"]);
    let count = column("annotations", "id").len();
    assert_eq!(column("annotations", "id"), (1..=count).collect::<Vec<_>>());
    for row in coco["annotations"].as_array().unwrap() {
        assert_eq!(row["category_id"].as_i64(), row["image_id"].as_i64().map(|id| (id + 1) / 2));
    }
    // The models of COLMAP share the folder of images and the numbers of images.
    let images = std::fs::read_to_string(at.join("whole/sparse/2/images.txt")).unwrap();
    let names: Vec<&str> = images
        .lines()
        .filter(|line| line.contains(".png"))
        .map(|line| line.split(' ').next_back().unwrap())
        .collect();
    assert_eq!(names, ["c/0001.png", "c/0002.png"]);
    assert!(images.lines().any(|line| line.starts_with("5 ")), "{images}");
    assert_eq!(json(&at.join("whole/images/a"), "transforms.json")["scene"], "a.glb");
    for share in 1..=3 {
        let output = blinn(&at, &format!("{line} -o parts/ --chunk {share}/3 --progress none"));
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && text.contains("scenes are missing") == (share < 3), "{text}");
    }
    let whole = files(&at.join("whole"));
    assert!(files(&at.join("parts")) == whole);
    // A scene that fails is left out until it is repaired.
    let good = std::fs::read(at.join("in/b.obj")).unwrap();
    std::fs::write(at.join("in/b.obj"), "f 1 2 3\n").unwrap();
    let output = blinn(&at, &format!("{line} -o mended/"));
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json(&at.join("mended"), "annotations.json")["images"].as_array().unwrap().len(), 4);
    std::fs::write(at.join("in/b.obj"), good).unwrap();
    runs(&at, &format!("{line} -o mended/ --resume"));
    assert!(files(&at.join("mended")) == whole);
    // A file that is not of this dataset stays.
    std::fs::create_dir(at.join("foreign")).unwrap();
    std::fs::write(at.join("foreign/annotations.json"), "mine").unwrap();
    let output = blinn(&at, &format!("{line} -o foreign/ --no-overwrite"));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(1) && text.contains("--merge: foreign/annotations.json exists"),
        "{text}"
    );
    assert_eq!(std::fs::read(at.join("foreign/annotations.json")).unwrap(), b"mine");
}

/// BOP's scenes share a folder of models, whose numbers differ.
#[test]
fn merged_scenes_of_bop_have_objects_of_their_own() {
    let (_dir, at) = folder();
    let (tower, cube) = (model("tower/tower.glb"), model("tests/cube.obj"));
    let line = format!("turntable {tower} {cube} --views 1 {SMALL} --merge");
    runs(&at, &format!("{line} --dataset bop,coco,colmap-bin -o data/"));
    let at = at.join("data");
    let models = json(&at, "models/models_info.json");
    let second = json(&at, "train/000002/scene_gt.json");
    assert_eq!(second["1"][0]["obj_id"], 2001);
    assert!(models["2001"]["diameter"].is_f64() && models["1001"]["diameter"].is_f64());
    for object in models.as_object().unwrap().keys() {
        assert!(at.join(format!("models/obj_{:0>6}.ply", object)).exists(), "{object}");
    }
    let coco = json(&at, "annotations.json");
    assert_eq!(coco["images"][1]["file_name"], "train/000002/rgb/000001.png");
    let images = std::fs::read(at.join("sparse/1/images.bin")).unwrap();
    assert!(images.windows(28).any(|name| name == b"train/000002/rgb/000001.png\0"));
}

#[test]
fn invalid_merges_are_refused() {
    let (_dir, at) = folder();
    let (cube, tower) = (model("tests/cube.obj"), model("tower/tower.glb"));
    for (flags, message) in [
        ("--merge -o a/", "--dataset"),
        ("--dataset nerf --merge -o a/", "add coco, bop or colmap"),
        ("--dataset coco --merge -o a/####.png", "would both write"),
        ("--dataset coco --merge -o ####.png", "needs a folder of its own"),
        ("--dataset colmap --merge -o {stem}/####.png", "FOLDER/images/{index:04}-{stem}/####.png"),
        ("--dataset coco --merge -o {stem}/a/####.png", "in one folder of -o only"),
        ("--dataset coco --merge -o x/{shard}.tar", "an archive describes each image by itself"),
    ] {
        refused(&at, &format!("turntable {cube} {tower} --views 2 {flags}"), message);
    }
}

/// The annotations of COCO are those of the pictures, which --normalize does not change.
#[test]
fn normalized_scenes_have_annotations() {
    let (_dir, at) = folder();
    let line = format!("turntable {} --views 2 {SMALL} --dataset nerf,coco", model("tests/cube.obj"));
    runs(&at, &format!("{line} -o plain/"));
    runs(&at, &format!("{line} -o unit/ --normalize unit-cube"));
    let annotations = |folder: &str| json(&at.join(folder), "annotations.json");
    assert!(!annotations("plain")["annotations"].as_array().unwrap().is_empty());
    assert_eq!(annotations("plain")["annotations"], annotations("unit")["annotations"]);
    // Depths are in the written units: the cube has a side of 2.
    let step = |folder: &str| annotations(folder)["images"][0]["integer_depth_scale"].as_f64().unwrap();
    assert!((step("plain") / step("unit") - 2.0).abs() < 0.02);
    assert!(json(&at.join("unit"), "transforms.json")["normalized_to_scene"].is_array());
    for format in ["bop", "colmap", "nerf,colmap-bin"] {
        let line = format!("turntable {} --views 2 --normalize unit-cube", model("tests/cube.obj"));
        refused(&at, &format!("{line} --dataset {format} -o a/"), "have the scene's own coordinates");
    }
}

/// The ledger does not list masks, whose number depends on the scene.
#[test]
fn deleted_masks_of_bop_are_written_again() {
    let (_dir, at) = folder();
    let line = format!("turntable {} --views 2 {SMALL} --dataset bop -o data/", model("tests/cube.obj"));
    let line = format!("{line} --ledger ledger --resume");
    runs(&at, &line);
    let whole = files(&at.join("data"));
    for name in ["mask/000001_000000.png", "mask_visib/000002_000000.png", "depth/000002.png"] {
        std::fs::remove_file(at.join("data/train/000001").join(name)).unwrap();
        runs(&at, &line);
        assert!(files(&at.join("data")) == whole, "{name}");
    }
    let lines = std::fs::read_to_string(at.join("ledger")).unwrap().lines().count();
    runs(&at, &line);
    assert_eq!(
        std::fs::read_to_string(at.join("ledger")).unwrap().lines().count(),
        lines,
        "nothing is missing"
    );
}

#[test]
fn invalid_formats_are_refused() {
    let (_dir, at) = folder();
    let cube = model("tests/cube.obj");
    for (flags, message) in [
        ("--views 2 --dataset kitti", "expected nerf, colmap, colmap-bin, bop, coco, coco-polygons"),
        ("--views 2 --dataset colmap,colmap-bin", "two forms of one format; choose one"),
        ("--dataset coco", "--views"),
        ("--count 2 --dataset coco", "--dataset applies only to datasets; add --views N"),
        ("--count 2 --on random", "--on applies only to datasets; add --views N"),
        ("--views 2 --category object", "--dataset"),
        ("--views 2 --dataset nerf --category object", "only to --dataset coco"),
        ("--views 2 --dataset coco --category =x", "NAME=GLOB"),
        ("--views 2 --dataset bop -o a/#.png", "-o ROOT/train/000001/rgb/######.png"),
        ("--views 2 --dataset bop -o r/train/000001/rgb/####.png", "-o ROOT/train/000001/rgb/######.png"),
        ("--views 2 --dataset bop -o r/train/000001/rgb/######.exr", "-o ROOT/train/000001/rgb/######.png"),
    ] {
        refused(&at, &format!("turntable {cube} {flags}"), message);
    }
    std::fs::copy(&cube, at.join("cube.obj")).unwrap();
    let line = "job openjd turntable cube.obj --views 2 --dataset bop -o r/train/000001/rgb/######.png";
    refused(&at, line, "a job cannot write r/train/000001/scene_camera.json");
    let line = "job openjd turntable cube.obj --views 2 --dataset coco --merge -o r/cube/######.png";
    refused(&at, line, "--merge: a job renders one scene");
    fails(
        &at,
        &["turntable", &cube, "--views", "2", "--dataset", "colmap", "-o", "a b #.png"],
        2,
        "COLMAP reads no spaces",
    );
}
