//! Animated WebP (Google's WebP container specification). libwebp compresses the dirty rectangle of each frame, whose
//! data move to the animation's `ANMF` chunks.

use std::io;

use super::dirty_rect::{crop, dirty_rect, full_rect};
use super::encoder::{AnimationSettings, Encoder, invalid_input};
use super::frame_timing::FrameTiming;
use super::spool::Spool;
use crate::riff::{chunks, write_chunk};
use blinn_core::worded;
use blinn_render::PixelRect;

/// Largest number of pixels a side.
const MAX_SIDE: u32 = 16_383;
/// Longest delay: 24 bits of milliseconds.
const MAX_DELAY: u64 = 0xff_ffff;

/// Flags of the `VP8X` chunk.
const ANIMATION_FLAG: u8 = 0x02;
const ALPHA_FLAG: u8 = 0x10;
/// Flag of an `ANMF` chunk: the frame replaces the pixels below it, and stays.
const DO_NOT_BLEND: u8 = 0x02;

pub(super) struct Webp {
    settings: AnimationSettings,
    timing: FrameTiming,
    previous: Vec<[u8; 4]>,
    frame_count: u64,
    has_alpha: bool,
}

fn timing(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks_per_second: 1000.0 }
}

/// Checks that frames last between a millisecond and the longest delay.
pub(super) fn check_rate(fps: f64) -> Result<(), String> {
    if fps <= 1000.0 && timing(fps).delay(0) <= MAX_DELAY {
        return Ok(());
    }
    Err(worded!("WebP has 0.00006 to 1000 frames a second, not {}; set another `fps`", fps))
}

/// Checks the number of pixels a side.
pub(super) fn check_size((width, height): (u32, u32)) -> Result<(), String> {
    if width.max(height) <= MAX_SIDE {
        return Ok(());
    }
    Err(format!("WebP has at most {MAX_SIDE} pixels a side, not {width}x{height}"))
}

impl Webp {
    pub fn new(settings: &AnimationSettings) -> Webp {
        Webp {
            settings: *settings,
            timing: timing(settings.fps),
            previous: Vec::new(),
            frame_count: 0,
            has_alpha: false,
        }
    }

    /// The dirty rectangle, extended to start at even coordinates, as the container demands.
    fn frame_rect(&self, pixels: &[[u8; 4]]) -> PixelRect {
        let AnimationSettings { width, height, .. } = self.settings;
        if self.frame_count == 0 {
            return full_rect(width, height);
        }
        // An unchanged frame still needs a pixel.
        let rect = dirty_rect(&self.previous, pixels, width).unwrap_or(full_rect(1, 1));
        let x = rect.x & !1;
        let y = rect.y & !1;
        PixelRect { x, y, width: rect.width + (rect.x - x), height: rect.height + (rect.y - y) }
    }
}

impl Encoder for Webp {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let rect = self.frame_rect(pixels);
        let part = crop(pixels, self.settings.width, rect);
        self.has_alpha |= part.iter().any(|p| p[3] < 255);
        let webp = compress(rect.width, rect.height, &part, self.settings.quality)?;

        let mut frame = Vec::with_capacity(webp.len() + 16);
        let delay = self.timing.delay(self.frame_count).min(MAX_DELAY) as u32;
        for number in [rect.x / 2, rect.y / 2, rect.width - 1, rect.height - 1, delay] {
            frame.extend(low_24_bits(number));
        }
        frame.push(DO_NOT_BLEND);
        for (name, data) in chunks(&webp).filter(|(name, _)| [b"ALPH", b"VP8 ", b"VP8L"].contains(name)) {
            write_chunk(&mut frame, name, data)?;
        }
        write_chunk(body, b"ANMF", &frame)?;
        self.frame_count += 1;
        self.previous.clear();
        self.previous.extend_from_slice(pixels);
        Ok(())
    }

    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        let mut after_length = b"WEBP".to_vec();
        let flags = ANIMATION_FLAG | if self.has_alpha { ALPHA_FLAG } else { 0 };
        let mut features = vec![flags, 0, 0, 0];
        features.extend(low_24_bits(self.settings.width - 1));
        features.extend(low_24_bits(self.settings.height - 1));
        write_chunk(&mut after_length, b"VP8X", &features)?;
        // 0 plays loop forever.
        let plays: u16 = if self.settings.repeat { 0 } else { 1 };
        let transparent_background = [0; 4];
        write_chunk(
            &mut after_length,
            b"ANIM",
            &[&transparent_background, &plays.to_le_bytes()[..]].concat(),
        )?;
        let length = u32::try_from(after_length.len() as u64 + body.length()).map_err(|_| {
            invalid_input("WebP has at most 4 GiB; write .mp4, or fewer or smaller frames".into())
        })?;
        let mut head = b"RIFF".to_vec();
        head.extend(length.to_le_bytes());
        head.extend(after_length);
        Ok(head)
    }
}

/// Compresses one image; lossless at quality 100.
pub(super) fn compress(width: u32, height: u32, pixels: &[[u8; 4]], quality: u8) -> io::Result<Vec<u8>> {
    let encoder = ::webp::Encoder::from_rgba(pixels.as_flattened(), width, height);
    let encoded = encoder.encode_simple(quality >= 100, f32::from(quality));
    encoded.map(|bytes| bytes.to_vec()).map_err(|e| io::Error::other(format!("libwebp failed: {e:?}")))
}

fn low_24_bits(number: u32) -> [u8; 3] {
    let [a, b, c, _] = number.to_le_bytes();
    [a, b, c]
}
