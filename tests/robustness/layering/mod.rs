//! Imports go one way: between folders down the list `ORDER`, between files without cycles.

mod source;
mod tests;
mod tokens;
mod uses;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use source::Modules;
use uses::{Cycle, cycles, uses};

/// From the bottom up. `main.rs` and `lib.rs` stand above all.
const ORDER: [&str; 15] = [
    "cancellation",
    "geometry",
    "simd",
    "scene",
    "import",
    "accel",
    "integrator",
    "render",
    "display",
    "output",
    "compare",
    "batch",
    "bench",
    "cli",
    "python",
];

/// Uses that the order would allow and that are wrong all the same.
const FORBIDDEN: [(&str, &str); 8] = [
    ("import", "simd"),
    ("accel", "import"),
    ("integrator", "import"),
    ("render", "import"),
    ("output", "import"),
    ("output", "scene"),
    ("batch", "accel"),
    ("bench", "batch"),
];

/// The only module of the program that the Python module names.
const PYTHON_BRIDGE: &str = "cli::embed::";

/// Cycles between files that are to be broken, each as a line of its files. A part of one passes as well. The list
/// only shrinks: a line whose cycle is gone is an error.
const KNOWN: &str = include_str!("known_cycles.txt");

fn rank(folder: &str) -> usize {
    ORDER.iter().position(|m| *m == folder).unwrap_or_else(|| panic!("'{folder}' is not in the list"))
}

/// Returns true if code in `folder` may use items of `other`.
fn may_use(folder: &str, other: &str) -> bool {
    rank(other) <= rank(folder) && !FORBIDDEN.contains(&(folder, other))
}

/// The first part of a path below src.
fn folder(file: &str) -> &str {
    file.split('/').next().unwrap_or(file).trim_end_matches(".rs")
}

/// All files below a folder, by their paths from src.
fn read(src: &Path, below: &Path, files: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(below).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            read(src, &path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let inside = path.strip_prefix(src).unwrap().components();
            let inside: Vec<_> = inside.map(|part| part.as_os_str().to_str().unwrap()).collect();
            files.insert(inside.join("/"), fs::read_to_string(&path).unwrap());
        }
    }
}

fn source() -> BTreeMap<String, String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = BTreeMap::new();
    read(&src, &src, &mut files);
    assert!(files.len() > 40, "only {} files were found", files.len());
    files
}

/// By the text alone, tests and comments included.
#[test]
fn folders_only_name_folders_below_them() {
    let mut count = 0;
    for (file, text) in source() {
        let folder = folder(&file);
        if folder == "main" || folder == "lib" {
            continue;
        }
        for line in text.lines() {
            for part in line.split("crate::").skip(1) {
                let used: String = part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if !ORDER.contains(&used.as_str()) {
                    continue;
                }
                count += 1;
                assert!(may_use(folder, &used), "{file}: {folder} uses {used}: {line}");
                let is_past_bridge = used == "cli" && !part.starts_with(PYTHON_BRIDGE);
                assert!(
                    folder != "python" || !is_past_bridge,
                    "{file} uses more than {PYTHON_BRIDGE} {line}"
                );
            }
        }
    }
    assert!(count > 60, "only {count} uses were found");
}

/// By what paths resolve to, however they are written. Nothing but the program uses `cli` or `bench`; the Python module
/// uses the program.
#[test]
fn files_only_use_files_in_folders_below_them() {
    let uses = uses(&Modules::read(&source()), true);
    assert!(uses.len() > 300, "only {} uses were found", uses.len());
    for ((from, to), names) in uses {
        let (folder, other) = (folder(&from), folder(&to));
        let allowed = match (folder, other) {
            ("cli", _) | ("bench", "bench") => other != "python",
            ("python", _) => true,
            (_, "cli" | "bench" | "python") => false,
            ("lib", _) => true,
            _ => rank(other) <= rank(folder),
        };
        assert!(allowed, "{from} uses {to}: {names:?}");
    }
}

#[test]
fn files_do_not_import_each_other_in_cycles() {
    let found = cycles(&uses(&Modules::read(&source()), false));
    let is_in = |cycle: &Cycle, known: &str| {
        cycle.files.iter().all(|file| known.split_whitespace().any(|other| other == file))
    };
    let mut wrong = Vec::new();
    for cycle in &found {
        if !KNOWN.lines().any(|known| is_in(cycle, known)) {
            let files: Vec<&str> = cycle.files.iter().map(String::as_str).collect();
            wrong.push(format!("new cycle: {}\n  {}", files.join(" "), cycle.ties.join("\n  ")));
        }
    }
    for known in KNOWN.lines() {
        if !found.iter().any(|cycle| is_in(cycle, known)) {
            wrong.push(format!("no cycle any more, delete it from known_cycles.txt: {known}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn files_are_one_idea_long() {
    for (file, text) in source() {
        let lines = text.lines().count();
        assert!(lines <= 500, "{file} has {lines} lines");
    }
}
