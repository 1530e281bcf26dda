//! The attribute bitstream, versions 0 and 1.
//!
//! Elements are stored in blocks. A block has one plane of deltas for every byte of the element, in groups of
//! 16 deltas of the same bit width. A channel is four adjacent bytes of the element; its mode says how the
//! deltas are summed.

use super::reader::{Decoded, Reader, TRAILING, TRUNCATED};

/// Deltas per group.
const GROUP: usize = 16;
/// Largest number of elements in a block.
const BLOCK: usize = 256;
/// Largest number of bytes in a group. The tail of a stream is at least as long, so that a full window can be
/// read.
const WINDOW: usize = 24;

/// Deltas of one channel: a plane for each of its bytes.
type Planes = [[u8; BLOCK]; 4];

/// How the four bytes of a channel follow from the previous element's.
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    Words,
    /// Exclusive or of 32 bits. The encoder rotated the delta left by this number of bits.
    Xor(u32),
}

impl Channel {
    fn new(code: u8) -> Decoded<Self> {
        match (code & 15, code >> 4) {
            (0, 0) => Ok(Channel::Bytes),
            (1, 0) => Ok(Channel::Words),
            (2, rotation) => Ok(Channel::Xor(rotation.into())),
            _ => Err("the meshopt attribute stream has an unknown channel mode"),
        }
    }
}

/// Decodes mode ATTRIBUTES. The stride is a multiple of 4 up to 256, and `size` is `count * stride`.
pub(super) fn decode(bytes: &[u8], count: usize, stride: usize, size: usize) -> Decoded<Vec<u8>> {
    let (&header, body) = bytes.split_first().ok_or(TRUNCATED)?;
    let version = match header {
        0xa0 => 0,
        0xa1 => 1,
        0xa2..=0xaf => return Err("the meshopt attribute stream has an unknown version"),
        _ => return Err("the meshopt attribute stream has an invalid header"),
    };
    let (tail, padded) = match version {
        0 => (stride, stride.max(32)),
        _ => (stride + stride / 4, (stride + stride / 4).max(WINDOW)),
    };
    let end = body.len().checked_sub(padded).ok_or(TRUNCATED)?;
    let (baseline, modes) = body[body.len() - tail..].split_at(stride);

    let mut last = baseline.as_chunks::<4>().0.iter().map(|&b| u32::from_le_bytes(b)).collect::<Vec<_>>();
    let mut channels = vec![Channel::Bytes; stride / 4];
    for (channel, &code) in channels.iter_mut().zip(modes) {
        *channel = Channel::new(code)?;
    }

    // A block is at least as large as its headers, which bounds the output by the input.
    let block = ((8192 / stride) & !(GROUP - 1)).min(BLOCK);
    let min_bytes = if version == 0 { stride } else { stride / 4 };
    if count.div_ceil(block) > end / min_bytes {
        return Err(TRUNCATED);
    }
    let mut out = vec![0; size];
    let mut planes = [[0; BLOCK]; 4];
    let mut data = Reader { bytes: body };
    for rows in out.chunks_mut(block * stride) {
        let n = rows.len() / stride;
        let controls = if version == 1 { data.take(stride / 4)? } else { &[] };
        for (c, last) in last.iter_mut().enumerate() {
            for (b, plane) in planes.iter_mut().enumerate() {
                let control = controls.get(c).map(|&control| (control >> (2 * b)) & 3);
                read_plane(&mut data, control, n, plane)?;
            }
            *last = integrate(rows, stride, c * 4, &planes, *last, channels[c]);
        }
    }
    // The reader may look ahead into the tail, but must not consume it.
    match data.bytes.len().checked_sub(padded) {
        Some(0) => Ok(out),
        Some(_) => Err(TRAILING),
        None => Err(TRUNCATED),
    }
}

/// Reads the deltas of `n` elements for one byte of a channel. Version 0 has no control mode.
fn read_plane(data: &mut Reader, control: Option<u8>, n: usize, plane: &mut [u8; BLOCK]) -> Decoded<()> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            plane[..n].fill(0);
            return Ok(());
        }
        // Literal bytes are not padded to a multiple of the group size.
        Some(_) => {
            plane[..n].copy_from_slice(data.take(n)?);
            return Ok(());
        }
    };
    let groups = n.div_ceil(GROUP);
    let header = data.take(groups.div_ceil(4))?;
    for (g, out) in plane.as_chunks_mut::<GROUP>().0[..groups].iter_mut().enumerate() {
        let used = match widths[usize::from((header[g / 4] >> (g % 4 * 2)) & 3)] {
            0 => {
                out.fill(0);
                0
            }
            1 => read_group::<1>(data.bytes, out)?,
            2 => read_group::<2>(data.bytes, out)?,
            4 => read_group::<4>(data.bytes, out)?,
            _ => {
                out.copy_from_slice(data.bytes.get(..GROUP).ok_or(TRUNCATED)?);
                GROUP
            }
        };
        data.take(used)?;
    }
    Ok(())
}

/// Reads 16 deltas of `BITS` bits. A delta of all ones is a sentinel for a literal byte after the packed
/// deltas. Returns the number of bytes read.
fn read_group<const BITS: usize>(data: &[u8], out: &mut [u8; GROUP]) -> Decoded<usize> {
    let window = data.first_chunk::<WINDOW>().ok_or(TRUNCATED)?;
    let sentinel = u8::MAX >> (8 - BITS);
    let per_byte = 8 / BITS;
    for (i, delta) in out.iter_mut().enumerate() {
        // Single bits start at the low end of a byte, wider fields at the high end.
        let field = if BITS == 1 { i % 8 } else { per_byte - 1 - i % per_byte };
        *delta = (window[i / per_byte] >> (field * BITS)) & sentinel;
    }
    // Without a branch per delta, since sentinels are unpredictable. The padded length is a power of two, so
    // that the masked index needs no bounds check.
    let mut padded = [0; 32];
    padded[..WINDOW].copy_from_slice(window);
    let mut used = GROUP * BITS / 8;
    for delta in out.iter_mut() {
        let is_literal = *delta == sentinel;
        let literal = padded[used & 31];
        *delta = if is_literal { literal } else { *delta };
        used += usize::from(is_literal);
    }
    Ok(used)
}

/// Sums the deltas of one channel into the rows. Returns the channel's last value.
fn integrate(rows: &mut [u8], stride: usize, at: usize, planes: &Planes, last: u32, channel: Channel) -> u32 {
    // Adds four bytes or two words at once. The top bits are added separately, so that nothing carries over.
    match channel {
        Channel::Bytes => sum_deltas(rows, stride, at, planes, last, |last, v| {
            let delta = ((v >> 1) & 0x7f7f_7f7f) ^ ((v & 0x0101_0101) * 0xff);
            ((last & 0x7f7f_7f7f) + (delta & 0x7f7f_7f7f)) ^ ((last ^ delta) & 0x8080_8080)
        }),
        Channel::Words => sum_deltas(rows, stride, at, planes, last, |last, v| {
            let delta = ((v >> 1) & 0x7fff_7fff) ^ ((v & 0x0001_0001) * 0xffff);
            ((last & 0x7fff_7fff) + (delta & 0x7fff_7fff)) ^ ((last ^ delta) & 0x8000_8000)
        }),
        Channel::Xor(rotation) => {
            sum_deltas(rows, stride, at, planes, last, |last, v| last ^ v.rotate_right(rotation))
        }
    }
}

/// Applies `step` to each delta of the channel at byte `at` of the rows.
fn sum_deltas(
    rows: &mut [u8],
    stride: usize,
    at: usize,
    [a, b, c, d]: &Planes,
    mut last: u32,
    step: impl Fn(u32, u32) -> u32,
) -> u32 {
    let deltas = a.iter().zip(b).zip(c.iter().zip(d));
    for (row, ((&a, &b), (&c, &d))) in rows.chunks_exact_mut(stride).zip(deltas) {
        last = step(last, u32::from_le_bytes([a, b, c, d]));
        if let Some(slot) = row.get_mut(at..at + 4) {
            slot.copy_from_slice(&last.to_le_bytes());
        }
    }
    last
}
