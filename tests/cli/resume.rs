//! `--resume`: finished pictures are kept, everything else is rendered again.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use crate::common::program::*;

const SMALL: &str = "--size 32x18 -s 1";

/// Pictures of every format are kept while their inputs and settings are unchanged.
#[test]
fn resume_keeps_images_until_an_input_changes() {
    let (_dir, at) = folder();
    for name in [
        "textured.gltf",
        "textured.bin",
        "planks.png",
        "tin base.png",
        "tin_metal_rough.png",
        "tin_normal.png",
    ] {
        fs::copy(model(&format!("textured/{name}")), at.join(name)).unwrap();
    }
    for out in ["o/a#.png", "o/b#.exr", "o/c#.jpg", "o/d#.webp"] {
        let layers = if out.ends_with("exr") { "" } else { "--aov depth,cryptomatte" };
        let line = format!("turntable textured.gltf {SMALL} --count 2 {layers} -o {out} --resume");
        let wrote = |flags: &str| runs(&at, &format!("{line} {flags}")).matches("wrote ").count();
        let each = if layers.is_empty() { 1 } else { 4 };
        assert_eq!(wrote(""), 2 * each, "{out}");
        let whole = files(&at.join("o"));
        assert_eq!(wrote("--threads 1 -v --progress plain"), 0, "{out}");
        assert_eq!(wrote("--only 2"), 0, "{out}");
        // Only missing and broken pictures are rendered again.
        let first = at.join(out.replace('#', "1"));
        fs::write(&first, &fs::read(&first).unwrap()[..200]).unwrap();
        assert_eq!(wrote(""), each, "{out}");
        if !layers.is_empty() {
            fs::remove_file(first.with_extension("depth.png")).unwrap();
            assert_eq!(wrote(""), each, "{out}");
        }
        assert!(files(&at.join("o")) == whole, "{out}");
        assert_eq!(wrote("--seed 5"), 2 * each, "{out}: another setting");
        assert_eq!(wrote("--start 10"), 2 * each, "{out}: other angles");
    }
    // A changed texture, a missing one, and one that is back.
    let line = format!("render textured.gltf {SMALL} -o t.png --resume");
    let wrote = || runs(&at, &line).contains("wrote t.png");
    assert!(wrote() && !wrote());
    let planks = fs::read(at.join("planks.png")).unwrap();
    fs::copy(at.join("tin base.png"), at.join("planks.png")).unwrap();
    assert!(wrote() && !wrote());
    fs::remove_file(at.join("planks.png")).unwrap();
    assert!(wrote() && !wrote());
    // One that appears in a texture folder, which did not exist before.
    fs::create_dir(at.join("textures")).unwrap();
    assert!(wrote() && !wrote());
    fs::write(at.join("textures/planks.png"), &planks).unwrap();
    assert!(wrote() && !wrote());
    fs::write(at.join("planks.png"), planks).unwrap();
    assert!(wrote() && !wrote());
    refused(&at, &format!("{line} --no-overwrite"), "--no-overwrite");
}

/// Pipes in place of files are reported and never read: those that a scene refers to and those that a
/// picture's stamp does.
#[cfg(unix)]
#[test]
fn pipes_instead_of_files_do_not_block() {
    let (_dir, at) = folder();
    let pipe = |name: &str| {
        assert!(Command::new("mkfifo").arg(at.join(name)).status().unwrap().success());
    };
    pipe("pipe.png");
    pipe("pipe.mtl");
    fs::write(at.join("map.mtl"), "newmtl a\nmap_Kd pipe.png\n").unwrap();
    for (scene, library) in [("a.obj", "pipe.mtl"), ("b.obj", "map.mtl")] {
        let text = format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
        fs::write(at.join(scene), text).unwrap();
    }
    let run = |line: &str| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line.split_whitespace())
            .current_dir(&at)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        for _ in 0..600 {
            if child.try_wait().unwrap().is_some() {
                return String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        child.kill().unwrap();
        panic!("{line}: it waits");
    };
    let line = format!("render a.obj b.obj {SMALL} --resume");
    let messages = run(&line);
    assert_eq!(messages.matches("not a regular file").count(), 2, "{messages}");
    assert_eq!(messages.matches("wrote ").count(), 2, "{messages}");
    assert!(!run(&line).contains("wrote "), "what cannot be read is still the same");
    // In place of an MTL file, and of the picture itself: its stamp is not read, and the picture is written
    // into the pipe.
    fs::remove_file(at.join("map.mtl")).unwrap();
    pipe("map.mtl");
    fs::remove_file(at.join("a.png")).unwrap();
    pipe("a.png");
    let reader = std::thread::spawn({
        let pipe = at.join("a.png");
        move || fs::read(pipe).unwrap()
    });
    assert!(run(&line).contains("wrote b.png"));
    assert!(reader.join().unwrap().starts_with(b"\x89PNG"));
}

/// File names that are not UTF-8 are told apart.
#[cfg(target_os = "linux")]
#[test]
fn resume_distinguishes_names_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let (_dir, at) = folder();
    let name = std::ffi::OsStr::from_bytes(b"m\xff.glb");
    let wrote = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
        let line = format!("{SMALL} --resume -o m.png");
        let output = command.arg("render").arg(name).args(line.split(' ')).current_dir(&at).output().unwrap();
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).contains("wrote m.png")
    };
    fs::copy(model("tests/triangle.glb"), at.join(name)).unwrap();
    assert!(wrote() && !wrote());
    fs::copy(model("tests/quad_nonindexed.glb"), at.join(name)).unwrap();
    assert!(wrote() && !wrote());
}

/// A picture with warnings is rendered again under `--strict`.
#[test]
fn strict_does_not_keep_images_made_with_a_warning() {
    let (_dir, at) = folder();
    fs::write(at.join("a.obj"), "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let line = format!("render a.obj {SMALL} --resume");
    assert!(runs(&at, &line).contains("warning"));
    let output = blinn(&at, &format!("{line} --strict"));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && messages.contains("gone.mtl"), "{messages}");
    // A picture without warnings serves with and without `--strict`.
    fs::write(at.join("gone.mtl"), "newmtl a\n").unwrap();
    assert!(runs(&at, &format!("{line} --strict")).contains("wrote"));
    for flag in ["--strict", ""] {
        assert!(!runs(&at, &format!("{line} {flag}")).contains("wrote"), "{flag}");
    }
}

/// Blocks that a disk never wrote are zeros, in a file of the right length.
#[test]
fn damaged_images_are_rendered_again() {
    let (_dir, at) = folder();
    let scene = model("tests/cube.obj");
    for extension in ["png", "jpg", "webp", "exr"] {
        let line =
            format!("turntable {scene} --count 3 --size 48x48 -s 1 --resume -o {extension}/#.{extension}");
        runs(&at, &line);
        let file = at.join(format!("{extension}/2.{extension}"));
        let good = fs::read(&file).unwrap();
        for at_byte in [good.len() / 2, good.len() * 2 / 3] {
            let mut hole = good.clone();
            hole[at_byte..at_byte + 24].fill(0);
            fs::write(&file, &hole).unwrap();
            assert!(hole == good || runs(&at, &line).contains("kept 2 of"), "{extension} at {at_byte}");
            assert!(fs::read(&file).unwrap() == good, "{extension} at {at_byte}");
        }
        assert!(runs(&at, &line).contains("kept 3 of"), "{extension}");
    }
}

/// A job that is killed several times ends with the same files as an undisturbed one.
#[cfg(unix)]
#[test]
fn a_killed_render_is_resumed() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let line =
        |out: &str| format!("turntable {scene} --size 64x36 -s 4 --count 12 --resume -q -o {out}/#.png");
    runs(&at, &line("whole"));
    for i in 0..8 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line("killed").split_whitespace())
            .current_dir(&at)
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(10 + 23 * i));
        let _ = child.kill();
        child.wait().unwrap();
        for name in names(&at).iter().filter(|n| n.starts_with("killed/") && n.ends_with(".png")) {
            image::open(at.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
    runs(&at, &line("killed"));
    let finished: BTreeMap<_, _> =
        files(&at.join("killed")).into_iter().filter(|(name, _)| name.ends_with(".png")).collect();
    assert!(finished == files(&at.join("whole")));
}
