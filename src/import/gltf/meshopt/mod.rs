//! Decoder of EXT_meshopt_compression and KHR_meshopt_compression, written from the extension specifications.
//!
//! The input is untrusted: a damaged stream is an error, and allocations are bounded by the length of the
//! input.

mod filter;
mod index;
mod reader;
mod vertex;

#[cfg(test)]
mod tests;

pub(super) use filter::{Filter, packed_stride};
use reader::Decoded;

/// Bitstream of a compressed buffer view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// Decodes `count` elements of `stride` bytes, little endian.
pub(super) fn decode(
    bytes: &[u8],
    count: usize,
    stride: usize,
    mode: Mode,
    filter: Filter,
) -> Result<Vec<u8>, String> {
    Ok(decode_view(bytes, count, stride, mode, filter)?)
}

fn decode_view(bytes: &[u8], count: usize, stride: usize, mode: Mode, filter: Filter) -> Decoded<Vec<u8>> {
    let size = count.checked_mul(stride).ok_or("a meshopt buffer view is too large")?;
    match mode {
        Mode::Attributes => {
            if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
                return Err("a meshopt attribute stride is not a multiple of 4 up to 256");
            }
            filter::check_stride(filter, stride)?;
            let mut out = vertex::decode(bytes, count, stride, size)?;
            filter::apply(filter, stride, &mut out);
            Ok(out)
        }
        Mode::Triangles | Mode::Indices => {
            if stride != 2 && stride != 4 {
                return Err("a meshopt index stride is neither 2 nor 4");
            }
            if filter != Filter::None {
                return Err("meshopt indices cannot have a filter");
            }
            match mode {
                Mode::Triangles => index::triangles(bytes, count, stride, size),
                _ => index::sequence(bytes, count, stride, size),
            }
        }
    }
}
