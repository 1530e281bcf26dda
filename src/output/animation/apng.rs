//! APNG: frames are the parts of the picture that changed, each compressed as a PNG of its own by the
//! `png` crate, whose data go into the chunks that the specification has for animations.

use std::io::{self, Write};

use crate::output::animation::dirty_rect::{Rect, changed};
use crate::output::animation::frame_timing::FrameTiming;
use crate::output::animation::spool::Spool;
use crate::output::animation::{AnimationSettings, Encoder, invalid};

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Ticks of a delay a second: what can be said of all frames in 16 bits of a fraction.
const TICKS: u16 = 10_000;

pub(crate) struct Apng {
    settings: AnimationSettings,
    clock: FrameTiming,
    before: Vec<[u8; 4]>,
    frames: u32,
    /// Chunks of animation are numbered, frames and data alike.
    sequence: u32,
    /// The first frame's chunks: header, and what says of colours.
    head: Vec<u8>,
}

fn clock(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks: f64::from(TICKS) }
}

/// Says what is wrong with a rate that no delay is long enough for.
pub(crate) fn check_rate(fps: f64) -> Result<(), String> {
    if clock(fps).delay(0) <= u64::from(u16::MAX) {
        return Ok(());
    }
    Err(format!("an APNG's frame lasts 6.5 s at most: a rate of {fps} frames a second is too low"))
}

impl Apng {
    pub fn new(settings: &AnimationSettings) -> io::Result<Apng> {
        let (settings, clock) = (*settings, clock(settings.fps));
        Ok(Apng { settings, clock, before: Vec::new(), frames: 0, sequence: 0, head: Vec::new() })
    }

    fn next_number(&mut self) -> [u8; 4] {
        let number = self.sequence;
        self.sequence += 1;
        number.to_be_bytes()
    }
}

impl Encoder for Apng {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let first = self.frames == 0;
        let rect = if first {
            Rect::whole(self.settings.width, self.settings.height)
        } else {
            // A frame that changes nothing has a pixel all the same.
            changed(&self.before, pixels, self.settings.width).unwrap_or(Rect::whole(1, 1))
        };
        let delay = self.clock.delay(u64::from(self.frames)).min(u64::from(u16::MAX)) as u16;
        let png = compress(rect.width, rect.height, &rect.cut(pixels, self.settings.width))?;

        let mut control = self.next_number().to_vec();
        for number in [rect.width, rect.height, rect.x, rect.y] {
            control.extend(number.to_be_bytes());
        }
        control.extend(delay.to_be_bytes());
        control.extend(TICKS.to_be_bytes());
        // It stays, and its pixels, alpha too, take the place of those below.
        control.extend([0, 0]);
        chunk(body, b"fcTL", &control)?;
        for (name, data) in chunks(&png) {
            match name {
                b"IDAT" if first => chunk(body, b"IDAT", data)?,
                b"IDAT" => {
                    let number = self.next_number();
                    chunk(body, b"fdAT", &[&number, data].concat())?;
                }
                b"IEND" => {}
                _ if first => chunk(&mut self.head, name, data)?,
                _ => {}
            }
        }
        self.frames += 1;
        self.before.clear();
        self.before.extend_from_slice(pixels);
        Ok(())
    }

    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        chunk(body, b"IEND", &[])?;
        let plays: u32 = if self.settings.repeat { 0 } else { 1 };
        let mut head = SIGNATURE.to_vec();
        head.extend(&self.head);
        chunk(&mut head, b"acTL", &[self.frames.to_be_bytes(), plays.to_be_bytes()].concat())?;
        Ok(head)
    }
}

/// A PNG. All frames have the header of the first, so all have alpha.
fn compress(width: u32, height: u32, pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()?;
    Ok(out)
}

/// Names and data of a PNG's chunks.
fn chunks(png: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = png.get(SIGNATURE.len()..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (name, after) = after.split_first_chunk::<4>()?;
        let (data, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        rest = after.get(4..)?;
        Some((name, data))
    })
}

fn chunk(out: &mut dyn Write, name: &[u8; 4], data: &[u8]) -> io::Result<()> {
    let length = u32::try_from(data.len()).map_err(|_| invalid("a frame of 4 GiB".into()))?;
    let mut sum = crc32fast::Hasher::new();
    sum.update(name);
    sum.update(data);
    out.write_all(&length.to_be_bytes())?;
    out.write_all(name)?;
    out.write_all(data)?;
    out.write_all(&sum.finalize().to_be_bytes())
}
