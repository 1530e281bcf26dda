//! blinn renders glTF and OBJ mesh scenes on the CPU: triangle meshes with k_a, k_d, k_s and
//! shininess, hits by a bounding volume hierarchy, and the Blinn-Phong shading of a classic
//! ray-tracing lecture — eye rays, Lambert, shadows, many lights, ambient, specular.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod accel;
pub mod cli;
pub mod display;
pub mod geometry;
pub mod import;
pub mod integrator;
pub mod output;
pub mod render;
pub mod scene;
