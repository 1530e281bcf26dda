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
    /// The light at which each byte gives way to the next, and the byte at each of so many steps of
    /// light: from there it is a step or two.
    struct Bytes {
        ends: [f32; 255],
        first: [u8; STEPS + 1],
    }
    const STEPS: usize = 4095;
    static BYTES: OnceLock<Bytes> = OnceLock::new();
    let bytes = BYTES.get_or_init(|| {
        let ends = std::array::from_fn(|i| {
            let e = (i as f64 + 0.5) / 255.0;
            let linear = if e <= 0.04045 { e / 12.92 } else { libm::pow((e + 0.055) / 1.055, 2.4) };
            linear as f32
        });
        let below = |i: usize| ends.partition_point(|&end: &f32| end <= i as f32 / STEPS as f32);
        Bytes { ends, first: std::array::from_fn(|i| below(i) as u8) }
    });
    let mut byte = bytes.first[(v.clamp(0.0, 1.0) * STEPS as f32) as usize];
    while byte < 255 && v >= bytes.ends[usize::from(byte)] {
        byte += 1;
    }
    byte
}

/// What each byte stands for.
pub(super) fn from_8() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)))
}

/// What each number of 16 bits stands for.
pub(super) fn from_16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=u16::MAX).map(|i| srgb_to_linear(f32::from(i) / 65535.0)).collect())
}

/// Colours, not alpha, from sRGB to linear light.
pub(super) fn decode_colors(v: Vec4) -> Vec4 {
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
