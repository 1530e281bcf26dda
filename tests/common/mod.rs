//! Code that several test binaries share: scenes and random numbers, runs of the program, generated files.
#![allow(dead_code, reason = "each binary uses a part")]

pub mod gltf_fixture;
pub mod html;
pub mod program;
pub mod scenes;
pub mod seed_files;

use std::path::{Path, PathBuf};

use blinn::import::{LoadOptions, load};
use blinn::scene::Scene;

/// The path of a file in models/.
pub fn model_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}

/// Loads a scene from models/.
pub fn load_model(name: &str) -> Scene {
    let path = model_path(name);
    load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display())).0
}
