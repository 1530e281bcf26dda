//! Subnormal numbers: an Intel processor takes about 150 cycles for each operation with one, and other processors have
//! their own slow cases. Renders count the instructions that meet any, with a library that is compiled and loaded for
//! the purpose (`counter.c`).
//!
//! The optimiser can bring such numbers in, when it computes a value that is not used. The variable `BLINN_PROGRAM` names
//! another build of the program to test, such as a release.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::model_path;

/// Instructions that may meet subnormal numbers in a render: accidents, such as a point whose interpolated coordinate
/// happens to be 1e-39.
const FEW: u64 = 100;

/// Compiles the counter in `folder`.
fn compile_counter(folder: &Path) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/robustness/denormals/counter.c");
    let library = folder.join("counter.so");
    let mut cc = Command::new("cc");
    let output = cc.args(["-O1", "-shared", "-fPIC", "-o"]).arg(&library).arg(source).output();
    let output = output.expect("the test needs a C compiler, `cc`, which Rust's linker needs as well");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    library
}

/// The program of this build, or the one that `BLINN_PROGRAM` names.
fn program() -> PathBuf {
    std::env::var_os("BLINN_PROGRAM").map_or_else(|| env!("CARGO_BIN_EXE_blinn").into(), PathBuf::from)
}

/// Renders with the words of `line`, the first of which is a model. Returns the number of instructions that met
/// subnormal numbers, and the report.
fn count_denormals(counter: &Path, folder: &Path, line: &str) -> (u64, String) {
    let report = folder.join("counts.txt");
    let (model, flags) = line.split_once(' ').unwrap_or((line, ""));
    let output = Command::new(program())
        .arg("render")
        .arg(model_path(model))
        .args(["-o", "out.png", "--size", "96x54", "--quiet"])
        .args(flags.split_whitespace())
        .env("LD_PRELOAD", counter)
        .env("DENORMALS", &report)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    let counts = fs::read_to_string(&report).expect("the counter writes a report");
    (counts.lines().next().and_then(|total| total.parse().ok()).expect("a total"), counts)
}

#[track_caller]
fn assert_few(lines: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let counter = compile_counter(folder.path());
    for line in lines {
        let (total, counts) = count_denormals(&counter, folder.path(), line);
        assert!(total <= FEW, "{line}: {total} instructions met subnormal numbers:\n{counts}");
    }
}

/// A program that computes with subnormal numbers: the other tests could not fail without it.
#[test]
fn the_counter_counts() {
    let folder = tempfile::tempdir().unwrap();
    let counter = compile_counter(folder.path());
    let source = folder.path().join("subnormal.c");
    let program = folder.path().join("subnormal");
    let code =
        "int main(void) { volatile float x = 1e-39f; for (int i = 0; i < 500; i++) x *= 0.999f; return 0; }";
    fs::write(&source, code).unwrap();
    let compiled = Command::new("cc").arg("-O1").arg("-o").arg(&program).arg(&source).status().unwrap();
    assert!(compiled.success());
    let report = folder.path().join("counts.txt");
    let status =
        Command::new(&program).env("LD_PRELOAD", counter).env("DENORMALS", &report).status().unwrap();
    assert!(status.success());
    let counts = fs::read_to_string(&report).unwrap();
    assert_eq!(counts.lines().next(), Some("500"), "{counts}");
}

#[test]
fn renders_meet_few_subnormal_numbers() {
    assert_few(&[
        "cornell/cornell.glb -s 2",
        "lecture/lecture.glb -s 2",
        "still-life/still-life.glb -s 2",
        "assembly/assembly.glb -s 2",
        "textured/textured.gltf -s 2",
        "alpha/alpha.glb -s 2",
    ]);
}

#[test]
fn secondary_rays_meet_few_subnormal_numbers() {
    assert_few(&[
        "cornell/cornell.glb -s 2 --ao 4 --light-radius 0.1",
        "lecture/lecture.glb -s 2 --ao 4 --ground plane",
        "tower/tower.glb -s 2 --sun 0,-1,0,3 --ao 2,1",
    ]);
}

#[test]
fn animations_meet_few_subnormal_numbers() {
    assert_few(&[
        "figure/figure.glb -s 2 --time 0.7 --light-radius 0.1",
        "assembly/assembly.glb -s 1 --time 1.3",
    ]);
}
