//! APNG (PNG specification, third edition). The `png` crate compresses the dirty rectangle of each frame as a PNG of
//! its own, whose data move to the animation's `IDAT` and `fdAT` chunks.

use std::io;

use ::png::{BitDepth, ColorType, Compression, SrgbRenderingIntent};

use super::dirty_rect::{crop, dirty_rect, full_rect};
use super::encoder::{AnimationSettings, Encoder};
use super::frame_timing::FrameTiming;
use super::spool::Spool;
use crate::png_chunks::{SIGNATURE, chunks, write_chunk};
use blinn_core::worded;
use blinn_render::PixelRect;

/// Denominator of all delays, whose numerators have 16 bits.
const TICKS_PER_SECOND: u16 = 10_000;

/// `dispose_op` and `blend_op` of a frame that stays, and whose pixels replace those below it, alpha included.
const DISPOSE_NONE_BLEND_SOURCE: [u8; 2] = [0, 0];

pub(super) struct Apng {
    settings: AnimationSettings,
    timing: FrameTiming,
    previous: Vec<[u8; 4]>,
    frame_count: u32,
    /// Sequence number of the next `fcTL` or `fdAT` chunk.
    sequence_number: u32,
    /// The first frame's chunks before its data: header and colour space.
    header_chunks: Vec<u8>,
}

fn timing(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks_per_second: f64::from(TICKS_PER_SECOND) }
}

/// Checks that the delay of a frame fits 16 bits.
pub(super) fn check_rate(fps: f64) -> Result<(), String> {
    if timing(fps).delay(0) <= u64::from(u16::MAX) {
        return Ok(());
    }
    Err(worded!("APNG has at least one frame in 6.5 s, not {} frames a second; set another `fps`", fps))
}

impl Apng {
    pub fn new(settings: &AnimationSettings) -> Apng {
        Apng {
            settings: *settings,
            timing: timing(settings.fps),
            previous: Vec::new(),
            frame_count: 0,
            sequence_number: 0,
            header_chunks: Vec::new(),
        }
    }

    fn next_sequence_number(&mut self) -> [u8; 4] {
        let number = self.sequence_number;
        self.sequence_number += 1;
        number.to_be_bytes()
    }

    /// The `fcTL` chunk of the current frame.
    fn frame_control(&mut self, rect: PixelRect) -> Vec<u8> {
        let delay = self.timing.delay(u64::from(self.frame_count)).min(u64::from(u16::MAX)) as u16;
        let mut control = self.next_sequence_number().to_vec();
        for number in [rect.width, rect.height, rect.x, rect.y] {
            control.extend(number.to_be_bytes());
        }
        control.extend(delay.to_be_bytes());
        control.extend(TICKS_PER_SECOND.to_be_bytes());
        control.extend(DISPOSE_NONE_BLEND_SOURCE);
        control
    }
}

impl Encoder for Apng {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let AnimationSettings { width, height, .. } = self.settings;
        let is_first = self.frame_count == 0;
        let rect = if is_first {
            full_rect(width, height)
        } else {
            // An unchanged frame still needs a pixel.
            dirty_rect(&self.previous, pixels, width).unwrap_or(full_rect(1, 1))
        };
        let png = compress(rect.width, rect.height, &crop(pixels, width, rect))?;

        let control = self.frame_control(rect);
        write_chunk(body, b"fcTL", &control)?;
        for (name, data) in chunks(&png) {
            match name {
                b"IDAT" if is_first => write_chunk(body, b"IDAT", data)?,
                b"IDAT" => {
                    let number = self.next_sequence_number();
                    write_chunk(body, b"fdAT", &[&number, data].concat())?;
                }
                b"IEND" => {}
                _ if is_first => write_chunk(&mut self.header_chunks, name, data)?,
                _ => {}
            }
        }
        self.frame_count += 1;
        self.previous.clear();
        self.previous.extend_from_slice(pixels);
        Ok(())
    }

    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        write_chunk(body, b"IEND", &[])?;
        // 0 plays loop forever.
        let plays: u32 = if self.settings.repeat { 0 } else { 1 };
        let mut head = SIGNATURE.to_vec();
        head.extend(&self.header_chunks);
        write_chunk(&mut head, b"acTL", &[self.frame_count.to_be_bytes(), plays.to_be_bytes()].concat())?;
        Ok(head)
    }
}

/// Compresses a PNG with alpha: all frames share the header of the first.
fn compress(width: u32, height: u32, pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut out, width, height);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()?;
    Ok(out)
}
