//! Filters: transform each element of an attribute stream after decoding.
//!
//! The specification allows an error of one unit in the last place. The order of operations and the rounding
//! are those of the scalar reference decoder, so the bytes are the same on every machine. Elements outside
//! the allowed range yield meaningless values but do not panic.

use super::reader::Decoded;

/// Transform of each element after decoding; indices have none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Checks that a filter supports the stride.
pub(super) fn check_stride(filter: Filter, stride: usize) -> Decoded<()> {
    match (filter, stride) {
        (Filter::None | Filter::Exponential, _) => Ok(()),
        (Filter::Octahedral | Filter::Color, 4 | 8) | (Filter::Quaternion, 8 | 16) => Ok(()),
        _ => Err("the meshopt filter does not support the stride"),
    }
}

/// Bytes of each element after a filter; `None` for those of the stream. Quaternions are packed whatever the stride is: from
/// version 5.2 on, Blender gives that of four floats, and the rotations are the first half of what the stream decodes to.
pub(in super::super) fn packed_stride(filter: Filter) -> Option<usize> {
    (filter == Filter::Quaternion).then_some(QUATERNION_BYTES)
}

const QUATERNION_BYTES: usize = 8;

/// Filters elements in place. The stride has been checked.
pub(super) fn apply(filter: Filter, stride: usize, data: &mut [u8]) {
    match (filter, stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => map_bytes(data, |v| octahedral(v.map(|c| i32::from(c as i8)), 127.0)),
        (Filter::Octahedral, _) => {
            map_words(data, |v| octahedral(v.map(|c| i32::from(c as i16)), 32767.0));
        }
        (Filter::Quaternion, _) => {
            let packed = data.len() / stride * QUATERNION_BYTES;
            map_words(&mut data[..packed], |v| quaternion(v.map(|c| i32::from(c as i16))));
        }
        (Filter::Exponential, _) => {
            for word in data.as_chunks_mut().0 {
                *word = exponential(i32::from_le_bytes(*word)).to_le_bytes();
            }
        }
        // Luma and alpha are unsigned, both chroma components signed.
        (Filter::Color, 4) => map_bytes(data, |[y, co, cg, a]| {
            color([i32::from(y), i32::from(co as i8), i32::from(cg as i8), i32::from(a)], 255.0)
        }),
        (Filter::Color, _) => map_words(data, |[y, co, cg, a]| {
            color([i32::from(y), i32::from(co as i16), i32::from(cg as i16), i32::from(a)], 65535.0)
        }),
    }
}

fn map_bytes(data: &mut [u8], f: impl Fn([u8; 4]) -> [i32; 4]) {
    for element in data.as_chunks_mut::<4>().0 {
        *element = f(*element).map(|v| v as u8);
    }
}

fn map_words(data: &mut [u8], f: impl Fn([u16; 4]) -> [i32; 4]) {
    for element in data.as_chunks_mut::<8>().0 {
        let v = u64::from_le_bytes(*element);
        let words = f([v as u16, (v >> 16) as u16, (v >> 32) as u16, (v >> 48) as u16]);
        let packed = words.iter().rev().fold(0, |packed, &w| (packed << 16) | u64::from(w as u16));
        *element = packed.to_le_bytes();
    }
}

/// Rounds to the nearest integer, halves away from zero. `as` saturates.
fn round(v: f32) -> i32 {
    (v + 0.5f32.copysign(v)) as i32
}

/// Decodes a unit vector from octahedral coordinates. The third component is the stored value of 1.0.
fn octahedral([x, y, one, w]: [i32; 4], max: f32) -> [i32; 4] {
    let x = x as f32;
    let y = y as f32;
    let z = one as f32 - x.abs() - y.abs();
    // Unfolds the lower half of the octahedron.
    let fold = z.min(0.0);
    let unfolded = |c: f32| if c >= 0.0 { c + fold } else { c - fold };
    let x = unfolded(x);
    let y = unfolded(y);
    let scale = max / (x * x + y * y + z * z).sqrt();
    [round(x * scale), round(y * scale), round(z * scale), w]
}

/// Decodes a unit quaternion from its three smaller components; the largest follows from the length.
fn quaternion([x, y, z, tag]: [i32; 4]) -> [i32; 4] {
    let one = (tag | 3) as f32;
    let largest = (tag & 3) as usize;
    let x = x as f32;
    let y = y as f32;
    let z = z as f32;
    // The stored components are unscaled and sqrt(2) times too large, hence the factor 2.
    let w = (one * one * 2.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let scale = 32767.0 / std::f32::consts::SQRT_2 / one;
    let mut out = [0; 4];
    for (i, c) in [w, x, y, z].into_iter().enumerate() {
        out[(largest + i) & 3] = round(c * scale);
    }
    out
}

/// Decodes a float from a signed 8-bit exponent and a signed 24-bit mantissa.
fn exponential(v: i32) -> f32 {
    let exponent = v >> 24;
    let mantissa = (v << 8) >> 8;
    // Exact for the allowed exponents. The ends of the range become 0 or infinity, as in the reference
    // decoder.
    f32::from_bits(((exponent + 127) as u32) << 23) * mantissa as f32
}

/// Decodes RGBA from luma, two chroma components and an alpha whose highest bit marks the number of bits.
fn color([y, co, cg, alpha]: [i32; 4], max: f32) -> [i32; 4] {
    let bits = i32::BITS - alpha.leading_zeros();
    let ones = (1 << bits) - 1;
    let rgb = [y + co - cg, y + cg, y - co - cg];
    // Alpha has one bit less than the other components, so its lowest bit is repeated.
    let a = ((alpha << 1) & ones) | (alpha & 1);
    let scale = max / ones as f32;
    [rgb[0], rgb[1], rgb[2], a].map(|c| (c as f32 * scale + 0.5) as i32)
}
