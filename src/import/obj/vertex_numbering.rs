//! Faces whose texture coordinates and normals have the numbers of their vertices, although objects without these
//! attributes come before: VTK and trimesh count only vertices.

use super::chunk::NO_INDEX;
use super::text::{logical_lines, split_keyword};

/// The elements of one kind, `vt` or `vn`, that belong to the vertices of a file; [`NO_INDEX`] for none.
#[derive(Debug)]
struct ElementsOfVertices(Vec<u32>);

/// The texture coordinates and the normals that belong to the vertices of a file; `None` for a kind whose own numbers
/// count.
#[derive(Debug, Default)]
pub(super) struct VertexNumbering {
    uvs: Option<ElementsOfVertices>,
    normals: Option<ElementsOfVertices>,
}

/// The numbers of positions, texture coordinates and normals before the current line.
type Totals = [usize; 3];

impl VertexNumbering {
    /// Finds the kinds of a file that are numbered by vertices: all corners that have them repeat the number of their
    /// vertex, some number is beyond the end, and each object has as many of them as vertices, or none.
    pub fn find(text: &str) -> VertexNumbering {
        let mut totals: Totals = [0; 3];
        // An object begins with the first vertex after other statements.
        let mut objects: Vec<Totals> = vec![totals];
        let mut is_in_vertices = true;
        let mut repeats = [true; 2];
        let mut largest = [0; 2];
        for line in logical_lines(text) {
            let (keyword, rest) = split_keyword(&line.text);
            let kind = match keyword {
                "v" => 0,
                "vt" => 1,
                "vn" => 2,
                _ if keyword.is_empty() || keyword.starts_with('#') => continue,
                _ => {
                    is_in_vertices = false;
                    if keyword == "f" {
                        rest.split_whitespace()
                            .for_each(|corner| compare(corner, &mut repeats, &mut largest));
                    }
                    continue;
                }
            };
            if kind == 0 && !is_in_vertices {
                objects.push(totals);
            }
            is_in_vertices = true;
            totals[kind] += 1;
        }
        objects.push(totals);
        let find = |kind: usize| {
            let is_numbered = repeats[kind - 1] && totals[kind] > 0 && largest[kind - 1] > totals[kind];
            if is_numbered { elements_of_vertices(&objects, kind) } else { None }
        };
        VertexNumbering { uvs: find(1), normals: find(2) }
    }

    /// Returns the name of the kinds that are numbered by vertices; `None` if there are none.
    pub fn attributes(&self) -> Option<&'static str> {
        match (&self.uvs, &self.normals) {
            (Some(_), Some(_)) => Some("texture coordinates and normals"),
            (Some(_), None) => Some("texture coordinates"),
            (None, Some(_)) => Some("normals"),
            (None, None) => None,
        }
    }

    /// Returns the element of a kind (1 for `vt`, 2 for `vn`) that belongs to a vertex, both from 0, and [`NO_INDEX`] for
    /// none; `None` for a kind whose own numbers count.
    pub fn element(&self, kind: usize, vertex: u32) -> Option<u32> {
        let elements = match kind {
            1 => self.uvs.as_ref()?,
            2 => self.normals.as_ref()?,
            _ => return None,
        };
        Some(elements.0.get(vertex as usize).copied().unwrap_or(NO_INDEX))
    }
}

/// Compares the numbers of a corner's texture coordinate and normal with that of its vertex.
fn compare(corner: &str, repeats: &mut [bool; 2], largest: &mut [usize; 2]) {
    let mut parts = corner.split('/');
    let vertex = parts.next().unwrap_or("");
    for (kind, part) in parts.take(2).enumerate().filter(|(_, part)| !part.is_empty()) {
        repeats[kind] &= part == vertex;
        largest[kind] = largest[kind].max(part.parse().unwrap_or(0));
    }
}

/// Returns the elements of a kind by vertex. `objects` has the totals at the start of each object, and at the end.
fn elements_of_vertices(objects: &[Totals], kind: usize) -> Option<ElementsOfVertices> {
    let mut elements = Vec::new();
    for object in objects.windows(2) {
        let count = |kind: usize| object[1][kind] - object[0][kind];
        match count(kind) {
            0 => elements.resize(object[1][0], NO_INDEX),
            own if own == count(0) => {
                elements
                    .extend((object[0][kind]..object[1][kind]).map(|i| u32::try_from(i).unwrap_or(NO_INDEX)));
            }
            _ => return None,
        }
    }
    Some(ElementsOfVertices(elements))
}
