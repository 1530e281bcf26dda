//! Threads, memory and files after viewers and the server have gone.
#![cfg(target_os = "linux")]

use std::time::{Duration, Instant};

use super::Server;
use crate::common::program::*;

/// A field of /proc/PID/status.
fn status(server: &Server, field: &str) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{}/status", server.child.id())).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(field)).unwrap();
    line.trim_matches(|c: char| !c.is_ascii_digit()).parse().unwrap()
}

/// Waits until no viewer's thread is left.
fn settled_threads(server: &Server, expected: u64) -> u64 {
    let since = Instant::now();
    loop {
        let threads = status(server, "Threads:");
        if threads <= expected || since.elapsed() > Duration::from_secs(20) {
            return threads;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn threads_and_memory_return_after_100_viewers() {
    let (_dir, dir) = folder();
    let server = Server::start(&dir, &model("figure/figure.glb"));
    let before = status(&server, "Threads:");
    let visit = |count: usize| {
        let mut viewers: Vec<_> = (0..count).map(|_| server.viewer()).collect();
        for viewer in &mut viewers {
            let view = viewer.view();
            viewer.post(&view, [320, 200], false);
        }
        for viewer in &mut viewers {
            viewer.next_frame();
        }
        // Some are gone without a word, in the middle of their picture.
    };
    // The allocator's and the renderer's own buffers.
    visit(25);
    assert_eq!(settled_threads(&server, before), before);
    let memory = status(&server, "VmRSS:");
    for _ in 0..4 {
        visit(25);
    }
    assert_eq!(settled_threads(&server, before), before);
    let after = status(&server, "VmRSS:");
    assert!(after < memory + (24 << 10), "{memory} KiB before, {after} KiB after");
}

/// Ctrl-C ends the server, with viewers and without.
#[test]
fn an_interrupt_ends_the_server() {
    for viewers in [0, 2].into_iter().filter(|_| heeds("-INT")) {
        let (_dir, dir) = folder();
        let mut server = Server::start(&dir, &model("tests/cube.obj"));
        let _viewers: Vec<_> = (0..viewers).map(|_| server.viewer()).collect();
        let pid = server.child.id().to_string();
        assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
        assert_eq!(server.child.wait().unwrap().code(), Some(130));
        assert!(names(&dir).is_empty());
    }
}
