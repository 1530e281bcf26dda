//! Wavefront OBJ and MTL: forty years of exporters.
//!
//! Two readers turn text into the same blocks of numbers, faces and statements: a fast one for
//! well-formed text ([`scan`]), and a careful one around tobj ([`careful`]) for everything else,
//! which also says what is wrong. What the blocks mean is then one for both ([`parsed`]):
//! polygons, smoothing groups, welding, MTLs and textures are our own.

mod block;
mod careful;
mod float;
mod material;
mod meshes;
mod mtl;
mod parsed;
mod polygon;
mod scan;
mod table;
mod text;
mod textures;

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};

use super::error::{LoadError, Warning, Warnings};
use super::uri::{Folder, printable};
use super::{Limits, LoadOptions, Up};
use crate::scene::{Format, Instance, Local, Node, Scene, Source};
use mtl::Mtl;
use parsed::Parsed;
use textures::Library;

/// Reads an .obj with the MTLs and textures that it names.
pub(super) fn load(
    bytes: Vec<u8>,
    folder: &Folder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let mut warnings = Warnings::default();
    let (parsed, generator) = match quickly(&bytes, scan::STRETCH, &options.limits) {
        Some(read) => read,
        None => carefully(&bytes, &options.limits, &mut warnings)?,
    };
    drop(bytes);
    scene(parsed, generator, folder, options, warnings)
}

/// Well-formed text, on all threads; `None` for any other.
fn quickly(bytes: &[u8], stretch: usize, limits: &Limits) -> Option<(Parsed, String)> {
    let parsed = Parsed::new(scan::read(bytes, stretch, limits)?)?;
    let first = bytes.iter().take(1000).position(|b| *b == b'\n').unwrap_or(bytes.len().min(1000));
    Some((parsed, generator(&text::decode(&bytes[..first]).0)))
}

/// Any text, by tobj, with what it has to say.
fn carefully(bytes: &[u8], limits: &Limits, warnings: &mut Warnings) -> Result<(Parsed, String), LoadError> {
    let (text, guessed) = text::decode(bytes);
    if guessed {
        warnings.add("", "the text is not UTF-8: read as Windows-1252");
    }
    let block = careful::read(&text, limits, warnings)?;
    // The reader has checked every index itself.
    let parsed = Parsed::new(vec![block]);
    Ok((parsed.ok_or_else(|| LoadError::invalid("OBJ", "a face points at nothing"))?, generator(&text)))
}

/// What was read, with materials, as a scene.
fn scene(
    mut parsed: Parsed,
    generator: String,
    folder: &Folder,
    options: &LoadOptions,
    mut warnings: Warnings,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let mut counted = |n: u64, what: &str| {
        if n > 0 {
            warnings.add("", format!("{n} {what}"));
        }
    };
    counted(parsed.lines_and_points, "lines and points are not shown");
    counted(parsed.degenerate, "faces with fewer than three vertices left out");
    counted(parsed.too_large, "concave polygons with too many corners are cut as if they were convex");
    if parsed.segments.is_empty() {
        return Err(LoadError::invalid("OBJ", "no faces: there is nothing to draw"));
    }
    let (library, complete) = read_libraries(&parsed, folder, options, &mut warnings);
    let used: Vec<Option<&Mtl>> = parsed.materials.iter().map(|name| by_name(&library, name)).collect();
    let mtls: Vec<&Mtl> = used.iter().flatten().copied().collect();
    let mut images = Library::load(&mtls, folder, &options.limits, &mut warnings)?;

    let mut scene = Scene {
        source: Source { format: Format::Obj, generator, ..Default::default() },
        objects: parsed.objects.clone(),
        ..Default::default()
    };
    let local = match options.up {
        Up::Y => Local::IDENTITY,
        Up::Z => Local::Matrix(DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y))),
    };
    scene.nodes.push(Node { name: String::new(), local, visible: true, ..Default::default() });
    let materials = std::mem::take(&mut parsed.materials);
    let no_libraries = parsed.libraries.is_empty();
    let (meshes, left_out) = meshes::meshes(parsed, &options.limits)?;
    if left_out > 0 {
        warnings.add("", format!("{left_out} triangles that use a vertex twice left out"));
    }
    // Materials in the order in which faces use them; `None` is the default material.
    let mut material_of: HashMap<Option<u32>, u32> = HashMap::new();
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
        if let (Some(asked), None) = (key.material, mtl)
            && complete
            && !materials[asked as usize].is_empty()
            && !no_libraries
        {
            let name = printable(&materials[asked as usize]);
            warnings.add("", format!("material '{name}' is not in the MTL: shown matte white"));
        }
        if let Some(map) = scene.materials[mesh.material as usize].normal {
            super::tangents::generate(&mut mesh, &map.texture);
        }
        let (mesh_id, object) = (i as u32, key.object + 1);
        scene.instances.push(Instance { node: 0, mesh: mesh_id, object, placement: None, skin: None });
        scene.meshes.push(mesh);
    }
    (scene.images, scene.textures) = (images.images, images.textures);
    Ok((scene, warnings.into_vec()))
}

/// All materials of all MTLs, in order; and whether every MTL was there.
fn read_libraries(
    parsed: &Parsed,
    folder: &Folder,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> (Vec<Mtl>, bool) {
    let mut all = Vec::new();
    let mut read = |name: &str| -> Result<Vec<Mtl>, String> {
        let bytes = textures::find(folder, "", name, options.limits.file_bytes)?;
        let (text, _) = text::decode(&bytes);
        let unified = name.replace('\\', "/");
        let beside = unified.rsplit_once('/').map_or("", |(folder, _)| folder);
        Ok(mtl::parse(&text, &printable(name), beside, warnings))
    };
    let mut missing = Vec::new();
    for line in &parsed.libraries {
        // The whole line as one name, then without quotes, then a name for each word.
        let whole = line.trim_matches('"');
        match read(whole) {
            Ok(materials) => all.extend(materials),
            Err(why) if !line.contains(char::is_whitespace) => missing.push(why),
            Err(why) => {
                let words: Vec<_> = line.split_whitespace().map(&mut read).collect();
                if words.iter().all(Result::is_err) {
                    missing.push(why);
                } else {
                    missing.extend(words.iter().filter_map(|w| w.as_ref().err().cloned()));
                    all.extend(words.into_iter().flatten().flatten());
                }
            }
        }
    }
    let complete = missing.is_empty();
    for why in missing {
        warnings.add("", format!("MTL {why}; its materials are shown matte white"));
    }
    (all, complete)
}

/// The material of that name: exactly, or else as exporters alter names.
fn by_name<'m>(all: &'m [Mtl], name: &str) -> Option<&'m Mtl> {
    let unquoted = name.trim_matches('"');
    all.iter()
        .find(|m| m.name == name)
        .or_else(|| all.iter().find(|m| m.name.trim_matches('"') == unquoted))
        .or_else(|| all.iter().find(|m| m.name.eq_ignore_ascii_case(unquoted)))
}

/// The first comment, where exporters name themselves.
fn generator(text: &str) -> String {
    let first = text.trim_start_matches('\u{feff}').split(['\n', '\r']).next().unwrap_or("");
    first.strip_prefix('#').map(|c| printable(c.trim())).unwrap_or_default()
}

#[cfg(test)]
mod differential;
#[cfg(test)]
mod tests;
