//! Replays the fuzz corpus, and thousands of generated inputs that are the same in every run. `just fuzz
//! TARGET` searches for more.

#[path = "../fuzz/targets/mod.rs"]
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use targets::TARGETS;

/// Inputs of a target by name, among them all that once failed.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(target);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut all: Vec<_> = entries
        .map(|entry| {
            let entry = entry.unwrap();
            (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
        })
        .collect();
    all.sort();
    all
}

/// Runs a target on all inputs. Returns how many were accepted, and how many there were.
fn try_all(name: &str, inputs: impl IntoIterator<Item = (String, Vec<u8>)>) -> (usize, usize) {
    let (_, target) = TARGETS.iter().find(|(n, _)| *n == name).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (mut accepted, mut count) = (0, 0);
    for (which, bytes) in inputs {
        let outcome = catch_unwind(AssertUnwindSafe(|| target(&bytes, folder.path())));
        accepted += usize::from(outcome.unwrap_or_else(|_| panic!("{name}: {which} panics")));
        count += 1;
    }
    println!("{name}: {accepted} of {count} got far");
    (accepted, count)
}

#[test]
fn what_was_kept_does_no_harm() {
    let mut size = 0;
    for (name, _) in TARGETS {
        let inputs = corpus(name);
        size += inputs.iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
        let (accepted, count) = try_all(name, inputs);
        assert!(accepted >= 1 && count >= 3, "{name}: {accepted} of {count} got far");
    }
    assert!(size <= 300 << 10, "the corpus has grown to {size} bytes");
}

/// Up to four thousand random bytes (xorshift64*).
fn random(seed: u64) -> Vec<u8> {
    let mut state = (seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        state.wrapping_mul(0x2545_F491_4F6C_DD1D)
    };
    (0..32 + next() % 480).flat_map(|_| next().to_le_bytes()).collect()
}

/// Runs a target that accepts arbitrary bytes on `count` generated inputs; at least `share` of them must be
/// accepted.
fn random_inputs(name: &str, count: u64, share: f64) {
    let inputs = (0..count).map(|seed| (format!("seed {seed}"), random(seed)));
    let (accepted, count) = try_all(name, inputs);
    assert!(accepted as f64 >= share * count as f64, "{name}: only {accepted} of {count} got far");
}

#[test]
fn gltf_of_any_parts() {
    random_inputs("gltf", 1000, 0.05);
}

#[test]
fn obj_of_any_statements() {
    random_inputs("obj", 1000, 0.05);
}

/// Vertices up to 1e18 beside small ones, and rays that start within 1e9.
#[test]
fn rays_among_any_triangles() {
    random_inputs("triangles", 1500, 0.3);
}
