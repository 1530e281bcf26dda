//! Scenes of .blend files: the user's Blender converts them to GLB with the modules of the Blender extension.

mod blend_file;
mod cache;
mod child;
mod conversion;
mod convert;
mod find;
mod probe;

use std::path::Path;

use blend_file::BlendFile;
use blinn_core::option_words::word_options;
use blinn_import::{LoadError, LoadOptions, SceneChoice, Warning, load, load_bytes};
use blinn_scene::{Scene, SourceFormat};

/// Loads a scene as [`blinn_import::load`] does, and also .blend files, which are recognised by their first bytes and by
/// their name.
///
/// `blender` is a Blender, or a Python with the module `bpy`. Without it, `$BLINN_BLENDER` names it, or else it is the
/// newest on `PATH`. Scripts of the file are not run. Conversions are kept in the cache of the user.
///
/// # Errors
/// As for [`blinn_import::load`]; there is no Blender, or it cannot convert the file.
pub fn load_scene(
    path: &Path,
    options: &LoadOptions,
    blender: Option<&Path>,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let Some(file) = BlendFile::open(path, options)? else { return load(path, options) };
    let conversion = convert::convert(&file, options, blender)?;
    let options =
        LoadOptions { format: Some(SourceFormat::Gltf), scene: SceneChoice::Default, ..options.clone() };
    let (mut scene, import_warnings) = load_bytes(conversion.glb(), path, &options)?;
    scene.source.digest = file.digest;
    scene.source.files = conversion.source_files(&file);
    let lines = conversion.report.warnings.iter();
    let own = lines.map(|text| Warning { location: String::new(), message: word_options(text) });
    Ok((scene, own.chain(import_warnings).collect()))
}
