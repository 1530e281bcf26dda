//! blinn renders glTF and OBJ scenes on the CPU. It traces rays through bounding volume hierarchies
//! (BVHs) of triangles, and shades hits with the Blinn-Phong model of a ray-tracing lecture: ambient,
//! diffuse and specular terms with coefficients k_a, k_d, k_s and shininess, many lights, and shadows.
//!
//! # From a file to a picture
//!
//! [`Options`] are those of `blinn render`, with the same defaults, and the file has the same bytes.
//!
//! ```
//! use blinn::{Options, Scene};
//!
//! # fn main() -> Result<(), blinn::SessionError> {
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("lecture.png");
//! let scene = Scene::load("models/lecture/lecture.obj")?;
//! let options = Options { size: Some((64, 36)), samples: 16, ..Options::default() };
//! let picture = scene.render(&options)?;
//! picture.save(&path)?;
//! # Ok(())
//! # }
//! ```
//!
//! A [`Session`] renders many images of a scene, which share camera, lights, exposure and acceleration structure.
//! Warnings are [`Notice`]s, of the picture and of the session; those of the file are in [`Scene::warnings`].
//!
//! ```
//! use blinn::{Options, Request, Scene, Session};
//!
//! # fn main() -> Result<(), blinn::SessionError> {
//! let scene = Scene::load("models/figure/figure.glb")?;
//! let options = Options { size: Some((32, 32)), ..Options::default() };
//! let mut session = Session::new(&scene, &options)?;
//! let start = session.image(&Request::default())?;
//! let later = session.image(&Request { time: 0.5, ..Request::default() })?;
//! assert_ne!(start.image.pixels, later.image.pixels);
//! # Ok(())
//! # }
//! ```
//!
//! # Step by step
//!
//! **file → [`Scene`](scene::Scene) → [`PosedScene`](scene::PosedScene) → [`Accel`](accel::Accel) →
//! [`Pixels`](render::Pixels) → file.** Each step takes the result of the one before, and can be used on
//! its own.
//!
//! ```
//! use blinn::accel::{Accel, AccelSettings};
//! use blinn::display::{Background, Display, ViewTransform};
//! use blinn::import::{LoadOptions, load};
//! use blinn::integrator::{Frame, Phong};
//! use blinn::output::{BitDepth, ImageFormat, Overwrite, Picture, save};
//! use blinn::render::{RenderSettings, render};
//! use blinn::scene::{Lighting, PoseSettings, View, pose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Load the file. Problems that do not prevent rendering are warnings.
//! let (scene, warnings) = load("models/lecture/lecture.obj".as_ref(), &LoadOptions::default())?;
//! assert!(warnings.is_empty());
//!
//! // Pose the scene at a time (0 s), and build the BVHs.
//! let posed = pose(&scene, &PoseSettings::default())?;
//! let (accel, _report) = Accel::build(&posed, &AccelSettings::default());
//!
//! // Render with the file's camera and lights, or with defaults.
//! let settings = RenderSettings { width: 64, height: 36, ..Default::default() };
//! let (camera, _notes) = View::default().resolve(&posed, settings.width, settings.height)?;
//! let lighting = Lighting::default().resolve(&posed, &camera);
//! let frame = Frame::new(&posed, &accel, camera, &lighting);
//! let pixels = render(&frame, &Phong::default(), &settings, &())?;
//!
//! // Convert to display values and save. The file appears only when it is complete.
//! let display = Display::default();
//! let picture = Picture::new(pixels, display);
//! let folder = tempfile::tempdir()?;
//! save(&picture, &folder.path().join("lecture.png"), ImageFormat::Png, BitDepth::Default, Overwrite::Yes)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Cameras
//!
//! A [`View`](scene::View) is a request; it resolves to the [`Camera`](scene::Camera) that generates eye
//! rays. The default view is the file's first camera, or else frames the scene. Each field of a view
//! replaces one property. Lengths are metres, angles radians, and +Y is up. Vectors are [`glam`]'s.
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
//! // In the lecture's basis, w is opposite to the view direction.
//! assert!(camera.basis.w.dot(DVec3::new(10.0, 4.2, 6.0)) > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Animation
//!
//! [`pose`](scene::pose()) evaluates a scene at a time in seconds; the scene itself never changes.
//! [`Accel::update`](accel::Accel::update) adapts an existing `Accel` to another time, which is faster than
//! building a new one.
//!
//! ```
//! # use blinn::accel::{Accel, AccelSettings};
//! # use blinn::import::{LoadOptions, load};
//! use blinn::scene::{PoseSettings, pose};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (scene, _) = load("models/figure/figure.glb".as_ref(), &LoadOptions::default())?;
//! let at = |time| pose(&scene, &PoseSettings { time, ..Default::default() });
//! let start = at(0.0)?;
//! let later = at(0.5)?;
//! assert_ne!(start.bounds(), later.bounds());
//! let (mut accel, _) = Accel::build(&start, &AccelSettings::default());
//! let _report = accel.update(&later);
//! # Ok(())
//! # }
//! ```
//!
//! # Layers
//!
//! [`render_aovs`](render::render_aovs) returns arbitrary output variables (AOVs) at the pixel centres, such
//! as depth, normals and object ids, as row-major arrays with row 0 on top. [`Aov`](integrator::Aov) lists
//! them. `docs/examples` has complete programs, also for progress reports and cancellation.
//!
//! # Errors, panics and threads
//!
//! Errors say what is wrong, where, and what to do. No file can make the library panic or use unbounded
//! memory: [`Limits`](import::Limits) are checked before allocating. Work runs in rayon's current thread
//! pool. Pictures are bit-identical for any number of threads.
#![deny(unsafe_code)]
#![warn(missing_docs)]

/// Vectors and matrices of the public API.
pub use glam;

#[doc(inline)]
pub use blinn_accel as accel;
#[doc(inline)]
pub use blinn_core::{cancellation, geometry};
#[doc(inline)]
pub use blinn_import as import;
#[doc(inline)]
pub use blinn_output as output;
#[doc(inline)]
pub use blinn_output::{compare, datasets};
#[doc(inline)]
pub use blinn_render as render;
#[doc(inline)]
pub use blinn_render::{display, integrator};
#[doc(inline)]
pub use blinn_scene as scene;
#[doc(inline)]
pub use blinn_session as session;

#[doc(inline)]
pub use blinn_session::{Notice, Options, Picture, Request, Scene, Session, SessionError};

/// Compiles the example of README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
