//! `turntable --dataset bop -o {shard}.tar`: archives of BOP. `.ci/objects.py` reads them with other programs.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::program::*;
use crate::shards::members;

const SMALL: &str = "--views 2 --size 48x36 -s 1 -q --dataset bop";

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// The pixels of a mask of a sample, row-major, decoded as BOP's toolkit does.
fn decoded(mask: &Value) -> Vec<bool> {
    let size = |i: usize| mask["size"][i].as_u64().unwrap() as usize;
    let (height, width) = (size(0), size(1));
    let mut columns = Vec::new();
    for (i, count) in mask["counts"].as_array().unwrap().iter().enumerate() {
        columns.resize(columns.len() + count.as_u64().unwrap() as usize, i % 2 == 1);
    }
    assert_eq!(columns.len(), width * height);
    (0..width * height).map(|i| columns[i % width * height + i / width]).collect()
}

fn picture(file: &Path) -> Vec<bool> {
    image::open(file).unwrap().to_luma8().pixels().map(|pixel| pixel.0[0] > 0).collect()
}

/// A sample has what the folders of the same scenes have about its image, and the models beside the archives are theirs.
#[test]
fn samples_equal_the_folders_of_a_merged_dataset() {
    let (_dir, at) = folder();
    let scenes = format!("{} {}", model("assembly/assembly.glb"), model("tests/cube.obj"));
    runs(
        &at,
        &format!("turntable {scenes} {SMALL},coco -o a/train_web/shard-{{shard:06}}.tar --shard-size 2"),
    );
    runs(&at, &format!("turntable {scenes} {SMALL},coco --merge -o f/"));
    let mut names = names(&at.join("a"));
    names.retain(|name| !name.ends_with(".ply"));
    let expected = [
        "models/models_info.json",
        "models/scenes/000001.json",
        "models/scenes/000002.json",
        "train_web/key_to_shard.json",
        "train_web/shard-000000.tar",
        "train_web/shard-000001.tar",
    ];
    assert_eq!(names, expected);
    let (archives, folders) = (files(&at.join("a")), files(&at.join("f")));
    let models = |files: &BTreeMap<String, Vec<u8>>| -> Vec<(String, Vec<u8>)> {
        let is_model = |name: &str| name.starts_with("models/obj_") || name == "models/models_info.json";
        files.iter().filter(|(name, _)| is_model(name)).map(|(n, b)| (n.clone(), b.clone())).collect()
    };
    assert!(models(&archives).len() > 2 && models(&archives) == models(&folders));
    let shards = json(&archives["train_web/key_to_shard.json"]);
    assert_eq!(shards.as_object().unwrap().len(), 4);
    let mut masks = 0;
    for scene in 1..=2 {
        let samples: BTreeMap<String, Vec<u8>> =
            members(&at.join(format!("a/train_web/shard-{:06}.tar", scene - 1))).into_iter().collect();
        let whole = |name: &str| json(&folders[&format!("train/{scene:06}/{name}.json")]);
        for view in 1..=2 {
            let key = format!("{scene:06}_{view:06}");
            assert_eq!(shards[&key], scene - 1, "{key}");
            let sample = |extension: &str| &samples[&format!("{key}.{extension}")];
            for (extension, file) in [
                ("rgb.png", format!("rgb/{view:06}.png")),
                ("depth.png", format!("depth/{view:06}.png")),
                ("normal.png", format!("layers/{view:06}.normal.png")),
            ] {
                assert!(
                    *sample(extension) == folders[&format!("train/{scene:06}/{file}")],
                    "{key} {extension}"
                );
            }
            let image = view.to_string();
            for (extension, name) in
                [("camera", "scene_camera"), ("gt", "scene_gt"), ("gt_info", "scene_gt_info")]
            {
                assert_eq!(json(sample(&format!("{extension}.json"))), whole(name)[&image], "{key} {name}");
            }
            let description = json(sample("json"));
            assert_eq!(description["file_path"], format!("{key}.rgb.png"));
            assert_eq!(description["depth_path"], format!("{key}.depth.png"));
            assert_eq!(json(sample("coco.json"))["images"][0]["file_name"], format!("{key}.rgb.png"));
            let count = json(sample("gt.json")).as_array().unwrap().len();
            assert!(count > 0);
            for kind in ["mask", "mask_visib"] {
                let all = json(sample(&format!("{kind}.json")));
                assert_eq!(all.as_object().unwrap().len(), count);
                for i in 0..count {
                    let file = at.join(format!("f/train/{scene:06}/{kind}/{view:06}_{i:06}.png"));
                    assert!(decoded(&all[i.to_string()]) == picture(&file), "{key} {kind} {i}");
                    masks += 1;
                }
            }
        }
    }
    assert!(masks > 8, "{masks}");
}

/// Files beside archives are made again if they are missing, and archives are the same whatever the shares.
#[test]
fn archives_are_kept_with_their_models() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("in")).unwrap();
    for (file, from) in
        [("a.glb", "tower/tower.glb"), ("b.obj", "tests/cube.obj"), ("c.glb", "assembly/assembly.glb")]
    {
        fs::copy(model(from), at.join("in").join(file)).unwrap();
    }
    let line = format!("turntable in {SMALL} --resume").replace(" -q", "");
    let count = |messages: &str, archives: usize| {
        assert_eq!(messages.matches(".tar\n").count(), archives, "{messages}");
        messages.matches("kept ").count()
    };
    let run = |flags: &str| runs(&at, &format!("{line} {flags}"));
    assert_eq!(count(&run("--shard-size 2 -o s/{shard}.jpg.tar"), 3), 0);
    let whole = files(&at.join("s"));
    assert!(whole.contains_key("models/models_info.json") && whole.contains_key("key_to_shard.json"));
    assert!(members(&at.join("s/0.jpg.tar")).iter().any(|(name, _)| name == "000001_000001.rgb.jpg"));
    let again = run("--shard-size 2 -o s/{shard}.jpg.tar");
    assert_eq!(count(&again, 3), 3);
    assert!(!again.contains("wrote "), "{again}");
    // Missing files are made anew, with the archive whose scene it belongs to.
    for (lost, kept) in [
        ("models/obj_002001.ply", 2),
        ("models/scenes/000003.json", 2),
        ("models/models_info.json", 3),
        ("key_to_shard.json", 3),
    ] {
        fs::remove_file(at.join("s").join(lost)).unwrap();
        assert_eq!(count(&run("--shard-size 2 -o s/{shard}.jpg.tar"), 3), kept, "{lost}");
        assert!(files(&at.join("s")) == whole, "{lost}");
    }
    for (share, is_partial) in [(2, true), (1, true), (3, false)] {
        let messages = run(&format!("--shard-size 2 -o p/{{shard}}.jpg.tar --chunk {share}/3 --threads 1"));
        assert_eq!(messages.contains("scenes are missing"), is_partial, "{messages}");
    }
    assert!(files(&at.join("p")) == whole);
    // Archives of limited bytes have the same files beside them.
    run("--shard-size 1B -o b/{shard}.jpg.tar");
    assert!(files(&at.join("b")) == whole);
    assert_eq!(count(&run("--shard-size 1B -o b/{shard}.jpg.tar"), 3), 3);
    // Without the format, archives are others.
    let others = line.replace("--dataset bop", "--dataset nerf");
    assert_eq!(count(&runs(&at, &format!("{others} --shard-size 2 -o s/{{shard}}.jpg.tar")), 3), 0);
}

/// A scene that fails is in no archive and has no models in the common file until it is repaired.
#[test]
fn failed_scenes_are_left_out() {
    let (_dir, at) = folder();
    for (name, text) in [("a", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ("b", "f 1 2 3\n")] {
        fs::write(at.join(format!("{name}.obj")), text).unwrap();
    }
    let line = format!("turntable a.obj b.obj {SMALL} -o s/{{shard}}.tar");
    let output = blinn(&at, &line.replace(" -q", ""));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(messages.contains("1 of 2 scenes are missing"), "{messages}");
    let objects = || {
        let info = json(&fs::read(at.join("s/models/models_info.json")).unwrap());
        info.as_object().unwrap().keys().cloned().collect::<Vec<_>>()
    };
    assert_eq!(objects(), ["1001"]);
    fs::copy(at.join("a.obj"), at.join("b.obj")).unwrap();
    runs(&at, &format!("{line} --resume"));
    assert_eq!(objects(), ["1001", "2001"]);
    let shards = json(&fs::read(at.join("s/key_to_shard.json")).unwrap());
    assert_eq!(shards.as_object().unwrap().len(), 4);
}

#[test]
fn names_that_tools_of_bop_do_not_read_are_refused() {
    let (_dir, at) = folder();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    for (flags, message) in [
        ("-o {shard}.webp.tar", "BOP's tools read .png and .jpg in archives"),
        ("-o {shard}.exr.tar", "BOP's tools read .png and .jpg in archives"),
        ("-o {shard}/{shard}.tar", "with {shard:06} in its last part"),
        ("-o {shard}.tar --merge", "remove --merge"),
        ("-o {shard}.tar --normalize unit-cube", "have the scene's own coordinates"),
    ] {
        refused(&at, &format!("turntable cube.obj {SMALL} {flags}"), message);
    }
    let dry = blinn(&at, &format!("turntable cube.obj {SMALL} -o s/{{shard}}.tar --dry-run")).stdout;
    let dry = String::from_utf8(dry).unwrap();
    assert_eq!(dry, "s/0.tar\ns/key_to_shard.json\ns/models/models_info.json\n");
}
