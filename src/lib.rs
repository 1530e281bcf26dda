//! blinn renders glTF and OBJ mesh scenes on the CPU.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod accel;
pub mod geometry;
pub mod import;
pub mod scene;
