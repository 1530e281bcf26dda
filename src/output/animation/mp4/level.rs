//! Levels of H.264: limits that a player must support (ITU-T H.264, table A-1).

/// A level and its limits for the High profile.
struct Level {
    /// Ten times the level, as in a sequence parameter set.
    number: u8,
    macroblocks_per_second: f64,
    macroblocks_per_frame: u32,
    bits_per_second: f64,
}

const fn level(
    number: u8,
    macroblocks_per_second: f64,
    macroblocks_per_frame: u32,
    bits_per_second: f64,
) -> Level {
    Level { number, macroblocks_per_second, macroblocks_per_frame, bits_per_second }
}

const LEVELS: [Level; 8] = [
    level(30, 40_500.0, 1_620, 12.5e6),
    level(31, 108_000.0, 3_600, 17.5e6),
    level(32, 216_000.0, 5_120, 25e6),
    level(40, 245_760.0, 8_192, 25e6),
    level(42, 522_240.0, 8_704, 62.5e6),
    level(50, 589_824.0, 22_080, 168.75e6),
    level(51, 983_040.0, 36_864, 300e6),
    level(52, 2_073_600.0, 36_864, 300e6),
];

/// The decoding rate that a stream requires of a player.
pub(super) struct StreamRate {
    macroblocks_per_frame: u32,
    macroblocks_per_second: f64,
    bits_per_second: f64,
}

impl StreamRate {
    /// The mean rates of a stream of `frames` frames in `bytes` bytes.
    pub fn new(width: u32, height: u32, fps: f64, bytes: u64, frames: usize) -> StreamRate {
        let macroblocks_per_frame = width.div_ceil(16) * height.div_ceil(16);
        StreamRate {
            macroblocks_per_frame,
            macroblocks_per_second: f64::from(macroblocks_per_frame) * fps,
            bits_per_second: bytes as f64 * 8.0 * fps / frames.max(1) as f64,
        }
    }

    /// The lowest level that holds the stream, or the highest one.
    pub fn level(&self) -> u8 {
        let holds = |level: &&Level| {
            self.macroblocks_per_second <= level.macroblocks_per_second
                && self.macroblocks_per_frame <= level.macroblocks_per_frame
                && self.bits_per_second <= level.bits_per_second
        };
        LEVELS.iter().find(holds).unwrap_or(&LEVELS[LEVELS.len() - 1]).number
    }
}
