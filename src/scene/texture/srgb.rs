//! sRGB's encoding (IEC 61966-2-1): light to what files and screens hold, and back.

use std::sync::OnceLock;

use glam::Vec4;

/// An encoded value in 0…1 to linear light.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The way back: linear light in 0…1 to an encoded value.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

/// The byte of linear light, rounded exactly; 0 and 255 for less and more than there is, 0 for what is
/// no number.
pub fn linear_to_srgb8(v: f32) -> u8 {
    /// The light at which each byte gives way to the next, and the byte of the least light in each
    /// bucket: those of a power of two are as wide, and narrower than any byte's light, so that at most
    /// one byte ends within each.
    struct Bytes {
        ends: [f32; 256],
        first: [u8; BUCKETS + 1],
    }
    /// Below all but the first byte.
    const LEAST: f32 = 1.0 / 8192.0;
    const SHIFT: u32 = 23 - 7;
    const BUCKETS: usize = 13 << 7;
    static BYTES: OnceLock<Bytes> = OnceLock::new();
    let bytes = BYTES.get_or_init(|| {
        let ends = std::array::from_fn(|i| {
            let e = (i as f64 + 0.5) / 255.0;
            let linear = if e <= 0.04045 { e / 12.92 } else { libm::pow((e + 0.055) / 1.055, 2.4) };
            // The last has no end.
            if i < 255 { linear as f32 } else { f32::INFINITY }
        });
        let low = |i: usize| f32::from_bits(LEAST.to_bits() + ((i as u32) << SHIFT));
        let below = |i: usize| ends.partition_point(|&end: &f32| end <= low(i));
        Bytes { ends, first: std::array::from_fn(|i| below(i) as u8) }
    });
    // NaN, too, is less.
    let v = if v > LEAST { v.min(1.0) } else { LEAST };
    let first = bytes.first[((v.to_bits() - LEAST.to_bits()) >> SHIFT) as usize];
    first + u8::from(v >= bytes.ends[usize::from(first)])
}

/// What each byte stands for.
pub(crate) fn from_8() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)))
}

/// What each number of 16 bits stands for.
pub(crate) fn from_16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=u16::MAX).map(|i| srgb_to_linear(f32::from(i) / 65535.0)).collect())
}

/// Colours, not alpha, from sRGB to linear light.
pub(crate) fn decode_colors(v: Vec4) -> Vec4 {
    Vec4::new(decode(v.x), decode(v.y), decode(v.z), v.w)
}

/// [`srgb_to_linear`] between two bytes, within 1e-5 of it.
fn decode(v: f32) -> f32 {
    let x = (v * 255.0).clamp(0.0, 255.0);
    let low = (x as usize).min(254);
    let [a, b] = [from_8()[low], from_8()[low + 1]];
    a + (b - a) * (x - low as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoding_between_bytes_is_near() {
        for i in 0..=4096 {
            let v = i as f32 / 4096.0;
            assert!((decode(v) - srgb_to_linear(v)).abs() < 1e-5, "{v}");
        }
    }

    #[test]
    fn encoding_finds_the_nearest_byte() {
        for i in 0..=100_000 {
            let v = i as f32 / 100_000.0;
            let exact = linear_to_srgb(v) * 255.0;
            assert!((exact - f32::from(linear_to_srgb8(v))).abs() < 0.501, "{v}: {exact}");
        }
        // On both sides of where one byte gives way to the next.
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
    fn bytes_round_trip_through_linear_light() {
        for byte in 0..=255u8 {
            let linear = srgb_to_linear(f32::from(byte) / 255.0);
            assert_eq!(linear_to_srgb8(linear), byte);
            assert!((linear_to_srgb(linear) * 255.0 - f32::from(byte)).abs() < 1e-3);
        }
    }
}
