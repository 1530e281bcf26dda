//! Plain OBJ text: the numbers of a cleaned file in its own words, and faces with absolute indices. tobj parses it.

use std::borrow::Cow;
use std::fmt::{Display, Write};
use std::path::Path;

use glam::Vec3;

use super::chunk::{Chunk, Corner, NO_INDEX};
use crate::error::LoadError;

/// Plain text with one `v`, `vt` or `vn` line per element.
#[derive(Debug, Default)]
pub(super) struct PlainText {
    text: String,
}

impl PlainText {
    /// Adds a line. `words` are numbers that `str::parse` accepts.
    pub fn push_line(&mut self, keyword: &str, words: &[Cow<'_, str>]) {
        self.text.push_str(keyword);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
    }

    /// Adds the faces of `chunk`, parses the text with tobj and sets the positions (unless `keeps_positions`),
    /// texture coordinates and normals of all corners.
    pub fn parse_into(mut self, chunk: &mut Chunk, keeps_positions: bool) -> Result<(), LoadError> {
        if chunk.faces == 0 && chunk.round_vertices.is_empty() {
            return Ok(());
        }
        let has_uvs = chunk.corners.iter().any(|c| c.vt != NO_INDEX);
        let has_normals = chunk.corners.iter().any(|c| c.vn != NO_INDEX);
        // tobj wants the same attributes in all faces of a mesh. Corners without one use an element at the end.
        self.text.push_str("vt 0 0\nvn 0 0 0\n");
        self.push_faces(chunk, has_uvs, has_normals);
        self.push_rounds(chunk, has_uvs, has_normals);
        let mesh = self.parse()?;
        let indices = [&mesh.indices, &mesh.texcoord_indices, &mesh.normal_indices];
        let expected = [true, has_uvs, has_normals];
        let count = chunk.corners.len() + 3 * chunk.round_vertices.len();
        if indices.iter().zip(expected).any(|(list, used)| used && list.len() != count) {
            return Err(error(&"faces were lost"));
        }
        for (i, corner) in chunk.corners.iter().enumerate() {
            let at = |list: usize, size: usize| size * indices[list][i] as usize;
            if !keeps_positions {
                chunk.positions[corner.v as usize] = Vec3::from_slice(&mesh.positions[at(0, 3)..]);
            }
            if corner.vt != NO_INDEX {
                let [u, v] = [0, 1].map(|k| mesh.texcoords[at(1, 2) + k]);
                chunk.uvs[corner.vt as usize] = [u, v];
            }
            if corner.vn != NO_INDEX {
                chunk.normals[corner.vn as usize] = Vec3::from_slice(&mesh.normals[at(2, 3)..]);
            }
        }
        if !keeps_positions {
            let rounds = mesh.indices[chunk.corners.len()..].iter().step_by(3);
            for (&vertex, &index) in chunk.round_vertices.iter().zip(rounds) {
                chunk.positions[vertex as usize] = Vec3::from_slice(&mesh.positions[3 * index as usize..]);
            }
        }
        Ok(())
    }

    /// Adds the faces with one-based indices.
    fn push_faces(&mut self, chunk: &Chunk, has_uvs: bool, has_normals: bool) {
        let mut corners = chunk.corners.iter();
        for face in 0..chunk.faces {
            let arity = chunk.arities.get(face).map_or(3, |&a| a as usize);
            self.text.push('f');
            for corner in corners.by_ref().take(arity) {
                self.push_corner(corner, chunk, has_uvs, has_normals);
            }
            self.text.push('\n');
        }
    }

    /// Adds a triangle for each vertex of points and lines, whose corners are that vertex.
    fn push_rounds(&mut self, chunk: &Chunk, has_uvs: bool, has_normals: bool) {
        for &v in &chunk.round_vertices {
            self.text.push('f');
            for _ in 0..3 {
                self.push_corner(&Corner { v, vt: NO_INDEX, vn: NO_INDEX }, chunk, has_uvs, has_normals);
            }
            self.text.push('\n');
        }
    }

    fn push_corner(&mut self, corner: &Corner, chunk: &Chunk, has_uvs: bool, has_normals: bool) {
        let one_based =
            |index: u32, count: usize| if index == NO_INDEX { count + 1 } else { index as usize + 1 };
        let v = corner.v + 1;
        let vt = one_based(corner.vt, chunk.uvs.len());
        let vn = one_based(corner.vn, chunk.normals.len());
        // Writing to a string cannot fail.
        let _ = match (has_uvs, has_normals) {
            (true, true) => write!(self.text, " {v}/{vt}/{vn}"),
            (true, false) => write!(self.text, " {v}/{vt}"),
            (false, true) => write!(self.text, " {v}//{vn}"),
            (false, false) => write!(self.text, " {v}"),
        };
    }

    fn parse(&self) -> Result<tobj::Mesh, LoadError> {
        let options = tobj::LoadOptions { single_index: false, triangulate: false, ..Default::default() };
        let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
        let parsed = tobj::load_obj_buf(&mut self.text.as_bytes(), &options, no_materials);
        let (mut models, _) = parsed.map_err(|e| error(&e))?;
        models.pop().map(|model| model.mesh).ok_or_else(|| error(&"faces were lost"))
    }
}

fn error(cause: &dyn Display) -> LoadError {
    LoadError::parse("the file", format!("cannot be parsed as OBJ: {cause}"))
}
