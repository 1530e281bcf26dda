//! All frames of a scene in one animation file.

use std::path::Path;

use super::sequence_info::SequenceInfo;
use crate::args::{LoopArg, OutputArgs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::{ANIMATION_QUALITY, AnimationFormat};
use blinn_render::display::Background;
use blinn_scene::Scene;
use blinn_session::{DEFAULT_FPS, Options, PathTemplate};

/// Settings of an animation file.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct AnimationOutput {
    pub format: AnimationFormat,
    /// Frames per second.
    pub fps: f64,
    /// True if the rate of the file takes precedence.
    pub has_file_rate: bool,
    /// True to loop forever, false to play once.
    pub loops: bool,
    /// 1 to 100, for lossy formats.
    pub quality: u8,
    /// True if the content rotates clockwise as seen from above.
    pub clockwise: bool,
}

/// The animation format of an output name. A `.webp` is a single image: frames with that name are numbered, as those
/// with `.png` are.
pub fn animation_format(name: &Path) -> Option<AnimationFormat> {
    AnimationFormat::from_path(name).filter(|format| *format != AnimationFormat::Webp)
}

impl AnimationOutput {
    /// Resolves the settings.
    ///
    /// # Errors
    /// Options that apply only to images. The messages say how to get the result with other options.
    pub fn new(
        format: AnimationFormat,
        template: &PathTemplate,
        args: &OutputArgs,
        sequence: &SequenceInfo,
        options: &Options,
    ) -> Result<Self, UsageError> {
        let name = args.output.as_deref().unwrap_or("".as_ref()).display().to_string();
        check_options(format, template, args, sequence, options)
            .map_err(|text| UsageError(worded!("`output` {}: {}", name, text)))?;
        Ok(AnimationOutput {
            format,
            fps: sequence.fps.unwrap_or(DEFAULT_FPS),
            has_file_rate: sequence.fps.is_none() && sequence.is_clip,
            loops: args.r#loop != Some(LoopArg::Once),
            quality: args.encoder_quality.unwrap_or(ANIMATION_QUALITY),
            clockwise: sequence.clockwise,
        })
    }

    /// The settings for a scene.
    ///
    /// # Errors
    /// The format cannot have the rate of the scene's file.
    pub fn in_scene(self, scene: &Scene) -> Result<AnimationOutput, String> {
        let Some(frames) = scene.settings.frames.filter(|_| self.has_file_rate) else { return Ok(self) };
        self.format.check_rate(frames.rate)?;
        Ok(AnimationOutput { fps: frames.rate, ..self })
    }
}

fn check_options(
    format: AnimationFormat,
    template: &PathTemplate,
    args: &OutputArgs,
    sequence: &SequenceInfo,
    options: &Options,
) -> Result<(), String> {
    let use_frames = worded!("render images (`output` frames/####.png), then use blinn assemble");
    if !sequence.is_sequence {
        return Err(worded!(
            "an animation needs several frames; add `frames`, use blinn turntable, or write a .png"
        ));
    }
    if template.has_frame_number() {
        return Err("all frames go into one file; remove the frame number from its name".into());
    }
    if template.has_camera() {
        return Err("all frames go into one file; remove {camera} from its name".into());
    }
    if let Some(option) = sequence.subset_option {
        return Err(worded!("`{}` leaves out frames of the animation; {}", option, use_frames));
    }
    if args.resume {
        return Err(worded!("`resume` does not apply to animations; {}", use_frames));
    }
    if !options.aovs.is_empty() {
        return Err(worded!("`aov` does not apply to animations; {} on the frames of an AOV", use_frames));
    }
    if args.depth.as_deref().is_some_and(|depth| depth != "8") {
        return Err(worded!("an animation has 8 bits per channel; remove `depth`"));
    }
    if args.encoder_quality.is_some() && !format.has_quality() {
        return Err(worded!("`encoder-quality` applies only to .jpg, .mp4 and .html; remove it"));
    }
    check_animation(format, sequence.fps.unwrap_or(DEFAULT_FPS), options)
}

/// Checks that an animation can show images with `options`.
///
/// # Errors
/// The limit of the format, and what to do.
pub fn check_animation(format: AnimationFormat, fps: f64, options: &Options) -> Result<(), String> {
    if options.fixed_background() == Background::Transparent && format == AnimationFormat::Mp4 {
        return Err(worded!("MP4 has no transparency; set `background` COLOR, or write .apng or .html"));
    }
    format.check_rate(fps)?;
    match options.known_size() {
        Some(size) => format.check_size(size),
        None => Ok(()),
    }
}
