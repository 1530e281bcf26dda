//! Decodes the compressed buffer views of EXT_meshopt_compression and KHR_meshopt_compression.
//!
//! Written from the Khronos extension texts. The input is not trusted: a damaged stream gives an error, and
//! the memory asked for is always bounded by the length of the input.

mod filter;
mod index;
mod vertex;

#[cfg(test)]
mod tests;

/// The bitstream a compressed buffer view is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// The transform applied to each element after decoding; only attributes may have one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Messages are fixed sentences; they become strings only at the border of this module.
type Decoded<T> = Result<T, &'static str>;

const TRUNCATED: &str = "the meshopt stream ends too early";
const TRAILING: &str = "the meshopt stream has bytes left over";

/// Decodes `bytes` to `count` elements of `stride` bytes, little endian, exactly `count * stride` bytes long.
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

/// A reader that never leaves its bytes.
struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Decoded<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(n).ok_or(TRUNCATED)?;
        self.bytes = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Decoded<u8> {
        let (&first, rest) = self.bytes.split_first().ok_or(TRUNCATED)?;
        self.bytes = rest;
        Ok(first)
    }

    /// Unsigned LEB128 of at most five bytes; the bits beyond 32 are dropped, as the specification asks.
    fn varint(&mut self) -> Decoded<u32> {
        let mut value = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number in a meshopt stream is longer than five bytes")
    }

    fn finish(&self) -> Decoded<()> {
        if self.bytes.is_empty() { Ok(()) } else { Err(TRAILING) }
    }
}

/// Undoes the zigzag code, which keeps small negative numbers small.
fn unzigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}
