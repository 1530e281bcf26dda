//! The sRGB transfer function (IEC 61966-2-1).

use std::sync::OnceLock;

use glam::Vec4;

/// Decodes an sRGB value in 0…1 to linear light.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// Encodes linear light in 0…1 as an sRGB value.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

/// Encodes linear light as an sRGB byte, rounded exactly. Clamps to 0…255; NaN gives 0.
#[inline]
pub fn linear_to_srgb8(v: f32) -> u8 {
    EncodeTable::get().encode(v)
}

/// A lookup table over the high bits of an f32. The buckets of one power of two have equal widths, narrower than the light
/// of any byte, so that at most one threshold between bytes lies within each.
pub(super) struct EncodeTable {
    /// The byte at the lower end of each bucket, shifted by [`EncodeTable::SHIFT`], plus the number that makes the low bits of
    /// light at the threshold, if there is one, carry to the next byte.
    buckets: [u32; EncodeTable::SIZE],
}

impl EncodeTable {
    /// Lower end of the first bucket; below it, every byte is 0.
    const LOW: f32 = 1.0 / 8192.0;
    const SHIFT: u32 = 23 - 7;
    /// Index of the bucket of 1, the last one.
    const LAST: usize = 13 << 7;
    /// A power of two, for lookups without branches.
    const SIZE: usize = (EncodeTable::LAST + 1).next_power_of_two();

    /// Returns the table.
    #[inline]
    pub fn get() -> &'static EncodeTable {
        static TABLE: OnceLock<EncodeTable> = OnceLock::new();
        TABLE.get_or_init(EncodeTable::new)
    }

    fn new() -> EncodeTable {
        // The light at which each byte ends. The last byte has no end.
        let thresholds: [f32; 255] = std::array::from_fn(|i| {
            let e = (i as f64 + 0.5) / 255.0;
            let linear = if e <= 0.04045 { e / 12.92 } else { libm::pow((e + 0.055) / 1.055, 2.4) };
            linear as f32
        });
        let bucket = |i: usize| {
            let low = EncodeTable::LOW.to_bits() + ((i as u32) << EncodeTable::SHIFT);
            let byte = thresholds.partition_point(|&end| end <= f32::from_bits(low));
            let width = 1 << EncodeTable::SHIFT;
            let to_threshold = thresholds.get(byte).map_or(width, |end| (end.to_bits() - low).min(width));
            ((byte as u32) << EncodeTable::SHIFT) + (width - to_threshold)
        };
        EncodeTable { buckets: std::array::from_fn(|i| bucket(i.min(EncodeTable::LAST))) }
    }

    /// Encodes as [`linear_to_srgb8`] does.
    #[inline(always)]
    pub fn encode(&self, v: f32) -> u8 {
        let [byte] = self.encode_lanes(&[v]);
        byte
    }

    /// Encodes several values side by side.
    #[inline(always)]
    pub fn encode_lanes<const N: usize>(&self, values: &[f32; N]) -> [u8; N] {
        let mut offsets = [0; N];
        for (offset, &v) in offsets.iter_mut().zip(values) {
            // NaN compares false and becomes LOW.
            let v = if v > Self::LOW { v } else { Self::LOW };
            let v = if v < 1.0 { v } else { 1.0 };
            *offset = v.to_bits() - Self::LOW.to_bits();
        }
        let mut sums = [0; N];
        for (sum, offset) in sums.iter_mut().zip(offsets) {
            *sum = self.buckets[(offset >> Self::SHIFT) as usize % Self::SIZE];
        }
        let mut bytes = [0; N];
        for (i, byte) in bytes.iter_mut().enumerate() {
            *byte = ((sums[i] + (offsets[i] & ((1 << Self::SHIFT) - 1))) >> Self::SHIFT) as u8;
        }
        bytes
    }
}

/// Encodes linear light in 0…1 as 16 bits, to the value of [`linear_to_srgb`], rounded.
#[inline]
pub(super) fn linear_to_srgb16(v: f32) -> u16 {
    EncodeTable16::get().encode(v)
}

/// Parabolas through the 16-bit values of light, for each bucket of the high bits of an f32. Where a value is close to the
/// threshold between two integers, [`linear_to_srgb`] decides.
struct EncodeTable16 {
    /// Coefficients over a bucket, from 0 to 1, with the half that rounds.
    parabolas: [[f32; 3]; EncodeTable16::BUCKETS],
}

impl EncodeTable16 {
    /// Lower end of the first bucket.
    const LOW: f32 = 1.0 / 512.0;
    const SHIFT: u32 = 23 - 7;
    const BUCKETS: usize = 9 << 7;
    /// Bounds the errors of a parabola, 0.01, and of [`linear_to_srgb`], 0.013.
    const MARGIN: f32 = 1.0 / 32.0;

    fn get() -> &'static EncodeTable16 {
        static TABLE: OnceLock<EncodeTable16> = OnceLock::new();
        TABLE.get_or_init(|| {
            let low = |i: usize| f32::from_bits(Self::LOW.to_bits() + ((i as u32) << Self::SHIFT));
            let value = |v: f64| (1.055 * libm::pow(v, 1.0 / 2.4) - 0.055) * 65535.0;
            let parabola = |i: usize| {
                let (start, end) = (f64::from(low(i)), f64::from(low(i + 1)));
                let [a, b, c] = [start, (start + end) / 2.0, end].map(value);
                let square = 2.0 * (a - 2.0 * b + c);
                [a + 0.5, c - a - square, square].map(|v| v as f32)
            };
            EncodeTable16 { parabolas: std::array::from_fn(parabola) }
        })
    }

    #[inline]
    fn encode(&self, v: f32) -> u16 {
        if v > 0.003_130_8 && v < 1.0 {
            let offset = v.to_bits() - Self::LOW.to_bits();
            let [a, b, c] = self.parabolas[(offset >> Self::SHIFT) as usize];
            let t = (offset & ((1 << Self::SHIFT) - 1)) as f32 / (1 << Self::SHIFT) as f32;
            let rounded = a + t * (b + t * c);
            let value = rounded as u16;
            let rest = rounded - f32::from(value);
            if rest > Self::MARGIN && rest < 1.0 - Self::MARGIN {
                return value;
            }
        }
        (linear_to_srgb(v) * 65535.0 + 0.5) as u16
    }
}

/// Returns the linear light of each byte.
#[inline]
pub(super) fn decode_table_8() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)))
}

/// Returns the linear light of each 16-bit value.
#[inline]
pub(super) fn decode_table_16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=u16::MAX).map(|i| srgb_to_linear(f32::from(i) / 65535.0)).collect())
}

/// Decodes colours from sRGB to linear light, within 1e-5 of [`srgb_to_linear`]. Alpha is unchanged.
#[inline(always)]
pub(super) fn decode_colors(v: Vec4) -> Vec4 {
    let [r, g, b, _] = DecodeTable::get().decode(&v.to_array());
    Vec4::new(r, g, b, v.w)
}

/// The table of bytes with its steps, which decodes several values side by side.
pub(super) struct DecodeTable {
    light: [f32; 256],
    /// From each byte's light to the next's.
    steps: [f32; 256],
}

impl DecodeTable {
    /// Returns the table.
    #[inline]
    pub fn get() -> &'static DecodeTable {
        static TABLE: OnceLock<DecodeTable> = OnceLock::new();
        TABLE.get_or_init(|| {
            let light = *decode_table_8();
            let steps = std::array::from_fn(|i| light[(i + 1).min(255)] - light[i]);
            DecodeTable { light, steps }
        })
    }

    /// Returns the light of encoded values: the table, interpolated.
    #[inline(always)]
    pub fn decode<const N: usize>(&self, values: &[f32; N]) -> [f32; N] {
        // Numbers from here to its double are integers, which the lowest bits hold.
        const INTEGERS: f32 = 8_388_608.0;
        let (mut rest, mut low) = ([0.0; N], [0; N]);
        for (i, v) in values.iter().enumerate() {
            let x = (v * 255.0).clamp(0.0, 255.0);
            let rounded = (x + INTEGERS) - INTEGERS;
            let floor = if rounded > x { rounded - 1.0 } else { rounded };
            let floor = floor.min(254.0);
            rest[i] = x - floor;
            low[i] = (floor + INTEGERS).to_bits() & 0xff;
        }
        let (mut light, mut steps) = ([0.0; N], [0.0; N]);
        for (i, low) in low.into_iter().enumerate() {
            light[i] = self.light[(low & 0xff) as usize];
            steps[i] = self.steps[(low & 0xff) as usize];
        }
        for i in 0..N {
            light[i] += steps[i] * rest[i];
        }
        light
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Interpolates the table by its definition.
    fn decode(v: f32) -> f32 {
        let x = (v * 255.0).clamp(0.0, 255.0);
        let low = (x as usize).min(254);
        let [a, b] = [decode_table_8()[low], decode_table_8()[low + 1]];
        a + (b - a) * (x - low as f32)
    }

    #[test]
    fn values_side_by_side_are_decoded_to_the_same_bits() {
        let last = 1.0f32.next_up();
        for i in 0..=65536u32 {
            let v = i as f32 / 65536.0;
            let values = [v, v.next_up(), v.next_down().max(0.0), i as f32 / 255.0, last, -v, v + 1.0];
            let bits = |light: [f32; 7]| light.map(f32::to_bits);
            assert_eq!(bits(DecodeTable::get().decode(&values)), bits(values.map(decode)), "{v}");
        }
    }

    #[test]
    fn interpolated_decoding_is_within_its_bound() {
        for i in 0..=4096 {
            let v = i as f32 / 4096.0;
            let light = decode_colors(Vec4::splat(v));
            assert!((light.x - srgb_to_linear(v)).abs() < 1e-5 && light.w == v, "{v}");
        }
    }

    #[test]
    fn encoding_rounds_to_the_nearest_byte() {
        for i in 0..=100_000 {
            let v = i as f32 / 100_000.0;
            let exact = linear_to_srgb(v) * 255.0;
            assert!((exact - f32::from(linear_to_srgb8(v))).abs() < 0.501, "{v}: {exact}");
        }
        // Both sides of the thresholds between bytes.
        for byte in 0..255u8 {
            let end = (f64::from(byte) + 0.5) / 255.0;
            let light = if end <= 0.04045 { end / 12.92 } else { libm::pow((end + 0.055) / 1.055, 2.4) };
            let light = light as f32;
            assert_eq!(
                [light.next_down(), light, light.next_up()].map(linear_to_srgb8),
                [byte, byte + 1, byte + 1]
            );
        }
        assert_eq!([0.5, f32::NAN, 2.0, f32::INFINITY, -1.0].map(linear_to_srgb8), [188, 0, 255, 255, 0]);
    }

    #[test]
    fn sixteen_bits_are_those_of_the_function() {
        let end = 1.0f32.to_bits() + 200;
        let values = (0.002f32.to_bits()..end).step_by(61).chain(end - 1000..end).map(f32::from_bits);
        for v in values.chain([0.0, 1e-30, -1.0, 2.0, f32::NAN, f32::INFINITY]) {
            assert_eq!(linear_to_srgb16(v), (linear_to_srgb(v) * 65535.0 + 0.5) as u16, "{v}");
        }
    }

    #[test]
    fn bytes_round_trip_through_linear_light() {
        for byte in 0..=255u8 {
            let linear = srgb_to_linear(f32::from(byte) / 255.0);
            assert_eq!(linear_to_srgb8(linear), byte);
            assert!((linear_to_srgb(linear) * 255.0 - f32::from(byte)).abs() < 1e-3);
        }
    }
}
