//! The programs in docs/examples work as documented.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs an example. Cargo builds examples before it runs all tests, beside the test programs' folder.
fn example(name: &str, words: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_blinn")).parent().unwrap();
    let program: PathBuf = folder.join("examples").join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let root = env!("CARGO_MANIFEST_DIR");
    let output = Command::new(&program).args(words).current_dir(root).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e} (cargo build --examples)", program.display()));
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_memory_example_prints_pixels() {
    let messages = example("memory", &["models/textured/textured.glb"]);
    assert!(messages.starts_with("320x240 pixels, "), "{messages}");
    let covered: usize = messages.split(' ').nth(2).unwrap().parse().unwrap();
    assert!(covered > 10_000, "{messages}");
}

#[test]
fn a_camera_path_renders_eight_different_images() {
    let folder = tempfile::tempdir().unwrap();
    let messages = example("camera_path", &["models/lecture/lecture.glb", folder.path().to_str().unwrap()]);
    assert_eq!(messages.lines().count(), 8, "{messages}");
    let mut pictures: Vec<Vec<u8>> =
        std::fs::read_dir(&folder).unwrap().map(|e| std::fs::read(e.unwrap().path()).unwrap()).collect();
    pictures.sort();
    pictures.dedup();
    assert_eq!(pictures.len(), 8);
}

#[test]
fn the_layers_example_prints_values() {
    let messages = example("layers", &["models/cornell/cornell.glb"]);
    let lines: Vec<&str> = messages.lines().collect();
    assert_eq!(lines.len(), 3, "{messages}");
    let numbers = |line: &str| -> Vec<f32> {
        let list = line.split_once('[').unwrap().1.trim_end_matches(']');
        list.split(", ").map(|n| n.parse().unwrap()).collect()
    };
    assert!(numbers(lines[0])[0] > 0.1, "{messages}");
    let length: f32 = numbers(lines[1]).iter().map(|x| x * x).sum();
    assert!((length - 1.0).abs() < 1e-5, "{messages}");
    assert!(numbers(lines[2])[0] >= 1.0, "{messages}");
}

#[test]
fn the_progress_example_cancels_half_way() {
    let messages = example("progress", &["models/still-life/still-life.glb"]);
    let pixels: u64 =
        messages.trim().strip_prefix("cancelled after ").unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((480 * 320 / 2..480 * 320).contains(&pixels), "{messages}");
}

/// Heights are within the scene's bounds.
#[test]
fn the_rays_example_prints_heights() {
    let messages = example("rays", &["models/tower/tower.glb"]);
    assert_eq!(messages.lines().count(), 25, "{messages}");
    let scene = crate::common::load_model("tower/tower.glb");
    let posed = blinn::scene::pose(&scene, &Default::default()).unwrap();
    let bounds = posed.bounds();
    let heights: Vec<f64> = messages
        .lines()
        .filter_map(|line| line.split_once("height ")?.1.split_once(" m")?.0.parse().ok())
        .collect();
    assert!(heights.len() > 3, "{messages}");
    assert!(heights.iter().all(|y| (bounds.min.y - 0.01..=bounds.max.y + 0.01).contains(y)), "{messages}");
    assert!(messages.contains(&scene.objects[0]), "{messages}");
}
