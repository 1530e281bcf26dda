//! `blinn render --watch`.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Stdio};

use crate::common::program::*;

/// A running watch, which ends with the test.
struct Watch {
    child: Child,
    lines: BufReader<ChildStderr>,
}

impl Watch {
    /// The messages up to the one that it waits for changes.
    fn messages(&mut self) -> String {
        let mut all = String::new();
        loop {
            let mut line = String::new();
            assert!(self.lines.read_line(&mut line).unwrap() > 0, "it ended: {all}");
            if line.contains("watching") {
                return all + &line;
            }
            all += &line;
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Changes of the scene, of a file that it uses and of one that a flag names are rendered; errors are reported, and the
/// next change is rendered again.
#[test]
fn each_change_is_rendered() {
    let (_dir, dir) = folder();
    let at = |name: &str| dir.join(name);
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    let cube: String =
        cube.lines().filter(|line| line.starts_with(['v', 'f'])).map(|line| format!("{line}\n")).collect();
    let scene = format!("mtllib a.mtl\nusemtl m\n{cube}");
    fs::write(at("a.obj"), &scene).unwrap();
    fs::write(at("a.mtl"), "newmtl m\nKd 1 0 0\n").unwrap();
    let camera = |view_point: &str| fs::read_to_string(model("lecture/view-1.xml")).unwrap() + view_point;
    fs::write(at("camera.xml"), camera("")).unwrap();
    let look = "a.obj --size 40x30 -s 1 --camera-xml camera.xml";
    let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(format!("render {look} --watch").split(' '))
        .current_dir(&dir)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap());
    let mut watch = Watch { child, lines };
    let messages = watch.messages();
    assert!(messages.contains("wrote a.png") && messages.contains("watching 3 files"), "{messages}");
    let expected = || {
        runs(&dir, &format!("render {look} -o expected.png -q"));
        fs::read(at("expected.png")).unwrap()
    };
    let red = fs::read(at("a.png")).unwrap();
    assert!(red == expected());

    fs::write(at("a.mtl"), "newmtl m\nKd 0 0 1\n").unwrap();
    watch.messages();
    let blue = fs::read(at("a.png")).unwrap();
    assert!(blue == expected() && blue != red);

    fs::write(at("camera.xml"), "<camera>").unwrap();
    let mut line = String::new();
    watch.lines.read_line(&mut line).unwrap();
    assert!(line.contains("--camera-xml"), "{line}");
    fs::write(at("camera.xml"), camera("\n")).unwrap();
    watch.messages();

    fs::remove_file(at("a.obj")).unwrap();
    let messages = watch.messages();
    assert!(messages.contains("blinn: ") && messages.contains("a.obj"), "{messages}");
    assert!(fs::read(at("a.png")).unwrap() == blue, "the old picture stays");
    fs::write(at("new.obj"), scene.replace("usemtl m\n", "")).unwrap();
    fs::rename(at("new.obj"), at("a.obj")).unwrap();
    watch.messages();
    let grey = fs::read(at("a.png")).unwrap();
    assert!(grey == expected() && grey != blue);
}

#[test]
fn what_is_read_or_written_once_is_refused() {
    let (_dir, dir) = folder();
    let cube = model("tests/cube.obj");
    for (line, message) in [
        (format!("render {cube} {cube} --watch -o {{index}}.png"), "one scene"),
        (format!("render {cube} --watch --resume"), "--resume"),
        (format!("render {cube} --watch --no-overwrite"), "--no-overwrite"),
        (format!("render {cube} --watch --ledger l"), "--ledger"),
        (format!("render {cube} --watch --dry-run"), "--dry-run"),
        (format!("render {cube} --watch -o -"), "standard output"),
        (format!("render {cube} --watch -o {{shard}}.tar"), "archive"),
        ("render - --watch -o a.png".into(), "standard input"),
        (format!("job slurm render {cube} --frames 1-3 --watch -o out/"), "--watch"),
        (format!("turntable {cube} --watch"), "--watch"),
    ] {
        refused(&dir, &line, message);
    }
}
