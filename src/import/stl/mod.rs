//! STL: triangles as text, or as binary records with colours.

mod ascii;
mod binary;
mod encoding;
#[cfg(test)]
mod tests;
mod welder;

use glam::DVec3;

use crate::error::{LoadError, Warning, Warnings};
use crate::files::scene_folder::SceneFolder;
use crate::memory::MemoryBudget;
use crate::obj;
use crate::options::LoadOptions;
use crate::polygons::far_centre::far_centre;
use crate::polygons::polygon_mesh::PolygonMesh;
use crate::polygons::polygon_scene::{PolygonFile, build_scene};
use blinn_scene::{Scene, SourceFormat};

/// Least number of bytes of a facet as text: `facet normal`, `outer loop`, three vertices, and the two ends.
const MIN_FACET_TEXT: u64 = 60;

/// A parsed file.
struct StlFile {
    mesh: PolygonMesh,
    /// The text in the header of a binary file.
    generator: String,
    /// Bytes charged for what was freed after parsing.
    charged_table: u64,
}

/// Returns true if a file of `bytes` bytes begins as STL files do. Only a binary file whose size fits its number of facets is
/// recognised.
pub(super) fn is_stl(head: &[u8], bytes: u64) -> bool {
    let is_utf16 = || encoding::decode_utf16(head).is_some_and(|text| ascii::is_text(text.as_bytes()));
    binary::has_exact_size(head, bytes) || ascii::is_text(head) || is_utf16()
}

fn begins_as_text(bytes: &[u8]) -> bool {
    ascii::is_text(&bytes[..bytes.len().min(4096)])
}

/// Loads an STL file.
pub(super) fn load(
    bytes: &[u8],
    folder: &SceneFolder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let mut budget = MemoryBudget::of_import(options);
    budget.charge(bytes.len() as u64)?;
    let has_binary_size = binary::has_exact_size(bytes, bytes.len() as u64);
    let mut decoded = None;
    if !has_binary_size {
        budget.charge(encoding::decoded_size(bytes))?;
        decoded = encoding::decode_utf16(bytes).filter(|text| begins_as_text(text.as_bytes()));
    }
    let is_text = decoded.is_some() || (!has_binary_size && begins_as_text(bytes));
    let bytes = decoded.as_ref().map_or(bytes, |text| text.as_bytes());
    let length = bytes.len() as u64;
    let facets = if is_text { length / MIN_FACET_TEXT } else { binary::facet_count(bytes) };
    LoadError::check_limit("triangles", facets, options.limits.triangles)?;
    let mut warnings = Warnings::default();
    let parse = |origin: DVec3, budget: &MemoryBudget, warnings: &mut Warnings| {
        let parse = if is_text { ascii::parse } else { binary::parse };
        parse(bytes, origin, budget, &options.cancel, warnings)
    };
    let before = budget.charged();
    let mut file = parse(DVec3::ZERO, &budget, &mut warnings)?;
    let origin = far_centre(file.mesh.corner_positions());
    if let Some(origin) = origin {
        // Free the first result before the second is parsed.
        drop(file);
        budget = MemoryBudget::of_import(options);
        budget.charge(before)?;
        warnings = Warnings::default();
        file = parse(origin, &budget, &mut warnings)?;
    }
    let StlFile { mesh, generator, charged_table } = file;
    budget.charge(mesh.meshes_bytes().saturating_sub(charged_table))?;
    if mesh.faces == 0 {
        let message = format!("the file has no faces to render{}", warnings.into_ending());
        return Err(LoadError::invalid("STL", message));
    }
    let materials = obj::textured_materials(&[], folder, &options.limits, &budget, &mut warnings)?;
    let file = PolygonFile { mesh, origin, format: SourceFormat::Stl, generator, materials };
    let scene = build_scene(file, options, &mut warnings)?;
    Ok((scene, warnings.into_vec()))
}
