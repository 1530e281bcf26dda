//! The files that a command line names.

use std::path::{Path, PathBuf};

/// Files of a command line that are not scenes.
pub struct OptionFiles<'a> {
    /// Files that options read.
    pub inputs: Vec<&'a Path>,
    /// Files that options write, with the name of each option.
    pub outputs: Vec<(&'static str, &'a Path)>,
}

/// A scene and its number, from 1.
#[derive(Clone, Debug)]
pub struct NumberedScene {
    pub number: usize,
    pub path: PathBuf,
}
