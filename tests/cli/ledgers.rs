//! `--ledger`: a line about each scene, and images that other runs replace.

use std::fs;
use std::path::Path;

use super::batches::{ledger, write_objects, write_triangle};
use crate::common::program::*;

const SMALL: &str = "--size 16x12 -s 1";

/// Images that a run with other settings has replaced are not kept, whatever the ledger of that run. Those that were
/// copied are kept, as are those of a ledger without the version of their files.
#[test]
fn a_ledger_does_not_keep_images_that_another_run_replaced() {
    let (_dir, at) = folder();
    write_triangle(&at.join("objects/1.obj"), 1);
    write_triangle(&at.join("objects/2.obj"), 2);
    for output in ["-o out/{stem}.png", "--shard-size 9 -o out/{shard}.tar"] {
        let run = |flags: &str| runs(&at, &format!("render objects {SMALL} {output} {flags}"));
        let ours = "--resume --ledger ours";
        run(ours);
        let expected = files(&at.join("out"));
        for theirs in ["--seed 3", "--seed 3 --ledger theirs", "--seed 3 --resume --ledger ours"] {
            run(theirs);
            assert!(files(&at.join("out")) != expected, "{theirs}");
            let messages = run(ours);
            assert!(messages.contains("images: 2;"), "{theirs}: {messages}");
            assert!(files(&at.join("out")) == expected, "{theirs}");
            assert!(run(ours).contains("2 done before; images: 0;"), "{theirs}");
        }
        for (name, bytes) in &expected {
            fs::remove_file(at.join("out").join(name)).unwrap();
            fs::write(at.join("out").join(name), bytes).unwrap();
        }
        let messages = run(ours);
        assert!(messages.contains("2 kept"), "{messages}");
        assert!(run(ours).contains("2 done before; images: 0;"));
        let text = fs::read_to_string(at.join("ours")).unwrap();
        fs::write(at.join("ours"), text.replace("files_version", "other")).unwrap();
        run("--seed 3");
        assert!(run(ours).contains("2 done before; images: 0;"), "a line without the version");
        fs::remove_dir_all(at.join("out")).unwrap();
        fs::remove_file(at.join("ours")).unwrap();
    }
}

/// The frames of a share of a clip are known once its scene is read: the ledger has their numbers, not those of another
/// share.
#[test]
fn a_ledger_knows_the_frames_of_a_share_of_a_clip() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    let share = |i: u32| {
        let line =
            format!("render {figure} {SMALL} --fps 8 --frames --chunk {i}/2 -o f/#.png --resume --ledger l");
        runs(&at, &line)
    };
    share(1);
    let first = files(&at.join("f")).len();
    share(2);
    let all = files(&at.join("f"));
    let last = format!("{}.png", all.len());
    assert!(first > 1 && all.contains_key(&last), "{:?}", all.keys());
    for i in [1, 2] {
        assert!(share(i).contains("1 done before; images: 0;"));
    }
    // Files of another share do not stand for those that are missing.
    fs::remove_file(at.join("f").join(&last)).unwrap();
    assert!(share(1).contains("1 done before; images: 0;"));
    assert!(share(2).contains("images: 1, "));
    assert!(files(&at.join("f")) == all);
}

/// The ledger has a line about each scene, and `--resume` skips what it names as done.
#[test]
fn a_ledger_describes_every_scene_and_skips_those_that_are_done() {
    let (_dir, at) = folder();
    write_objects(&at, 4);
    fs::write(at.join("objects/2/02.obj"), "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let line = format!("turntable objects {SMALL} --count 2 -o out/{{stem}}/#.png --ledger log/ledger.jsonl");
    let run = |flags: &str| {
        let output = blinn(&at, &format!("{line} {flags}"));
        (output.status.code().unwrap(), ledger(&at, "log/ledger.jsonl"))
    };
    let (code, lines) = run("--resume");
    assert_eq!(code, 1);
    let stems: Vec<&str> = lines.iter().map(|line| line["scene"].as_str().unwrap()).collect();
    let scenes = ["0/00", "0/03", "1/01", "1/broken", "2/02"].map(|stem| format!("objects/{stem}.obj"));
    assert_eq!(stems, scenes);
    for (i, line) in lines.iter().enumerate() {
        assert_eq!(line["index"], i + 1);
        let is_broken = i == 3;
        assert_eq!(line["status"], if is_broken { "failed" } else { "done" });
        assert_eq!(line["images"], if is_broken { 0 } else { 2 });
        assert_eq!(line["warnings"], usize::from(i == 4));
        let written = files(&at.join("out"));
        let stem = Path::new(stems[i]).file_stem().unwrap().to_str().unwrap();
        let bytes = |name: String| written.get(&name).map_or(0, Vec::len);
        assert_eq!(line["bytes"], bytes(format!("{stem}/1.png")) + bytes(format!("{stem}/2.png")));
        assert!(line["seconds"].as_f64().unwrap() >= 0.0);
    }
    assert!(lines[3]["error"].as_str().unwrap().contains("broken.obj"), "{}", lines[3]);
    assert!(lines[4]["warning_texts"][0].as_str().unwrap().contains("gone.mtl"), "{}", lines[4]);
    // Only the failed scene is tried again, or none.
    let again = |flags: &str| {
        let before = ledger(&at, "log/ledger.jsonl").len();
        let (code, lines) = run(flags);
        let scenes: Vec<String> = lines[before..].iter().map(|line| line["scene"].to_string()).collect();
        (code, scenes.concat())
    };
    assert_eq!(again("--resume"), (1, "\"objects/1/broken.obj\"".into()));
    assert_eq!(again("--resume --no-retry"), (1, String::new()));
    // A scene that changed, whose image is missing, or with other settings is rendered again.
    write_triangle(&at.join("objects/1/broken.obj"), 4);
    assert_eq!(again("--resume --no-retry"), (0, "\"objects/1/broken.obj\"".into()));
    fs::remove_file(at.join("out/03/2.png")).unwrap();
    assert_eq!(again("--resume"), (0, "\"objects/0/03.obj\"".into()));
    assert_eq!(again("--resume --seed 3").1.matches("obj").count(), 5 + 5);
    // Without --resume, the ledger begins anew.
    assert_eq!(run("").1.len(), 5);
    refused(&at, &format!("render objects {SMALL} -o {{stem}}.png --ledger objects/0/00.obj"), "--ledger");
    fs::write(at.join("notes.txt"), "mine").unwrap();
    let output = blinn(&at, &format!("render objects/0 {SMALL} -o {{stem}}.png --ledger notes.txt"));
    assert!(output.status.code() == Some(1) && fs::read_to_string(at.join("notes.txt")).unwrap() == "mine");
    refused(&at, "render objects --no-retry", "--ledger");
}

/// The cameras of a list decide images, not its file.
#[test]
fn a_ledger_knows_the_cameras_of_a_list() {
    let (_dir, at) = folder();
    write_triangle(&at.join("objects/a.obj"), 0);
    let write_list = |name: &str, z: f64| {
        let list = format!(
            "{{\"K\": [16,0,8,0,16,8,0,0,1], \"width\": 16, \"height\": 16, \"convention\": \"opengl\", \
             \"camera_to_world\": [1,0,0,0, 0,1,0,0, 0,0,1,{z}, 0,0,0,1], \"file\": \"v.jpg\"}}\n"
        );
        fs::write(at.join(name), list).unwrap();
    };
    let lines = |list: &str| {
        runs(&at, &format!("render objects -s 1 -q --cameras {list} -o out/ --resume --ledger l"));
        ledger(&at, "l").len()
    };
    write_list("a.jsonl", 4.0);
    write_list("b.jsonl", 4.0);
    write_list("c.jsonl", 5.0);
    assert_eq!(["a.jsonl", "b.jsonl", "c.jsonl"].map(lines), [1, 1, 2]);
}
