//! GIF: each frame has its own palette and draws only the pixels that changed.

use std::io::{self, Write};

use ::gif::{DisposalMethod, Encoder as GifWriter, EncodingError, Frame, Repeat};

use super::dirty_rect::{crop, dirty_rect, full_rect};
use super::encoder::{AnimationSettings, Encoder, invalid_input};
use super::frame_timing::FrameTiming;
use super::palette::quantize;
use super::spool::Spool;
use blinn_core::worded;

/// Browsers play delays below two hundredths of a second as ten hundredths.
const MAX_FPS: f64 = 50.0;
const TRANSPARENT: [u8; 4] = [0; 4];

pub(super) struct Gif {
    width: u32,
    height: u32,
    timing: FrameTiming,
    writer: GifWriter<Vec<u8>>,
    /// The canvas before the pending frame is drawn.
    canvas: Vec<[u8; 4]>,
    /// The latest frame: the next one decides how it is disposed of.
    pending: Option<Vec<[u8; 4]>>,
    written_frames: u64,
}

fn timing(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks_per_second: 100.0 }
}

/// Checks that browsers play the delay, and that it fits 16 bits.
pub(super) fn check_rate(fps: f64) -> Result<(), String> {
    if fps > MAX_FPS || timing(fps).delay(0) > u64::from(u16::MAX) {
        return Err(worded!(
            "GIF has at most {} frames a second and at least one in 655 s, not {}; \
             set another `fps`, or write .apng or .mp4",
            MAX_FPS,
            fps
        ));
    }
    Ok(())
}

/// Width and height as 16-bit numbers.
fn sides((width, height): (u32, u32)) -> Result<(u16, u16), String> {
    match (u16::try_from(width), u16::try_from(height)) {
        (Ok(columns), Ok(rows)) => Ok((columns, rows)),
        _ => Err(format!("GIF has at most 65535 pixels a side, not {width}x{height}")),
    }
}

/// Checks that the sides fit 16 bits.
pub(super) fn check_size(size: (u32, u32)) -> Result<(), String> {
    sides(size).map(drop)
}

impl Gif {
    pub fn new(settings: &AnimationSettings) -> io::Result<Gif> {
        let AnimationSettings { width, height, fps, repeat, .. } = *settings;
        let (columns, rows) = sides((width, height)).map_err(invalid_input)?;
        let mut writer = GifWriter::new(Vec::new(), columns, rows, &[]).map_err(into_io_error)?;
        if repeat {
            writer.set_repeat(Repeat::Infinite).map_err(into_io_error)?;
        }
        let canvas = vec![TRANSPARENT; width as usize * height as usize];
        Ok(Gif { width, height, timing: timing(fps), writer, canvas, pending: None, written_frames: 0 })
    }

    /// Draws a frame over the canvas. With `clear`, the canvas is transparent afterwards: drawing cannot make a pixel
    /// transparent, which the next frame may need.
    fn write(&mut self, frame: Vec<[u8; 4]>, clear: bool, body: &mut Spool) -> io::Result<()> {
        let rect = if clear {
            full_rect(self.width, self.height)
        } else {
            // An unchanged frame still needs a pixel.
            dirty_rect(&self.canvas, &frame, self.width).unwrap_or(full_rect(1, 1))
        };
        let old = crop(&self.canvas, self.width, rect);
        let new = crop(&frame, self.width, rect);
        let changed = |(old, new): (&[u8; 4], &[u8; 4])| (old != new).then(|| [new[0], new[1], new[2]]);
        let pixels: Vec<_> = old.iter().zip(&new).map(changed).collect();
        let indexed = quantize(&pixels, rect.width as usize);
        // The rectangle lies within the canvas, whose sides fit 16 bits.
        let [left, top, width, height] = [rect.x, rect.y, rect.width, rect.height].map(|v| v as u16);
        self.writer
            .write_frame(&Frame {
                // At the slowest rates, rounding makes some delays one hundredth too long for 16 bits.
                delay: self.timing.delay(self.written_frames).min(u16::MAX.into()) as u16,
                dispose: if clear { DisposalMethod::Background } else { DisposalMethod::Keep },
                transparent: Some(indexed.transparent),
                needs_user_input: false,
                top,
                left,
                width,
                height,
                interlaced: false,
                palette: Some(indexed.palette),
                buffer: indexed.indices.into(),
            })
            .map_err(into_io_error)?;
        self.written_frames += 1;
        self.canvas = if clear { vec![TRANSPARENT; frame.len()] } else { frame };
        body.write_all(self.writer.get_ref())?;
        self.writer.get_mut().clear();
        Ok(())
    }
}

impl Encoder for Gif {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let binary_alpha = |p: &[u8; 4]| if p[3] < 128 { TRANSPARENT } else { [p[0], p[1], p[2], 255] };
        let next: Vec<_> = pixels.iter().map(binary_alpha).collect();
        if let Some(pending) = self.pending.take() {
            let vanishes = |(old, new): (&[u8; 4], &[u8; 4])| *new == TRANSPARENT && *old != TRANSPARENT;
            let clear = pending.iter().zip(&next).any(vanishes);
            self.write(pending, clear, body)?;
        }
        self.pending = Some(next);
        Ok(())
    }

    fn finish(mut self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        if let Some(pending) = self.pending.take() {
            self.write(pending, false, body)?;
        }
        body.write_all(&self.writer.into_inner().map_err(into_io_error)?)?;
        Ok(Vec::new())
    }
}

fn into_io_error(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(e) => e,
        other => io::Error::other(other),
    }
}
