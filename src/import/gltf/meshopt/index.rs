//! The two index bitstreams: triangle lists, and plain index sequences.

use super::{Decoded, Reader, TRUNCATED, unzigzag};

/// The specification knows only version 1 of either stream.
const TRIANGLES_HEADER: u8 = 0xe1;
const SEQUENCE_HEADER: u8 = 0xd1;

/// Splits a stream into its middle and its tail of `tail` bytes, once the header byte is known to be right.
fn frame(bytes: &[u8], header: u8, tail: usize) -> Decoded<(Reader<'_>, &[u8])> {
    let (&first, body) = bytes.split_first().ok_or(TRUNCATED)?;
    if first != header {
        return Err(match first & 0xf0 == header & 0xf0 {
            true => "the meshopt index stream has an unknown version",
            false => "the meshopt index stream has a wrong header",
        });
    }
    let middle = body.len().checked_sub(tail).ok_or(TRUNCATED)?;
    let (middle, tail) = body.split_at(middle);
    Ok((Reader { bytes: middle }, tail))
}

/// Stores one index; the narrow form keeps the low half, as the specification says.
fn store(out: &mut [u8], index: u32) {
    let n = out.len().min(4);
    out[..n].copy_from_slice(&index.to_le_bytes()[..n]);
}

/// Decodes mode INDICES: each index is a step from one of two running baselines.
pub(super) fn sequence(bytes: &[u8], count: usize, stride: usize, size: usize) -> Decoded<Vec<u8>> {
    let (mut data, _padding) = frame(bytes, SEQUENCE_HEADER, 4)?;
    // Every index takes at least a byte, so the output cannot dwarf the input.
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

/// The last 16 things seen. Reading what was never written is an error, hence the count.
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

    /// The entry pushed `back` pushes before the newest one; `back` is below 15 for every code.
    fn get(&self, back: u8) -> Decoded<T> {
        let slot = self.pushed.checked_sub(1 + usize::from(back));
        slot.map(|s| self.ring[s & 15]).ok_or("a meshopt triangle refers to one that never was")
    }
}

struct Triangles<'a> {
    data: Reader<'a>,
    codeaux: &'a [u8],
    next: u32,
    last: u32,
    edges: Fifo<(u32, u32)>,
    vertices: Fifo<u32>,
}

impl Triangles<'_> {
    fn take_next(&mut self) -> u32 {
        let index = self.next;
        self.next = index.wrapping_add(1);
        index
    }

    fn step_last(&mut self, delta: u32) -> u32 {
        self.last = self.last.wrapping_add(delta);
        self.last
    }

    fn free_index(&mut self) -> Decoded<u32> {
        let v = self.data.varint()?;
        Ok(self.step_last(unzigzag(v)))
    }

    /// A corner named by half a byte, and whether it is new and so belongs in the vertex FIFO.
    fn corner(&mut self, nibble: u8) -> Decoded<(u32, bool)> {
        Ok(match nibble {
            0 => (self.take_next(), true),
            15 => (self.free_index()?, true),
            _ => (self.vertices.get(nibble - 1)?, false),
        })
    }

    /// Codes below 0xf0: an edge seen before, and a third corner.
    fn on_edge(&mut self, edge: u8, third: u8) -> Decoded<[u32; 3]> {
        let (a, b) = self.edges.get(edge)?;
        let c = match third {
            0 => self.take_next(),
            1..=12 => self.vertices.get(third)?,
            13 => self.step_last(u32::MAX),
            14 => self.step_last(1),
            _ => self.free_index()?,
        };
        if !(1..=12).contains(&third) {
            self.vertices.push(c);
        }
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }

    /// Codes from 0xf0 on: three corners that share no known edge.
    fn on_corners(&mut self, code: u8) -> Decoded<[u32; 3]> {
        let pair = match self.codeaux.get(usize::from(code)) {
            Some(&pair) if code < 14 => pair,
            _ => {
                let pair = self.data.byte()?;
                // The table could have said this shorter, so here it means that a new mesh starts.
                if pair == 0 {
                    self.next = 0;
                }
                pair
            }
        };
        let a = if code == 15 { self.free_index()? } else { self.take_next() };
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

/// Decodes mode TRIANGLES: a code byte for each triangle, extra data, and a table of common corner pairs.
pub(super) fn triangles(bytes: &[u8], count: usize, stride: usize, size: usize) -> Decoded<Vec<u8>> {
    if !count.is_multiple_of(3) {
        return Err("a meshopt triangle count is not a multiple of 3");
    }
    let (mut data, codeaux) = frame(bytes, TRIANGLES_HEADER, 16)?;
    let codes = data.take(count / 3)?;
    // A nibble of 15 would ask for extra data, which the table form has not.
    if codeaux[14..] != [0, 0] || codeaux.iter().any(|&pair| pair >> 4 == 15 || pair & 15 == 15) {
        return Err("the meshopt triangle stream has a bad lookup table");
    }
    let mut state = Triangles { data, codeaux, next: 0, last: 0, edges: Fifo::new(), vertices: Fifo::new() };
    // Not larger than the codes by more than a factor of 12, so the input bounds it.
    let mut out = vec![0; size];
    for (&code, slots) in codes.iter().zip(out.chunks_exact_mut(3 * stride)) {
        let triangle = match code >> 4 {
            15 => state.on_corners(code & 15)?,
            edge => state.on_edge(edge, code & 15)?,
        };
        for (slot, index) in slots.chunks_exact_mut(stride).zip(triangle) {
            store(slot, index);
        }
    }
    state.data.finish()?;
    Ok(out)
}
