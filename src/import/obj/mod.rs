//! Wavefront OBJ and MTL: forty years of exporters.
//!
//! Two readers turn text into the same blocks of numbers, faces and statements: a fast one for
//! well-formed text ([`scan`]), and a careful one around tobj ([`careful`]) for everything else,
//! which also says what is wrong. What the blocks mean is then one for both ([`parsed`]):
//! polygons, smoothing groups, welding, MTLs and textures are our own.

mod block;
mod colors;
mod digits;
mod ear_clipping;
mod fast_parser;
mod float;
mod lenient_parser;
mod libraries;
mod line_chunks;
mod map;
mod material;
mod meshes;
mod mtl;
mod parsed;
mod polygon;
mod recenter;
mod smoothing;
mod table;
mod text;
mod textures;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use super::error::{LoadError, Warning, Warnings};
use super::memory::MemoryBudget;
use super::{Limits, LoadOptions, UpAxis};
use crate::import::files::{escape::printable, scene_folder::SceneFolder};
use crate::scene::{FileDigest, HashingReader, Instance, LocalTransform, Node, Scene, Source, SourceFormat};
use libraries::Libraries;
use line_chunks::STRETCH;
use mtl::Mtl;
use parsed::Parsed;
use textures::Library;

/// Reads an .obj with the MTLs and textures that it names.
pub(super) fn load(
    path: &Path,
    folder: &SceneFolder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let limits = &options.limits;
    let budget = MemoryBudget::new(limits.memory_bytes);
    let mut read = read_text(path, folder, limits, &budget, None)?;
    if let Some(middle) = recenter::middle(&read.parsed) {
        // Only what is kept is in memory: the first reading goes before the second comes.
        drop(read);
        read = read_text(path, folder, limits, &MemoryBudget::new(limits.memory_bytes), Some(middle))?;
    }
    scene(read, folder, options, &budget)
}

/// An OBJ's own text, read.
struct Read {
    parsed: Parsed,
    /// What positions are relative to, where that is not where the file has its origin.
    origin: Option<DVec3>,
    generator: String,
    warnings: Warnings,
}

/// Reads the text of a file, quickly where it can.
fn read_text(
    path: &Path,
    folder: &SceneFolder,
    limits: &Limits,
    budget: &MemoryBudget,
    origin: Option<DVec3>,
) -> Result<Read, LoadError> {
    let file = crate::import::files::read_file::open_scene_file(path, limits.file_bytes)?;
    let bytes = file.get_ref().metadata().map_err(|e| LoadError::io(path, e))?.len();
    budget.charge_obj(bytes)?;
    let mut file = HashingReader::new(file);
    if let Some(read) = quickly(&mut file, STRETCH, limits, origin) {
        folder.sources.record_scene(file.digest());
        return Ok(read);
    }
    budget.charge_obj_lenient(bytes)?;
    let bytes = crate::import::files::read_file::read_scene_file(path, limits.file_bytes)?;
    folder.sources.record_scene(FileDigest::of(&bytes));
    carefully(&bytes, limits, origin)
}

/// Well-formed text, on all threads; `None` for any other.
fn quickly(
    file: impl std::io::Read + Send,
    stretch: usize,
    limits: &Limits,
    origin: Option<DVec3>,
) -> Option<Read> {
    let (blocks, head) = fast_parser::read(file, stretch, limits, origin)?;
    let generator = generator(&text::decode(&head).0);
    Some(Read { parsed: Parsed::new(blocks)?, origin, generator, warnings: Warnings::default() })
}

/// Any text, by tobj, with what it has to say.
fn carefully(bytes: &[u8], limits: &Limits, origin: Option<DVec3>) -> Result<Read, LoadError> {
    let mut warnings = Warnings::default();
    let (text, guessed) = text::decode(bytes);
    if guessed {
        warnings.add("", "lines that are not UTF-8 were read as Windows-1252");
    }
    let block = lenient_parser::read(&text, limits, origin, &mut warnings)?;
    // The reader has checked every index itself.
    let parsed = Parsed::new(vec![block]);
    let parsed = parsed.ok_or_else(|| LoadError::invalid("OBJ", "a face points at nothing"))?;
    Ok(Read { parsed, origin, generator: generator(&text), warnings })
}

/// Why a text without faces is no scene: perhaps it is no OBJ at all.
fn nothing_to_draw(parsed: &Parsed, warnings: Warnings) -> LoadError {
    if parsed.positions.is_empty() {
        return LoadError::invalid(
            "OBJ",
            "no vertices and no faces: only .gltf, .glb and .obj files are read",
        );
    }
    let told: String = warnings.into_vec().iter().map(|warning| format!("; {warning}")).collect();
    LoadError::invalid("OBJ", format!("no faces: there is nothing to draw{told}"))
}

/// What was read, with materials, as a scene.
fn scene(
    read: Read,
    folder: &SceneFolder,
    options: &LoadOptions,
    budget: &MemoryBudget,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let Read { mut parsed, origin, generator, mut warnings } = read;
    let mut counted = |n: u64, what: &str| {
        if n > 0 {
            warnings.add("", format!("{n} {what}"));
        }
    };
    counted(parsed.lines_and_points, "lines and points are not shown");
    counted(parsed.degenerate, "faces with fewer than three vertices left out");
    counted(parsed.too_large, "concave polygons with too many corners are cut as if they were convex");
    counted(parsed.crossing, "polygons of many corners that cross themselves are cut as if they were convex");
    if parsed.segments.is_empty() {
        return Err(nothing_to_draw(&parsed, warnings));
    }
    let painted = colors::painted(&parsed.colors);
    colors::to_linear(&mut parsed.colors, &mut warnings);
    let libraries =
        Libraries::read(&parsed.libraries, &parsed.materials, folder, &options.limits, &mut warnings);
    let used: Vec<Option<&Mtl>> = parsed.materials.iter().map(|name| libraries.material(name)).collect();
    let mtls: Vec<&Mtl> = used.iter().flatten().copied().collect();
    let mut images = Library::load(&mtls, folder, &options.limits, budget, &mut warnings)?;

    let mut scene = Scene {
        source: Source { format: SourceFormat::Obj, generator, ..Default::default() },
        objects: parsed.objects.clone(),
        ..Default::default()
    };
    let local = LocalTransform::Matrix(to_world(options.up, origin));
    scene.nodes.push(Node { name: String::new(), local, visible: true, ..Default::default() });
    let meshes = meshes::meshes(parsed, &options.limits)?;
    // Materials in the order in which faces use them; `None` is the default material.
    let mut material_of: HashMap<Option<u32>, u32> = HashMap::new();
    let mut black = 0;
    for (i, (key, mut mesh)) in meshes.into_iter().enumerate() {
        let mtl = key.material.and_then(|m| used[m as usize]);
        let slot = key.material.filter(|_| mtl.is_some());
        mesh.material = *material_of.entry(slot).or_insert_with(|| {
            scene.materials.push(match mtl {
                Some(mtl) => material::material(mtl, &mut images, &mut warnings),
                None => material::default_material(),
            });
            scene.materials.len() as u32 - 1
        });
        if mtl.is_some_and(|m| m.by_blender) && !mesh.colors.is_empty() {
            // Blender writes what its materials make of the colours into Kd, and shows no others.
            mesh.colors = Vec::new();
            warnings.add("", "vertex colours beside a material of Blender's are not part of it: left out");
        }
        black += u64::from(painted && colors::take_black(&mut mesh));
        if let Some(map) = scene.materials[mesh.material as usize].normal {
            // A normal map turns the normals of flat faces too.
            super::tangents::generate(&mut mesh, &map.texture, &scene.source);
        }
        let (mesh_id, object) = (i as u32, key.object + 1);
        scene.instances.push(Instance { node: 0, mesh: mesh_id, object, ..Instance::default() });
        scene.meshes.push(mesh);
    }
    if black > 0 {
        let what =
            "meshes whose vertex colours are all 0 0 0, beside others with colours: shown without them";
        warnings.add("", format!("{black} {what}"));
    }
    (scene.images, scene.textures) = (images.images, images.textures);
    Ok((scene, warnings.into_vec()))
}

/// From coordinates relative to `origin` to the world.
fn to_world(up: UpAxis, origin: Option<DVec3>) -> DAffine3 {
    let turn = match up {
        UpAxis::Y => DMat3::IDENTITY,
        UpAxis::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    };
    DAffine3 { matrix3: turn, translation: turn * origin.unwrap_or_default() }
}

/// The first comment, where exporters name themselves.
fn generator(text: &str) -> String {
    let first = text.trim_start_matches('\u{feff}').split(['\n', '\r']).next().unwrap_or("");
    first.strip_prefix('#').map(|c| printable(c.trim())).unwrap_or_default()
}

#[cfg(test)]
mod tests;
