//! Flags of the command line of `blinn view`: those that every picture has, and those that only start the state.

use std::ffi::OsString;

use crate::args::{CAMERA_FLAGS, ExplicitFlags};

/// Flags of the page and of the process, which no picture has.
const OWN: [&str; 11] = [
    "port",
    "base-url",
    "allow-host",
    "open",
    "json",
    "threads",
    "max-memory",
    "progress",
    "perf",
    "verbose",
    "quiet",
];
/// Flags that the state of the view replaces, besides those of the camera.
const REPLACED: [&str; 15] = [
    "size",
    "max-size",
    "samples",
    "adaptive",
    "background",
    "no-background",
    "exposure",
    "view",
    "lights",
    "ao",
    "hdri",
    "hdri-rotate",
    "variant",
    "animation",
    "time",
];

/// The flags of the command line.
#[derive(Clone, Debug)]
pub struct StartFlags {
    /// All that a render has.
    pub all: ExplicitFlags,
    /// Those that the state does not replace.
    pub kept: ExplicitFlags,
}

impl StartFlags {
    /// Reads a valid command line.
    pub fn parse(argv: &[OsString]) -> StartFlags {
        let all = ExplicitFlags::parse(argv).without(&OWN);
        let kept = all.clone().without(&CAMERA_FLAGS).without(&REPLACED);
        StartFlags { all, kept }
    }

    /// The value of --hdri.
    pub fn hdri(&self) -> Option<&str> {
        self.all.value("hdri")?.to_str()
    }
}
