//! Wavefront OBJ and MTL.

use super::error::{LoadError, Warning};
use super::{LoadOptions, uri::Folder};
use crate::scene::Scene;

/// Reads an .obj.
pub(super) fn load(
    bytes: &[u8],
    folder: &Folder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let _ = (bytes, folder, options);
    Err(LoadError::Unsupported("OBJ is not read yet".into()))
}
