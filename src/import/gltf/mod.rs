//! glTF 2.0.

use super::error::{LoadError, Warning};
use super::{LoadOptions, uri::Folder};
use crate::scene::Scene;

/// Reads a .gltf or .glb.
pub(super) fn load(
    bytes: &[u8],
    folder: &Folder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let _ = (bytes, folder, options);
    Err(LoadError::Unsupported("glTF is not read yet".into()))
}
