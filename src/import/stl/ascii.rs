//! STL as text: solids with facets, each a loop of vertices.

use glam::DVec3;

use super::StlFile;
use super::welder::Welder;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::memory::MemoryBudget;
use crate::polygons::polygon_mesh::{Part, PolygonMesh};
use blinn_core::cancellation::CancelToken;

/// Number of lines between two looks at the cancellation.
const CANCEL_INTERVAL: usize = 1 << 16;

/// Bytes of a corner in the mesh, with its share of the number of the facet's part, and corners that are charged at first.
const CORNER: u64 = 6;
const CHARGED_CORNERS: usize = 1 << 12;

/// Returns true if a file begins as text does: `solid`, and then a facet or the end. Binary files may begin with `solid`, too.
pub(super) fn is_text(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let is_solid = head.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let contains = |word: &[u8]| head.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word));
    is_solid && !head.contains(&0) && (contains(b"facet") || contains(b"endsolid"))
}

/// Parses a file with positions relative to `origin`.
pub(super) fn parse(
    file: &[u8],
    origin: DVec3,
    budget: &MemoryBudget,
    cancel: &CancelToken,
    warnings: &mut Warnings,
) -> Result<StlFile, LoadError> {
    let mut mesh = PolygonMesh::default();
    let mut welder = Welder::new(origin, budget);
    let mut charged_corners = 0;
    // The first corner of the facet that is being read.
    let mut first = None;
    let mut degenerate = 0u64;
    // The line of the first number with a decimal comma.
    let mut decimal_comma = None;
    let file = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
    let end = if file.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut lines = file.split(|byte| *byte == end).enumerate().peekable();
    while let Some((i, line)) = lines.next() {
        if i % CANCEL_INTERVAL == 0 {
            cancel.check()?;
        }
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        let keyword = words.next().unwrap_or_default().to_ascii_lowercase();
        match keyword.as_str() {
            "vertex" => {
                first.get_or_insert(mesh.corners.len());
                if mesh.corners.len() == charged_corners {
                    let more = charged_corners.max(CHARGED_CORNERS);
                    budget.charge(CORNER * more as u64)?;
                    charged_corners += more;
                }
                match position(words) {
                    Some((position, has_comma)) => {
                        if has_comma {
                            decimal_comma.get_or_insert(i);
                        }
                        welder.push_corner(position, &mut mesh)?;
                    }
                    // The file ends within the line.
                    None if lines.peek().is_none() => break,
                    None => return Err(no_vertex(i, &text)),
                }
            }
            "endloop" | "endfacet" | "facet" => {
                if let Some(first) = first.take() {
                    if mesh.push_face(first) {
                        if mesh.objects.is_empty() {
                            begin_solid("", &mut mesh);
                        }
                        mesh.face_parts.push(mesh.objects.len() as u32 - 1);
                    } else {
                        degenerate += 1;
                    }
                }
            }
            "solid" => begin_solid(text.trim().get("solid".len()..).unwrap_or_default().trim(), &mut mesh),
            _ => {}
        }
    }
    if let Some(first) = first {
        mesh.corners.truncate(first);
        warnings.add("", "the file ends within a facet, which is left out");
    }
    if let Some(line) = decimal_comma {
        let what = "numbers have decimal commas: read as decimal points";
        warnings.add(format!("STL, line {}", line + 1), what);
    }
    if degenerate > 0 {
        warnings.add("", format!("ignored {degenerate} facets with fewer than three vertices"));
    }
    Ok(StlFile { mesh, generator: String::new(), charged_table: welder.charged_table() })
}

/// Begins an object and its part.
fn begin_solid(name: &str, mesh: &mut PolygonMesh) {
    let object = mesh.objects.len() as u32;
    mesh.objects.push(if name.is_empty() { "default".into() } else { name.to_string() });
    mesh.parts.push(Part { object, material: 0 });
}

/// Parses the three numbers of a vertex. The second value is true if one has a decimal comma, as programs write it under many
/// locales.
fn position<'t>(mut words: impl Iterator<Item = &'t str>) -> Option<(DVec3, bool)> {
    let mut has_comma = false;
    let mut number = || {
        let word = words.next()?;
        word.parse::<f64>().ok().or_else(|| {
            let is_decimal = word.matches(',').count() == 1 && !word.contains('.') && !word.ends_with(',');
            let value = word.replace(',', ".").parse::<f64>().ok().filter(|_| is_decimal)?;
            has_comma = true;
            Some(value)
        })
    };
    let position = DVec3::new(number()?, number()?, number()?);
    Some((position, has_comma))
}

fn no_vertex(line: usize, text: &str) -> LoadError {
    let text: String = text.trim().chars().take(60).collect();
    let message = format!("expected a vertex with three numbers, not '{}'", printable(&text));
    LoadError::parse(format!("STL, line {}", line + 1), message)
}
