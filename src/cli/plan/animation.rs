//! Moving pictures: what of a command line they take, and what they refuse.

use crate::batch::PathTemplate;
use crate::cli::Usage;
use crate::cli::args::values::Layers;
use crate::cli::args::{LoopArg, OutputArgs};
use crate::display::Background;
use crate::output::{ANIMATION_QUALITY, AnimationFormat};

use crate::cli::plan::shots::USUAL_FPS;
use crate::cli::plan::{Look, Series};

/// How all frames of a scene become one file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playing {
    pub format: AnimationFormat,
    /// Frames a second.
    pub fps: f64,
    /// Whether it starts over at its end.
    pub repeat: bool,
    /// 1 to 100, for formats that lose something.
    pub quality: u8,
    /// Which way a turntable is seen to turn.
    pub clockwise: bool,
}

/// The format of a name that stands for all frames. A `.webp` stands for one: frames to such a name are
/// numbered, as those to a `.png` are.
pub fn format(name: &std::path::Path) -> Option<AnimationFormat> {
    AnimationFormat::from_path(name).filter(|format| *format != AnimationFormat::Webp)
}

impl Playing {
    /// Refuses whatever is of single pictures, and says how to get there all the same.
    pub fn new(
        format: AnimationFormat,
        template: &PathTemplate,
        args: &OutputArgs,
        series: &Series,
        look: &Look,
    ) -> Result<Self, Usage> {
        let name = args.output.as_deref().unwrap_or("".as_ref()).display().to_string();
        let refused = |what: &str| Err(Usage(format!("-o {name}: {what}")));
        let then = "render frames (-o frames/####.png), then take blinn assemble";
        if !series.many {
            return refused(
                "a moving picture is of many: add --frames, take blinn turntable, or write a .png",
            );
        }
        if template.has_frame_number() {
            return refused("all frames go into one file: leave their number out of its name");
        }
        if let Some(share) = series.share {
            return refused(&format!("{share} leaves frames out: {then}"));
        }
        if args.resume {
            return refused(&format!("--resume keeps finished frames, which are not in it: {then}"));
        }
        if look.layers != Layers::default() {
            return refused(&format!("a moving picture has no --aov: {then} with those of a layer"));
        }
        if args.depth.as_deref().is_some_and(|depth| depth != "8") {
            return refused("a moving picture has 8 bits a channel: leave --depth out");
        }
        if args.quality.is_some() && !format.has_quality() {
            return refused("--quality is of .jpg, .mp4 and .html alone: leave it out");
        }
        if look.background == Background::Transparent && format == AnimationFormat::Mp4 {
            return refused("an MP4 has no transparency: give a --background COLOR, or write .apng or .html");
        }
        let fps = series.fps.unwrap_or(USUAL_FPS);
        if let Err(text) = format.check_rate(fps) {
            return refused(&text);
        }
        if let Some(size) = look.known_size()
            && let Err(text) = format.check_size(size)
        {
            return refused(&text);
        }
        Ok(Playing {
            format,
            fps,
            repeat: args.r#loop != Some(LoopArg::Once),
            quality: args.quality.unwrap_or(ANIMATION_QUALITY),
            clockwise: series.clockwise,
        })
    }
}
