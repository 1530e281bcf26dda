//! Bad files, absurd geometry, full disks and small limits: an error that names the place, nothing partial, no
//! panic, no read outside the scene's folder. `layering` holds the structure of the source.
//!
//! - `bad_files`: hand-made bad files, each with its expected error
//! - `degenerate_geometry`: NaN, infinite, coincident and huge triangles and rays
//! - `denormals`: renders compute with few subnormal numbers
//! - `fuzz_corpus`: the corpus of the fuzz targets, and generated inputs for each
//! - `import_limits`: each of `import::Limits`, at the limit and one past it
//! - `io_failures`: disks that fill up, files that vanish, closed pipes, shared folders
//! - `layering`: imports between folders go one way, no new import cycles between files, short files
//! - `memory_limit`: `--max-memory` holds
//! - `path_traversal`: references that lead out of a scene's folder

// The fuzz targets are a crate of their own that includes the same fixtures.
#![allow(clippy::duplicate_mod)]

#[path = "../common/mod.rs"]
mod common;

mod bad_files;
mod degenerate_geometry;
// The counter needs the control word and signals of x86-64 Linux.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
mod denormals;
mod fuzz_corpus;
mod import_limits;
mod io_failures;
mod memory_limit;
mod path_traversal;
