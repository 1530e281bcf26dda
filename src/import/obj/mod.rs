//! Wavefront OBJ and MTL: forty years of exporters.
//!
//! A pass in front understands the text and resolves every index ([`normalise`]); tobj reads what
//! that pass writes; polygons, smoothing groups, MTLs and textures are our own.

mod assemble;
mod material;
mod mtl;
mod normalise;
mod polygon;
mod text;
mod textures;

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};

use super::error::{LoadError, Warning, Warnings};
use super::uri::{Folder, printable};
use super::{LoadOptions, Up};
use crate::scene::{Format, Instance, Local, Node, Scene, Source};
use assemble::Model;
use mtl::Mtl;
use normalise::Parsed;
use textures::Library;

/// Reads an .obj with the MTLs and textures that it names.
pub(super) fn load(
    bytes: &[u8],
    folder: &Folder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let mut warnings = Warnings::default();
    let (text, guessed) = text::decode(bytes);
    if guessed {
        warnings.add("", "the text is not UTF-8: read as Windows-1252");
    }
    let parsed = normalise::parse(&text, &options.limits, &mut warnings)?;
    let models = read_by_tobj(&parsed)?;
    let (mut meshes, left_out) = assemble::meshes(&parsed, &models);
    if left_out > 0 {
        warnings.add("", format!("{left_out} triangles that use a vertex twice left out"));
    }

    let (library, complete) = read_libraries(&parsed, folder, options, &mut warnings);
    let used: Vec<Option<&Mtl>> = parsed.materials.iter().map(|name| by_name(&library, name)).collect();
    let mtls: Vec<&Mtl> = used.iter().flatten().copied().collect();
    let mut images = Library::load(&mtls, folder, &options.limits, &mut warnings)?;

    let mut scene = Scene {
        source: Source { format: Format::Obj, generator: generator(&text), ..Default::default() },
        objects: parsed.objects.clone(),
        ..Default::default()
    };
    let local = match options.up {
        Up::Y => Local::IDENTITY,
        Up::Z => Local::Matrix(DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y))),
    };
    scene.nodes.push(Node { name: String::new(), local, visible: true, ..Default::default() });
    // Materials in the order in which faces use them; `None` is the default material.
    let mut material_of: HashMap<Option<u32>, u32> = HashMap::new();
    for (mesh, model) in meshes.iter_mut().zip(&models) {
        let key = parsed.runs[model.run].key;
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
            && !parsed.materials[asked as usize].is_empty()
            && !parsed.libraries.is_empty()
        {
            let name = printable(&parsed.materials[asked as usize]);
            warnings.add("", format!("material '{name}' is not in the MTL: shown matte white"));
        }
    }
    for (i, model) in models.iter().enumerate() {
        let object = parsed.runs[model.run].key.object + 1;
        scene.instances.push(Instance { node: 0, mesh: i as u32, object, placement: None, skin: None });
    }
    (scene.meshes, scene.images, scene.textures) = (meshes, images.images, images.textures);
    for mesh in &mut scene.meshes {
        if let Some(map) = scene.materials[mesh.material as usize].normal {
            super::tangents::generate(mesh, &map.texture);
        }
    }
    Ok((scene, warnings.into_vec()))
}

/// Hands the normalised text to tobj. Its models carry the numbers of their runs as names.
fn read_by_tobj(parsed: &Parsed) -> Result<Vec<Model>, LoadError> {
    let text = parsed.to_text();
    let options = tobj::LoadOptions { single_index: false, triangulate: false, ..Default::default() };
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let wrong =
        |e: &dyn std::fmt::Display| LoadError::parse("the file", format!("cannot be read as OBJ: {e}"));
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials).map_err(|e| wrong(&e))?;
    models
        .into_iter()
        .map(|model| {
            let run = model.name.parse().ok().filter(|&i: &usize| i < parsed.runs.len());
            let run = run.ok_or_else(|| wrong(&"a group was lost"))?;
            if model.mesh.indices.len() != parsed.runs[run].corners.len() {
                return Err(wrong(&"faces were lost"));
            }
            Ok(Model { mesh: model.mesh, run })
        })
        .collect()
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
    let first = text.trim_start_matches('\u{feff}').lines().next().unwrap_or("");
    first.strip_prefix('#').map(|c| printable(c.trim())).unwrap_or_default()
}

#[cfg(test)]
mod tests;
