//! Arrows between modules point one way: what a module may use stands below it in this list.

use std::fs;
use std::path::{Path, PathBuf};

/// From the bottom up. `main.rs` and `lib.rs` stand above all.
const ORDER: [&str; 11] = [
    "geometry",
    "scene",
    "import",
    "accel",
    "integrator",
    "render",
    "display",
    "output",
    "batch",
    "bench",
    "cli",
];

/// Uses that the order would allow and that are wrong all the same.
const FORBIDDEN: [(&str, &str); 7] = [
    ("accel", "import"),
    ("integrator", "import"),
    ("render", "import"),
    ("output", "import"),
    ("output", "scene"),
    ("batch", "accel"),
    ("bench", "batch"),
];

fn rank(module: &str) -> usize {
    ORDER.iter().position(|m| *m == module).unwrap_or_else(|| panic!("module '{module}' is not in the list"))
}

fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

#[test]
fn modules_only_use_what_stands_below_them() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&src, &mut all);
    let mut uses = 0;
    for file in &all {
        let inside = file.strip_prefix(&src).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs");
        if module == "main" || module == "lib" {
            continue;
        }
        for line in fs::read_to_string(file).unwrap().lines() {
            for used in line.split("crate::").skip(1) {
                let used: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if used.is_empty() || !ORDER.contains(&used.as_str()) {
                    continue;
                }
                uses += 1;
                let allowed = rank(&used) <= rank(module) && !FORBIDDEN.contains(&(module, used.as_str()));
                assert!(allowed, "{}: {module} uses {used}: {line}", inside.display());
            }
        }
    }
    assert!(all.len() > 40 && uses > 60, "{} files with {uses} uses were looked at", all.len());
}

#[test]
fn files_are_one_idea_long() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&src, &mut all);
    for file in all {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= 500, "{} has {lines} lines", file.display());
    }
}
