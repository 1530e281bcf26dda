//! `-o {shard}.tar`: images in archives, as WebDataset reads them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
#[cfg(unix)]
use std::process::Command;

use serde_json::Value;

use crate::common::program::*;

const SMALL: &str = "--size 16x12 -s 1 -q";

/// Seven objects, one of them broken.
fn write_objects(at: &Path) {
    fs::create_dir_all(at.join("objects")).unwrap();
    for i in 0..7 {
        let text = format!("v 0 0 0\nv {} 0 0\nv 0 {} 0\nf 1 2 3\n", 1 + i % 5, 1 + i % 7);
        let text = if i == 3 { "v 0 0 0\nf 1 2 3\n".to_string() } else { text };
        fs::write(at.join(format!("objects/o{i}.x.obj")), text).unwrap();
    }
}

/// Overwrites a file, which keeps its size and its time: only who opens it notices.
fn spoil(file: &Path) {
    let metadata = fs::metadata(file).unwrap();
    fs::write(file, vec![b'x'; metadata.len() as usize]).unwrap();
    let file = fs::File::options().write(true).open(file).unwrap();
    file.set_modified(metadata.modified().unwrap()).unwrap();
}

/// The files in an archive, in order.
pub fn members(file: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = fs::read(file).unwrap();
    let mut rest = &bytes[..];
    let mut all = Vec::new();
    while rest[0] != 0 {
        let text = |range: std::ops::Range<usize>| {
            String::from_utf8(rest[range].iter().copied().take_while(|b| *b != 0).collect()).unwrap()
        };
        let size = usize::from_str_radix(text(124..136).trim(), 8).unwrap();
        all.push((text(0..100), rest[512..512 + size].to_vec()));
        rest = &rest[512 + size.div_ceil(512) * 512..];
    }
    assert!(rest.len() >= 1024 && rest.iter().all(|b| *b == 0), "the archive has its end");
    all
}

#[test]
fn archives_hold_whole_scenes_with_layers_and_descriptions() {
    let (_dir, at) = folder();
    write_objects(&at);
    let line = format!("turntable objects {SMALL} --views 3 --on random --normalize unit-sphere");
    let run = |flags: &str| blinn(&at, &format!("{line} {flags}")).status.code();
    assert_eq!(run("--shard-size 7 -o s/{shard:03}.tar"), Some(1), "one object is broken");
    assert_eq!(run("-o f/{stem}/#.png"), Some(1));
    // Two scenes of three views each.
    assert_eq!(names(&at.join("s")), ["000.tar", "001.tar", "002.tar", "003.tar"]);
    let single = files(&at.join("f"));
    let mut count = 0;
    for (shard, scenes) in [(0, vec![0, 1]), (1, vec![2]), (2, vec![4, 5]), (3, vec![6])] {
        let members = members(&at.join(format!("s/00{shard}.tar")));
        let mut expected = Vec::new();
        for i in scenes {
            for view in 1..=3 {
                let key = format!("{:08}-o{i}_x-{view:04}", i + 1);
                expected.extend(
                    ["png", "depth.png", "normal.png", "mask.png", "json"].map(|e| format!("{key}.{e}")),
                );
            }
        }
        assert_eq!(members.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>(), expected);
        for (name, bytes) in members {
            let (key, extension) = name.split_once('.').unwrap();
            let (stem, view) = (&key[9..11], &key[key.len() - 1..]);
            count += 1;
            if extension != "json" {
                assert!(bytes == single[&format!("{stem}.x/{view}.{extension}")], "{name}");
                continue;
            }
            let all: Value = serde_json::from_slice(&bytes).unwrap();
            let transforms: Value =
                serde_json::from_slice(&single[&format!("{stem}.x/transforms.json")]).unwrap();
            let frame = &transforms["frames"][view.parse::<usize>().unwrap() - 1];
            assert_eq!(all["transform_matrix"], frame["transform_matrix"]);
            for member in ["fl_x", "cy", "w", "aabb", "integer_depth_scale", "normalized_to_scene"] {
                assert_eq!(all[member], transforms[member], "{member}");
            }
            assert_eq!(all["scene"], format!("objects/{stem}.x.obj"));
            assert_eq!(
                all["empty"], false,
                "also in images that are not empty, for readers that infer columns"
            );
            assert_eq!(all["depth_path"], name.replace("json", "depth.png"));
        }
    }
    assert_eq!(count, 6 * 3 * 5);
}

/// Archives do not depend on threads, shares and interruptions, and complete ones are kept.
#[test]
fn archives_are_resumed_as_a_whole() {
    let (_dir, at) = folder();
    write_objects(&at);
    let line = format!("render objects {SMALL} --shard-size 2");
    let run = |flags: &str| {
        let output = blinn(&at, &format!("{line} {flags}").replace(" -q", ""));
        String::from_utf8(output.stderr).unwrap().matches("wrote ").count()
    };
    assert_eq!(run("-o a/{shard}.jpg.tar"), 4);
    let whole: BTreeMap<String, Vec<u8>> = files(&at.join("a"));
    assert!(whole["0.jpg.tar"].windows(4).any(|bytes| bytes == b"JFIF" || bytes == [0xff, 0xd8, 0xff, 0xe0]));
    assert_eq!(run("-o b/{shard}.jpg.tar --threads 1 --chunk 2/3"), 1);
    assert_eq!(run("-o b/{shard}.jpg.tar --chunk 1/3") + run("-o b/{shard}.jpg.tar --chunk 3/3"), 3);
    assert!(files(&at.join("b")) == whole);
    // The broken object alone is tried again, unless the ledger says that it is broken.
    for (flags, tried) in [("", 1), ("--ledger l", 1), ("--ledger l --no-retry", 0)] {
        let line = format!("{line} -o a/{{shard}}.jpg.tar --resume --progress json {flags}");
        let messages = String::from_utf8(blinn(&at, &line.replace(" -q", "")).stderr).unwrap();
        let count = |event: &str| messages.matches(&format!("\"event\":\"{event}\"")).count();
        assert_eq!((count("wrote"), count("failed")), (0, tried), "{flags}: {messages}");
        assert!(messages.contains(&format!("\"scenes\":{tried},")), "{flags}: {messages}");
    }
    assert!(files(&at.join("a")) == whole);
    // A missing, a torn and an outdated one.
    fs::remove_file(at.join("a/3.jpg.tar")).unwrap();
    fs::write(at.join("a/0.jpg.tar"), &whole["0.jpg.tar"][..1000]).unwrap();
    fs::write(at.join("objects/o4.x.obj"), "v 0 0 0\nv 9 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert_eq!(run("-o a/{shard}.jpg.tar --resume"), 3);
    assert_eq!(run("-o c/{shard}.jpg.tar"), 4);
    assert!(files(&at.join("a")) == files(&at.join("c")));
    assert!(files(&at.join("a")) != whole);
    // The broken object is repaired.
    fs::write(at.join("objects/o3.x.obj"), "v 0 0 0\nv 3 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert_eq!((run("-o a/{shard}.jpg.tar --resume"), run("-o d/{shard}.jpg.tar")), (1, 4));
    assert!(files(&at.join("a")) == files(&at.join("d")));
    let resumed = blinn(&at, &format!("{line} -o a/{{shard}}.jpg.tar --resume").replace(" -q", ""));
    assert!(String::from_utf8_lossy(&resumed.stderr).contains("kept a/0.jpg.tar\n"));
}

/// A ledger knows archives by their names: images of the same names in another folder are others.
#[test]
fn a_ledger_does_not_keep_archives_of_another_folder() {
    let (_dir, at) = folder();
    write_objects(&at);
    fs::remove_file(at.join("objects/o3.x.obj")).unwrap();
    let run = |flags: &str| runs(&at, &format!("render objects -s 1 --shard-size 3 {flags}"));
    run("--size 16x12 -o b/{shard}.tar");
    run("--size 32x24 -o a/{shard}.tar --ledger l");
    let messages = run("--size 32x24 -o b/{shard}.tar --resume --ledger l");
    assert_eq!(messages.matches("wrote b/").count(), 2, "{messages}");
    assert!(files(&at.join("a")) == files(&at.join("b")));
    // Each folder is known from now on, and no archive is opened.
    for folder in ["a", "b"] {
        for file in files(&at.join(folder)).into_keys() {
            spoil(&at.join(folder).join(file));
        }
        let messages = run(&format!("--size 32x24 -o {folder}/{{shard}}.tar --resume --ledger l"));
        assert_eq!(messages.matches(&format!("kept {folder}/")).count(), 2, "{messages}");
    }
}

/// Archives that were rendered without a warning are current for all, and those that may have had one are not for `--strict`.
#[test]
fn strict_archives_are_kept_without_strict() {
    let (_dir, at) = folder();
    fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let run = |file: &str, flags: &str| {
        let line = format!("render a.obj --size 16x12 -s 1 --resume -o {file}{{shard}}.tar {flags}");
        let messages = String::from_utf8(blinn(&at, &line).stderr).unwrap();
        ["wrote", "kept"].map(|word| messages.contains(&format!("{word} {file}0.tar\n")))
    };
    assert_eq!(run("strict", "--strict"), [true, false]);
    assert_eq!((run("strict", "--strict"), run("strict", "")), ([false, true], [false, true]));
    assert_eq!((run("any", ""), run("any", "--strict")), ([true, false], [true, false]));
}

/// Archives of limited bytes hold the same samples as others, in order, as many whole scenes as fit.
#[test]
fn archives_of_limited_bytes_are_filled_in_order() {
    let (_dir, at) = folder();
    write_objects(&at);
    let line = format!("render objects --frames 1-2 {SMALL}").replace(" -q", "");
    let run = |flags: &str| {
        let output = blinn(&at, &format!("{line} {flags}"));
        String::from_utf8(output.stderr).unwrap().matches("wrote ").count()
    };
    let samples = |folder: &str| -> Vec<Vec<(String, Vec<u8>)>> {
        let files = files(&at.join(folder)).into_keys();
        files.map(|name| members(&at.join(folder).join(name))).collect()
    };
    let bytes = |members: &[(String, Vec<u8>)]| -> u64 {
        members.iter().map(|(_, bytes)| 512 + 512 * (bytes.len() as u64).div_ceil(512)).sum()
    };
    assert_eq!(run("-o one/{shard}.tar"), 1);
    let all = samples("one").concat();
    let scene = |name: &str| name[..8].to_string();
    let of_scene = |number: &str| {
        let all: Vec<_> = all.iter().filter(|(name, _)| scene(name) == number).cloned().collect();
        bytes(&all)
    };
    // Two scenes fit, three do not.
    let limit = 2 * ["00000001", "00000002", "00000003"].map(of_scene).into_iter().max().unwrap() + 512;
    assert_eq!(run(&format!("--shard-size {limit}B -o a/{{shard}}.tar")), 3);
    let archives = samples("a");
    assert!(archives.concat() == all && archives.iter().all(|members| bytes(members) <= limit));
    for pair in archives.windows(2) {
        assert_ne!(scene(&pair[0].last().unwrap().0), scene(&pair[1][0].0), "scenes are whole");
        assert!(bytes(&pair[0]) + of_scene(&scene(&pair[1][0].0)) > limit, "the next scene does not fit");
    }
    let whole = files(&at.join("a"));
    assert_eq!(run(&format!("--shard-size {limit}B -o b/{{shard}}.tar --threads 1 --ledger l")), 3);
    assert!(files(&at.join("b")) == whole);
    // The broken scene is tried again, unless the ledger has it.
    let resume = format!("--shard-size {limit}B -o b/{{shard}}.tar --resume --ledger l");
    assert_eq!(run(&format!("{resume} --no-retry")), 0);
    assert_eq!(run(&resume), 0);
    assert!(files(&at.join("b")) == whole);
    // A missing archive is made again.
    fs::remove_file(at.join("b/1.tar")).unwrap();
    assert_eq!(run(&format!("{resume} --no-retry")), 1);
    assert!(files(&at.join("b")) == whole);
    // It is repaired: archives are those of an undisturbed run, and only its images are rendered.
    let broken = fs::read(at.join("objects/o3.x.obj")).unwrap();
    fs::write(at.join("objects/o3.x.obj"), "v 0 0 0\nv 3 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let messages = blinn(&at, &format!("{line} {resume}")).stderr;
    let messages = String::from_utf8(messages).unwrap();
    assert!(messages.contains("scenes: 7: 1 done, 6 done before;"), "{messages}");
    run(&format!("--shard-size {limit}B -o d/{{shard}}.tar"));
    assert!(files(&at.join("b")) == files(&at.join("d")) && files(&at.join("b")) != whole);
    // Broken again, its images stay, as images in files do.
    fs::write(at.join("objects/o3.x.obj"), broken).unwrap();
    assert_eq!(run(&resume), 0);
    assert!(files(&at.join("b")) == files(&at.join("d")));
    fs::remove_dir_all(at.join("b")).unwrap();
    assert_eq!(run(&format!("{resume} --no-retry")), 3);
    assert!(files(&at.join("b")) == whole);
    // Larger and smaller archives are made of the same images.
    for factor in [3, 1] {
        let limit = factor * limit;
        run(&format!("--shard-size {limit}B -o e{factor}/{{shard}}.tar"));
        let resumed =
            format!("{line} --shard-size {limit}B -o b/{{shard}}.tar --resume --no-retry --ledger l");
        let messages = String::from_utf8(blinn(&at, &resumed).stderr).unwrap();
        assert!(messages.contains(": 0 done, 6 done before, 1 failed before;"), "{messages}");
        files(&at.join(format!("e{factor}"))).into_iter().for_each(|(name, bytes)| {
            assert!(fs::read(at.join("b").join(&name)).unwrap() == bytes, "{factor}: {name}");
        });
    }
    // Another limit divides anew, and a scene that is larger has an archive of its own.
    let small = "--shard-size 1B -o b/{shard}.tar --resume --ledger l --no-retry";
    assert_eq!(run(small), 6);
    assert_eq!(run("--shard-size 1B -o c/{shard}.tar"), 6);
    assert!(files(&at.join("b")) == files(&at.join("c")));
    refused(
        &at,
        "render objects --chunk 1/2 --shard-size 1MB -o {shard}.tar",
        "depends on all scenes before",
    );
    refused(&at, "render objects --dry-run --shard-size 1MB -o {shard}.tar", "are not known before");
}

/// Images of an earlier run are copied, so that their scenes cannot fail, and few files are open, however many scenes are
/// rendered.
#[cfg(unix)]
#[test]
fn complete_images_outlast_errors_of_the_machine() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("objects")).unwrap();
    let write = |i: usize, is_broken: bool| {
        let face = if is_broken { "f 1 2 9" } else { "f 1 2 3" };
        let text = format!("v 0 0 0\nv {} 0 0\nv 0 {} 0\n{face}\n", 1 + i % 5, 1 + i % 7);
        fs::write(at.join(format!("objects/{i:02}.obj")), text).unwrap();
    };
    (0..43).for_each(|i| write(i, i >= 3));
    let line =
        |out: &str| format!("render objects {SMALL} --shard-size 50 --threads 1 -o {out}/{{shard}}.tar");
    assert_eq!(blinn(&at, &line("a")).status.code(), Some(1));
    assert_eq!(members(&at.join("a/0.tar")).len(), 2 * 3);
    (3..43).for_each(|i| write(i, false));
    let limited = format!("ulimit -n 24; exec '{}' {} --resume", env!("CARGO_BIN_EXE_blinn"), line("a"));
    let output = Command::new("bash").args(["-c", &limited]).current_dir(&at).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    runs(&at, &line("b"));
    assert!(files(&at.join("a")) == files(&at.join("b")));
    // A scene that cannot be read any more leaves its images where they are, and others take none of them along.
    fs::remove_file(at.join("objects/00.obj")).unwrap();
    fs::write(at.join("objects/07.obj"), "v 0 0 0\nv 5 0 0\nv 0 5 0\nf 1 2 3\n").unwrap();
    let list: String = (0..43).map(|i| format!("objects/{i:02}.obj\n")).collect();
    fs::write(at.join("list"), list).unwrap();
    let listed = |out: &str| line(out).replace("objects", "@list");
    assert_eq!(blinn(&at, &format!("{} --resume", listed("a"))).status.code(), Some(1));
    assert_eq!(blinn(&at, &listed("c")).status.code(), Some(1));
    let (kept, new) = (members(&at.join("a/0.tar")), members(&at.join("c/0.tar")));
    assert!(kept[..2] == members(&at.join("b/0.tar"))[..2] && kept[2..] == new[..], "{}", kept.len());
    // Other settings leave nothing of them.
    assert_eq!(blinn(&at, &format!("{} --resume --seed 3", listed("a"))).status.code(), Some(1));
    assert_eq!(blinn(&at, &format!("{} --seed 3", listed("c"))).status.code(), Some(1));
    assert!(files(&at.join("a")) == files(&at.join("c")));
}

/// A ledger that cannot be written is reported once, and archives are written without it, as files are.
#[cfg(unix)]
#[test]
fn archives_outlast_their_ledger() {
    let (_dir, at) = folder();
    write_objects(&at);
    fs::remove_file(at.join("objects/o3.x.obj")).unwrap();
    // Lines of other scenes, up to the largest file.
    let line = |bytes: usize| format!("{:<1$}\n", "{\"scene\":\"other\"}", bytes - 1);
    let ledger = line(1000).repeat(40) + &line(900);
    for out in ["a/{shard}.tar --shard-size 2", "b/{shard}.tar --shard-size 1B", "c/{index}.png"] {
        fs::write(at.join("l"), &ledger).unwrap();
        let line = format!("render objects --size 16x12 -s 1 --threads 1 --resume --ledger l -o {out}");
        let limited = format!("ulimit -f 40; exec '{}' {line}", env!("CARGO_BIN_EXE_blinn"));
        let output = Command::new("bash").args(["-c", &limited]).current_dir(&at).output().unwrap();
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{messages}");
        assert_eq!(messages.matches("--ledger: l cannot be written").count(), 1, "{messages}");
    }
    let counts = ["a", "b", "c"].map(|folder| files(&at.join(folder)).len());
    assert_eq!(counts, [3, 6, 6]);
}

/// Scenes whose images an archive has are noted in the ledger once, in the order of the list. Then no archive is opened.
#[test]
fn kept_archives_are_noted_in_the_ledger() {
    let (_dir, at) = folder();
    write_objects(&at);
    let repaired = "v 0 0 0\nv 3 0 0\nv 0 1 0\nf 1 2 3\n";
    // Numbers of scenes, and whether they are done.
    let ledger = |name: &str| -> Vec<(u64, bool)> {
        let text = fs::read_to_string(at.join(name)).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        lines.map(|line| (line["index"].as_u64().unwrap(), line["status"] == "done")).collect()
    };
    let done = |broken: Option<u64>| (1..=7).map(|i| (i, broken != Some(i))).collect::<Vec<_>>();
    for (i, size) in ["--shard-size 10", "--shard-size 1B"].into_iter().enumerate() {
        write_objects(&at);
        let line =
            |flags: &str| format!("render objects --size 16x12 -s 1 {size} -o {i}/{{shard}}.tar {flags}");
        blinn(&at, &line(""));
        let name = format!("{i}.jsonl");
        let resumed = line(&format!("--resume --ledger {name}"));
        blinn(&at, &resumed);
        assert_eq!(ledger(&name), done(Some(4)), "{size}");
        // Only the scene that failed is tried and noted again.
        blinn(&at, &resumed);
        assert_eq!(ledger(&name)[7..], [(4, false)], "{size}");
        blinn(&at, &format!("{resumed} --no-retry"));
        assert_eq!(ledger(&name).len(), 8, "{size}");
        // The repaired scene stands between others without a ledger.
        fs::write(at.join("objects/o3.x.obj"), repaired).unwrap();
        fs::remove_file(at.join(&name)).unwrap();
        let messages = runs(&at, &resumed);
        assert!(messages.contains("scenes: 7: 1 done, 6 done before; images: 1, 6 kept;"), "{messages}");
        assert_eq!(ledger(&name), done(None), "{size}");
        if i == 0 {
            spoil(&at.join("0/0.tar"));
            assert!(runs(&at, &resumed).contains("kept 0/0.tar"));
        }
    }
}

/// On a full disk, all scenes are counted: those in archives, those of the archive that is not written, and the others.
#[cfg(target_os = "linux")]
#[test]
fn scenes_of_an_archive_that_is_not_written_are_not_done() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("objects")).unwrap();
    for i in 0..12 {
        let text = format!("v 0 0 0\nv {} 0 0\nv 0 {} 0\nf 1 2 3\n", 1 + i % 5, 1 + i % 7);
        fs::write(at.join(format!("objects/{i:02}.obj")), text).unwrap();
    }
    // Two scenes in each archive.
    for (i, size) in ["2", "4100B"].into_iter().enumerate() {
        for (full, not_written, not_started) in [(2, 2, ", 6 not started"), (5, 2, "")] {
            let run = |flags: &str| {
                let line =
                    format!("render objects --size 16x12 -s 1 --shard-size {size} -o {i}/{{shard}}.tar");
                let output = blinn(&at, &format!("{line} {flags}"));
                (output.status.code(), String::from_utf8(output.stderr).unwrap())
            };
            let _ = fs::remove_dir_all(at.join(i.to_string()));
            fs::create_dir(at.join(i.to_string())).unwrap();
            let file = at.join(format!("{i}/{full}.tar"));
            std::os::unix::fs::symlink("/dev/full", &file).unwrap();
            let (code, messages) = run("");
            assert_eq!((code, messages.matches("wrote ").count()), (Some(1), full), "{messages}");
            let line = format!("blinn: {not_written} of 12 scenes not written{not_started}\n");
            assert!(messages.ends_with(&line), "{messages}");
            let (_, messages) = run("--ledger l");
            let done = 2 * full;
            let line =
                format!("scenes: 12: {done} done, {not_written} not written{not_started}; images: {done};");
            assert!(messages.contains(&line), "{messages}");
            assert_eq!(fs::read_to_string(at.join("l")).unwrap().lines().count(), done);
            let (_, messages) = run("--progress json");
            let event = messages.lines().find(|line| line.contains("\"done\"")).unwrap();
            let event: Value = serde_json::from_str(event).unwrap();
            let counts = ["scenes", "failed", "left"].map(|name| event[name].as_u64().unwrap() as usize);
            assert_eq!(counts, [12, 0, 12 - done], "{messages}");
            // The others are rendered later.
            fs::remove_file(&file).unwrap();
            let (code, messages) = run("--resume --ledger l");
            assert_eq!((code, messages.matches("wrote ").count()), (Some(0), 6 - full), "{messages}");
            // The run without a ledger has replaced the archives. Lines of archives of a number of scenes have a version: these
            // scenes are noted again.
            let noted_again = if size == "2" { done } else { 0 };
            assert_eq!(fs::read_to_string(at.join("l")).unwrap().lines().count(), 12 + noted_again);
        }
    }
}

/// A run that is killed leaves complete archives only.
#[cfg(unix)]
#[test]
fn a_killed_run_of_archives_is_resumed() {
    let (_dir, at) = folder();
    write_objects(&at);
    let line = |out: &str| {
        format!(
            "turntable objects --views 4 --size 64x48 -s 16 -q --shard-size 8 --resume --ledger {out}.jsonl -o {out}/{{shard:02}}.tar"
        )
    };
    blinn(&at, &line("whole"));
    kill_repeatedly(&at, &line("killed"));
    assert_eq!(blinn(&at, &line("killed")).status.code(), Some(1));
    let whole = files(&at.join("whole"));
    assert_eq!(whole.len(), 4);
    assert!(files(&at.join("killed")) == whole);
}

#[test]
fn wrong_names_of_archives_are_refused() {
    let (_dir, at) = folder();
    write_objects(&at);
    for (flags, message) in [
        ("render objects -o a.tar", "put {shard:05} into the name"),
        ("render objects -o {stem}-{shard}.tar", "no other placeholder than {shard}"),
        ("render objects -o {shard}.gif.tar", "an archive holds images"),
        ("render objects -o {shard}.xyz.tar", "unknown format"),
        ("render objects -o a.png --shard-size 5", "--shard-size applies only to archives"),
        ("render objects --frames -o {shard}.tar", "the number of frames of each scene must be known"),
        ("render objects -o {shard}.tar --report a.html", "--report"),
        ("turntable objects/o1.x.obj --chunk 1/2 -o {shard}.tar", "all frames of a scene are in one archive"),
    ] {
        refused(&at, flags, message);
    }
    let dry = blinn(&at, &format!("render objects {SMALL} --shard-size 3 --dry-run -o {{shard}}.tar")).stdout;
    assert_eq!(String::from_utf8(dry).unwrap(), "0.tar\n1.tar\n2.tar\n");
}

/// Each sample has COCO's annotations of its image, those of the same dataset as files.
#[test]
fn samples_have_annotations() {
    let (_dir, at) = folder();
    let (cube, tower) = (model("tests/cube.obj"), model("tower/tower.glb"));
    let line = format!("turntable {cube} {tower} --views 2 --size 48x36 -s 1 -q --dataset coco");
    runs(&at, &format!("{line} -o s/{{shard}}.tar"));
    runs(&at, &format!("{line} -o f/{{stem}}/#.png"));
    let parsed = |bytes: &[u8]| -> Value { serde_json::from_slice(bytes).unwrap() };
    let whole = ["cube", "tower"]
        .map(|stem| parsed(&fs::read(at.join(format!("f/{stem}/annotations.json"))).unwrap()));
    let members = members(&at.join("s/0.tar"));
    let keys: Vec<&str> = members.iter().map(|(name, _)| name.split_once('.').unwrap().0).collect();
    let mut distinct = keys.clone();
    distinct.dedup();
    assert_eq!(distinct.len(), 4, "the files of a sample stand together");
    let samples: Vec<_> = members.iter().filter(|(name, _)| name.ends_with(".coco.json")).collect();
    assert_eq!(samples.len(), 4);
    for (i, (name, bytes)) in samples.into_iter().enumerate() {
        let (sample, whole, view) = (parsed(bytes), &whole[i / 2], i % 2 + 1);
        let image = &sample["images"][0];
        assert_eq!(image["file_name"], name.replace("coco.json", "png"));
        assert_eq!(image["id"], i + 1, "ids count through all scenes");
        assert_eq!(sample["categories"], whole["categories"]);
        let own: Vec<&Value> =
            whole["annotations"].as_array().unwrap().iter().filter(|a| a["image_id"] == view).collect();
        let annotations = sample["annotations"].as_array().unwrap();
        assert!(!own.is_empty() && annotations.len() == own.len());
        for (annotation, own) in annotations.iter().zip(own) {
            for member in ["segmentation", "amodal_segmentation", "bbox", "category_id", "object_id", "name"]
            {
                assert_eq!(annotation[member], own[member], "{member}");
            }
            assert_eq!(annotation["image_id"], i + 1);
        }
    }
    // Archives without the annotations, or with others, are not up to date.
    let resumed = |formats: &str| {
        let line = line.replace(" -q", "").replace("coco", formats);
        runs(&at, &format!("{line} -o s/{{shard}}.tar --resume"))
    };
    assert!(resumed("coco").contains("kept s/0.tar"));
    assert!(resumed("coco-polygons").contains("wrote s/0.tar"));
    assert!(resumed("nerf").contains("wrote s/0.tar"));
    refused(&at, &format!("{line},colmap -o s/{{shard}}.tar"), "use --dataset nerf,coco,bop");
}
