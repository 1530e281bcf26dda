//! blinn renders glTF and OBJ mesh scenes on the CPU: triangle meshes with k_a, k_d, k_s and
//! shininess, hits by a bounding volume hierarchy, and the Blinn-Phong shading of a classic
//! ray-tracing lecture — eye rays, Lambert, shadows, many lights, ambient, specular.
//!
//! A picture is made in four steps, each of which can be had alone:
//!
//! ```
//! use blinn::accel::{Accel, BuildSettings};
//! use blinn::display::{Background, Display, ViewTransform};
//! use blinn::import::{LoadOptions, load};
//! use blinn::integrator::{Frame, Phong};
//! use blinn::output::{Depth, Format, Picture, Replace, save};
//! use blinn::render::{RenderSettings, render};
//! use blinn::scene::{Lighting, PoseSettings, View, pose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Load: a file becomes a scene of plain data, with a warning for whatever it lacks.
//! let (scene, warnings) = load("models/lecture/lecture.obj".as_ref(), &LoadOptions::default())?;
//! assert!(warnings.is_empty());
//!
//! // Pose: where everything is at a moment. Then the trees that rays are traced through.
//! let posed = pose(&scene, &PoseSettings::default())?;
//! let (accel, _left_out) = Accel::build(&posed, &BuildSettings::default());
//!
//! // Render: the lecture's camera, lights, and the last slide's sum for every sample.
//! let settings = RenderSettings { width: 64, height: 36, ..Default::default() };
//! let (camera, _notes) = View::default().resolve(&posed, settings.width, settings.height)?;
//! let lit = Lighting::default().resolve(&posed, &camera);
//! let frame = Frame::new(&posed, &accel, camera, &lit);
//! let pixels = render(&frame, &Phong::default(), &settings, &())?;
//!
//! // Save: whole or not at all.
//! let display = Display { ev: 0.0, view: ViewTransform::Standard, background: Background::Transparent };
//! let picture = Picture::new(pixels, display);
//! let folder = tempfile::tempdir()?;
//! save(&picture, &folder.path().join("lecture.png"), Format::Png, Depth::Usual, Replace::Yes)?;
//! # Ok(())
//! # }
//! ```
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod accel;
pub mod batch;
pub mod bench;
pub mod cli;
pub mod display;
pub mod geometry;
pub mod import;
pub mod integrator;
pub mod output;
pub mod render;
pub mod scene;
