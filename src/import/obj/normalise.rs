//! The pass in front of tobj: reads what programs wrote, and gives tobj what it reads rightly.
//!
//! tobj takes faces of one kind at a time, resolves no groups, and stops at the first thing it does
//! not know. So faces are sorted into runs — of one object, smoothing group, material, with and
//! without texture coordinates and normals — and every index is resolved and checked here.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{Vec3, Vec4};

use super::super::error::{LoadError, Warnings};
use super::super::{Limits, uri::printable};
use super::text::{lines, number, split_keyword};

/// What all faces of a run have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct RunKey {
    /// Index into [`Parsed::objects`].
    pub object: u32,
    /// 0 is off.
    pub smoothing: u32,
    /// Index into [`Parsed::materials`]; `None` before any `usemtl`.
    pub material: Option<u32>,
    pub has_uv: bool,
    pub has_normal: bool,
}

/// A corner of a face: indices from 0, where the run has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub v: u32,
    pub vt: u32,
    pub vn: u32,
}

/// Faces of one kind, in file order.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub key: RunKey,
    pub corners: Vec<Corner>,
    pub arities: Vec<u32>,
}

/// An OBJ's text, understood.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    pub positions: Vec<Vec3>,
    /// Linear RGBA by vertex; empty where no vertex has one, white where this one has none.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<Vec3>,
    pub runs: Vec<Run>,
    pub objects: Vec<String>,
    pub materials: Vec<String>,
    /// The whole rest of each `mtllib` line.
    pub libraries: Vec<String>,
}

/// Reads the text of an OBJ.
pub(super) fn parse(text: &str, limits: &Limits, warnings: &mut Warnings) -> Result<Parsed, LoadError> {
    let mut reader = Reader::new(text, limits);
    for line in lines(text) {
        let (keyword, rest) = split_keyword(&line.text);
        reader.line(line.number, keyword, rest)?;
    }
    reader.finish(warnings)
}

struct Reader<'l> {
    limits: &'l Limits,
    parsed: Parsed,
    run_of: HashMap<RunKey, usize>,
    material_of: HashMap<String, u32>,
    /// True: `o` names objects and `g` counts for nothing; else `g` does.
    by_o: bool,
    object: Option<u32>,
    smoothing: u32,
    material: Option<u32>,
    triangles: u64,
    lines_and_points: u64,
    degenerate: u64,
    unknown: Vec<String>,
    totals: Totals,
    without: Option<(usize, u64)>,
}

impl<'l> Reader<'l> {
    fn new(text: &str, limits: &'l Limits) -> Reader<'l> {
        let totals = Totals::of(text);
        Reader {
            limits,
            parsed: Parsed::default(),
            run_of: HashMap::new(),
            material_of: HashMap::new(),
            by_o: totals.objects > 0,
            object: None,
            smoothing: 0,
            material: None,
            triangles: 0,
            lines_and_points: 0,
            degenerate: 0,
            unknown: Vec::new(),
            totals,
            without: None,
        }
    }

    fn line(&mut self, at: usize, keyword: &str, rest: &str) -> Result<(), LoadError> {
        match keyword {
            "v" => self.vertex(at, rest),
            "vt" => {
                let v = numbers(at, "vt", rest, 1)?;
                self.parsed.uvs.push([v[0], v.get(1).copied().unwrap_or(0.0)]);
                Ok(())
            }
            "vn" => {
                let v = numbers(at, "vn", rest, 3)?;
                self.parsed.normals.push(Vec3::new(v[0], v[1], v[2]));
                Ok(())
            }
            "f" | "fo" => self.face(at, rest),
            "l" | "p" => {
                self.lines_and_points += 1;
                Ok(())
            }
            "o" => {
                self.object = Some(self.new_object(rest));
                Ok(())
            }
            "g" if !self.by_o => {
                // A group that is taken up again is the same object.
                let known = self.parsed.objects.iter().position(|o| o == rest);
                self.object = Some(known.map_or_else(|| self.new_object(rest), |i| i as u32));
                Ok(())
            }
            "s" => {
                self.smoothing = match rest {
                    "" | "off" | "Off" | "OFF" => 0,
                    "on" => 1,
                    other => number(other).filter(|v| *v > 0.0).map_or(0, |v| v.min(4e9) as u32),
                };
                Ok(())
            }
            "usemtl" => {
                let name = rest.to_string();
                let next = self.parsed.materials.len() as u32;
                self.material = Some(*self.material_of.entry(name.clone()).or_insert_with(|| {
                    self.parsed.materials.push(name);
                    next
                }));
                Ok(())
            }
            "mtllib" => {
                if !rest.is_empty() && !self.parsed.libraries.iter().any(|l| l == rest) {
                    self.parsed.libraries.push(rest.to_string());
                }
                Ok(())
            }
            "g" | "vp" => Ok(()),
            other => {
                let name = printable(other);
                if self.unknown.len() < 20 && !self.unknown.contains(&name) {
                    self.unknown.push(name);
                }
                Ok(())
            }
        }
    }

    fn new_object(&mut self, name: &str) -> u32 {
        self.parsed.objects.push(name.to_string());
        self.parsed.objects.len() as u32 - 1
    }

    /// x y z, perhaps w, perhaps a colour of three or four numbers.
    fn vertex(&mut self, at: usize, rest: &str) -> Result<(), LoadError> {
        LoadError::check("vertices", self.parsed.positions.len() as u64 + 1, self.limits.vertices)?;
        let v = numbers(at, "v", rest, 3)?;
        let color = match v[3..] {
            [r, g, b] => Some(Vec4::new(r, g, b, 1.0)),
            [r, g, b, a] => Some(Vec4::new(r, g, b, a)),
            _ => None,
        };
        let parsed = &mut self.parsed;
        if let Some(color) = color {
            parsed.colors.resize(parsed.positions.len(), Vec4::ONE);
            parsed.colors.push(color);
        }
        parsed.positions.push(Vec3::new(v[0], v[1], v[2]));
        Ok(())
    }

    fn face(&mut self, at: usize, rest: &str) -> Result<(), LoadError> {
        let mut corners = Vec::with_capacity(4);
        let (mut has_uv, mut has_normal) = (true, true);
        let mut lacks = false;
        let totals = &self.totals;
        for word in rest.split_whitespace() {
            let mut parts = word.splitn(3, '/');
            let mut index = |kind: Kind, so_far: usize, total: usize| match parts.next() {
                None | Some("") => Ok(None),
                Some(text) => match resolve(at, word, kind, text, so_far)? {
                    Some(index) if (index as usize) < total => Ok(Some(index)),
                    _ if kind == Kind::Vertex => {
                        let rule = format!("there is no vertex {text}: the file has {total}");
                        Err(LoadError::invalid(place(at, word), rule))
                    }
                    // Exporters that name what they did not write mean nothing by it.
                    _ => {
                        lacks = true;
                        Ok(None)
                    }
                },
            };
            let Some(v) = index(Kind::Vertex, self.parsed.positions.len(), totals.vertices)? else {
                return Err(LoadError::parse(place(at, word), format!("'{word}' names no vertex")));
            };
            let vt = index(Kind::TextureCoordinate, self.parsed.uvs.len(), totals.uvs)?;
            let vn = index(Kind::Normal, self.parsed.normals.len(), totals.normals)?;
            has_uv &= vt.is_some();
            has_normal &= vn.is_some();
            corners.push(Corner { v, vt: vt.unwrap_or(0), vn: vn.unwrap_or(0) });
        }
        if lacks {
            self.without.get_or_insert((at, 0)).1 += 1;
        }
        if corners.len() < 3 {
            if corners.is_empty() {
                return Err(LoadError::parse(format!("line {at}"), "a face without vertices"));
            }
            self.degenerate += 1;
            return Ok(());
        }
        self.triangles += corners.len() as u64 - 2;
        LoadError::check("triangles", self.triangles, self.limits.triangles)?;
        let object = match self.object {
            Some(object) => object,
            None => {
                let object = self.new_object("default");
                self.object = Some(object);
                object
            }
        };
        let smoothing = if has_normal { 0 } else { self.smoothing };
        let key = RunKey { object, smoothing, material: self.material, has_uv, has_normal };
        let next = self.parsed.runs.len();
        let run = *self.run_of.entry(key).or_insert(next);
        if run == next {
            self.parsed.runs.push(Run { key, corners: Vec::new(), arities: Vec::new() });
        }
        let run = &mut self.parsed.runs[run];
        run.arities.push(corners.len() as u32);
        run.corners.append(&mut corners);
        Ok(())
    }

    fn finish(mut self, warnings: &mut Warnings) -> Result<Parsed, LoadError> {
        if let Some((line, faces)) = self.without {
            let what = format!(
                "{faces} faces name texture coordinates or normals that the file has not: without them"
            );
            warnings.add(format!("line {line}"), what);
        }
        let mut counted = |n: u64, what: &str| {
            if n > 0 {
                warnings.add("", format!("{n} {what}"));
            }
        };
        counted(self.lines_and_points, "lines and points are not shown");
        counted(self.degenerate, "faces with fewer than three vertices left out");
        if !self.unknown.is_empty() {
            warnings.add("", format!("statements not understood and left out: {}", self.unknown.join(", ")));
        }
        if self.parsed.runs.is_empty() {
            return Err(LoadError::invalid("OBJ", "no faces: there is nothing to draw"));
        }
        if !self.parsed.colors.is_empty() {
            self.parsed.colors.resize(self.parsed.positions.len(), Vec4::ONE);
        }
        Ok(self.parsed)
    }
}

/// At least `least` numbers, as f32.
fn numbers(at: usize, keyword: &str, rest: &str, least: usize) -> Result<Vec<f32>, LoadError> {
    let one = |word: &str| match number(word) {
        Some(v) => Ok(v as f32),
        None => Err(LoadError::parse(place(at, word), format!("'{}' is not a number", printable(word)))),
    };
    let values: Vec<f32> = rest.split_whitespace().map(one).collect::<Result<_, _>>()?;
    if values.len() < least {
        let found = values.len();
        return Err(LoadError::parse(
            format!("line {at}"),
            format!("{keyword} needs {least} numbers, not {found}"),
        ));
    }
    Ok(values)
}

fn place(line: usize, word: &str) -> String {
    format!("line {line}, at '{}'", printable(word))
}

/// How much of everything the file has: faces may stand before what they use.
#[derive(Debug, Default)]
struct Totals {
    vertices: usize,
    uvs: usize,
    normals: usize,
    objects: usize,
}

impl Totals {
    fn of(text: &str) -> Totals {
        let mut totals = Totals::default();
        for line in lines(text) {
            match split_keyword(&line.text).0 {
                "v" => totals.vertices += 1,
                "vt" => totals.uvs += 1,
                "vn" => totals.normals += 1,
                "o" => totals.objects += 1,
                _ => {}
            }
        }
        totals
    }
}

/// What an index counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Vertex,
    TextureCoordinate,
    Normal,
}

/// An index as written — from 1, or negative from what has been given so far — to one from 0;
/// `None` where there can be no such thing.
fn resolve(line: usize, word: &str, kind: Kind, text: &str, so_far: usize) -> Result<Option<u32>, LoadError> {
    let Ok(written) = text.parse::<i64>() else {
        let what = match kind {
            Kind::Vertex => "a vertex index",
            Kind::TextureCoordinate => "an index of a texture coordinate",
            Kind::Normal => "an index of a normal",
        };
        return Err(LoadError::parse(place(line, word), format!("'{}' is not {what}", printable(text))));
    };
    let index = if written < 0 { so_far as i64 + written } else { written - 1 };
    Ok(u32::try_from(index).ok())
}

impl Parsed {
    /// The text that tobj reads: all vertices, then a group for each run, named by its number.
    pub fn to_text(&self) -> String {
        let mut out = String::with_capacity(self.positions.len() * 40);
        for p in &self.positions {
            let _ = writeln!(out, "v {} {} {}", p.x, p.y, p.z);
        }
        for t in &self.uvs {
            let _ = writeln!(out, "vt {} {}", t[0], t[1]);
        }
        for n in &self.normals {
            let _ = writeln!(out, "vn {} {} {}", n.x, n.y, n.z);
        }
        for (i, run) in self.runs.iter().enumerate() {
            let _ = writeln!(out, "o {i}");
            let mut corners = run.corners.iter();
            for &arity in &run.arities {
                out.push('f');
                for c in corners.by_ref().take(arity as usize) {
                    let _ = match (run.key.has_uv, run.key.has_normal) {
                        (true, true) => write!(out, " {}/{}/{}", c.v + 1, c.vt + 1, c.vn + 1),
                        (true, false) => write!(out, " {}/{}", c.v + 1, c.vt + 1),
                        (false, true) => write!(out, " {}//{}", c.v + 1, c.vn + 1),
                        (false, false) => write!(out, " {}", c.v + 1),
                    };
                }
                out.push('\n');
            }
        }
        out
    }
}
