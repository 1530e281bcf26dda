//! The bytes of a scene: a file, or memory.

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use crate::error::LoadError;
use crate::files::read_file::{FILE_SIZE, open_scene_file, read_scene_file};

/// A scene's own file, or its content.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SceneInput<'a> {
    File(&'a Path),
    Memory(&'a [u8]),
}

impl<'a> SceneInput<'a> {
    /// Opens it for at most `limit` bytes. Returns the number of bytes too.
    pub fn open(&self, limit: u64) -> Result<(Box<dyn Read + Send + 'a>, u64), LoadError> {
        match *self {
            SceneInput::File(path) => {
                let file = open_scene_file(path, limit)?;
                let bytes = file.get_ref().metadata().map_err(|e| LoadError::io(path, e))?.len();
                Ok((Box::new(file), bytes))
            }
            SceneInput::Memory(bytes) => Ok((Box::new(check_size(bytes, limit)?), bytes.len() as u64)),
        }
    }

    /// Returns all bytes if there are at most `limit`.
    pub fn read(&self, limit: u64) -> Result<Cow<'a, [u8]>, LoadError> {
        match *self {
            SceneInput::File(path) => read_scene_file(path, limit).map(Cow::Owned),
            SceneInput::Memory(bytes) => check_size(bytes, limit).map(Cow::Borrowed),
        }
    }
}

fn check_size(bytes: &[u8], limit: u64) -> Result<&[u8], LoadError> {
    LoadError::check_limit(FILE_SIZE, bytes.len() as u64, limit)?;
    Ok(bytes)
}
