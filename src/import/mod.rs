//! Files to [`Scene`]: untrusted from the first byte.
//!
//! Every size is checked before memory is taken for it, every index before it is used, and no
//! reference leads out of the scene's folder unless that was allowed. What a file lacks or has
//! wrong without harm becomes a [`Warning`], never silence.

mod camera_xml;
mod error;
mod files;
mod flat;
mod gltf;
pub(crate) mod image;
mod memory;
mod missing_uvs;
mod obj;
mod smooth;
mod tangents;

use std::io::{self, Read};
use std::path::Path;

use crate::scene::{Content, Scene};

pub use camera_xml::load_camera_xml;
pub use error::{LoadError, Warning};
pub use files::limits::Limits;
pub(crate) use files::read_file::{open_regular, open_scene_file};
pub use image::environment::load_sky;
pub use smooth::Smooth;

/// Which of a file's scenes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum SceneChoice {
    /// The file's default scene, or its first.
    #[default]
    Default,
    /// By name, or else by index.
    Named(String),
}

/// Which way is up in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +Y, as it is written.
    #[default]
    Y,
    /// +Z: (x, y, z) becomes (x, z, −y) for everything in the file.
    Z,
}

/// How to read a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// What is refused.
    pub limits: Limits,
    /// Which scene.
    pub scene: SceneChoice,
    /// Which way is up.
    pub up: Up,
    /// Which of the file's material variants, by name; `none` or `None` for its default materials.
    pub variant: Option<String>,
    /// Which normals.
    pub smooth: Smooth,
    /// Lets references lead out of the scene's folder.
    pub allow_outside: bool,
}

/// Reads a scene: glTF, GLB or OBJ, judged by its content, then by its name.
///
/// # Errors
/// What cannot be read, with the place in the file and what to do about it.
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, Vec<Warning>), LoadError> {
    let limit = options.limits.file_bytes;
    let mut head = Vec::new();
    let file = files::read_file::open_scene_file(path, limit)?;
    file.take(4096).read_to_end(&mut head).map_err(|e| LoadError::io(path, e))?;
    if let Some(what) = files::git_lfs::advice(&head) {
        return Err(LoadError::io(path, io::Error::new(io::ErrorKind::InvalidData, what)));
    }
    if let Some(what) = files::archive_hint::advice(&head) {
        return Err(LoadError::Unsupported(what.into()));
    }
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = files::uri::Folder::of(path, options.allow_outside);
    let (mut scene, mut warnings) = if looks_like_gltf(path, &head) {
        let bytes = files::read_file::read_scene_file(path, limit)?;
        folder.found.scene(Content::of(&bytes));
        gltf::load(&bytes, &folder, options)?
    } else {
        if let Some(wanted) = options.variant.as_deref().filter(|v| *v != "none") {
            return Err(gltf::missing_variant(wanted, &[]));
        }
        obj::load(path, &folder, options)?
    };
    warnings.extend(missing_uvs::warnings(&scene));
    scene.name = name;
    (scene.source.content, scene.source.files) = folder.found.all();
    // What a Blender user has seen of these files, Blender filtered.
    let by_blender = scene.source.is_blender();
    scene.textures.iter_mut().for_each(|t| t.decode_last = by_blender);
    smooth::apply(&mut scene, options.smooth);
    Ok((scene, warnings))
}

/// GLB's magic number, or JSON's first brace; an extension decides only where the text does not.
fn looks_like_gltf(path: &Path, head: &[u8]) -> bool {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let first = text.iter().copied().find(|b| !b.is_ascii_whitespace());
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    head.starts_with(b"glTF") || first == Some(b'{') || extension.is_some_and(|e| e == "gltf" || e == "glb")
}
