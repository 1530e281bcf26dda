//! Exit codes and messages: one line for each thing that can go wrong, and nothing partial left behind.

use std::fs;
use std::process::Command;

use crate::common::program::*;

#[test]
fn a_missing_file_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let messages = String::from_utf8(blinn_args(dir.path(), &["info", "missing.obj"]).stderr).unwrap();
    assert_eq!(messages.matches("No such file").count(), 1, "once: {messages}");
    fails(dir.path(), &["render", "missing.glb"], 1, "missing.glb");
    fails(dir.path(), &["info", "missing.obj"], 1, "missing.obj");
    // A similar name is suggested, and each missing one is named.
    fs::write(dir.path().join("chair.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    for command in ["render", "info"] {
        fails(dir.path(), &[command, "chaer.obj"], 1, "; did you mean 'chair.obj'?");
    }
    let diff = ["diff", "chair.obj", "chaer.obj"];
    fails(dir.path(), &diff, 2, "chaer.obj does not exist; did you mean 'chair.obj'?");
    let both = "x does not exist; chairs.obj does not exist; did you mean 'chair.obj'?";
    fails(dir.path(), &["diff", "x", "chairs.obj"], 2, both);
}

/// Labels for people and for scripts, as the environment asks for.
#[test]
fn messages_are_coloured_where_the_environment_asks_for_it() {
    let dir = tempfile::tempdir().unwrap();
    let messages = |variables: &[(&str, &str)], line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
        command.args(line.split(' ')).current_dir(dir.path()).envs(variables.iter().copied());
        String::from_utf8(command.output().unwrap().stderr).unwrap()
    };
    let force = ("CLICOLOR_FORCE", "1");
    for line in ["render missing.glb", "render --quux", "render missing.glb --size 1x"] {
        assert!(messages(&[], line).starts_with("blinn: "), "{line}");
        assert!(messages(&[force], line).starts_with("\x1b[1;31merror:\x1b[0m "), "{line}");
        assert!(messages(&[force, ("NO_COLOR", "1")], line).starts_with("blinn: "), "{line}");
    }
    let events = messages(&[force], "render missing.glb --progress json");
    assert!(!events.contains('\x1b'), "programs read them: {events}");
    let list = messages(&[force], "render missing.glb lost.obj");
    assert!(list.contains("error:\x1b[0m 2 of 2 scenes failed:\n  missing.glb"), "{list}");
}

#[test]
fn a_corrupt_glb_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let mut bytes = fs::read(model("cornell/cornell.glb")).unwrap();
    // Within the JSON chunk: of a file that ends later, the complete part is read.
    bytes.truncate(200);
    fs::write(dir.path().join("cut.glb"), &bytes).unwrap();
    fails(dir.path(), &["render", "cut.glb", "-o", "a.png"], 1, "cut.glb");
    fs::write(dir.path().join("noise.glb"), [7u8; 300]).unwrap();
    fails(dir.path(), &["render", "noise.glb", "-o", "a.png"], 1, "noise.glb");
}

#[test]
fn an_empty_obj_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("empty.obj"), "# nothing\n").unwrap();
    fails(dir.path(), &["render", "empty.obj", "-o", "a.png"], 1, "empty.obj");
}

#[test]
fn an_output_that_cannot_be_written_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.as_str();
    fs::create_dir(dir.path().join("folder.png")).unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    fails(dir.path(), &["render", scene, "--size", "8x8", "-o", "file/a.png"], 1, "file");
    // An existing folder given as `-o` takes the picture's default name; a folder in place of the picture is
    // an error.
    fs::create_dir_all(dir.path().join("out/cornell.png")).unwrap();
    fails(dir.path(), &["render", scene, "--size", "8x8", "-o", "out/"], 1, "cornell.png");
    assert!(names(&dir.path().join("out/cornell.png")).is_empty());
}

#[test]
fn wrong_command_lines_are_exit_2() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.as_str();
    for (args, message) in [
        (vec!["render"], "SCENE"),
        (vec!["render", scene, "--not-a-flag"], "--not-a-flag"),
        (vec!["render", scene, "--siz", "8x8"], "--siz"),
        (vec!["render", scene, "--size", "8x"], "1280x720"),
        (vec!["render", scene, "-s", "0"], "0"),
        (vec!["render", scene, "-o", "{name}.png"], "unknown placeholder {name}: expected {stem}"),
        (vec!["render", scene, "-o", "a.tiff"], ".png, .exr, .jpg, .webp, .gif"),
        (vec!["render", scene, "-o", "a.jpg", "--no-background"], "JPEG has no transparency"),
        (vec!["render", scene, "-o", "a.jpg", "--depth", "16"], "JPEG has 8 bits"),
        (vec!["render", scene, "-o", "a.webp", "--depth", "16"], "WebP has 8 bits"),
        (
            vec!["render", scene, "-o", "a.webp", "--encoder-quality", "50"],
            "--encoder-quality applies only to .jpg, .mp4 and .html",
        ),
        (vec!["render", scene, "-o", "a.jpg", "--encoder-quality", "0"], "1..=100"),
        (vec!["render", scene, "-o", "-", "--aov", "depth"], "standard output takes one image"),
        (vec!["render", scene, scene, "-o", "a.png"], "{stem}"),
        (vec!["render", scene, "--aov", "depht"], "depht"),
        (vec!["render", scene, "--view-up", "1,2"], "X,Y,Z"),
        (vec!["render", scene, "--view-up", "0,0,0"], "a direction must not be zero"),
        (vec!["render", scene, "--view-dir=-0,0,0"], "a direction must not be zero"),
        (vec!["render", scene, "-o", "a.jpg", "--size", "65536x1"], "JPEG has at most 65535 pixels"),
        (vec!["render", scene, "-o", "a.webp", "--size", "1x16385"], "WebP has at most 16384 pixels"),
        (vec!["render", scene, "--orbit", "10"], "AZIMUTH,ELEVATION"),
        (vec!["render", scene, "--orbit", "10,91"], "±90"),
        (vec!["render", scene, "--orbit", "10,20", "--view-dir", "0,0,1"], "--view-dir"),
        (vec!["render", scene, "--zoom", "0"], "greater than zero"),
        (vec!["render", scene, "--hide", "[a"], "pattern"),
        (vec!["frobnicate"], "frobnicate"),
    ] {
        fails(dir.path(), &args, 2, message);
    }
}

#[test]
fn the_other_scenes_are_rendered_when_one_fails() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let args = ["render", "missing.glb", scene.as_str(), "--size", "8x8", "-q"];
    let output = blinn_args(dir.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.contains("missing.glb") && errors.contains("1 of 2 scenes failed"), "{errors}");
    assert_eq!(names(dir.path()), ["cornell.png"]);
}

#[test]
fn unknown_names_are_exit_1_and_list_known_names() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.as_str();
    fails(dir.path(), &["render", scene, "--camera", "Nobody"], 1, "its cameras are: 0 'Camera'");
    fails(dir.path(), &["render", scene, "--camera", "Camear"], 1, "did you mean 'Camera'?");
    fails(
        dir.path(),
        &["render", scene, "--hide", "Nobody*"],
        1,
        "no node or object matches 'Nobody*'; the file has: '",
    );
    fails(
        dir.path(),
        &["render", scene, "--only-objects", "a/b"],
        1,
        "no node or object matches 'a/b'; the file has: '",
    );
    fails(dir.path(), &["render", scene, "--scene", "Nobody"], 1, "Nobody");
    fails(dir.path(), &["render", scene, "--animation", "Nobody"], 1, "Nobody");
    fails(
        dir.path(),
        &["render", scene, "--variant", "Nobody"],
        1,
        "no material variant 'Nobody'; available: none",
    );
    let obj = model("cornell/cornell.obj");
    fails(dir.path(), &["render", obj.as_str(), "--variant", "Nobody"], 1, "no material variant 'Nobody'");
    let shoe = model("tests/gltf/variants.glb");
    fails(dir.path(), &["info", shoe.as_str(), "--variant", "Nobody"], 1, "'Day', 'Dusk', 'Night'");
}

/// A panic in a decoder, on any thread, fails its scene only.
#[cfg(debug_assertions)]
#[test]
fn a_decoder_panic_fails_only_its_scene() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = ["textured/textured.obj", "tests/cube.obj"].map(model);
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    command.arg("render").args(&scenes).args(["--size", "16x16", "-s", "1"]).current_dir(dir.path());
    let output = command.env("BLINN_TEST_PANIC", "planks.png").output().unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(names(dir.path()), ["cube.png"], "{messages}");
    let of: Vec<&str> = messages.lines().filter(|line| line.contains("textured.obj")).collect();
    assert!(!of.is_empty() && messages.contains("wrote cube.png"), "{messages}");
    for line in of {
        assert!(
            line.contains("please report it with the file: left: 1  right: 2 (src/import/image/mod.rs:"),
            "{messages}"
        );
    }
    assert!(
        !messages.contains("panicked") && !messages.contains("backtrace") && messages.lines().count() <= 4,
        "{messages}"
    );
}

#[test]
fn a_file_of_another_format_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes, message) in [
        ("a.glb", &b"\x89PNG\r\n\x1a\n"[..], "the file is a PNG picture"),
        ("b.gltf", b"hello", "not a glTF file"),
        ("c.glb", b"", "the file is empty"),
    ] {
        fs::write(dir.path().join(name), bytes).unwrap();
        fails(dir.path(), &["render", name], 1, message);
    }
    fails(dir.path(), &["render", "gone.glb", "--dry-run"], 1, "gone.glb: ");
}

/// Names with line breaks and terminal codes change neither lines nor colours; `--print-paths` has them as they are.
#[cfg(unix)]
#[test]
fn names_of_files_stay_on_the_line_of_their_message() {
    let (_dir, at) = folder();
    let name = "a\nb\u{1b}[31m\u{202e}c";
    fs::write(at.join(format!("{name}.obj")), "mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let scene = format!("{name}.obj");
    let args = ["render", &scene, "--size", "8x8", "-s", "1", "--verbose", "--print-paths=null"];
    let output = blinn_args(&at, &args);
    assert_eq!(output.stdout, format!("{name}.png\0").as_bytes());
    let messages = String::from_utf8(output.stderr).unwrap();
    let is_hidden = |c: char| c != '\n' && c.is_control() || c == '\u{202e}';
    assert!(!messages.contains(is_hidden), "{messages:?}");
    assert!(messages.lines().any(|line| line == "wrote a b [31m c.png"), "{messages:?}");
    assert!(
        messages.lines().any(|line| line.starts_with("warning: a b [31m c.obj: MTL 'no.mtl'")),
        "{messages:?}"
    );
}
