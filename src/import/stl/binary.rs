//! Binary STL: a header of 80 bytes, the number of facets, and 50 bytes for each.
//!
//! Two programs store colours in the last two bytes of a facet, 5 bits for each channel: VisCAM, where the highest bit marks a
//! colour, and Materialise Magics, whose header has `COLOR=` and the colour of facets whose highest bit is set.

use glam::{DVec3, Vec3, Vec4};

use super::StlFile;
use super::welder::Welder;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::memory::MemoryBudget;
use crate::polygons::polygon_mesh::PolygonMesh;
use blinn_core::cancellation::CancelToken;
use blinn_scene::srgb_to_linear;

const HEADER: usize = 80;
/// Bytes before the first facet.
const START: usize = HEADER + 4;
const FACET: usize = 50;
/// Marks a facet with a colour (VisCAM) or with that of the header (Magics).
const MARK: u16 = 1 << 15;
/// Bytes of the corners and the colour of a facet in the mesh.
const CORNERS: u64 = 12;
const COLOR: u64 = 16;
/// Number of facets between two looks at the cancellation.
const CANCEL_INTERVAL: usize = 1 << 16;

/// Returns the number of facets that the file says it has.
fn stated_count(file: &[u8]) -> Option<u64> {
    let count = file.get(HEADER..START)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

/// Returns true if a file of `bytes` bytes is as long as its number of facets requires.
pub(super) fn has_exact_size(head: &[u8], bytes: u64) -> bool {
    stated_count(head).is_some_and(|count| count > 0 && bytes == START as u64 + FACET as u64 * count)
}

/// Returns the number of facets that the file has.
pub(super) fn facet_count(file: &[u8]) -> u64 {
    let present = (file.len().saturating_sub(START) / FACET) as u64;
    match stated_count(file) {
        // Programs that write to a pipe do not know the number.
        Some(0) | None => present,
        Some(count) => count.min(present),
    }
}

/// Parses a file with positions relative to `origin`.
pub(super) fn parse(
    file: &[u8],
    origin: DVec3,
    budget: &MemoryBudget,
    cancel: &CancelToken,
    warnings: &mut Warnings,
) -> Result<StlFile, LoadError> {
    let Some(stated) = stated_count(file) else {
        return Err(LoadError::parse(
            "STL",
            "neither text that begins with 'solid' and has facets, nor a binary file",
        ));
    };
    let count = facet_count(file);
    if stated > count {
        warnings.add("", format!("the file ends after {count} of {stated} triangles"));
    } else if stated < count {
        warnings.add("", format!("the file states no number of triangles; read {count}"));
    }
    let header = &file[..HEADER];
    let default = magics_color(header);
    let facets = &file[START..START + FACET * count as usize];
    let facets = facets.as_chunks::<FACET>().0;
    let attribute = |facet: &[u8; FACET]| u16::from_le_bytes([facet[48], facet[49]]);
    let has_colors = default.is_some() || facets.iter().any(|facet| attribute(facet) & MARK != 0);
    budget.charge(count * (CORNERS + if has_colors { COLOR } else { 0 }))?;
    let mut mesh = PolygonMesh::default();
    mesh.corners.reserve_exact(3 * facets.len());
    mesh.face_colors.reserve_exact(if has_colors { facets.len() } else { 0 });
    let mut welder = Welder::new(origin, budget);
    for (i, facet) in facets.iter().enumerate() {
        if i % CANCEL_INTERVAL == 0 {
            cancel.check()?;
        }
        let first = mesh.corners.len();
        // The normal comes first; the order of the vertices has it too.
        for corner in facet[12..48].as_chunks::<12>().0 {
            let axis =
                |k: usize| f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]]);
            welder.push_corner(Vec3::new(axis(0), axis(4), axis(8)).as_dvec3(), &mut mesh)?;
        }
        mesh.push_face(first);
        if has_colors {
            mesh.face_colors.push(facet_color(attribute(facet), default));
        }
    }
    let text = header.split(|byte| *byte == 0).next().unwrap_or_default();
    let text = String::from_utf8_lossy(text).into_owned();
    let generator = printable(text.split("COLOR=").next().unwrap_or_default().trim());
    Ok(StlFile { mesh, generator, charged_table: welder.charged_table() })
}

/// Returns the colour of facets that Materialise Magics writes into the header.
fn magics_color(header: &[u8]) -> Option<Vec4> {
    let mark = b"COLOR=";
    let at = header.windows(mark.len()).position(|window| window == mark)? + mark.len();
    let [r, g, b, a] = *header.get(at..at + 4)? else { return None };
    let channel = |byte: u8| srgb_to_linear(f32::from(byte) / 255.0);
    // An alpha of 0 would hide the model.
    let alpha = if a == 0 { 1.0 } else { f32::from(a) / 255.0 };
    Some(Vec4::new(channel(r), channel(g), channel(b), alpha))
}

/// Returns the colour of a facet by its attribute. `default` is the colour of a header by Magics.
fn facet_color(attribute: u16, default: Option<Vec4>) -> Vec4 {
    let channel = |shift: u32| srgb_to_linear(f32::from((attribute >> shift) & 31) / 31.0);
    match default {
        Some(default) if attribute & MARK != 0 => default,
        Some(_) => Vec4::new(channel(0), channel(5), channel(10), 1.0),
        None if attribute & MARK != 0 => Vec4::new(channel(10), channel(5), channel(0), 1.0),
        None => Vec4::ONE,
    }
}
