//! Limits of the process: threads, file sizes, address space, `--max-memory`.

use std::fs;
use std::process::Command;

use crate::common::program::*;

/// Thread creation fails: one line.
#[cfg(target_os = "linux")]
#[test]
fn thread_creation_failure_is_one_line() {
    // The limit applies to every user except root.
    let shell = |line: &str| {
        let id = Command::new("id").arg("-u").output().unwrap().stdout;
        let mut command = match id.as_slice() {
            b"0\n" => {
                let mut command = Command::new("setpriv");
                command.args(["--reuid=65534", "--regid=65534", "--clear-groups", "bash"]);
                command
            }
            _ => Command::new("bash"),
        };
        command.args(["-c", line]).current_dir("/").output()
    };
    let (program, scene) = (env!("CARGO_BIN_EXE_blinn"), model("cornell/cornell.glb"));
    let may = format!("test -x '{program}' && test -r '{}'", scene);
    if !shell(&may).is_ok_and(|output| output.status.success()) {
        return;
    }
    for command in ["render --dry-run", "info"] {
        for most in [1, 2] {
            let line = format!("ulimit -u {most}; exec '{program}' {command} '{}' -q", scene);
            let output = shell(&line).unwrap();
            let messages = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{line}: {messages}");
            assert!(messages.starts_with("blinn: no thread could be started: "), "{line}: {messages}");
            assert_eq!(messages.lines().count(), 1, "{messages}");
        }
    }
}

/// A full disk: one line, and no partial file.
#[cfg(unix)]
#[test]
fn a_full_disk_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let line = format!(
        "ulimit -f 1; exec '{}' render '{}' --size 320x180 -s 1 -q -o a.png",
        env!("CARGO_BIN_EXE_blinn"),
        scene
    );
    let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.lines().count() == 1 && messages.contains("a.png cannot be written"), "{messages}");
    assert!(names(dir.path()).is_empty());
}

/// `--max-memory` covers environment maps, before they are decoded, beside the program and its two threads.
#[test]
fn an_environment_map_is_within_max_memory() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    // Only a header; the pixels would need 192 MiB beside the file.
    let text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2896 +X 5792\n";
    fs::write(dir.path().join("light.hdr"), text).unwrap();
    let needed = (42 << 20) + 2896 * 5792 * 12 + text.len();
    let with = |allowed: usize, message: &str| {
        let (scene, allowed) = (scene.as_str(), allowed.to_string());
        let args = ["render", scene, "--hdri", "light.hdr", "--max-memory", &allowed, "--threads", "2"];
        fails(dir.path(), &args, 2, message);
    };
    with(needed - 1, &format!("bytes of memory: {needed} exceeds the limit of {}", needed - 1));
    with(needed, "the environment map cannot be decoded");
}

/// Memory is limited by the address space, too.
#[cfg(target_os = "linux")]
#[test]
fn ulimit_refuses_a_scene_and_not_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let (one, two) = (model("tests/triangle.glb"), model("cornell/cornell.glb"));
    let line = format!(
        "ulimit -v 3000000; exec '{}' render '{}' '{}' --size 16384x16384 -s 1",
        env!("CARGO_BIN_EXE_blinn"),
        one,
        two
    );
    let output = Command::new("sh").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    // Each scene when it fails, and both in the summary.
    assert_eq!(messages.matches("only 2.9 GiB are available").count(), 4, "{messages}");
}
