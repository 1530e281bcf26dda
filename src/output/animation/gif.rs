//! GIF: each frame has its own palette, and draws only the pixels that changed.

use std::io::{self, Write};

use ::gif::{DisposalMethod, Encoder as Writer, EncodingError, Frame, Repeat};

use crate::output::animation::dirty_rect::{Rect, changed};
use crate::output::animation::frame_timing::FrameTiming;
use crate::output::animation::palette::quantise;
use crate::output::animation::spool::Spool;
use crate::output::animation::{AnimationSettings, Encoder, invalid};

/// Browsers show frames of less than two hundredths as if they had ten.
const MOST_FRAMES: f64 = 50.0;
const NOTHING: [u8; 4] = [0; 4];

pub(crate) struct Gif {
    width: u32,
    height: u32,
    clock: FrameTiming,
    writer: Writer<Vec<u8>>,
    /// What is on the screen before the held frame is drawn.
    below: Vec<[u8; 4]>,
    /// The latest frame: the next one decides what becomes of it.
    held: Option<Vec<[u8; 4]>>,
    written: u64,
}

fn clock(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks: 100.0 }
}

/// Says what is wrong with a rate that there is no delay for.
pub(crate) fn check_rate(fps: f64) -> Result<(), String> {
    if fps > MOST_FRAMES || clock(fps).delay(0) > u64::from(u16::MAX) {
        return Err(format!(
            "a GIF has at most {MOST_FRAMES} frames a second, and one in 655 s at least, not {fps}: \
             give another --fps, or write .apng or .mp4"
        ));
    }
    Ok(())
}

/// Columns and rows in the numbers of a GIF.
fn sides((width, height): (u32, u32)) -> Result<(u16, u16), String> {
    match (u16::try_from(width), u16::try_from(height)) {
        (Ok(columns), Ok(rows)) => Ok((columns, rows)),
        _ => Err(format!("a GIF has at most 65535 pixels a side, not {width}x{height}")),
    }
}

/// Says what is wrong with a size that no GIF has.
pub(crate) fn check_size(size: (u32, u32)) -> Result<(), String> {
    sides(size).map(drop)
}

impl Gif {
    pub fn new(settings: &AnimationSettings) -> io::Result<Gif> {
        let AnimationSettings { width, height, fps, repeat, .. } = *settings;
        let (columns, rows) = sides((width, height)).map_err(invalid)?;
        let clock = clock(fps);
        let mut writer = Writer::new(Vec::new(), columns, rows, &[]).map_err(plain)?;
        if repeat {
            writer.set_repeat(Repeat::Infinite).map_err(plain)?;
        }
        let below = vec![NOTHING; width as usize * height as usize];
        Ok(Gif { width, height, clock, writer, below, held: None, written: 0 })
    }

    /// Draws a frame over what is below it. Where the one after it has to take pixels away, which no
    /// drawing can, it clears the whole screen behind it.
    fn write(&mut self, frame: Vec<[u8; 4]>, clear: bool, body: &mut Spool) -> io::Result<()> {
        let rect = match changed(&self.below, &frame, self.width) {
            _ if clear => Rect::whole(self.width, self.height),
            Some(rect) => rect,
            None => Rect::whole(1, 1),
        };
        let (old, new) = (rect.cut(&self.below, self.width), rect.cut(&frame, self.width));
        let drawn = |(old, new): (&[u8; 4], &[u8; 4])| (old != new).then(|| [new[0], new[1], new[2]]);
        let pixels: Vec<_> = old.iter().zip(&new).map(drawn).collect();
        let indexed = quantise(&pixels, rect.width as usize);
        // All fit: they are within the screen, whose sides do.
        let [left, top, width, height] = [rect.x, rect.y, rect.width, rect.height].map(|v| v as u16);
        self.writer
            .write_frame(&Frame {
                // Of a rate that is barely allowed, single delays are one hundredth too many.
                delay: self.clock.delay(self.written).min(u16::MAX.into()) as u16,
                dispose: if clear { DisposalMethod::Background } else { DisposalMethod::Keep },
                transparent: Some(indexed.nothing),
                needs_user_input: false,
                top,
                left,
                width,
                height,
                interlaced: false,
                palette: Some(indexed.palette),
                buffer: indexed.indices.into(),
            })
            .map_err(plain)?;
        self.written += 1;
        self.below = if clear { vec![NOTHING; frame.len()] } else { frame };
        body.write_all(self.writer.get_ref())?;
        self.writer.get_mut().clear();
        Ok(())
    }
}

impl Encoder for Gif {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        // Alpha is on or off.
        let solid = |p: &[u8; 4]| if p[3] < 128 { NOTHING } else { [p[0], p[1], p[2], 255] };
        let next: Vec<_> = pixels.iter().map(solid).collect();
        if let Some(held) = self.held.take() {
            let clear = held.iter().zip(&next).any(|(old, new)| *new == NOTHING && *old != NOTHING);
            self.write(held, clear, body)?;
        }
        self.held = Some(next);
        Ok(())
    }

    fn finish(mut self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        if let Some(held) = self.held.take() {
            self.write(held, false, body)?;
        }
        body.write_all(&self.writer.into_inner().map_err(plain)?)?;
        Ok(Vec::new())
    }
}

fn plain(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(e) => e,
        other => io::Error::other(other),
    }
}
