//! `blinn assemble`: finished frames → a moving picture.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use image::ImageReader;

use crate::cli::args::{AssembleArgs, DirectionArg, LoopArg};
use crate::cli::run::panics::caught;
use crate::cli::run::progress::Reporter;
use crate::cli::run::scene_job::folder_of;
use crate::cli::run::sequence::{frames, missing};
use crate::cli::{Summary, Usage, describe, one_line};
use crate::display::{Background, composite_over};
use crate::import::image::jpeg;
use crate::output::{ANIMATION_QUALITY, AnimationFile, AnimationFormat, AnimationSettings, Overwrite};

/// What a frame may take while it is decoded.
const MOST_BYTES: u64 = 4 << 30;

pub(crate) fn run(args: &AssembleArgs) -> Result<Summary, Usage> {
    let output = &args.output;
    let Some(format) = AnimationFormat::from_path(output) else {
        let name = output.display();
        return Err(Usage(format!("-o {name}: the name must end in .gif, .apng, .webp, .mp4 or .html")));
    };
    if args.quality.is_some() && !format.has_quality() {
        return Err(Usage("--quality is of .webp, .mp4 and .html alone: leave it out".into()));
    }
    if args.direction.is_some() && format != AnimationFormat::Html {
        return Err(Usage("--direction is of .html alone: leave it out".into()));
    }
    format.check_rate(args.fps).map_err(|text| Usage(format!("-o {}: {text}", output.display())))?;
    let reporter = Reporter::new(&args.telling, 1, args.quiet);
    let failure = caught(|| assemble(args, format, &reporter)).err().map(|e| one_line(&describe(output, &e)));
    if let Some(line) = &failure {
        reporter.fail(None, line);
    }
    let mut summary = Summary::default();
    summary.add(failure);
    reporter.done(&summary);
    Ok(summary)
}

fn assemble(args: &AssembleArgs, format: AnimationFormat, reporter: &Reporter) -> Result<()> {
    let frames = frames(&args.frames, &args.output)?;
    if let Some(numbers) = missing(&frames) {
        let text = format!("frames are missing: {numbers}");
        if args.strict {
            bail!("{text} (an error because of --strict)");
        }
        reporter.warn(&args.output, &text);
    }
    let Some((first, rest)) = frames.split_first() else { bail!("there are no frames") };
    let opening = read(first)?;
    let settings = AnimationSettings {
        width: opening.width,
        height: opening.height,
        fps: args.fps,
        repeat: args.r#loop == LoopArg::Forever,
        quality: args.quality.unwrap_or(ANIMATION_QUALITY),
        overwrite: if args.no_overwrite { Overwrite::No } else { Overwrite::Yes },
        clockwise: args.direction == Some(DirectionArg::Cw),
    };
    folder_of(&args.output)?;
    let mut moving = AnimationFile::create(&args.output, format, &settings)?;
    let mut push = |mut frame: Opened, path: &Path| -> Result<()> {
        if (frame.width, frame.height) != (settings.width, settings.height) {
            bail!(
                "{} is {}x{}, and {} {}x{}: frames of one picture have one size",
                path.display(),
                frame.width,
                frame.height,
                first.display(),
                settings.width,
                settings.height
            );
        }
        if let Some(Background::Color(background)) = args.background {
            frame.pixels.iter_mut().for_each(|pixel| *pixel = composite_over(*pixel, background));
        }
        moving.push(&frame.pixels).map_err(|e| anyhow::Error::new(e).context(path.display().to_string()))
    };
    reporter.frames(&args.output, frames.len());
    let step = || reporter.watch(&args.output, 1).finish();
    push(opening, first)?;
    step();
    for path in rest {
        push(read(path)?, path)?;
        step();
    }
    moving.finish()?;
    reporter.wrote(None, &args.output);
    Ok(())
}

/// A frame as its file has it.
struct Opened {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
}

fn read(path: &PathBuf) -> Result<Opened> {
    let cannot = || format!("{} cannot be read as a frame", path.display());
    // By what is in it, whatever its name.
    let bytes = std::fs::read(path).with_context(cannot)?;
    if bytes.is_empty() {
        bail!("{}: it is empty", cannot());
    }
    let mut reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().with_context(cannot)?;
    use image::ImageFormat::{Jpeg, Png, WebP};
    if !matches!(reader.format(), Some(Png | Jpeg | WebP)) {
        bail!("{}: frames are .png, .jpg or .webp", path.display());
    }
    if reader.format() == Some(Jpeg) && !jpeg::is_complete(&bytes) {
        bail!("{} cannot be read as a frame: it is cut off", path.display());
    }
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    // What it says has its cause in it.
    let image = reader.decode().map_err(|e| anyhow!("{}: {e}", cannot()))?.into_rgba8();
    let (width, height) = image.dimensions();
    Ok(Opened { width, height, pixels: image.into_raw().as_chunks::<4>().0.to_vec() })
}
