//! The careful reader: what programs wrote, as they wrote it, and what is wrong with it and where.
//!
//! It takes the files that the fast reader gives up at. It understands the text line by line, and
//! tobj reads the numbers and faces of what it makes of it: plain text in which every index counts
//! from one and faces stand sorted by their form.

use std::borrow::Cow;
use std::fmt::Write;

use glam::{DVec3, Vec3, Vec4};

use crate::import::Limits;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::import::obj::block::{Block, Corner, NONE, Statement};
use crate::import::obj::recenter;
use crate::import::obj::text;
use crate::import::obj::text::{Line, lines, mantissa, number, split_keyword};

/// Reads the text of an OBJ: one block, whose indices all count from the start and whose positions are
/// relative to `origin`.
pub(crate) fn read(
    text: &str,
    limits: &Limits,
    origin: Option<DVec3>,
    warnings: &mut Warnings,
) -> Result<Block, LoadError> {
    let mut reader = Reader {
        limits,
        origin,
        block: Block::default(),
        triangles: 0,
        unknown: Vec::new(),
        totals: totals(text),
        without: None,
        polypaint: Vec::new(),
        odd: None,
        free_forms: 0,
    };
    for line in lines(text) {
        reader.line(&line)?;
    }
    reader.finish(warnings)
}

struct Reader<'l> {
    limits: &'l Limits,
    origin: Option<DVec3>,
    block: Block,
    triangles: u64,
    unknown: Vec<String>,
    /// Vertices, coordinates and normals of the file: faces may stand before what they use.
    totals: [usize; 3],
    /// The first face that names what the file has not, and how many do.
    without: Option<(usize, u64)>,
    /// ZBrush's colours, by vertex.
    polypaint: Vec<Vec4>,
    /// The first number with an exponent that is none, and where it is.
    odd: Option<String>,
    free_forms: u64,
}

impl Reader<'_> {
    fn line(&mut self, line: &Line) -> Result<(), LoadError> {
        let (keyword, rest) = split_keyword(&line.text);
        let name = || rest.to_string();
        match &*lower(keyword) {
            "v" => self.vertex(line, rest)?,
            "vt" => {
                let v = self.numbers(line, "vt", rest, 1)?;
                self.block.uvs.push([v[0], v.get(1).copied().unwrap_or(0.0)]);
            }
            "vn" => {
                let v = self.numbers(line, "vn", rest, 3)?;
                self.block.normals.push(Vec3::new(v[0], v[1], v[2]));
            }
            "f" | "fo" => self.face(line, rest)?,
            "l" | "p" => self.block.lines_and_points += 1,
            "o" => self.block.mark(Statement::Object(name())),
            "g" => self.block.mark(Statement::Group(name())),
            "s" => self.block.mark(Statement::Smoothing(text::smoothing(rest))),
            "usemtl" => self.block.mark(Statement::Material(name())),
            "mtllib" => self.block.mark(Statement::Library(name())),
            "curv" | "surf" | "bzp" | "bsp" | "cdc" | "cdp" => self.free_forms += 1,
            part if text::is_of_free_forms(part) => {}
            idle if text::is_idle(idle) => {}
            _ if keyword == text::POLYPAINT => self.paint(rest),
            _ => {
                let name = printable(keyword);
                if self.unknown.len() < 20 && !self.unknown.contains(&name) {
                    self.unknown.push(name);
                }
            }
        }
        Ok(())
    }

    /// x y z, perhaps w, perhaps a colour of three or four numbers.
    fn vertex(&mut self, line: &Line, rest: &str) -> Result<(), LoadError> {
        LoadError::check_limit("vertices", self.block.positions.len() as u64 + 1, self.limits.vertices)?;
        let v = self.numbers(line, "v", rest, 3)?;
        let color = match v[3..] {
            [r, g, b] => Some(Vec4::new(r, g, b, 1.0)),
            [r, g, b, a, ..] => Some(Vec4::new(r, g, b, a)),
            _ => None,
        };
        let position = Vec3::new(v[0], v[1], v[2]);
        let position = self.origin.map_or(position, |origin| recenter::relative(rest, position, origin));
        self.block.vertex(position, color);
        Ok(())
    }

    /// ZBrush's polypaint: eight hexadecimal digits a vertex, a mask and red, green and blue.
    fn paint(&mut self, rest: &str) {
        for digits in rest.as_bytes().as_chunks::<8>().0 {
            let text = std::str::from_utf8(digits).unwrap_or("");
            let Ok(mrgb) = u32::from_str_radix(text, 16) else { return };
            let channel = |shift: u32| f32::from((mrgb >> shift) as u8) / 255.0;
            self.polypaint.push(Vec4::new(channel(16), channel(8), channel(0), 1.0));
        }
    }

    fn face(&mut self, line: &Line, rest: &str) -> Result<(), LoadError> {
        let first = self.block.corners.len();
        let so_far = [self.block.positions.len(), self.block.uvs.len(), self.block.normals.len()];
        let mut lacks = false;
        for word in rest.split_whitespace() {
            let mut parts = word.splitn(3, '/');
            let mut index = |kind: usize| match parts.next() {
                None | Some("") => Ok(NONE),
                Some(text) => match resolve(line, word, kind, text, so_far[kind])? {
                    Some(index) if (index as usize) < self.totals[kind] => Ok(index),
                    _ if kind == 0 => {
                        let rule = format!("there is no vertex {text}: the file has {}", self.totals[0]);
                        Err(LoadError::invalid(line.place(word), rule))
                    }
                    // Exporters that name what they did not write mean nothing by it.
                    _ => {
                        lacks = true;
                        Ok(NONE)
                    }
                },
            };
            let corner = Corner { v: index(0)?, vt: index(1)?, vn: index(2)? };
            if corner.v == NONE {
                return Err(LoadError::parse(line.place(word), format!("'{word}' names no vertex")));
            }
            self.block.corners.push(corner);
        }
        if lacks {
            self.without.get_or_insert((line.number, 0)).1 += 1;
        }
        self.triangles += (self.block.corners.len() - first).saturating_sub(2) as u64;
        LoadError::check_limit("triangles", self.triangles, self.limits.triangles)?;
        self.block.face(first);
        Ok(())
    }

    fn finish(mut self, warnings: &mut Warnings) -> Result<Block, LoadError> {
        if let Some((line, faces)) = self.without {
            let what = format!(
                "{faces} faces name texture coordinates or normals that the file has not: without them"
            );
            warnings.add(format!("line {line}"), what);
        }
        if let Some(place) = self.odd {
            warnings.add(place, "numbers whose exponents make no sense: read without them");
        }
        if self.free_forms > 0 {
            warnings.add("", format!("{} curves and surfaces are not shown", self.free_forms));
        }
        if !self.unknown.is_empty() {
            warnings.add("", format!("statements not understood and left out: {}", self.unknown.join(", ")));
        }
        if self.block.colors.is_empty() && !self.polypaint.is_empty() {
            self.polypaint.truncate(self.block.positions.len());
            self.block.colors = self.polypaint;
        }
        through_tobj(&mut self.block)?;
        Ok(self.block)
    }

    /// At least `least` numbers.
    fn numbers(
        &mut self,
        line: &Line,
        keyword: &str,
        rest: &str,
        least: usize,
    ) -> Result<Vec<f32>, LoadError> {
        let mut one = |word: &str| {
            let read = number(word).or_else(|| {
                let front = mantissa(word)?;
                self.odd.get_or_insert_with(|| line.place(word));
                Some(front)
            });
            let wrong = || format!("'{}' is not a number", printable(word));
            read.ok_or_else(|| LoadError::parse(line.place(word), wrong()))
        };
        let values: Vec<f32> = rest.split_whitespace().map(&mut one).collect::<Result<_, _>>()?;
        if values.len() < least {
            let found = values.len();
            let place = line.place(line.text.get(..keyword.len()).unwrap_or(""));
            return Err(LoadError::parse(place, format!("{keyword} needs {least} numbers, not {found}")));
        }
        Ok(values)
    }
}

/// Some programs write keywords in capitals.
fn lower(keyword: &str) -> Cow<'_, str> {
    if keyword.contains(|c: char| c.is_ascii_uppercase()) {
        Cow::Owned(keyword.to_ascii_lowercase())
    } else {
        Cow::Borrowed(keyword)
    }
}

/// How many vertices, coordinates and normals the file has.
fn totals(text: &str) -> [usize; 3] {
    let mut totals = [0; 3];
    for line in lines(text) {
        match &*lower(split_keyword(&line.text).0) {
            "v" => totals[0] += 1,
            "vt" => totals[1] += 1,
            "vn" => totals[2] += 1,
            _ => {}
        }
    }
    totals
}

/// An index as written — from 1, or negative from what has been given so far — to one from 0;
/// `None` where there can be no such thing.
fn resolve(
    line: &Line,
    word: &str,
    kind: usize,
    text: &str,
    so_far: usize,
) -> Result<Option<u32>, LoadError> {
    let Ok(written) = text.parse::<i64>() else {
        let what = ["a vertex index", "an index of a texture coordinate", "an index of a normal"][kind];
        return Err(LoadError::parse(line.place(word), format!("'{}' is not {what}", printable(text))));
    };
    let index = if written < 0 { (so_far as i64).checked_add(written) } else { written.checked_sub(1) };
    Ok(index.and_then(|i| u32::try_from(i).ok()))
}

/// The form of a face: with coordinates, with normals.
type Form = (bool, bool);

/// Calls `each` with the corners of each face and its form.
fn faces(block: &Block, mut each: impl FnMut(std::ops::Range<usize>, Form)) {
    let mut marks = block.marks.iter().peekable();
    let mut form = (false, false);
    let mut start = 0;
    for face in 0..block.faces {
        while let Some(mark) = marks.next_if(|m| m.face <= face) {
            if let Statement::Form { uv, normal } = mark.statement {
                form = (uv, normal);
            }
        }
        let arity = block.arities.get(face).map_or(3, |&a| a as usize);
        each(start..start + arity, form);
        start += arity;
    }
}

/// Has tobj read everything, and takes its word for it.
fn through_tobj(block: &mut Block) -> Result<(), LoadError> {
    let forms = [(false, false), (true, false), (false, true), (true, true)];
    let mut corners: [Vec<usize>; 4] = Default::default();
    let mut text = String::with_capacity(block.positions.len() * 40);
    for p in &block.positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in &block.uvs {
        let _ = writeln!(text, "vt {} {}", t[0], t[1]);
    }
    for n in &block.normals {
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    for (i, form) in forms.iter().enumerate() {
        let _ = writeln!(text, "o {i}");
        faces(block, |face, own| {
            if own != *form {
                return;
            }
            text.push('f');
            for c in &block.corners[face.clone()] {
                let _ = match form {
                    (true, true) => write!(text, " {}/{}/{}", c.v + 1, c.vt + 1, c.vn + 1),
                    (true, false) => write!(text, " {}/{}", c.v + 1, c.vt + 1),
                    (false, true) => write!(text, " {}//{}", c.v + 1, c.vn + 1),
                    (false, false) => write!(text, " {}", c.v + 1),
                };
            }
            text.push('\n');
            corners[i].extend(face);
        });
    }
    let options = tobj::LoadOptions { single_index: false, triangulate: false, ..Default::default() };
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let wrong =
        |e: &dyn std::fmt::Display| LoadError::parse("the file", format!("cannot be read as OBJ: {e}"));
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).map_err(|e| wrong(&e))?;
    let mut read = 0;
    for model in models {
        let Some(own) = model.name.parse().ok().and_then(|i: usize| corners.get(i)) else { continue };
        let mesh = model.mesh;
        if mesh.indices.len() != own.len() {
            return Err(wrong(&"faces were lost"));
        }
        read += own.len();
        let at = |values: &[f32], i: u32| Vec3::from_slice(&values[3 * i as usize..]);
        for (k, &corner) in own.iter().enumerate() {
            let Corner { v, vt, vn } = block.corners[corner];
            block.positions[v as usize] = at(&mesh.positions, mesh.indices[k]);
            if vt != NONE {
                let i = 2 * mesh.texcoord_indices[k] as usize;
                block.uvs[vt as usize] = [mesh.texcoords[i], mesh.texcoords[i + 1]];
            }
            if vn != NONE {
                block.normals[vn as usize] = at(&mesh.normals, mesh.normal_indices[k]);
            }
        }
    }
    if read == block.corners.len() { Ok(()) } else { Err(wrong(&"faces were lost")) }
}
