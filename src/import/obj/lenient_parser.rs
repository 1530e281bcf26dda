//! The lenient OBJ parser: accepts the notations and mistakes of real exporters and reports what is wrong and where.
//!
//! It cleans the files that the fast parser gives up at, line by line, to [plain text](PlainText) for tobj.

use std::borrow::Cow;

use glam::{DVec3, Vec3, Vec4};

use crate::Limits;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::obj::chunk::{Chunk, Corner, NO_INDEX, Statement};
use crate::obj::decimal_comma::{AMBIGUOUS, Commas, Counts, split_numbers};
use crate::obj::number::{plain_mantissa, plain_number};
use crate::obj::plain_text::PlainText;
use crate::obj::recenter::parse_relative;
use crate::obj::text::{self, Line, logical_lines, split_keyword};
use crate::obj::vertex_numbering::VertexNumbering;
use blinn_core::cancellation::CancelToken;

/// Lines between two checks of whether the import was cancelled.
const LINES_PER_CHECK: usize = 1024;

/// Parses the text of an OBJ into one chunk with absolute indices and positions relative to `origin`.
pub(super) fn parse(
    text: &str,
    limits: &Limits,
    origin: Option<DVec3>,
    cancel: &CancelToken,
    warnings: &mut Warnings,
) -> Result<Chunk, LoadError> {
    parse_numbered(text, None, limits, origin, cancel, warnings)
}

/// Parses the text with a known numbering of texture coordinates and normals, or finds it where some do not exist.
fn parse_numbered(
    text: &str,
    numbering: Option<VertexNumbering>,
    limits: &Limits,
    origin: Option<DVec3>,
    cancel: &CancelToken,
    warnings: &mut Warnings,
) -> Result<Chunk, LoadError> {
    let is_first = numbering.is_none();
    let mut parser = LenientParser {
        limits,
        origin,
        numbering: numbering.unwrap_or_default(),
        chunk: Chunk::default(),
        plain_text: PlainText::default(),
        triangles: 0,
        unknown: Vec::new(),
        totals: count_elements(text),
        missing_attributes: None,
        polypaint: Vec::new(),
        malformed_exponent: None,
        decimal_comma: None,
        separating_comma: None,
        free_forms: 0,
    };
    for line in logical_lines(text) {
        if line.number.is_multiple_of(LINES_PER_CHECK) {
            cancel.check()?;
        }
        let Err(error) = parser.parse_line(&line) else { continue };
        return match line.before_cut(text) {
            Some(complete) if matches!(error, LoadError::Parse { .. }) => {
                let what = "the file ends in the middle of a line; ignored the line";
                warnings.add(format_args!("line {}", line.number), what);
                parse(complete, limits, origin, cancel, warnings)
            }
            _ => Err(error),
        };
    }
    if is_first && parser.missing_attributes.is_some() {
        let numbering = VertexNumbering::find(text);
        if let Some(attributes) = numbering.attributes() {
            let message = format!("faces number {attributes} by vertices: used those of the vertices");
            warnings.add("", message);
            return parse_numbered(text, Some(numbering), limits, origin, cancel, warnings);
        }
    }
    parser.finish(warnings)
}

struct LenientParser<'l> {
    limits: &'l Limits,
    origin: Option<DVec3>,
    numbering: VertexNumbering,
    /// Faces and statements; the numbers of vertices follow from `plain_text`.
    chunk: Chunk,
    plain_text: PlainText,
    triangles: u64,
    unknown: Vec<String>,
    /// Number of positions, texture coordinates and normals in the file. Faces may precede the elements they use.
    totals: [usize; 3],
    missing_attributes: Option<MissingAttributes>,
    /// ZBrush's vertex colours.
    polypaint: Vec<Vec4>,
    /// Location of the first number with a malformed exponent.
    malformed_exponent: Option<String>,
    /// Location of the first number with a decimal comma.
    decimal_comma: Option<String>,
    /// Location of the first comma between numbers.
    separating_comma: Option<String>,
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
                let mut words = self.parse_numbers(line, "vt", rest, 1, Counts::TEXTURE_COORDINATE)?;
                words.resize(2, "0".into());
                self.plain_text.push_line("vt", &words);
                self.chunk.uvs.push([0.0; 2]);
            }
            "vn" => {
                let words = self.parse_numbers(line, "vn", rest, 3, Counts::NORMAL)?;
                self.plain_text.push_line("vn", &words[..3]);
                // Those of faces are parsed again.
                let [x, y, z] = [0, 1, 2].map(|axis| words[axis].parse().unwrap_or(f32::NAN));
                self.chunk.normals.push(Vec3::new(x, y, z));
            }
            "f" | "fo" => self.parse_face(line, rest)?,
            kind @ ("l" | "p") => self.parse_round(line, rest, kind == "p")?,
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
        let words = self.parse_numbers(line, "v", rest, 3, Counts::VERTEX)?;
        let (position, extra) = words.split_at(3);
        let extra: Vec<f32> = extra.iter().map(|word| word.parse().unwrap_or(f32::NAN)).collect();
        let color = match extra[..] {
            [r, g, b] => Some(Vec4::new(r, g, b, 1.0)),
            [r, g, b, a, ..] => Some(Vec4::new(r, g, b, a)),
            _ => None,
        };
        self.plain_text.push_line("v", position);
        let relative = |origin| parse_relative(position.iter().map(|word| &**word), origin);
        self.chunk.push_vertex(self.origin.map_or(Vec3::ZERO, relative), color);
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

    /// The vertices of `p` or `l`. Texture coordinates of lines are not used.
    fn parse_round(&mut self, line: &Line, rest: &str, is_points: bool) -> Result<(), LoadError> {
        let first = self.chunk.round_vertices.len();
        for text in text::round_vertices(rest) {
            match parse_index(line, text, 0, text, self.chunk.positions.len())? {
                Some(vertex) if (vertex as usize) < self.totals[0] => self.chunk.round_vertices.push(vertex),
                _ => {
                    let rule =
                        format!("vertex {text} does not exist: the file has {} vertices", self.totals[0]);
                    return Err(LoadError::invalid(line.location(text), rule));
                }
            }
        }
        self.chunk.push_round(first, is_points);
        Ok(())
    }

    fn parse_face(&mut self, line: &Line, rest: &str) -> Result<(), LoadError> {
        let first = self.chunk.corners.len();
        let so_far = [self.chunk.positions.len(), self.chunk.uvs.len(), self.chunk.normals.len()];
        let mut is_missing = false;
        for word in rest.split_whitespace() {
            let mut parts = word.splitn(3, '/');
            let mut index = |kind: usize, vertex: u32| {
                let text = match parts.next() {
                    None | Some("") => return Ok(NO_INDEX),
                    Some(text) => text,
                };
                if let Some(element) = self.numbering.element(kind, vertex) {
                    return Ok(element);
                }
                match parse_index(line, word, kind, text, so_far[kind])? {
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
                }
            };
            let v = index(0, NO_INDEX)?;
            if v == NO_INDEX {
                return Err(LoadError::parse(line.location(word), format!("'{word}' has no vertex index")));
            }
            let corner = Corner { v, vt: index(1, v)?, vn: index(2, v)? };
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
        if let Some(location) = self.decimal_comma {
            warnings.add(location, "numbers have decimal commas: read as decimal points");
        }
        if let Some(location) = self.separating_comma {
            warnings.add(location, "numbers are separated by commas: read as blanks");
        }
        self.chunk.ignored += self.free_forms + self.unknown.len() as u64;
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
        if self.chunk.is_bare() && self.totals[0] > 0 {
            self.chunk.push_cloud(self.totals[0]);
        }
        self.plain_text.parse_into(&mut self.chunk, self.origin.is_some())?;
        Ok(self.chunk)
    }

    /// Returns at least `min` numbers as words that `str::parse` accepts.
    fn parse_numbers<'t>(
        &mut self,
        line: &Line,
        keyword: &str,
        rest: &'t str,
        min: usize,
        counts: Counts,
    ) -> Result<Vec<Cow<'t, str>>, LoadError> {
        let Some(mut list) = split_numbers(rest, counts) else {
            return Err(LoadError::parse(line.location(rest), format!("{keyword} {AMBIGUOUS}")));
        };
        // A word whose decimal comma was replaced is no part of the line.
        let location =
            |word: &Cow<str>| line.location(if let Cow::Borrowed(word) = word { word } else { rest });
        for word in &mut list.words {
            let plain = plain_number(word).or_else(|| {
                let mantissa = plain_mantissa(word)?;
                self.malformed_exponent.get_or_insert_with(|| location(word));
                Some(mantissa)
            });
            match plain {
                None => {
                    let message = format!("'{}' is not a number", printable(word));
                    return Err(LoadError::parse(location(word), message));
                }
                Some(Cow::Borrowed(same)) if same.len() == word.len() => {}
                Some(plain) => *word = plain.into_owned().into(),
            }
        }
        match list.commas {
            Commas::None => {}
            Commas::Decimal => _ = self.decimal_comma.get_or_insert_with(|| line.location(rest)),
            Commas::Separator => _ = self.separating_comma.get_or_insert_with(|| line.location(rest)),
        }
        if list.words.len() < min {
            let found = list.words.len();
            let location = line.location(line.text.get(..keyword.len()).unwrap_or(""));
            return Err(LoadError::parse(location, format!("{keyword} needs {min} numbers, found {found}")));
        }
        Ok(list.words)
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
