//! Warnings and choices of a session, as values that each program words for its users.

use std::fmt;
use std::path::PathBuf;

use crate::empty_reason::{EmptyReason, NO_EDGES};
use crate::frames::Chunk;
use crate::light_advice::LightAdvice;
use blinn_core::option_words::word_options;
use blinn_core::worded;
use blinn_render::display::{Look, ViewTransform};

/// Something that a user should know about the images of a scene.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// Triangles with coordinates that are not finite numbers are not rendered.
    NonFiniteTriangles(u64),
    /// Points and lines with coordinates that are not finite numbers are not rendered.
    NonFiniteRounds(u64),
    /// No node of the file has triangles, points or lines.
    NothingToDraw,
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
    /// Caustics need light that bounces between surfaces.
    CausticsAlone,
    /// The view transform of an image does not have the look.
    LookOfOtherViews(Look),
    /// An image has no edges of the kinds that are drawn.
    NoEdges,
    /// Points or lines are as large as the scene.
    LargeRounds {
        /// The option that sets their size, in metres.
        option: &'static str,
        /// The radius of the scene, in metres.
        radius: f64,
    },
    /// The metered camera sees nothing that is lit.
    NothingLit(LackOfLight),
    /// The file's lights are requested, but it has none, and nothing else lights the scene.
    NoLights {
        /// Names of empty nodes that were probably area lights.
        lost_lights: Vec<String>,
    },
    /// Nearly all of a picture is black.
    DarkImage(LackOfLight),
    /// Half of a picture or more is white.
    WhiteImage,
    /// The noise of a picture of a single sample per pixel is not removed.
    NoisySample,
    /// A light is inside a closed object that shadows it on all sides.
    EnclosedLight(EnclosedLight),
    /// Frames of an animation are asked for, and nothing moves.
    NothingMoves,
    /// The share of the frames that is to be rendered has none.
    EmptyShare(Chunk),
    /// Each frame is a .webp of its own.
    SeparateWebps,
    /// Metal or glass is black, because nothing surrounds the scene.
    NothingToReflect,
    /// Depths beyond those that 16 bits hold.
    DepthOverflow(DepthOverflow),
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
    /// Pictures of a list of cameras are left out.
    CamerasWithoutPose {
        /// Number of pictures.
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
    /// The file's lights have an unusual unit, and are scaled by a metered factor.
    LightScale(f32),
    /// Neither camera nor lights are in a file of Blender, whose exporter leaves them out unless it is told to write them.
    NoCameraAndLights,
    /// The near plane of the file's camera cuts a part of what is in view.
    NearPlane {
        /// In metres.
        near: f64,
    },
    /// Settings of the file that images lack.
    UnsupportedSettings(Vec<String>),
    /// Animations that do not play, as others have the same targets.
    IdleAnimations {
        /// Names of those that play.
        active: String,
        /// Names of those that do not.
        idle: String,
    },
}

/// A light that an object shadows on all sides.
#[derive(Clone, Debug, PartialEq)]
pub struct EnclosedLight {
    /// Name of the light.
    pub light: String,
    /// Name of the object.
    pub object: String,
}

impl fmt::Display for EnclosedLight {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&worded!(
            "the light '{}' is inside '{}', which shadows it on all sides; hide the object (`hide`), or give it an \
             emissive or transmissive material",
            self.light,
            self.object
        ))
    }
}

/// The light of a scene that is too dark, and what helps.
#[derive(Clone, Debug, PartialEq)]
pub struct LackOfLight {
    /// The light sources.
    pub sources: String,
    /// Names of empty nodes that were probably area lights.
    pub lost_lights: Vec<String>,
    /// The options that help.
    pub advice: LightAdvice,
}

impl fmt::Display for LackOfLight {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "lights: {}; {}{}", self.sources, lost_light_words(&self.lost_lights), self.advice)
    }
}

/// Depths beyond those that 16 bits hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthOverflow {
    /// The frame's number.
    pub frame: i64,
    /// The largest depth, in metres.
    pub farthest: f32,
    /// Metres per step.
    pub step: f64,
    /// The largest depth that can be stored, in metres.
    pub largest: f32,
}

impl fmt::Display for DepthOverflow {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let DepthOverflow { frame, farthest, step, largest } = self;
        f.write_str(&worded!(
            "frame {} has depths up to {} m, but 16 bits in units of {} m hold at most {} m; farther points are stored \
             as 65535; set a larger `depth-unit`, or `scale` if the file is not in metres",
            frame,
            farthest,
            step,
            largest
        ))
    }
}

/// The options that light a dark scene.
const OTHER_LIGHTS: &str = "use `lights three-point`, `hdri studio` or `ambient`";

/// Words that pictures of a list of cameras are left out.
pub fn pictures_without_pose(count: usize) -> String {
    let pictures = if count == 1 { "picture" } else { "pictures" };
    format!("left out {count} {pictures} without a pose")
}

/// Names that a message lists.
const LISTED: usize = 3;

/// The beginning of advice: the lights that a file has lost.
fn lost_light_words(names: &[String]) -> String {
    if names.is_empty() {
        return String::new();
    }
    let listed: Vec<String> = names.iter().take(LISTED).map(|name| format!("'{name}'")).collect();
    let more = names.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!(
        "{}{more} without content may be area lights, which Blender's exporter leaves out; ",
        listed.join(", ")
    )
}

fn non_finite(count: u64, elements: &str) -> String {
    format!("ignored {count} {elements} with coordinates that are not finite numbers or beyond ±1e18")
}

/// The view transforms that have a look, as a message suggests them.
fn views_of(look: Look) -> &'static str {
    match [ViewTransform::Agx, ViewTransform::Filmic].map(|view| look.is_of(view)) {
        [true, false] => "`view agx`",
        [false, _] => "`view filmic`",
        [true, true] => "`view agx` or `view filmic`",
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text())
    }
}

impl Notice {
    fn text(&self) -> String {
        match self {
            Notice::NonFiniteTriangles(count) => non_finite(*count, "triangles"),
            Notice::NonFiniteRounds(count) => non_finite(*count, "points and lines"),
            Notice::NothingToDraw => {
                "nothing to render: no node of the scene has a mesh with triangles, points or lines".into()
            }
            Notice::NothingSelected => {
                worded!("nothing to render: `hide` and `only-objects` exclude all objects")
            }
            Notice::View(text) | Notice::EmptyImages(text) => text.clone(),
            Notice::NoEnvironment { options } => {
                format!("{} no effect: no environment lights the scene", word_options(options))
            }
            Notice::LookOfOtherViews(look) => worded!(
                "`look` has no effect: the view transform does not have this look; add {}",
                word_options(views_of(*look))
            ),
            Notice::CausticsAlone => worded!("`caustics` has no effect without `indirect`"),
            Notice::NoEdges => word_options(NO_EDGES),
            Notice::LargeRounds { option, radius } => worded!(
                "`{}` is in metres and large for a scene with a radius of {} m; for pixels, write px after the number",
                option,
                format_args!("{radius:.3}")
            ),
            Notice::NothingCastsShadows => {
                worded!("`ground shadow` shows nothing: no light casts shadows; add a light or `ao`")
            }
            Notice::NothingLit(light) => {
                format!("the camera sees nothing that is lit; the exposure is 0; {light}")
            }
            Notice::NoLights { lost_lights } => worded!(
                "`lights file` has no effect: no light of the file is shown; {}{}",
                lost_light_words(lost_lights),
                word_options(OTHER_LIGHTS)
            ),
            Notice::DarkImage(light) => format!("the picture is dark; {light}"),
            Notice::WhiteImage => worded!(
                "most of the picture is white; use `exposure auto`, or a lower `exposure` or `light-scale`"
            ),
            Notice::NoisySample => worded!(
                "the picture is grainy, because noise is removed from two samples per pixel on; use `samples 4` or \
                 more"
            ),
            Notice::EnclosedLight(light) => light.to_string(),
            Notice::NearPlane { near } => worded!(
                "the near plane of the file's camera clips a part of the scene, which is nearer than {} m; use \
                 `clip off`",
                near
            ),
            Notice::SeparateWebps => {
                "each frame is a .webp of its own; blinn assemble joins them to an animated one".into()
            }
            Notice::EmptyShare(chunk) => {
                format!("nothing to render: share {chunk} is empty, as there are more shares than frames")
            }
            Notice::NothingMoves => {
                "the file has no animation that plays, so that all frames are alike; blinn turntable \
                                     moves the camera around the scene"
                    .into()
            }
            Notice::NothingToReflect => worded!(
                "metal and glass show black where they reflect no other surface, because nothing surrounds the scene; \
                 use `hdri studio` or `ambient`"
            ),
            Notice::DepthOverflow(overflow) => overflow.to_string(),
            Notice::EmptyImage { frame, reason } => format!("frame {frame} shows nothing: {reason}"),
            Notice::Camera(text) => format!("camera: {text}"),
            Notice::CameraList { count, file } => format!("cameras: {count} from {}", file.display()),
            Notice::CamerasWithoutPose { count, file } => {
                format!("{} in {}", pictures_without_pose(*count), file.display())
            }
            Notice::Lights(text) => format!("lights: {text}"),
            Notice::Exposure { ev, light_scale: None } => worded!("exposure: `exposure {}`", ev),
            Notice::Exposure { ev, light_scale: Some(scale) } => {
                worded!("exposure: `exposure {}` `light-scale {}`", ev, scale)
            }
            Notice::LightScale(scale) => worded!(
                "the unit of the file's lights is unusual, and they are scaled by `light-scale {}`; to keep their \
                 values, use `exposure 0`",
                scale
            ),
            Notice::NoCameraAndLights => {
                "the file has neither camera nor lights: view and lights are blinn's own; to keep \
                                          Blender's, export with Include › Data › Cameras and Punctual Lights"
                    .into()
            }
            Notice::UnsupportedSettings(names) => {
                format!("ignored settings of the file that are not supported: {}", names.join(", "))
            }
            Notice::IdleAnimations { active, idle } => worded!(
                "animation: {}; not played: {}, which have the same targets; use `animation`",
                active,
                idle
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dark_pictures_name_sources_and_options() {
        let notice = Notice::DarkImage(LackOfLight {
            sources: "1 from the file (raw)".into(),
            lost_lights: vec!["Area".into()],
            advice: LightAdvice {
                is_lit: true,
                is_indirect: true,
                has_environment: true,
                ..LightAdvice::default()
            },
        });
        assert_eq!(
            notice.to_string(),
            "the picture is dark; lights: 1 from the file (raw); 'Area' without content may be area lights, which \
             Blender's exporter leaves out; use `exposure auto`"
        );
    }

    #[test]
    fn dark_scenes_name_sources_lost_lights_and_options() {
        let names = |count: usize| (0..count).map(|i| format!("Area {i}")).collect::<Vec<_>>();
        let notice = Notice::NoLights { lost_lights: names(5) };
        assert_eq!(
            notice.to_string(),
            "`lights file` has no effect: no light of the file is shown; 'Area 0', 'Area 1', 'Area 2' and 2 more without \
             content may be area lights, which Blender's exporter leaves out; use `lights three-point`, `hdri studio` or \
             `ambient`"
        );
        let advice = LightAdvice { is_metered: true, ..LightAdvice::default() };
        let sources = "2 from the file (raw)".into();
        let notice = Notice::NothingLit(LackOfLight { sources, lost_lights: names(0), advice });
        assert_eq!(
            notice.to_string(),
            "the camera sees nothing that is lit; the exposure is 0; lights: 2 from the file (raw); use \
             `lights three-point`, `hdri studio` or `ambient`"
        );
    }
}
