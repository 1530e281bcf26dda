//! The contents of a manifest.

use crate::camera::BenchCamera;

/// Public scenes that a benchmark measures where their files exist.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifest {
    /// Peculiarities of files that loaders have to handle: names and descriptions.
    pub quirks: Vec<(String, String)>,
    /// The scenes.
    pub scenes: Vec<ManifestScene>,
}

/// A scene of the manifest.
#[derive(Clone, Debug, PartialEq)]
pub struct ManifestScene {
    /// Its name in the results.
    pub name: String,
    /// Patterns of its file's path below the folder of scenes, in order of preference.
    pub files: Vec<String>,
    /// The licence, as its source names it. Manifests of users need not name it.
    pub licence: Option<String>,
    /// The page or repository that offers it. Manifests of users need not name it.
    pub source: Option<String>,
    /// SHA-256 of the file in hexadecimal digits, where it is known.
    pub sha256: Option<String>,
    /// Names of the peculiarities of its file.
    pub quirks: Vec<String>,
    /// The cameras.
    pub cameras: Vec<BenchCamera>,
}

impl Manifest {
    /// Adds the scenes and quirks of another manifest. Those of the same names replace earlier ones.
    pub fn extend(&mut self, other: Manifest) {
        for scene in other.scenes {
            match self.scenes.iter_mut().find(|own| own.name == scene.name) {
                Some(own) => *own = scene,
                None => self.scenes.push(scene),
            }
        }
        for quirk in other.quirks {
            match self.quirks.iter_mut().find(|own| own.0 == quirk.0) {
                Some(own) => *own = quirk,
                None => self.quirks.push(quirk),
            }
        }
    }
}
