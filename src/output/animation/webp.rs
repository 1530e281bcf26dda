//! Animated WebP: frames are the parts of the picture that changed, each compressed by libwebp, in the
//! container that Google's specification has for animations.

use std::io::{self, Write};

use crate::output::animation::dirty_rect::{Rect, changed};
use crate::output::animation::frame_timing::FrameTiming;
use crate::output::animation::spool::Spool;
use crate::output::animation::{AnimationSettings, Encoder, invalid};

/// Most pixels a side.
const MOST: u32 = 16_383;
/// Longest delay: 24 bits of milliseconds.
const LONGEST: u64 = 0xff_ffff;

const ANIMATED: u8 = 0x02;
const ALPHA: u8 = 0x10;
/// Of a frame: its pixels take the place of those below, and stay.
const REPLACE: u8 = 0x02;

pub(crate) struct Webp {
    settings: AnimationSettings,
    clock: FrameTiming,
    before: Vec<[u8; 4]>,
    frames: u64,
    alpha: bool,
}

fn clock(fps: f64) -> FrameTiming {
    FrameTiming { fps, ticks: 1000.0 }
}

/// Says what is wrong with a rate that its milliseconds cannot count.
pub(crate) fn check_rate(fps: f64) -> Result<(), String> {
    if fps <= 1000.0 && clock(fps).delay(0) <= LONGEST {
        return Ok(());
    }
    Err(format!("a WebP counts milliseconds, 24 bits of them: --fps {fps}"))
}

impl Webp {
    pub fn new(settings: &AnimationSettings) -> io::Result<Webp> {
        let (settings, clock) = (*settings, clock(settings.fps));
        Ok(Webp { settings, clock, before: Vec::new(), frames: 0, alpha: false })
    }
}

impl Encoder for Webp {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let width = self.settings.width;
        let rect = if self.frames == 0 {
            Rect::whole(width, self.settings.height)
        } else {
            // Frames begin at even places. One that changes nothing has a pixel all the same.
            let rect = changed(&self.before, pixels, width).unwrap_or(Rect::whole(1, 1));
            let (x, y) = (rect.x & !1, rect.y & !1);
            Rect { x, y, width: rect.width + (rect.x - x), height: rect.height + (rect.y - y) }
        };
        let part = rect.cut(pixels, width);
        self.alpha |= part.iter().any(|p| p[3] < 255);
        let webp = compress(rect.width, rect.height, &part, self.settings.quality)?;

        let mut frame = Vec::with_capacity(webp.len() + 16);
        let delay = self.clock.delay(self.frames).min(LONGEST) as u32;
        for number in [rect.x / 2, rect.y / 2, rect.width - 1, rect.height - 1, delay] {
            frame.extend(three(number));
        }
        frame.push(REPLACE);
        for (name, data) in chunks(&webp).filter(|(name, _)| [b"ALPH", b"VP8 ", b"VP8L"].contains(name)) {
            chunk(&mut frame, name, data)?;
        }
        chunk(body, b"ANMF", &frame)?;
        self.frames += 1;
        self.before.clear();
        self.before.extend_from_slice(pixels);
        Ok(())
    }

    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        let mut after = b"WEBP".to_vec();
        let mut features = vec![ANIMATED | if self.alpha { ALPHA } else { 0 }, 0, 0, 0];
        features.extend(three(self.settings.width - 1));
        features.extend(three(self.settings.height - 1));
        chunk(&mut after, b"VP8X", &features)?;
        let plays: u16 = if self.settings.repeat { 0 } else { 1 };
        // The background is nothing; nobody shows it.
        chunk(&mut after, b"ANIM", &[&[0; 4], &plays.to_le_bytes()[..]].concat())?;
        let length = u32::try_from(after.len() as u64 + body.length()).map_err(|_| {
            invalid("a WebP has at most 4 GiB: write .mp4, or fewer or smaller frames".into())
        })?;
        let mut head = b"RIFF".to_vec();
        head.extend(length.to_le_bytes());
        head.extend(after);
        Ok(head)
    }
}

/// Says what is wrong with a size that no WebP has.
pub(crate) fn check_size((width, height): (u32, u32)) -> Result<(), String> {
    if width.max(height) <= MOST {
        return Ok(());
    }
    Err(format!("a WebP has at most {MOST} pixels a side, not {width}x{height}"))
}

/// A WebP of one picture; without loss at quality 100.
pub(crate) fn compress(width: u32, height: u32, pixels: &[[u8; 4]], quality: u8) -> io::Result<Vec<u8>> {
    let encoder = ::webp::Encoder::from_rgba(pixels.as_flattened(), width, height);
    let encoded = encoder.encode_simple(quality >= 100, f32::from(quality));
    encoded.map(|bytes| bytes.to_vec()).map_err(|e| io::Error::other(format!("libwebp says {e:?}")))
}

/// Names and data of a WebP's chunks.
fn chunks(webp: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = webp.get(12..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (name, after) = rest.split_first_chunk::<4>()?;
        let (length, after) = after.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        let (data, after) = after.split_at_checked(length)?;
        rest = after.get(length % 2..).unwrap_or_default();
        Some((name, data))
    })
}

fn chunk(out: &mut dyn Write, name: &[u8; 4], data: &[u8]) -> io::Result<()> {
    let length = u32::try_from(data.len()).map_err(|_| invalid("a frame of 4 GiB".into()))?;
    out.write_all(name)?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(data)?;
    out.write_all(&[0][..data.len() % 2])
}

/// 24 bits.
fn three(number: u32) -> [u8; 3] {
    let [a, b, c, _] = number.to_le_bytes();
    [a, b, c]
}
