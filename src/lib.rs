//! blinn renders glTF and OBJ mesh scenes on the CPU: triangle meshes with k_a, k_d, k_s and
//! shininess, hits by a bounding volume hierarchy, and the Blinn-Phong shading of a classic
//! ray-tracing lecture — eye rays, Lambert, shadows, many lights, ambient, specular.
//!
//! # A picture in four steps
//!
//! **file → [`Scene`](scene::Scene) → [`PosedScene`](scene::PosedScene) → [`Accel`](accel::Accel) →
//! [`Pixels`](render::Pixels) → file.** Each step can be had alone, and each takes what the one before
//! it made.
//!
//! ```
//! use blinn::accel::{Accel, BuildSettings};
//! use blinn::display::{Background, Display, ViewTransform};
//! use blinn::import::{LoadOptions, load};
//! use blinn::integrator::{Frame, Phong};
//! use blinn::output::{BitDepth, ImageFormat, Overwrite, Picture, save};
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
//! save(&picture, &folder.path().join("lecture.png"), ImageFormat::Png, BitDepth::Default, Overwrite::Yes)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Where the eye stands
//!
//! A [`View`](scene::View) is what was asked for, a [`Camera`](scene::Camera) what rays start from. A view
//! that says nothing is the file's first camera, or frames the scene; each of its fields replaces a
//! part. Metres, radians, and +Y up throughout. Vectors are [`glam`]'s.
//!
//! ```
//! # use blinn::import::{LoadOptions, load};
//! # use blinn::scene::{PoseSettings, pose};
//! use blinn::glam::DVec3;
//! use blinn::scene::View;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let (scene, _) = load("models/lecture/lecture.obj".as_ref(), &LoadOptions::default())?;
//! # let posed = pose(&scene, &PoseSettings::default())?;
//! let view = View {
//!     view_point: Some(DVec3::new(10.0, 4.2, 6.0)),
//!     look_at: Some(DVec3::ZERO),
//!     yfov: Some(21_f64.to_radians()),
//!     ..View::default()
//! };
//! let (camera, _notes) = view.resolve(&posed, 640, 360)?;
//! // The lecture's basis: w points away from what is looked at.
//! assert!(camera.basis.w.dot(DVec3::new(10.0, 4.2, 6.0)) > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Moments
//!
//! [`pose`](scene::pose()) puts a scene where it is at a time in seconds; the scene itself never changes. One
//! [`Accel`](accel::Accel) follows by [`update`](accel::Accel::update), which is cheaper than to build.
//!
//! ```
//! # use blinn::accel::{Accel, BuildSettings};
//! # use blinn::import::{LoadOptions, load};
//! use blinn::scene::{PoseSettings, pose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (scene, _) = load("models/figure/figure.glb".as_ref(), &LoadOptions::default())?;
//! let at = |time| pose(&scene, &PoseSettings { time, ..Default::default() });
//! let (start, later) = (at(0.0)?, at(0.5)?);
//! assert_ne!(start.bounds(), later.bounds());
//! let (mut accel, _) = Accel::build(&start, &BuildSettings::default());
//! let _left_out = accel.update(&later);
//! # Ok(())
//! # }
//! ```
//!
//! # Layers
//!
//! [`render_aovs`](render::render_aovs) gives what lies behind each pixel's centre as arrays, row-major,
//! row 0 on top: [`Aov`](integrator::Aov) lists them. More such programs, which also show progress and how
//! to cancel, are in `docs/examples`.
//!
//! # Errors, panics, threads
//!
//! Every error says what, where and what to do. No file makes this library panic or take memory without
//! bound: [`Limits`](import::Limits) are compared before anything is taken. Work is spread over rayon's
//! current pool; the bytes of a picture are the same on any number of threads.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub(crate) mod simd;
/// The vectors and matrices of this crate's interfaces.
pub use glam;

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
