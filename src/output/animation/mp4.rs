//! MP4: H.264 by openh264, with the index in front of the frames, so that playing starts before all is
//! loaded.

use std::io::{self, Write};

use mp4_atom::{
    Avc1, Avcc, Co64, Codec, Colr, Dinf, Dref, Encode, FourCC, Ftyp, Hdlr, Mdhd, Mdia, Minf, Moov, Mvhd,
    Pasp, Stbl, Stco, Stsc, StscEntry, Stsd, Stss, Stsz, StszSamples, Stts, SttsEntry, Tkhd, Trak, Url,
    Visual, Vmhd,
};
use openh264::encoder::{
    BitRate, Encoder as H264, EncoderConfig, FrameRate, IntraFramePeriod, Profile, QpRange, RateControlMode,
    VuiConfig,
};
use openh264::formats::YUVSlices;
use openh264::{OpenH264API, Timestamp};

use crate::output::animation::spool::Spool;
use crate::output::animation::yuv::Planes;
use crate::output::animation::{AnimationSettings, Encoder, invalid};

/// What H.264's level 5.2 ends at, in the encoder's words.
const MOST: (u32, u32) = (3840, 2160);
const LEAST: u32 = 16;
/// Each frame lasts so many ticks; a second is the rate times as many.
const FRAME_TICKS: u32 = 1000;
/// Bits a second that no picture reaches, and level 5.2 allows.
const RATE: u32 = 280_000_000;
/// Seconds between frames that can be jumped to.
const SEEK: f64 = 2.0;

/// Levels of the standard's table A-1: number, and the most macroblocks a second, macroblocks a frame and
/// bits a second (High profile) that a player of that level can be asked for.
const LEVELS: [(u8, f64, u32, f64); 8] = [
    (30, 40_500.0, 1_620, 12.5e6),
    (31, 108_000.0, 3_600, 17.5e6),
    (32, 216_000.0, 5_120, 25e6),
    (40, 245_760.0, 8_192, 25e6),
    (42, 522_240.0, 8_704, 62.5e6),
    (50, 589_824.0, 22_080, 168.75e6),
    (51, 983_040.0, 36_864, 300e6),
    (52, 2_073_600.0, 36_864, 300e6),
];

/// NAL units that are no slices of frames.
const SEQUENCE: u8 = 7;
const PICTURE: u8 = 8;
/// Slices of a frame that stands alone.
const INDEPENDENT: u8 = 5;

pub(crate) struct Mp4 {
    settings: AnimationSettings,
    timescale: u32,
    encoder: H264,
    /// The stream's two parameter sets.
    sequence: Vec<u8>,
    picture: Vec<u8>,
    /// Bytes of each frame.
    sizes: Vec<u32>,
    /// Numbers, from 1, of frames that stand alone.
    independent: Vec<u32>,
}

/// Ticks of its clock in a second.
fn ticks(fps: f64) -> f64 {
    (fps * f64::from(FRAME_TICKS)).round()
}

/// Says what is wrong with a rate that there is no clock for.
pub(crate) fn check_rate(fps: f64) -> Result<(), String> {
    if (1.0..=1e9).contains(&ticks(fps)) {
        return Ok(());
    }
    Err(format!("an MP4 has .001 to 1000000 frames a second, not {fps}: give another --fps"))
}

/// Says what is wrong with a size that the encoder does not take.
pub(crate) fn check_size((width, height): (u32, u32)) -> Result<(), String> {
    let (long, short) = (width.max(height), width.min(height));
    if long <= MOST.0 && short <= MOST.1 && short >= LEAST {
        return Ok(());
    }
    Err(format!(
        "an MP4 has at most {}x{} pixels, upright or not, and at least {LEAST} a side, not \
         {width}x{height}: give another --size, or write .apng",
        MOST.0, MOST.1
    ))
}

impl Mp4 {
    pub fn new(settings: &AnimationSettings) -> io::Result<Mp4> {
        let AnimationSettings { fps, quality, .. } = *settings;
        let qp = (51.0 - 0.35 * f32::from(quality.clamp(1, 100))).round() as u8;
        let config = EncoderConfig::new()
            .profile(Profile::High)
            // Quality is constant; the rate is what that takes.
            .rate_control_mode(RateControlMode::Quality)
            .bitrate(BitRate::from_bps(RATE))
            .qp(QpRange::new(qp, qp))
            // Needless at such a rate, but without it the encoder warns on standard error.
            .skip_frames(true)
            .max_frame_rate(FrameRate::from_hz(fps as f32))
            .intra_frame_period(IntraFramePeriod::from_num_frames((fps * SEEK).ceil().clamp(1.0, 1e4) as u32))
            .scene_change_detect(false)
            .background_detection(false)
            .adaptive_quantization(false)
            // One thread: the same bytes on every machine.
            .num_threads(1)
            .vui(VuiConfig::bt709());
        Ok(Mp4 {
            settings: *settings,
            timescale: ticks(fps) as u32,
            encoder: H264::with_api_config(OpenH264API::from_source(), config).map_err(io::Error::other)?,
            sequence: Vec::new(),
            picture: Vec::new(),
            sizes: Vec::new(),
            independent: Vec::new(),
        })
    }

    /// The least level that holds what was encoded: the encoder would say what its highest rate needs.
    fn level(&self, bytes: u64) -> u8 {
        let AnimationSettings { width, height, fps, .. } = self.settings;
        let blocks = width.div_ceil(16) * height.div_ceil(16);
        let speed = f64::from(blocks) * fps;
        let rate = bytes as f64 * 8.0 * fps / self.sizes.len().max(1) as f64;
        let holds = |(_, fastest, largest, most): &&(u8, f64, u32, f64)| {
            speed <= *fastest && blocks <= *largest && rate <= *most
        };
        LEVELS.iter().find(holds).unwrap_or(&LEVELS[LEVELS.len() - 1]).0
    }

    /// What a player has to know before the frames, which begin at byte `offset`.
    fn index(&self, offset: u64) -> io::Result<Vec<u8>> {
        let too_long = || invalid("it has too many frames for an MP4".into());
        let frames = u32::try_from(self.sizes.len()).map_err(|_| too_long())?;
        let duration = u64::from(frames) * u64::from(FRAME_TICKS);
        let even = |side: u32| side.next_multiple_of(2) as u16;
        let (width, height) = (even(self.settings.width), even(self.settings.height));
        let codec = Avc1 {
            visual: Visual { data_reference_index: 1, width, height, ..Default::default() },
            avcc: Avcc::new(&self.sequence, &self.picture).map_err(io::Error::other)?,
            btrt: None,
            colr: Some(Colr::Nclx {
                colour_primaries: 1,
                transfer_characteristics: 1,
                matrix_coefficients: 1,
                full_range_flag: false,
            }),
            pasp: Some(Pasp { h_spacing: 1, v_spacing: 1 }),
            taic: None,
            fiel: None,
            spatial: None,
        };
        // One chunk holds all.
        let stbl = Stbl {
            stsd: Stsd { codecs: vec![Codec::from(codec)] },
            stts: Stts { entries: vec![SttsEntry { sample_count: frames, sample_delta: FRAME_TICKS }] },
            stss: Some(Stss { entries: self.independent.clone() }),
            stsc: Stsc {
                entries: vec![StscEntry {
                    first_chunk: 1,
                    samples_per_chunk: frames,
                    sample_description_index: 1,
                }],
            },
            stsz: Stsz { samples: StszSamples::Different { sizes: self.sizes.clone() } },
            stco: u32::try_from(offset).ok().map(|offset| Stco { entries: vec![offset] }),
            co64: u32::try_from(offset).is_err().then(|| Co64 { entries: vec![offset] }),
            ..Default::default()
        };
        let minf = Minf {
            vmhd: Some(Vmhd::default()),
            dinf: Dinf { dref: Dref { entries: vec![Url::default().into()] } },
            stbl,
            ..Default::default()
        };
        let moov = Moov {
            mvhd: Mvhd {
                timescale: self.timescale,
                duration,
                rate: 1.into(),
                volume: 1.into(),
                next_track_id: 2,
                ..Default::default()
            },
            trak: vec![Trak {
                tkhd: Tkhd {
                    track_id: 1,
                    duration,
                    enabled: true,
                    in_movie: true,
                    width: width.into(),
                    height: height.into(),
                    ..Default::default()
                },
                mdia: Mdia {
                    mdhd: Mdhd {
                        timescale: self.timescale,
                        duration,
                        language: "und".into(),
                        ..Default::default()
                    },
                    hdlr: Hdlr { handler: FourCC::new(b"vide"), name: "video".into() },
                    minf,
                },
                ..Default::default()
            }],
            ..Default::default()
        };
        let brands = [b"isom", b"iso2", b"avc1", b"mp41"].map(FourCC::new);
        let ftyp = Ftyp { major_brand: brands[0], minor_version: 512, compatible_brands: brands.into() };
        let mut head = Vec::new();
        ftyp.encode(&mut head).map_err(io::Error::other)?;
        moov.encode(&mut head).map_err(io::Error::other)?;
        Ok(head)
    }
}

impl Encoder for Mp4 {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        if pixels.iter().any(|p| p[3] < 255) {
            return Err(invalid(
                "an MP4 has no transparency: give a --background COLOR, or write .webp, .apng, .gif or .html"
                    .into(),
            ));
        }
        let planes = Planes::of(pixels, self.settings.width as usize, self.settings.height as usize);
        let strides = (planes.width, planes.width / 2, planes.width / 2);
        let source =
            YUVSlices::new((&planes.y, &planes.u, &planes.v), (planes.width, planes.height), strides);
        let begin = self.sizes.len() as f64 * 1000.0 / self.settings.fps;
        let stream = self
            .encoder
            .encode_at(&source, Timestamp::from_millis(begin.min(1e15) as u64))
            .map_err(io::Error::other)?;

        let mut frame = Vec::new();
        let mut alone = false;
        for unit in openh264::nal_units(&stream.to_vec()) {
            // Between zeros and a one that say that it begins, which an MP4 says by lengths.
            let begin = unit.iter().position(|&byte| byte != 0).map_or(unit.len(), |one| one + 1);
            let unit = unit.get(begin..).unwrap_or_default();
            match unit.first().map(|byte| byte & 31) {
                Some(SEQUENCE) => self.sequence = unit.to_vec(),
                Some(PICTURE) => self.picture = unit.to_vec(),
                Some(kind) => {
                    alone |= kind == INDEPENDENT;
                    let length = u32::try_from(unit.len()).map_err(io::Error::other)?;
                    frame.extend(length.to_be_bytes());
                    frame.extend(unit);
                }
                None => {}
            }
        }
        if frame.is_empty() {
            return Err(io::Error::other("openh264 left out a frame"));
        }
        self.sizes.push(u32::try_from(frame.len()).map_err(io::Error::other)?);
        if alone {
            self.independent.push(self.sizes.len() as u32);
        }
        body.write_all(&frame)
    }

    fn finish(mut self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        let level = self.level(body.length());
        if let Some(byte) = self.sequence.get_mut(3) {
            *byte = level;
        }
        // A box's length has 32 bits, or 64 after a length of one.
        let media = match u32::try_from(body.length() + 8) {
            Ok(length) => [&length.to_be_bytes()[..], b"mdat"].concat(),
            Err(_) => [&1u32.to_be_bytes()[..], b"mdat", &(body.length() + 16).to_be_bytes()].concat(),
        };
        // The index says where the frames begin, which is after the index: its length does not depend on that.
        let length = self.index(0)?.len() + media.len();
        let mut head = self.index(length as u64)?;
        head.extend(media);
        Ok(head)
    }
}
