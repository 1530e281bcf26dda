//! The program `blinn` as people, scripts and farms meet it: commands, flags, help, exit codes, the files that it
//! writes and what it prints about them. Nearly all tests run the program; `camera` calls the library behind its flags.
//!
//! - `animation_output`: `--frames` and `turntable` into GIF, APNG, MP4 and HTML
//! - `assemble`: `blinn assemble` over frames on disk
//! - `bench`: what `blinn bench` counts, writes, reads and compares
//! - `camera`: `--orbit`, `--zoom`, f3d's camera flags, `--hide`, `--only-objects`
//! - `datasets`: `turntable --views`, its layers and `transforms.json`
//! - `examples`: the programs in docs/examples; they need `cargo build --examples`
//! - `farm`: scripts for render farms, and their tasks run by a stand-in for the engine
//! - `help`: help pages, usage errors, completions, man pages, docs/reference/command-line.md
//! - `image_output`: EXR, JPEG, WebP, Cryptomatte and layer previews read back
//! - `program`: exit codes, messages, one-line errors, signals, lights and ground from flags
//! - `sequences`: many frames and many files: lists, turntables, `--resume`, config files, reports

#[path = "../common/mod.rs"]
mod common;

mod animation_output;
mod assemble;
mod bench;
mod camera;
mod datasets;
mod examples;
mod farm;
mod help;
mod image_output;
mod program;
mod sequences;
