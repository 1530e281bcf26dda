//! Code that several test binaries share: scenes and random numbers, runs of the program, generated files.
#![allow(dead_code, reason = "each binary uses a part")]

pub mod gltf_fixture;
pub mod program;
pub mod scenes;
pub mod seed_files;
