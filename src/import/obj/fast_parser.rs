//! The fast OBJ parser: parses well-formed text in parallel chunks.
//!
//! It accepts only what it recognizes with certainty. At anything else (a continued line, an unusual
//! number, an index out of range, an unknown statement) it gives up without a message, and the
//! [lenient parser](super::lenient_parser) reads the whole file and reports what is wrong and where.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use crate::Limits;
use crate::obj::chunk::{Chunk, Corner, NO_INDEX, Statement};
use crate::obj::digits::parse_digits;
use crate::obj::float::parse_f32;
use crate::obj::import_size::ImportSize;
use crate::obj::line_chunks::LineChunks;
use crate::obj::recenter::parse_relative;
use crate::obj::text;

/// A file as the fast parser returns it.
pub(super) struct ParsedChunks {
    /// The chunks in file order.
    pub chunks: Vec<Chunk>,
    /// The start of the file.
    pub head: Vec<u8>,
    /// The size of the whole file. Where it exceeds the limit of memory, some chunks are empty.
    pub size: ImportSize,
}

/// Parses a file in chunks of about `chunk_bytes`, with positions relative to `origin`. Returns `None` if the
/// lenient parser is needed.
pub(super) fn parse(
    file: impl std::io::Read + Send,
    chunk_bytes: usize,
    limits: &Limits,
    origin: Option<DVec3>,
) -> Option<ParsedChunks> {
    let source = Mutex::new(LineChunks::new(file, chunk_bytes));
    let vertices = AtomicU64::new(0);
    let triangles = AtomicU64::new(0);
    let within = |count: &AtomicU64, more: usize, limit: u64| {
        count.fetch_add(more as u64, Ordering::Relaxed).saturating_add(more as u64) <= limit
    };
    // Bytes of all chunks. Beyond the limit, they are counted and dropped: the file's size does not depend on their order.
    let memory = AtomicU64::new(0);
    let size = Mutex::new(ImportSize::default());
    let give_up = AtomicBool::new(false);
    // Each task takes the next chunk when it finishes one: while one waits for the file, others parse.
    let task = |_| -> Option<Vec<(usize, Chunk)>> {
        let mut out = Vec::new();
        let mut buffer = Vec::new();
        loop {
            if give_up.load(Ordering::Relaxed) {
                return None;
            }
            let next = source.lock().ok()?.next(&mut buffer).ok()?;
            let Some((index, bytes)) = next.map(|index| (index, buffer.as_slice())) else {
                return Some(out);
            };
            let parser = ChunkParser { bytes, at: 0, chunk: Chunk::default(), origin };
            let chunk = parser.parse().filter(|chunk| {
                within(&vertices, chunk.positions.len(), limits.vertices)
                    && within(&triangles, chunk.triangle_count(), limits.triangles)
            });
            let Some(chunk) = chunk else {
                give_up.store(true, Ordering::Relaxed);
                return None;
            };
            let own = ImportSize::of(&chunk);
            size.lock().ok()?.add(own);
            let bytes = own.parsed_bytes();
            if memory.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes) <= limits.free_bytes() {
                out.push((index, chunk));
            }
        }
    };
    let tasks = (0..rayon::current_num_threads()).into_par_iter().with_max_len(1);
    let chunks: Vec<Vec<(usize, Chunk)>> = tasks.map(task).collect::<Option<_>>()?;
    let mut chunks: Vec<(usize, Chunk)> = chunks.into_iter().flatten().collect();
    chunks.sort_by_key(|(index, _)| *index);
    let chunks = chunks.into_iter().map(|(_, chunk)| chunk).collect();
    Some(ParsedChunks { chunks, head: source.into_inner().ok()?.head, size: size.into_inner().ok()? })
}

/// Parser of one chunk. Its methods return `None` to give up.
struct ChunkParser<'t> {
    bytes: &'t [u8],
    /// Offset of the next byte.
    at: usize,
    chunk: Chunk,
    origin: Option<DVec3>,
}

impl<'t> ChunkParser<'t> {
    fn parse(mut self) -> Option<Chunk> {
        while self.at < self.bytes.len() {
            self.parse_line()?;
        }
        Some(self.chunk)
    }

    #[inline(always)]
    fn peek(&self) -> u8 {
        byte_at(self.bytes, self.at)
    }

    #[inline(always)]
    fn skip_blanks(&mut self) {
        self.at = after_blanks(self.bytes, self.at);
    }

    /// Returns true at the end of a line. Gives up at a CR without LF, which the lenient parser handles.
    #[inline(always)]
    fn at_line_end(&self) -> Option<bool> {
        match self.peek() {
            b'\n' => Some(true),
            b'\r' if self.bytes.get(self.at + 1).is_none_or(|b| *b == b'\n') => Some(true),
            b'\r' => None,
            _ => Some(false),
        }
    }

    /// Moves to the next line. Gives up if anything but blanks is left on this one.
    #[inline(always)]
    fn finish_line(&mut self) -> Option<()> {
        self.skip_blanks();
        if !self.at_line_end()? {
            return None;
        }
        self.at += if self.peek() == b'\r' { 2 } else { 1 };
        Some(())
    }

    #[inline(always)]
    fn parse_line(&mut self) -> Option<()> {
        self.skip_blanks();
        let next = self.bytes.get(self.at + 1).copied().unwrap_or(b'\n');
        let blank = |b: u8| matches!(b, b' ' | b'\t');
        match (self.peek(), next) {
            (b'f', b) if blank(b) => self.parse_face(),
            (b'v', b) if blank(b) => self.parse_vertex(),
            (b'v', b't') => self.parse_texture_coordinate(),
            (b'v', b'n') => self.parse_normal(),
            (b'\n' | b'\r', _) => self.finish_line(),
            (b'#', _) => self.parse_comment(),
            _ => self.parse_statement(),
        }
    }

    /// `v x y z`, followed by nothing, w, or a colour of three or four numbers.
    fn parse_vertex(&mut self) -> Option<()> {
        let (mut position, at) = parse_vec3(self.bytes, self.at + 1)?;
        if let Some(origin) = self.origin {
            let text = std::str::from_utf8(&self.bytes[self.at + 1..at]).ok()?;
            position = parse_relative(text.split_whitespace(), origin);
        }
        self.at = at;
        let mut extra = [0.0; 4];
        let mut count = 0;
        loop {
            self.skip_blanks();
            if self.at_line_end()? {
                break;
            }
            (*extra.get_mut(count)?, self.at) = parse_number(self.bytes, self.at)?;
            count += 1;
        }
        let [r, g, b, a] = extra;
        let color = match count {
            0..3 => None,
            3 => Some(Vec4::new(r, g, b, 1.0)),
            _ => Some(Vec4::new(r, g, b, a)),
        };
        self.chunk.push_vertex(position, color);
        self.finish_line()
    }

    fn parse_texture_coordinate(&mut self) -> Option<()> {
        self.skip_keyword(2)?;
        let (u, at) = parse_number(self.bytes, self.at)?;
        self.at = at;
        self.skip_blanks();
        let mut v = 0.0;
        if !self.at_line_end()? {
            (v, self.at) = parse_number(self.bytes, self.at)?;
            self.skip_blanks();
            if !self.at_line_end()? {
                (_, self.at) = parse_number(self.bytes, self.at)?;
            }
        }
        self.chunk.uvs.push([u, v]);
        self.finish_line()
    }

    fn parse_normal(&mut self) -> Option<()> {
        self.skip_keyword(2)?;
        let (normal, at) = parse_vec3(self.bytes, self.at)?;
        self.at = at;
        self.chunk.normals.push(normal);
        self.finish_line()
    }

    /// Skips a keyword of `length` letters and checks that a blank follows.
    fn skip_keyword(&mut self, length: usize) -> Option<()> {
        self.at += length;
        matches!(self.peek(), b' ' | b'\t').then_some(())
    }

    fn parse_face(&mut self) -> Option<()> {
        let ChunkParser { bytes, chunk, .. } = self;
        // A local variable stays in a register; `self.at` would be stored for every byte.
        let mut at = self.at + 1;
        let first = chunk.corners.len();
        loop {
            at = after_blanks(bytes, at);
            if matches!(byte_at(bytes, at), b'\n' | b'\r') {
                break;
            }
            let mut corner = Corner { v: 0, vt: NO_INDEX, vn: NO_INDEX };
            (corner.v, at) = parse_index(chunk, bytes, at, 0)?;
            if byte_at(bytes, at) == b'/' {
                at += 1;
                if byte_at(bytes, at) != b'/' {
                    (corner.vt, at) = parse_index(chunk, bytes, at, 1)?;
                }
                if byte_at(bytes, at) == b'/' {
                    (corner.vn, at) = parse_index(chunk, bytes, at + 1, 2)?;
                }
            }
            if !matches!(byte_at(bytes, at), b' ' | b'\t' | b'\r' | b'\n') {
                return None;
            }
            chunk.corners.push(corner);
        }
        self.chunk.push_face(first);
        self.at = at;
        self.finish_line()
    }

    /// Returns the rest of the line and moves to the next one.
    fn take_rest(&mut self) -> Option<&'t str> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        let line = rest[..length].strip_suffix(b"\r").unwrap_or(&rest[..length]);
        self.at += length + 1;
        if line.contains(&b'\r') {
            return None;
        }
        std::str::from_utf8(line).ok()
    }

    /// The vertices of `p` or `l`. Texture coordinates of lines are not used.
    fn parse_round(&mut self, rest: &str, is_points: bool) -> Option<()> {
        let first = self.chunk.round_vertices.len();
        for index in text::round_vertices(rest) {
            let (vertex, end) = parse_index(&mut self.chunk, index.as_bytes(), 0, 0)?;
            if end != index.len() {
                return None;
            }
            self.chunk.round_vertices.push(vertex);
        }
        self.chunk.push_round(first, is_points);
        Some(())
    }

    fn parse_comment(&mut self) -> Option<()> {
        // ZBrush writes vertex colours in comments.
        let rest = self.take_rest()?;
        (!rest.starts_with(text::POLYPAINT)).then_some(())
    }

    fn parse_statement(&mut self) -> Option<()> {
        let (keyword, rest) = text::split_keyword(text::trim(self.take_rest()?));
        let name = || rest.to_string();
        let statement = match keyword {
            "o" => Statement::Object(name()),
            "g" => Statement::Group(name()),
            "usemtl" => Statement::Material(name()),
            "mtllib" => Statement::Library(name()),
            "s" if !rest.contains(['#', '\\']) => Statement::Smoothing(text::smoothing_group(rest)),
            "l" | "p" if !rest.contains('\\') => {
                return self.parse_round(rest, keyword == "p");
            }
            "" => return Some(()),
            keyword if text::is_ignored(keyword) && !rest.contains('\\') => return Some(()),
            _ => return None,
        };
        self.chunk.push_statement(statement);
        Some(())
    }
}

/// Returns a byte; a line end after the last one.
#[inline(always)]
fn byte_at(bytes: &[u8], at: usize) -> u8 {
    bytes.get(at).copied().unwrap_or(b'\n')
}

#[inline(always)]
fn after_blanks(bytes: &[u8], mut at: usize) -> usize {
    while matches!(byte_at(bytes, at), b' ' | b'\t') {
        at += 1;
    }
    at
}

/// Parses a number after blanks and returns it with its end.
#[inline(always)]
fn parse_number(bytes: &[u8], at: usize) -> Option<(f32, usize)> {
    let at = after_blanks(bytes, at);
    let (value, length) = parse_f32(bytes.get(at..)?)?;
    Some((value, at + length))
}

/// Parses three numbers and returns them with their end.
#[inline(always)]
fn parse_vec3(bytes: &[u8], at: usize) -> Option<(Vec3, usize)> {
    let (x, at) = parse_number(bytes, at)?;
    let (y, at) = parse_number(bytes, at)?;
    let (z, at) = parse_number(bytes, at)?;
    Some((Vec3::new(x, y, z), at))
}

/// Parses an index of up to nine digits and returns it, zero-based, with its end. `kind` is 0 for positions,
/// 1 for texture coordinates, 2 for normals.
#[inline(always)]
fn parse_index(chunk: &mut Chunk, bytes: &[u8], at: usize, kind: usize) -> Option<(u32, usize)> {
    let relative = byte_at(bytes, at) == b'-';
    let at = at + usize::from(relative);
    let (value, count) = parse_digits(bytes, at);
    if value == 0 || count > 9 {
        return None;
    }
    let value = value as u32;
    if relative {
        return Some((chunk.relative_index(kind, value), at + count));
    }
    chunk.max_index[kind] = chunk.max_index[kind].max(value);
    Some((value - 1, at + count))
}
