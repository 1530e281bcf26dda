//! The index bitstreams: triangles and index sequences.

use super::reader::{Decoded, Reader, TRUNCATED, unzigzag};

// Header bytes; version 1 is the only version of both streams.
const TRIANGLES_HEADER: u8 = 0xe1;
const SEQUENCE_HEADER: u8 = 0xd1;

/// Checks the header byte and splits the rest of a stream into its data and a tail of `tail` bytes.
fn split_stream(bytes: &[u8], header: u8, tail: usize) -> Decoded<(Reader<'_>, &[u8])> {
    let (&first, body) = bytes.split_first().ok_or(TRUNCATED)?;
    if first != header {
        return Err(match first & 0xf0 == header & 0xf0 {
            true => "the meshopt index stream has an unknown version",
            false => "the meshopt index stream has an invalid header",
        });
    }
    let data = body.len().checked_sub(tail).ok_or(TRUNCATED)?;
    let (data, tail) = body.split_at(data);
    Ok((Reader { bytes: data }, tail))
}

/// Stores an index; 16-bit indices keep the low half, as specified.
fn store(out: &mut [u8], index: u32) {
    let n = out.len().min(4);
    out[..n].copy_from_slice(&index.to_le_bytes()[..n]);
}

/// Decodes mode INDICES: each index is a difference to one of two running baselines.
pub(super) fn sequence(bytes: &[u8], count: usize, stride: usize, size: usize) -> Decoded<Vec<u8>> {
    let (mut data, _padding) = split_stream(bytes, SEQUENCE_HEADER, 4)?;
    // Every index takes at least one byte, which bounds the output by the input.
    if data.bytes.len() < count {
        return Err(TRUNCATED);
    }
    let mut out = vec![0; size];
    let mut baselines = [0u32; 2];
    for slot in out.chunks_exact_mut(stride) {
        let v = data.varint()?;
        let baseline = &mut baselines[(v & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(v >> 1));
        store(slot, *baseline);
    }
    data.finish()?;
    Ok(out)
}

/// The last 16 items. The count detects reads of items that were never pushed.
struct Fifo<T> {
    ring: [T; 16],
    pushed: usize,
}

impl<T: Copy + Default> Fifo<T> {
    fn new() -> Self {
        Fifo { ring: [T::default(); 16], pushed: 0 }
    }

    fn push(&mut self, item: T) {
        self.ring[self.pushed & 15] = item;
        self.pushed += 1;
    }

    /// The item `back` pushes before the newest; `back` is below 15 for every code.
    fn get(&self, back: u8) -> Decoded<T> {
        let slot = self.pushed.checked_sub(1 + usize::from(back));
        slot.map(|s| self.ring[s & 15]).ok_or("a meshopt triangle refers to a missing edge or vertex")
    }
}

/// State of the triangle decoder.
struct TriangleDecoder<'a> {
    data: Reader<'a>,
    /// Table of common corner pairs.
    codeaux: &'a [u8],
    /// Next new index.
    next: u32,
    /// Last explicitly coded index.
    last: u32,
    edges: Fifo<(u32, u32)>,
    vertices: Fifo<u32>,
}

impl TriangleDecoder<'_> {
    fn take_next(&mut self) -> u32 {
        let index = self.next;
        self.next = index.wrapping_add(1);
        index
    }

    fn step_last(&mut self, delta: u32) -> u32 {
        self.last = self.last.wrapping_add(delta);
        self.last
    }

    fn explicit_index(&mut self) -> Decoded<u32> {
        let v = self.data.varint()?;
        Ok(self.step_last(unzigzag(v)))
    }

    /// Decodes a corner from a nibble. The flag is true for a new vertex, which enters the vertex FIFO.
    fn corner(&mut self, nibble: u8) -> Decoded<(u32, bool)> {
        Ok(match nibble {
            0 => (self.take_next(), true),
            15 => (self.explicit_index()?, true),
            _ => (self.vertices.get(nibble - 1)?, false),
        })
    }

    /// Codes below 0xf0: a known edge and a third corner.
    fn triangle_on_edge(&mut self, edge: u8, third: u8) -> Decoded<[u32; 3]> {
        let (a, b) = self.edges.get(edge)?;
        let c = match third {
            0 => self.take_next(),
            1..=12 => self.vertices.get(third)?,
            13 => self.step_last(u32::MAX),
            14 => self.step_last(1),
            _ => self.explicit_index()?,
        };
        if !(1..=12).contains(&third) {
            self.vertices.push(c);
        }
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }

    /// Codes from 0xf0 on: three corners without a known edge.
    fn triangle_on_corners(&mut self, code: u8) -> Decoded<[u32; 3]> {
        let pair = match self.codeaux.get(usize::from(code)) {
            Some(&pair) if code < 14 => pair,
            _ => {
                let pair = self.data.byte()?;
                // The table has a shorter code for 0, so an explicit 0 marks the start of a new mesh.
                if pair == 0 {
                    self.next = 0;
                }
                pair
            }
        };
        let a = if code == 15 { self.explicit_index()? } else { self.take_next() };
        let (b, b_is_new) = self.corner(pair >> 4)?;
        let (c, c_is_new) = self.corner(pair & 15)?;
        self.vertices.push(a);
        if b_is_new {
            self.vertices.push(b);
        }
        if c_is_new {
            self.vertices.push(c);
        }
        self.edges.push((b, a));
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }
}

/// Decodes mode TRIANGLES: a code byte per triangle, additional data, and a table of common corner pairs.
pub(super) fn triangles(bytes: &[u8], count: usize, stride: usize, size: usize) -> Decoded<Vec<u8>> {
    if !count.is_multiple_of(3) {
        return Err("the meshopt index count is not a multiple of 3");
    }
    let (mut data, codeaux) = split_stream(bytes, TRIANGLES_HEADER, 16)?;
    let codes = data.take(count / 3)?;
    // A nibble of 15 would need additional data, which table entries do not have.
    if codeaux[14..] != [0, 0] || codeaux.iter().any(|&pair| pair >> 4 == 15 || pair & 15 == 15) {
        return Err("the meshopt triangle stream has an invalid lookup table");
    }
    let mut state =
        TriangleDecoder { data, codeaux, next: 0, last: 0, edges: Fifo::new(), vertices: Fifo::new() };
    // At most 12 times the size of the codes, which bounds the output by the input.
    let mut out = vec![0; size];
    for (&code, slots) in codes.iter().zip(out.chunks_exact_mut(3 * stride)) {
        let triangle = match code >> 4 {
            15 => state.triangle_on_corners(code & 15)?,
            edge => state.triangle_on_edge(edge, code & 15)?,
        };
        for (slot, index) in slots.chunks_exact_mut(stride).zip(triangle) {
            store(slot, index);
        }
    }
    state.data.finish()?;
    Ok(out)
}
