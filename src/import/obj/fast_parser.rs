//! The fast reader: well-formed text to blocks, on all threads at once.
//!
//! It reads what it recognises with certainty and gives up at anything else — a joined line, an
//! odd number, an index that points at nothing, a statement it does not know — without a word:
//! the careful reader then reads the whole file, and says what is wrong with it and where.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use crate::import::Limits;
use crate::import::obj::block::{Block, Corner, NONE, Statement};
use crate::import::obj::line_chunks::Stretches;
use crate::import::obj::{digits, float, recenter, text};

/// The blocks of a file, each of about `stretch` bytes, with positions relative to `origin`, and how the
/// file begins; or `None` where it takes a more careful reader.
pub(crate) fn read(
    file: impl std::io::Read + Send,
    stretch: usize,
    limits: &Limits,
    origin: Option<DVec3>,
) -> Option<(Vec<Block>, Vec<u8>)> {
    let source = Mutex::new(Stretches::new(file, stretch));
    let (vertices, triangles) = (AtomicU64::new(0), AtomicU64::new(0));
    let within = |count: &AtomicU64, more: usize, limit: u64| {
        count.fetch_add(more as u64, Ordering::Relaxed).saturating_add(more as u64) <= limit
    };
    let odd = AtomicBool::new(false);
    // Each task takes the next stretch when it is done with one: while one waits for the file, the
    // others read what they have.
    let task = |_| -> Option<Vec<(usize, Block)>> {
        let mut out = Vec::new();
        let mut buffer = Vec::new();
        loop {
            if odd.load(Ordering::Relaxed) {
                return None;
            }
            let next = source.lock().ok()?.next(&mut buffer).ok()?;
            let Some((index, bytes)) = next.map(|index| (index, buffer.as_slice())) else {
                return Some(out);
            };
            let block = Scanner { bytes, at: 0, block: Block::default(), origin }.read().filter(|block| {
                within(&vertices, block.positions.len(), limits.vertices)
                    && within(&triangles, block.triangles(), limits.triangles)
            });
            let Some(block) = block else {
                odd.store(true, Ordering::Relaxed);
                return None;
            };
            out.push((index, block));
        }
    };
    let tasks = (0..rayon::current_num_threads()).into_par_iter().with_max_len(1);
    let blocks: Vec<Vec<(usize, Block)>> = tasks.map(task).collect::<Option<_>>()?;
    let mut blocks: Vec<(usize, Block)> = blocks.into_iter().flatten().collect();
    blocks.sort_by_key(|(index, _)| *index);
    Some((blocks.into_iter().map(|(_, block)| block).collect(), source.into_inner().ok()?.head))
}

struct Scanner<'t> {
    bytes: &'t [u8],
    at: usize,
    block: Block,
    origin: Option<DVec3>,
}

impl<'t> Scanner<'t> {
    fn read(mut self) -> Option<Block> {
        while self.at < self.bytes.len() {
            self.line()?;
        }
        Some(self.block)
    }

    #[inline(always)]
    fn here(&self) -> u8 {
        byte(self.bytes, self.at)
    }

    #[inline(always)]
    fn blanks(&mut self) {
        self.at = after_blanks(self.bytes, self.at);
    }

    /// True at the line's end. A CR alone is none: then some other reader counts lines.
    #[inline(always)]
    fn at_end(&self) -> Option<bool> {
        match self.here() {
            b'\n' => Some(true),
            b'\r' if self.bytes.get(self.at + 1).is_none_or(|b| *b == b'\n') => Some(true),
            b'\r' => None,
            _ => Some(false),
        }
    }

    /// Goes to the next line.
    #[inline(always)]
    fn end(&mut self) -> Option<()> {
        self.blanks();
        if !self.at_end()? {
            return None;
        }
        self.at += if self.here() == b'\r' { 2 } else { 1 };
        Some(())
    }

    #[inline(always)]
    fn line(&mut self) -> Option<()> {
        self.blanks();
        let next = self.bytes.get(self.at + 1).copied().unwrap_or(b'\n');
        let blank = |b: u8| matches!(b, b' ' | b'\t');
        match (self.here(), next) {
            (b'f', b) if blank(b) => self.face(),
            (b'v', b) if blank(b) => self.vertex(),
            (b'v', b't') => self.texture_coordinate(),
            (b'v', b'n') => self.normal(),
            (b'\n' | b'\r', _) => self.end(),
            (b'#', _) => self.comment(),
            _ => self.statement(),
        }
    }

    /// x y z, perhaps w, perhaps a colour of three or four numbers.
    fn vertex(&mut self) -> Option<()> {
        let (mut position, at) = three(self.bytes, self.at + 1)?;
        if let Some(origin) = self.origin {
            let text = std::str::from_utf8(&self.bytes[self.at + 1..at]).ok()?;
            position = recenter::relative(text, position, origin);
        }
        self.at = at;
        let mut more = [0.0; 4];
        let mut count = 0;
        loop {
            self.blanks();
            if self.at_end()? {
                break;
            }
            (*more.get_mut(count)?, self.at) = number(self.bytes, self.at)?;
            count += 1;
        }
        let [r, g, b, a] = more;
        let color = match count {
            0..3 => None,
            3 => Some(Vec4::new(r, g, b, 1.0)),
            _ => Some(Vec4::new(r, g, b, a)),
        };
        self.block.vertex(position, color);
        self.end()
    }

    fn texture_coordinate(&mut self) -> Option<()> {
        self.keyword(2)?;
        let (u, at) = number(self.bytes, self.at)?;
        self.at = at;
        self.blanks();
        let mut v = 0.0;
        if !self.at_end()? {
            (v, self.at) = number(self.bytes, self.at)?;
            self.blanks();
            if !self.at_end()? {
                (_, self.at) = number(self.bytes, self.at)?;
            }
        }
        self.block.uvs.push([u, v]);
        self.end()
    }

    fn normal(&mut self) -> Option<()> {
        self.keyword(2)?;
        let (normal, at) = three(self.bytes, self.at)?;
        self.at = at;
        self.block.normals.push(normal);
        self.end()
    }

    /// Steps over a keyword of `length` letters, which has to end there.
    fn keyword(&mut self, length: usize) -> Option<()> {
        self.at += length;
        matches!(self.here(), b' ' | b'\t').then_some(())
    }

    fn face(&mut self) -> Option<()> {
        let Scanner { bytes, block, .. } = self;
        // Kept out of `self` while the line lasts: it changes with every byte.
        let mut at = self.at + 1;
        let first = block.corners.len();
        loop {
            at = after_blanks(bytes, at);
            if matches!(byte(bytes, at), b'\n' | b'\r') {
                break;
            }
            let mut corner = Corner { v: 0, vt: NONE, vn: NONE };
            (corner.v, at) = index(block, bytes, at, 0)?;
            if byte(bytes, at) == b'/' {
                at += 1;
                if byte(bytes, at) != b'/' {
                    (corner.vt, at) = index(block, bytes, at, 1)?;
                }
                if byte(bytes, at) == b'/' {
                    (corner.vn, at) = index(block, bytes, at + 1, 2)?;
                }
            }
            if !matches!(byte(bytes, at), b' ' | b'\t' | b'\r' | b'\n') {
                return None;
            }
            block.corners.push(corner);
        }
        self.block.face(first);
        self.at = at;
        self.end()
    }

    /// The rest of the line, where it is text that lines end in the usual way.
    fn rest(&mut self) -> Option<&'t str> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        let line = rest[..length].strip_suffix(b"\r").unwrap_or(&rest[..length]);
        self.at += length + 1;
        if line.contains(&b'\r') {
            return None;
        }
        std::str::from_utf8(line).ok()
    }

    fn comment(&mut self) -> Option<()> {
        // ZBrush paints in comments.
        let rest = self.rest()?;
        (!rest.starts_with(text::POLYPAINT)).then_some(())
    }

    fn statement(&mut self) -> Option<()> {
        let (keyword, rest) = text::split_keyword(text::trim(self.rest()?));
        let name = || rest.to_string();
        let statement = match keyword {
            "o" => Statement::Object(name()),
            "g" => Statement::Group(name()),
            "usemtl" => Statement::Material(name()),
            "mtllib" => Statement::Library(name()),
            "s" if !rest.contains(['#', '\\']) => Statement::Smoothing(text::smoothing(rest)),
            "l" | "p" if !rest.contains('\\') => {
                self.block.lines_and_points += 1;
                return Some(());
            }
            "" => return Some(()),
            idle if text::is_idle(idle) && !rest.contains('\\') => return Some(()),
            _ => return None,
        };
        self.block.mark(statement);
        Some(())
    }
}

/// A byte; behind the last line stands a line end.
#[inline(always)]
fn byte(bytes: &[u8], at: usize) -> u8 {
    bytes.get(at).copied().unwrap_or(b'\n')
}

#[inline(always)]
fn after_blanks(bytes: &[u8], mut at: usize) -> usize {
    while matches!(byte(bytes, at), b' ' | b'\t') {
        at += 1;
    }
    at
}

/// A number after blanks, and where it ends.
#[inline(always)]
fn number(bytes: &[u8], at: usize) -> Option<(f32, usize)> {
    let at = after_blanks(bytes, at);
    let (value, length) = float::read(bytes.get(at..)?)?;
    Some((value, at + length))
}

/// Three numbers, and where they end.
#[inline(always)]
fn three(bytes: &[u8], at: usize) -> Option<(Vec3, usize)> {
    let (x, at) = number(bytes, at)?;
    let (y, at) = number(bytes, at)?;
    let (z, at) = number(bytes, at)?;
    Some((Vec3::new(x, y, z), at))
}

/// An index of up to nine digits, of vertices, coordinates or normals, and where it ends.
#[inline(always)]
fn index(block: &mut Block, bytes: &[u8], at: usize, kind: usize) -> Option<(u32, usize)> {
    let back = byte(bytes, at) == b'-';
    let at = at + usize::from(back);
    let (value, count) = digits::read(bytes, at);
    if value == 0 || count > 9 {
        return None;
    }
    let value = value as u32;
    if back {
        return Some((block.back(kind, value), at + count));
    }
    block.reach[kind] = block.reach[kind].max(value);
    Some((value - 1, at + count))
}
