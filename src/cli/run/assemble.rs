//! `blinn assemble`: makes an animation from finished frames.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use image::ImageReader;

use super::frame_files::{frame_files, missing_numbers};
use super::panics;
use super::progress::{ImageMonitor, Reporter, SceneLog};
use crate::args::{AssembleArgs, DirectionArg, LoopArg};
use crate::console::{scene_error, single_line, strict_error};
use crate::files::create_parent_folder;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_import::image::jpeg;
use blinn_output::{ANIMATION_QUALITY, AnimationFile, AnimationFormat, AnimationSettings, Overwrite};
use blinn_render::display::{Background, composite_over};

/// Memory limit for decoding a frame, in bytes.
const MAX_DECODE_BYTES: u64 = 4 << 30;

pub fn run(args: &AssembleArgs) -> Result<Summary, UsageError> {
    let output = &args.output;
    let name = output.display();
    let Some(format) = AnimationFormat::from_path(output) else {
        return Err(UsageError(worded!(
            "`output` {}: the name must end in .gif, .apng, .webp, .mp4 or .html",
            name
        )));
    };
    if args.encoder_quality.is_some() && !format.has_quality() {
        return Err(UsageError(worded!(
            "`encoder-quality` applies only to .webp, .mp4 and .html; remove it"
        )));
    }
    if args.direction.is_some() && format != AnimationFormat::Html {
        return Err(UsageError(worded!("`direction` applies only to .html; remove it")));
    }
    format.check_rate(args.fps).map_err(|text| UsageError(worded!("`output` {}: {}", name, text)))?;
    let reporter = Reporter::new(&args.log, 1, args.quiet);
    let failure = panics::catch(|| assemble(args, format, &reporter)).err();
    let failure = failure.map(|error| single_line(&scene_error(output, &error)));
    if let Some(line) = &failure {
        reporter.fail(None, line);
    }
    let mut summary = Summary::default();
    summary.add_scene(failure);
    reporter.done(&summary);
    Ok(summary)
}

fn assemble(args: &AssembleArgs, format: AnimationFormat, reporter: &Reporter) -> Result<()> {
    let files = frame_files(&args.frames, &args.output)?;
    if let Some(numbers) = missing_numbers(&files) {
        let warning = format!("missing frames: {numbers}");
        if args.strict {
            return Err(strict_error(warning));
        }
        reporter.warn(&args.output, &warning);
    }
    let Some((first, rest)) = files.split_first() else { bail!("there are no frames") };
    let first_frame = FrameImage::read(first)?;
    let settings = AnimationSettings {
        width: first_frame.width,
        height: first_frame.height,
        fps: args.fps,
        repeat: args.r#loop == LoopArg::Forever,
        quality: args.encoder_quality.unwrap_or(ANIMATION_QUALITY),
        overwrite: if args.no_overwrite { Overwrite::No } else { Overwrite::Yes },
        clockwise: args.direction == Some(DirectionArg::Cw),
    };
    create_parent_folder(&args.output)?;
    let mut animation = AnimationFile::create(&args.output, format, &settings)?;
    let log = SceneLog::new(reporter, &args.output, false);
    log.begin_frames(files.len());
    let mut push = |mut frame: FrameImage, path: &Path| -> Result<()> {
        let (width, height) = (settings.width, settings.height);
        if (frame.width, frame.height) != (width, height) {
            bail!(
                "{} is {}x{}, but {} is {width}x{height}; all frames must have the same size",
                path.display(),
                frame.width,
                frame.height,
                first.display(),
            );
        }
        if let Some(Background::Color(background)) = args.background {
            frame.pixels.iter_mut().for_each(|pixel| *pixel = composite_over(*pixel, background));
        }
        animation
            .push(&frame.pixels)
            .map_err(|e| anyhow::Error::new(e).context(path.display().to_string()))?;
        ImageMonitor::new(&log, 1, &CancelToken::default()).finish();
        Ok(())
    };
    push(first_frame, first)?;
    for path in rest {
        push(FrameImage::read(path)?, path)?;
    }
    animation.finish()?;
    reporter.wrote(None, &args.output);
    Ok(())
}

/// A decoded frame.
struct FrameImage {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
}

impl FrameImage {
    /// Reads a PNG, JPEG or WebP, recognized by its content.
    fn read(path: &PathBuf) -> Result<FrameImage> {
        use image::ImageFormat::{Jpeg, Png, WebP};
        let unreadable = || format!("{} cannot be read as a frame", path.display());
        let bytes = std::fs::read(path).with_context(unreadable)?;
        if bytes.is_empty() {
            bail!("{}: the file is empty", unreadable());
        }
        let mut reader =
            ImageReader::new(Cursor::new(&bytes)).with_guessed_format().with_context(unreadable)?;
        if !matches!(reader.format(), Some(Png | Jpeg | WebP)) {
            bail!("{}: a frame must be a .png, .jpg or .webp", path.display());
        }
        if reader.format() == Some(Jpeg) && !jpeg::is_complete(&bytes) {
            bail!("{}: the file is truncated", unreadable());
        }
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(MAX_DECODE_BYTES);
        reader.limits(limits);
        // The message of an `ImageError` includes its cause.
        let image = reader.decode().map_err(|e| anyhow!("{}: {e}", unreadable()))?.into_rgba8();
        let (width, height) = image.dimensions();
        Ok(FrameImage { width, height, pixels: image.into_raw().as_chunks::<4>().0.to_vec() })
    }
}
