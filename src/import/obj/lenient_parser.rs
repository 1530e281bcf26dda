//! The lenient OBJ parser: accepts the notations and mistakes of real exporters and reports what is wrong and where.
//!
//! It parses the files that the fast parser gives up at, line by line. tobj then reads the numbers and faces
//! from plain text with absolute indices and faces sorted by vertex format.

use std::borrow::Cow;
use std::fmt::Write;

use glam::{DVec3, Vec3, Vec4};

use crate::import::Limits;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::import::obj::chunk::{Chunk, Corner, NO_INDEX, Statement, VertexFormat};
use crate::import::obj::recenter::parse_relative;
use crate::import::obj::text::{self, Line, logical_lines, parse_mantissa, parse_number, split_keyword};

/// Parses the text of an OBJ into one chunk with absolute indices and positions relative to `origin`.
pub(super) fn parse(
    text: &str,
    limits: &Limits,
    origin: Option<DVec3>,
    warnings: &mut Warnings,
) -> Result<Chunk, LoadError> {
    let mut parser = LenientParser {
        limits,
        origin,
        chunk: Chunk::default(),
        triangles: 0,
        unknown: Vec::new(),
        totals: count_elements(text),
        missing_attributes: None,
        polypaint: Vec::new(),
        malformed_exponent: None,
        free_forms: 0,
    };
    for line in logical_lines(text) {
        parser.parse_line(&line)?;
    }
    parser.finish(warnings)
}

struct LenientParser<'l> {
    limits: &'l Limits,
    origin: Option<DVec3>,
    chunk: Chunk,
    triangles: u64,
    unknown: Vec<String>,
    /// Number of positions, texture coordinates and normals in the file. Faces may precede the elements they use.
    totals: [usize; 3],
    missing_attributes: Option<MissingAttributes>,
    /// ZBrush's vertex colours.
    polypaint: Vec<Vec4>,
    /// Location of the first number with a malformed exponent.
    malformed_exponent: Option<String>,
    free_forms: u64,
}

/// Faces with indices of texture coordinates or normals that the file does not define.
struct MissingAttributes {
    first_line: usize,
    faces: u64,
}

impl LenientParser<'_> {
    fn parse_line(&mut self, line: &Line) -> Result<(), LoadError> {
        let (keyword, rest) = split_keyword(&line.text);
        let name = || rest.to_string();
        match &*lower_case(keyword) {
            "v" => self.parse_vertex(line, rest)?,
            "vt" => {
                let v = self.parse_numbers(line, "vt", rest, 1)?;
                self.chunk.uvs.push([v[0], v.get(1).copied().unwrap_or(0.0)]);
            }
            "vn" => {
                let v = self.parse_numbers(line, "vn", rest, 3)?;
                self.chunk.normals.push(Vec3::new(v[0], v[1], v[2]));
            }
            "f" | "fo" => self.parse_face(line, rest)?,
            "l" | "p" => self.chunk.lines_and_points += 1,
            "o" => self.chunk.push_statement(Statement::Object(name())),
            "g" => self.chunk.push_statement(Statement::Group(name())),
            "s" => self.chunk.push_statement(Statement::Smoothing(text::smoothing_group(rest))),
            "usemtl" => self.chunk.push_statement(Statement::Material(name())),
            "mtllib" => self.chunk.push_statement(Statement::Library(name())),
            "curv" | "surf" | "bzp" | "bsp" | "cdc" | "cdp" => self.free_forms += 1,
            keyword if text::is_free_form(keyword) || text::is_ignored(keyword) => {}
            _ if keyword == text::POLYPAINT => self.parse_polypaint(rest),
            _ => {
                let name = printable(keyword);
                if self.unknown.len() < 20 && !self.unknown.contains(&name) {
                    self.unknown.push(name);
                }
            }
        }
        Ok(())
    }

    /// `v x y z`, followed by nothing, w, or a colour of three or four numbers.
    fn parse_vertex(&mut self, line: &Line, rest: &str) -> Result<(), LoadError> {
        LoadError::check_limit("vertices", self.chunk.positions.len() as u64 + 1, self.limits.vertices)?;
        let v = self.parse_numbers(line, "v", rest, 3)?;
        let color = match v[3..] {
            [r, g, b] => Some(Vec4::new(r, g, b, 1.0)),
            [r, g, b, a, ..] => Some(Vec4::new(r, g, b, a)),
            _ => None,
        };
        let position = Vec3::new(v[0], v[1], v[2]);
        let position = self.origin.map_or(position, |origin| parse_relative(rest, position, origin));
        self.chunk.push_vertex(position, color);
        Ok(())
    }

    /// ZBrush's polypaint: eight hexadecimal digits per vertex for mask, red, green and blue.
    fn parse_polypaint(&mut self, rest: &str) {
        for digits in rest.as_bytes().as_chunks::<8>().0 {
            let text = std::str::from_utf8(digits).unwrap_or("");
            let Ok(mrgb) = u32::from_str_radix(text, 16) else { return };
            let channel = |shift: u32| f32::from((mrgb >> shift) as u8) / 255.0;
            self.polypaint.push(Vec4::new(channel(16), channel(8), channel(0), 1.0));
        }
    }

    fn parse_face(&mut self, line: &Line, rest: &str) -> Result<(), LoadError> {
        let first = self.chunk.corners.len();
        let so_far = [self.chunk.positions.len(), self.chunk.uvs.len(), self.chunk.normals.len()];
        let mut is_missing = false;
        for word in rest.split_whitespace() {
            let mut parts = word.splitn(3, '/');
            let mut index = |kind: usize| match parts.next() {
                None | Some("") => Ok(NO_INDEX),
                Some(text) => match parse_index(line, word, kind, text, so_far[kind])? {
                    Some(index) if (index as usize) < self.totals[kind] => Ok(index),
                    _ if kind == 0 => {
                        let rule =
                            format!("vertex {text} does not exist: the file has {} vertices", self.totals[0]);
                        Err(LoadError::invalid(line.location(word), rule))
                    }
                    // Some exporters write indices of attributes that they do not export.
                    _ => {
                        is_missing = true;
                        Ok(NO_INDEX)
                    }
                },
            };
            let corner = Corner { v: index(0)?, vt: index(1)?, vn: index(2)? };
            if corner.v == NO_INDEX {
                return Err(LoadError::parse(line.location(word), format!("'{word}' has no vertex index")));
            }
            self.chunk.corners.push(corner);
        }
        if is_missing {
            let missing = MissingAttributes { first_line: line.number, faces: 0 };
            self.missing_attributes.get_or_insert(missing).faces += 1;
        }
        self.triangles += (self.chunk.corners.len() - first).saturating_sub(2) as u64;
        LoadError::check_limit("triangles", self.triangles, self.limits.triangles)?;
        self.chunk.push_face(first);
        Ok(())
    }

    /// Adds the warnings and returns the chunk.
    fn finish(mut self, warnings: &mut Warnings) -> Result<Chunk, LoadError> {
        if let Some(MissingAttributes { first_line, faces }) = self.missing_attributes {
            let what = format!("ignored missing texture coordinates or normals of {faces} faces");
            warnings.add(format!("line {first_line}"), what);
        }
        if let Some(location) = self.malformed_exponent {
            warnings.add(location, "ignored malformed exponents of numbers");
        }
        if self.free_forms > 0 {
            warnings.add("", format!("ignored {} curves and surfaces: not supported", self.free_forms));
        }
        if !self.unknown.is_empty() {
            warnings.add("", format!("ignored unknown statements: {}", self.unknown.join(", ")));
        }
        if self.chunk.colors.is_empty() && !self.polypaint.is_empty() {
            self.polypaint.truncate(self.chunk.positions.len());
            self.chunk.colors = self.polypaint;
        }
        parse_with_tobj(&mut self.chunk)?;
        Ok(self.chunk)
    }

    /// Parses at least `min` numbers.
    fn parse_numbers(
        &mut self,
        line: &Line,
        keyword: &str,
        rest: &str,
        min: usize,
    ) -> Result<Vec<f32>, LoadError> {
        let mut parse = |word: &str| {
            let value = parse_number(word).or_else(|| {
                let mantissa = parse_mantissa(word)?;
                self.malformed_exponent.get_or_insert_with(|| line.location(word));
                Some(mantissa)
            });
            let message = || format!("'{}' is not a number", printable(word));
            value.ok_or_else(|| LoadError::parse(line.location(word), message()))
        };
        let values: Vec<f32> = rest.split_whitespace().map(&mut parse).collect::<Result<_, _>>()?;
        if values.len() < min {
            let found = values.len();
            let location = line.location(line.text.get(..keyword.len()).unwrap_or(""));
            return Err(LoadError::parse(location, format!("{keyword} needs {min} numbers, found {found}")));
        }
        Ok(values)
    }
}

/// Converts a keyword to lower case; some exporters write capitals.
fn lower_case(keyword: &str) -> Cow<'_, str> {
    if keyword.contains(|c: char| c.is_ascii_uppercase()) {
        Cow::Owned(keyword.to_ascii_lowercase())
    } else {
        Cow::Borrowed(keyword)
    }
}

/// Counts the positions, texture coordinates and normals of the file.
fn count_elements(text: &str) -> [usize; 3] {
    let mut totals = [0; 3];
    for line in logical_lines(text) {
        match &*lower_case(split_keyword(&line.text).0) {
            "v" => totals[0] += 1,
            "vt" => totals[1] += 1,
            "vn" => totals[2] += 1,
            _ => {}
        }
    }
    totals
}

/// Parses an index (one-based, or negative and relative to the elements so far) and makes it zero-based. Returns
/// `None` if it is out of range.
fn parse_index(
    line: &Line,
    word: &str,
    kind: usize,
    text: &str,
    so_far: usize,
) -> Result<Option<u32>, LoadError> {
    let Ok(index) = text.parse::<i64>() else {
        let what = ["a vertex index", "a texture coordinate index", "a normal index"][kind];
        return Err(LoadError::parse(line.location(word), format!("'{}' is not {what}", printable(text))));
    };
    let index = if index < 0 { (so_far as i64).checked_add(index) } else { index.checked_sub(1) };
    Ok(index.and_then(|i| u32::try_from(i).ok()))
}

/// Calls `visit` with the corners and the vertex format of each face.
fn visit_faces(chunk: &Chunk, mut visit: impl FnMut(std::ops::Range<usize>, VertexFormat)) {
    let mut statements = chunk.statements.iter().peekable();
    let mut format = VertexFormat::default();
    let mut start = 0;
    for face in 0..chunk.faces {
        while let Some(at) = statements.next_if(|s| s.face <= face) {
            if let Statement::VertexFormat(new) = at.statement {
                format = new;
            }
        }
        let arity = chunk.arities.get(face).map_or(3, |&a| a as usize);
        visit(start..start + arity, format);
        start += arity;
    }
}

/// Passes everything through tobj and uses its numbers.
fn parse_with_tobj(chunk: &mut Chunk) -> Result<(), LoadError> {
    let formats = [(false, false), (true, false), (false, true), (true, true)]
        .map(|(uv, normal)| VertexFormat { uv, normal });
    let mut corners: [Vec<usize>; 4] = Default::default();
    let mut text = String::with_capacity(chunk.positions.len() * 40);
    for p in &chunk.positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in &chunk.uvs {
        let _ = writeln!(text, "vt {} {}", t[0], t[1]);
    }
    for n in &chunk.normals {
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    for (i, format) in formats.iter().enumerate() {
        let _ = writeln!(text, "o {i}");
        visit_faces(chunk, |face, face_format| {
            if face_format != *format {
                return;
            }
            text.push('f');
            for c in &chunk.corners[face.clone()] {
                let _ = match (format.uv, format.normal) {
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
    let error =
        |e: &dyn std::fmt::Display| LoadError::parse("the file", format!("cannot be parsed as OBJ: {e}"));
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).map_err(|e| error(&e))?;
    let mut read = 0;
    for model in models {
        let Some(own) = model.name.parse().ok().and_then(|i: usize| corners.get(i)) else { continue };
        let mesh = model.mesh;
        if mesh.indices.len() != own.len() {
            return Err(error(&"faces were lost"));
        }
        read += own.len();
        let at = |values: &[f32], i: u32| Vec3::from_slice(&values[3 * i as usize..]);
        for (k, &corner) in own.iter().enumerate() {
            let Corner { v, vt, vn } = chunk.corners[corner];
            chunk.positions[v as usize] = at(&mesh.positions, mesh.indices[k]);
            if vt != NO_INDEX {
                let i = 2 * mesh.texcoord_indices[k] as usize;
                chunk.uvs[vt as usize] = [mesh.texcoords[i], mesh.texcoords[i + 1]];
            }
            if vn != NO_INDEX {
                chunk.normals[vn as usize] = at(&mesh.normals, mesh.normal_indices[k]);
            }
        }
    }
    if read == chunk.corners.len() { Ok(()) } else { Err(error(&"faces were lost")) }
}
