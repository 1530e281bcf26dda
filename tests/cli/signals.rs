//! Interrupted and ignored signals while a picture is rendered.
#![cfg(unix)]

use std::io::BufRead;
use std::path::Path;
use std::process::Command;

use crate::common::program::*;

/// Starts a render of some seconds by the shell command `line`, in which `$BLINN` stands for it.
fn long_render(folder: &Path, line: &str) -> std::process::Child {
    let scene = model("still-life/still-life.glb");
    let look = "--size 160x90 -s 2048 -o a.png --progress plain";
    let render = format!("'{}' render '{}' {look}", env!("CARGO_BIN_EXE_blinn"), scene);
    Command::new("sh")
        .args(["-c", &line.replace("$BLINN", &render)])
        .current_dir(folder)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits for the first progress message.
fn is_rendering(child: &mut std::process::Child) {
    let messages = std::io::BufReader::new(child.stderr.as_mut().unwrap());
    assert!(messages.lines().any(|line| line.unwrap().contains('%')), "it ended");
}

fn send(signal: &str, child: &std::process::Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// An interrupted render leaves no files, and the exit code names the signal.
#[test]
fn an_interrupted_render_leaves_nothing() {
    let signals = [("-HUP", 129), ("-INT", 130), ("-TERM", 143)];
    for (signal, code) in signals.into_iter().filter(|(signal, _)| heeds(signal)) {
        let dir = tempfile::tempdir().unwrap();
        let mut child = long_render(dir.path(), "exec $BLINN");
        is_rendering(&mut child);
        send(signal, &child);
        let messages = std::io::read_to_string(child.stderr.as_mut().unwrap()).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert!(
            messages.lines().all(|line| !line.is_empty()) && messages.contains("blinn: "),
            "{messages:?}"
        );
        assert!(names(dir.path()).is_empty());
    }
}

/// Ignored signals stay ignored: `nohup` jobs outlive their terminal, and background jobs of a script its
/// interrupts.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_was_ignored_stays_ignored() {
    let dir = tempfile::tempdir().unwrap();
    let signals = [("-HUP", "-TERM", 143), ("-INT", "-TERM", 143), ("-TERM", "-INT", 130)];
    for (ignored, ends, code) in signals.into_iter().filter(|(_, ends, _)| heeds(ends)) {
        let mut child = long_render(dir.path(), &format!("trap '' {}; exec $BLINN", &ignored[1..]));
        is_rendering(&mut child);
        send(ignored, &child);
        std::thread::sleep(std::time::Duration::from_millis(500));
        assert!(child.try_wait().unwrap().is_none(), "it is still rendering");
        send(ends, &child);
        assert_eq!(child.wait().unwrap().code(), Some(code));
    }
}

/// A signal ends the program at any time, also while it re-executes itself with allocator settings.
#[test]
fn a_signal_during_startup_is_not_lost() {
    let dir = tempfile::tempdir().unwrap();
    for i in 0..60 {
        let mut child = long_render(dir.path(), "exec $BLINN");
        std::thread::sleep(std::time::Duration::from_micros(500 + 100 * i));
        send("-TERM", &child);
        let ended = (0..100).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            child.try_wait().unwrap().is_some()
        });
        let _ = child.kill();
        child.wait().unwrap();
        assert!(ended, "run {i}");
    }
}

/// A benchmark that is interrupted writes the results of its finished rounds.
#[test]
fn an_interrupted_benchmark_keeps_its_rounds() {
    if !heeds("-INT") {
        return;
    }
    let (_dir, at) = folder();
    let line = "bench --size 16x9 --threads 1 --min-time 0.01 --rounds 1000 --stages build --json a.json";
    let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(line.split_whitespace())
        .arg(model("tests/cube.obj"))
        .current_dir(&at)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("round 3 ") {
        line.clear();
        assert!(messages.read_line(&mut line).unwrap() > 0, "it ended");
    }
    send("-INT", &child);
    let rest = std::io::read_to_string(messages).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
    let results: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at.join("a.json")).unwrap()).unwrap();
    let rounds = results["scenes"][0]["stages"][0]["seconds"].as_array().unwrap().len();
    assert!((2..1000).contains(&rounds), "{rounds} rounds");
}
