//! MP4: H.264 frames by openh264. The index precedes the frames, so that playback starts before the file is loaded.

mod boxes;
mod level;

use std::io::{self, Write};

use openh264::encoder::{
    BitRate, Encoder as H264Encoder, EncoderConfig, FrameRate, IntraFramePeriod, Profile, QpRange,
    RateControlMode, VuiConfig,
};
use openh264::formats::YUVSlices;
use openh264::{OpenH264API, Timestamp};

use super::encoder::{AnimationSettings, Encoder, invalid_input};
use super::spool::Spool;
use super::yuv::Yuv420;
use blinn_core::worded;
use boxes::{Track, media_header, movie_header};
use level::StreamRate;

/// The largest frame of H.264's level 5.2 in openh264.
const MAX_SIZE: (u32, u32) = (3840, 2160);
/// The smallest side that openh264 encodes.
const MIN_SIDE: u32 = 16;
/// Ticks per frame; the timescale is the frame rate times this.
const FRAME_TICKS: u32 = 1000;
/// Bits per second. Level 5.2 allows it, and no animation reaches it: the quality is constant.
const MAX_BIT_RATE: u32 = 280_000_000;
/// The lowest rate that the encoder is told: at 1 a second it skips frames. Their times in the file are exact.
const MIN_ENCODER_RATE: f64 = 6.0;
/// The lowest quality, and how much it is lowered for a frame that exceeds the encoder's buffer.
const MAX_QP: u8 = 51;
const QP_STEP: u8 = 6;
/// Seconds between key frames.
const KEY_FRAME_INTERVAL: f64 = 2.0;

/// NAL unit types (ITU-T H.264, table 7-1).
mod nal {
    pub const IDR_SLICE: u8 = 5;
    pub const SEQUENCE_PARAMETER_SET: u8 = 7;
    pub const PICTURE_PARAMETER_SET: u8 = 8;
    /// The bits of a unit's first byte that hold its type.
    pub const TYPE_MASK: u8 = 31;
}

pub(super) struct Mp4 {
    settings: AnimationSettings,
    encoder: H264Encoder,
    /// Quantiser of the encoder.
    qp: u8,
    track: Track,
}

/// Ticks per second.
fn timescale(fps: f64) -> f64 {
    (fps * f64::from(FRAME_TICKS)).round()
}

/// Checks that the timescale is a positive 32-bit number.
pub(super) fn check_rate(fps: f64) -> Result<(), String> {
    if (1.0..=1e9).contains(&timescale(fps)) {
        return Ok(());
    }
    Err(worded!("MP4 has 0.001 to 1000000 frames a second, not {}; set another `fps`", fps))
}

/// Checks that openh264 encodes frames of this size.
pub(super) fn check_size((width, height): (u32, u32)) -> Result<(), String> {
    let (max_long, max_short) = MAX_SIZE;
    let long = width.max(height);
    let short = width.min(height);
    if long <= max_long && short <= max_short && short >= MIN_SIDE {
        return Ok(());
    }
    Err(worded!(
        "MP4 has at most {}x{} pixels, in portrait or landscape, and at least {} a side, \
         not {}x{}; render in another `size`, or write .apng",
        max_long,
        max_short,
        MIN_SIDE,
        width,
        height
    ))
}

/// The quantiser of a quality from 1 to 100.
fn quantiser(quality: u8) -> u8 {
    (f32::from(MAX_QP) - 0.35 * f32::from(quality.clamp(1, 100))).round() as u8
}

/// The encoder of a quantiser.
fn h264_encoder(settings: &AnimationSettings, qp: u8) -> io::Result<H264Encoder> {
    H264Encoder::with_api_config(OpenH264API::from_source(), encoder_config(settings, qp))
        .map_err(io::Error::other)
}

/// Constant quality on one thread: the same bytes on every machine.
fn encoder_config(settings: &AnimationSettings, qp: u8) -> EncoderConfig {
    let fps = settings.fps;
    let key_frame_period = (fps * KEY_FRAME_INTERVAL).ceil().clamp(1.0, 1e4) as u32;
    EncoderConfig::new()
        .profile(Profile::High)
        .rate_control_mode(RateControlMode::Quality)
        .bitrate(BitRate::from_bps(MAX_BIT_RATE))
        .qp(QpRange::new(qp, qp))
        // Never happens at this bit rate, but without it the encoder prints a warning.
        .skip_frames(true)
        .max_frame_rate(FrameRate::from_hz(fps.max(MIN_ENCODER_RATE) as f32))
        .intra_frame_period(IntraFramePeriod::from_num_frames(key_frame_period))
        .scene_change_detect(false)
        .background_detection(false)
        .adaptive_quantization(false)
        .num_threads(1)
        .vui(VuiConfig::bt709())
}

impl Mp4 {
    pub fn new(settings: &AnimationSettings) -> io::Result<Mp4> {
        let qp = quantiser(settings.quality);
        let even = |side: u32| side.next_multiple_of(2) as u16;
        Ok(Mp4 {
            settings: *settings,
            encoder: h264_encoder(settings, qp)?,
            qp,
            track: Track {
                width: even(settings.width),
                height: even(settings.height),
                timescale: timescale(settings.fps) as u32,
                frame_ticks: FRAME_TICKS,
                ..Track::default()
            },
        })
    }

    /// Encodes a frame to an H.264 byte stream. A frame with more detail than the encoder's buffer holds, such as noise,
    /// and those after it have a lower quality.
    fn encode(&mut self, pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
        let AnimationSettings { width, height, fps, .. } = self.settings;
        let yuv = Yuv420::from_rgba(pixels, width as usize, height as usize);
        let strides = (yuv.width, yuv.width / 2, yuv.width / 2);
        let source = YUVSlices::new((&yuv.y, &yuv.u, &yuv.v), (yuv.width, yuv.height), strides);
        let start = self.track.frame_sizes.len() as f64 * 1000.0 / fps.max(MIN_ENCODER_RATE);
        let timestamp = Timestamp::from_millis(start.min(1e15) as u64);
        loop {
            let error = match self.encoder.encode_at(&source, timestamp) {
                Ok(stream) => return Ok(stream.to_vec()),
                Err(error) => error,
            };
            if self.qp == MAX_QP {
                return Err(io::Error::other(error));
            }
            self.qp = (self.qp + QP_STEP).min(MAX_QP);
            self.encoder = h264_encoder(&self.settings, self.qp)?;
        }
    }

    /// Converts a frame from start codes to the length prefixes of MP4, and keeps its parameter sets.
    fn sample(&mut self, stream: &[u8]) -> io::Result<Sample> {
        let mut sample = Sample::default();
        for unit in openh264::nal_units(stream) {
            // A start code is zeros and a one.
            let start = unit.iter().position(|&byte| byte != 0).map_or(unit.len(), |one| one + 1);
            let unit = unit.get(start..).unwrap_or_default();
            match unit.first().map(|byte| byte & nal::TYPE_MASK) {
                Some(nal::SEQUENCE_PARAMETER_SET) => self.track.sequence_parameter_set = unit.to_vec(),
                Some(nal::PICTURE_PARAMETER_SET) => self.track.picture_parameter_set = unit.to_vec(),
                Some(kind) => {
                    sample.is_key_frame |= kind == nal::IDR_SLICE;
                    let length = u32::try_from(unit.len()).map_err(io::Error::other)?;
                    sample.bytes.extend(length.to_be_bytes());
                    sample.bytes.extend(unit);
                }
                None => {}
            }
        }
        Ok(sample)
    }

    /// Sets the lowest level that holds the stream in its parameter set; the encoder's own is that of its maximum
    /// bit rate.
    fn set_level(&mut self, bytes: u64) {
        /// The byte of a sequence parameter set that holds the level.
        const LEVEL_BYTE: usize = 3;
        let AnimationSettings { width, height, fps, .. } = self.settings;
        let frames = self.track.frame_sizes.len();
        let level = StreamRate::new(width, height, fps, bytes, frames).level();
        if let Some(byte) = self.track.sequence_parameter_set.get_mut(LEVEL_BYTE) {
            *byte = level;
        }
    }
}

/// A frame as MP4 stores it: slices with length prefixes.
#[derive(Default)]
struct Sample {
    bytes: Vec<u8>,
    is_key_frame: bool,
}

impl Encoder for Mp4 {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        if pixels.iter().any(|p| p[3] < 255) {
            return Err(invalid_input(worded!(
                "MP4 has no transparency; set `background COLOR`, or write .webp, .apng, .gif or .html"
            )));
        }
        let stream = self.encode(pixels)?;
        let sample = self.sample(&stream)?;
        if sample.bytes.is_empty() {
            return Err(io::Error::other("openh264 skipped a frame"));
        }
        self.track.frame_sizes.push(u32::try_from(sample.bytes.len()).map_err(io::Error::other)?);
        if sample.is_key_frame {
            self.track.key_frames.push(self.track.frame_sizes.len() as u32);
        }
        body.write_all(&sample.bytes)
    }

    fn finish(mut self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        self.set_level(body.length());
        let media_header = media_header(body.length());
        // The index holds the offset of the frames, which follow it. Its length does not depend on the offset.
        let length = movie_header(&self.track, 0)?.len() + media_header.len();
        let mut head = movie_header(&self.track, length as u64)?;
        head.extend(media_header);
        Ok(head)
    }
}
