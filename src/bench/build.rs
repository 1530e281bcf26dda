//! Names the compiler and the commit of the build for results files.
//!
//! The commit is that of the environment variable `BLINN_COMMIT`, or of a published package. It is not asked of git: Cargo
//! would keep the answer of an earlier commit, or build again for each.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=BLINN_COMMIT");
    println!("cargo::rustc-env=BLINN_RUSTC={}", rustc_version().unwrap_or_default());
    println!("cargo::rustc-env=BLINN_BUILD_COMMIT={}", commit().unwrap_or_default());
}

/// The file that `cargo package` adds. A package does not gain it later.
const PACKAGED: &str = ".cargo_vcs_info.json";

/// `rustc 1.92.0 (ded5c06cf 2025-12-08)`.
fn rustc_version() -> Option<String> {
    let output = Command::new(std::env::var_os("RUSTC")?).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(text.lines().next()?.trim().to_string())
}

/// The commit in hexadecimal digits, if it is known.
fn commit() -> Option<String> {
    let named = std::env::var("BLINN_COMMIT").ok();
    let packaged = || {
        let folder = std::env::var_os("CARGO_MANIFEST_DIR")?;
        let text = std::fs::read_to_string(Path::new(&folder).join(PACKAGED)).ok()?;
        if text.contains("\"dirty\": true") {
            return None;
        }
        let after = text.split("\"sha1\"").nth(1)?;
        after.split('"').nth(1).map(str::to_string)
    };
    let commit = named.filter(|commit| !commit.is_empty()).or_else(packaged)?;
    let is_hash = (7..=64).contains(&commit.len()) && commit.bytes().all(|b| b.is_ascii_hexdigit());
    is_hash.then_some(commit)
}
