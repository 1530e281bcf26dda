//! `--ledger` and images that other runs replace.

use std::fs;

use super::batches::write_triangle;
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
    // What another share wrote does not stand for what is missing.
    fs::remove_file(at.join("f").join(&last)).unwrap();
    assert!(share(1).contains("1 done before; images: 0;"));
    assert!(share(2).contains("images: 1, "));
    assert!(files(&at.join("f")) == all);
}
