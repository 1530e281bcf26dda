//! The flags that a command line sets explicitly.

use std::ffi::{OsStr, OsString};

use clap::ArgAction;
use clap::parser::ValueSource;

use super::command_tree::{built, find_command, innermost};
use super::help;

/// Flags that place a camera, without those that fit it to the scene. A resolved camera replaces them.
pub const CAMERA_FLAGS: [&str; 22] = [
    "camera",
    "view-point",
    "view-dir",
    "look-at",
    "view-up",
    "proj-distance",
    "view-width",
    "view-height",
    "yfov",
    "view-rect",
    "intrinsics",
    "shift",
    "aperture-radius",
    "focus",
    "aperture-blades",
    "projection",
    "camera-orthographic",
    "orbit",
    "zoom",
    "camera-azimuth-angle",
    "camera-elevation-angle",
    "camera-xml",
];

/// A flag by its own name, also if an alias was used.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Flag {
    /// Without dashes.
    pub name: String,
    pub value: Option<OsString>,
}

impl Flag {
    /// The flag as an argument: `--name=value`.
    pub fn to_arg(&self) -> OsString {
        let mut arg = OsString::from(format!("--{}", self.name));
        if let Some(value) = &self.value {
            arg.push("=");
            arg.push(value);
        }
        arg
    }
}

/// The flags after the innermost command.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct ExplicitFlags(Vec<Flag>);

impl ExplicitFlags {
    /// Reads a valid command line.
    pub fn parse(argv: &[OsString]) -> ExplicitFlags {
        let matches = help::full().try_get_matches_from(argv);
        let Some(command) = matches.as_ref().ok().and_then(innermost) else {
            return ExplicitFlags::default();
        };
        let root = built();
        let arguments = find_command(&root, &command.path).into_iter().flat_map(|c| c.get_arguments());
        let mut flags = Vec::new();
        for arg in arguments {
            let id = arg.get_id().as_str();
            let Some(name) = arg.get_long() else { continue };
            if command.matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let flag =
                |value: Option<&OsStr>| Flag { name: name.into(), value: value.map(OsStr::to_os_string) };
            let values = command.matches.try_get_raw(id).ok().flatten();
            match values.filter(|_| !matches!(arg.get_action(), ArgAction::SetTrue)) {
                None => flags.push(flag(None)),
                Some(values) => flags.extend(values.map(|value| flag(Some(value)))),
            }
        }
        ExplicitFlags(flags)
    }

    /// Adds a flag with a value.
    pub fn push(&mut self, name: &str, value: impl Into<OsString>) {
        self.0.push(Flag { name: name.into(), value: Some(value.into()) });
    }

    pub fn iter(&self) -> impl Iterator<Item = &Flag> {
        self.0.iter()
    }

    pub fn contains(&self, name: &str) -> bool {
        self.0.iter().any(|flag| flag.name == name)
    }

    /// The last value of a flag.
    pub fn value(&self, name: &str) -> Option<&OsStr> {
        self.0.iter().rev().find(|flag| flag.name == name)?.value.as_deref()
    }

    /// Removes flags.
    pub fn without(self, names: &[&str]) -> ExplicitFlags {
        ExplicitFlags(self.0.into_iter().filter(|flag| !names.contains(&flag.name.as_str())).collect())
    }

    /// The flags as arguments: `--name=value`.
    pub fn to_args(&self) -> Vec<OsString> {
        self.0.iter().map(Flag::to_arg).collect()
    }
}
