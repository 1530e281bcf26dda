//! Warnings and choices of a session, as values that each program words for its users.

use std::fmt;
use std::path::PathBuf;

use crate::empty_reason::EmptyReason;

/// Something that a user should know about the images of a scene.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// Triangles with coordinates that are not finite numbers are not rendered.
    NonFiniteTriangles(u64),
    /// No node of the file has triangles.
    NoTriangles,
    /// The selection of objects excludes all of them.
    NothingSelected,
    /// A warning about the camera.
    View(String),
    /// An option changes the environment, and no environment lights the scene.
    NoEnvironment {
        /// The options without effect.
        options: &'static str,
    },
    /// A shadow catcher is shown, and nothing casts shadows.
    NothingCastsShadows,
    /// The metered camera sees nothing that is lit.
    NothingLit,
    /// Depths beyond those that 16 bits hold.
    DepthOverflow {
        /// The frame's number.
        frame: i64,
        /// The largest depth, in metres.
        farthest: f32,
        /// Metres per step.
        step: f64,
        /// The largest depth that can be stored, in metres.
        largest: f32,
    },
    /// An image shows nothing.
    EmptyImage {
        /// The frame's number.
        frame: i64,
        /// The reason.
        reason: EmptyReason,
    },
    /// Images of a scene show nothing.
    EmptyImages(String),
    /// The camera of all images.
    Camera(String),
    /// The list that cameras come from.
    CameraList {
        /// Number of cameras.
        count: usize,
        /// The list.
        file: PathBuf,
    },
    /// The light sources of all images.
    Lights(String),
    /// The metered exposure.
    Exposure {
        /// In stops.
        ev: f64,
        /// The factor of the file's lights, if their unit is unusual.
        light_scale: Option<f32>,
    },
    /// Animations that do not play, as others have the same targets.
    IdleAnimations {
        /// Names of those that play.
        active: String,
        /// Names of those that do not.
        idle: String,
    },
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Notice::NonFiniteTriangles(count) => {
                write!(f, "ignored {count} triangles with vertices that are not finite numbers")
            }
            Notice::NoTriangles => {
                f.write_str("nothing to render: no node of the scene has a mesh with triangles")
            }
            Notice::NothingSelected => {
                f.write_str("nothing to render: `hide` and `only-objects` exclude all objects")
            }
            Notice::View(text) | Notice::EmptyImages(text) => f.write_str(text),
            Notice::NoEnvironment { options } => {
                write!(f, "{options} no effect: no environment lights the scene")
            }
            Notice::NothingCastsShadows => {
                f.write_str("`ground shadow` shows nothing: no light casts shadows; add a light or `ao`")
            }
            Notice::NothingLit => f.write_str("the camera sees nothing that is lit; the exposure is 0"),
            Notice::DepthOverflow { frame, farthest, step, largest } => write!(
                f,
                "frame {frame} has depths up to {farthest} m, but 16 bits in units of {step} m hold at most {largest} m; \
                 farther points are stored as 65535; set a larger `depth-unit`"
            ),
            Notice::EmptyImage { frame, reason } => write!(f, "frame {frame} shows nothing: {reason}"),
            Notice::Camera(text) => write!(f, "camera: {text}"),
            Notice::CameraList { count, file } => write!(f, "cameras: {count} from {}", file.display()),
            Notice::Lights(text) => write!(f, "lights: {text}"),
            Notice::Exposure { ev, light_scale: None } => write!(f, "exposure: `exposure {ev}`"),
            Notice::Exposure { ev, light_scale: Some(scale) } => {
                write!(f, "exposure: `exposure {ev}` `light-scale {scale}`")
            }
            Notice::IdleAnimations { active, idle } => write!(
                f,
                "animation: {active}; not played: {idle}, which have the same targets; use `animation`"
            ),
        }
    }
}
