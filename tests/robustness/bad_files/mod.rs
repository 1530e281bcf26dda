//! Hand-made files with one defect each, and the kind, place and text of the error that each causes:
//! `expected.txt` has a line for each (`nothing` where a value is replaced by a default without a warning).
//! `GOLDEN=update` rewrites it; read the diff.

mod gltf;
mod non_gltf;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use blinn::import::{LoadError, LoadOptions, load, load_camera_xml, load_environment};

/// A bad file: its name in the list, and its files, of which the first is read.
pub struct Case {
    pub name: String,
    pub files: Vec<(&'static str, Vec<u8>)>,
}

impl Case {
    pub fn new(name: impl Into<String>, file: &'static str, bytes: impl Into<Vec<u8>>) -> Case {
        Case { name: name.into(), files: vec![(file, bytes.into())] }
    }

    pub fn with(mut self, file: &'static str, bytes: impl Into<Vec<u8>>) -> Case {
        self.files.push((file, bytes.into()));
        self
    }
}

/// The outcome in one line: the error's kind, place and text, or all warnings.
fn outcome(case: &Case) -> String {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in &case.files {
        std::fs::write(dir.path().join(name), bytes).unwrap();
    }
    let path = dir.path().join(case.files[0].0);
    let read = match path.extension().and_then(|e| e.to_str()) {
        Some("hdr") => load_environment(&path, &LoadOptions::default().limits).map(|_| Vec::new()),
        Some("xml") => load_camera_xml(&path).map(|_| Vec::new()),
        _ => load(&path, &LoadOptions::default()).map(|(_, warnings)| warnings),
    };
    let text = match read {
        Ok(warnings) => {
            let words: Vec<_> = warnings.iter().map(ToString::to_string).collect();
            if words.is_empty() { "nothing".into() } else { format!("warning | {}", words.join(" | ")) }
        }
        Err(LoadError::Io { path, cause }) => format!("Io | {} | {cause}", name_of(&path)),
        Err(LoadError::Parse { location, message }) => format!("Parse | {location} | {message}"),
        Err(LoadError::Invalid { location, message }) => format!("Invalid | {location} | {message}"),
        Err(LoadError::Limit { name, requested, allowed }) => {
            format!("Limit | {name} | {requested} of {allowed}")
        }
        Err(LoadError::Unsupported(what)) => format!("Unsupported | | {what}"),
        Err(LoadError::Cancelled(cancelled)) => unreachable!("{cancelled}"),
    };
    assert!(!text.contains('\n'), "{}: more than a line: {text}", case.name);
    text.replace(&format!("{}/", dir.path().display()), "")
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[test]
fn every_bad_file_is_known_by_its_kind_and_place() {
    let cases: Vec<Case> = gltf::cases().into_iter().chain(non_gltf::cases()).collect();
    assert!(cases.len() >= 120, "{}", cases.len());
    let names: BTreeSet<&str> = cases.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names.len(), cases.len(), "a name twice");
    let mut all = String::new();
    for case in &cases {
        let outcome = outcome(case);
        // Errors name a place.
        assert!(!outcome.starts_with("Parse |  |") && !outcome.starts_with("Invalid |  |"), "{outcome}");
        writeln!(all, "{}: {outcome}", case.name).unwrap();
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/robustness/bad_files/expected.txt");
    if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
        std::fs::write(&path, &all).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (is, was) in all.lines().zip(expected.lines()) {
        assert_eq!(is, was);
    }
    assert_eq!(all.lines().count(), expected.lines().count());
}
