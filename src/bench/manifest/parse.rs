//! Reads manifests in TOML.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::definition::{Manifest, ManifestScene};
use crate::camera::{BenchCamera, CameraPlacement};

/// The manifest that is built in.
const BUILT_IN: &str = include_str!("scenes.toml");

/// A manifest that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ManifestError(String);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    quirks: BTreeMap<String, String>,
    #[serde(default)]
    scene: Vec<Scene>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    name: String,
    files: Vec<String>,
    licence: Option<String>,
    source: Option<String>,
    sha256: Option<String>,
    #[serde(default)]
    quirks: Vec<String>,
    #[serde(default)]
    camera: Vec<CameraEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraEntry {
    name: String,
    eye: Option<[f64; 3]>,
    look_at: Option<[f64; 3]>,
    /// Degrees.
    yfov: Option<f64>,
    /// Azimuth and elevation in degrees.
    orbit: Option<[f64; 2]>,
}

impl Manifest {
    /// The manifest that is built in.
    ///
    /// # Errors
    /// None: a test reads it.
    pub fn built_in() -> Result<Manifest, ManifestError> {
        parse_manifest(BUILT_IN)
    }
}

/// Parses a manifest.
///
/// # Errors
/// The text is not TOML of the manifest's form, a pattern leaves the folder, or a camera is not valid.
pub fn parse_manifest(text: &str) -> Result<Manifest, ManifestError> {
    let file: File = toml::from_str(text).map_err(|e| toml_error(text, &e))?;
    let scenes = file.scene.into_iter().map(scene).collect::<Result<_, _>>()?;
    Ok(Manifest { quirks: file.quirks.into_iter().collect(), scenes })
}

/// The error on one line, with the line of the text where it is. Quotes, since messages show words in backticks as options.
fn toml_error(text: &str, error: &toml::de::Error) -> ManifestError {
    let message = error.message().replace('`', "'").replace('\n', "; ");
    let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
    ManifestError(line.map_or_else(|| message.clone(), |line| format!("line {line}: {message}")))
}

fn scene(scene: Scene) -> Result<ManifestScene, ManifestError> {
    let Scene { name, files, licence, source, sha256, quirks, camera } = scene;
    let error = |message: &str| ManifestError(format!("scene '{name}': {message}"));
    if files.is_empty() {
        return Err(error("it needs a pattern in files"));
    }
    let leaves_folder = |pattern: &String| {
        let parts = pattern.split(['/', '\\']);
        pattern.is_empty() || pattern.starts_with(['/', '\\']) || parts.into_iter().any(|part| part == "..")
    };
    if let Some(pattern) = files.iter().find(|pattern| leaves_folder(pattern)) {
        return Err(error(&format!("the pattern '{pattern}' must stay below the folder of scenes")));
    }
    let is_hash = |hash: &String| hash.len() == 64 && hash.bytes().all(|b| b.is_ascii_hexdigit());
    if sha256.as_ref().is_some_and(|hash| !is_hash(hash)) {
        return Err(error("sha256 needs 64 hexadecimal digits"));
    }
    let mut cameras: Vec<BenchCamera> = Vec::new();
    for entry in camera {
        let camera = placement(&entry).ok_or_else(|| {
            error(&format!(
                "the camera '{}' needs either eye, look_at and yfov (1 to 170 degrees) or orbit (elevation within \
                 ±90 degrees), in finite numbers",
                entry.name
            ))
        })?;
        if cameras.iter().any(|other| other.name == entry.name) {
            return Err(error(&format!("it has two cameras '{}'", entry.name)));
        }
        cameras.push(BenchCamera { name: entry.name, placement: camera });
    }
    let sha256 = sha256.map(|hash| hash.to_ascii_lowercase());
    Ok(ManifestScene { name, files, licence, source, sha256, quirks, cameras })
}

fn placement(entry: &CameraEntry) -> Option<CameraPlacement> {
    match (entry.eye, entry.look_at, entry.yfov, entry.orbit) {
        (Some(eye), Some(look_at), Some(yfov), None) => {
            let is_finite = eye.iter().chain(&look_at).all(|v| v.is_finite() && v.abs() <= 1e6);
            let is_valid = is_finite && eye != look_at && (1.0..=170.0).contains(&yfov);
            is_valid.then(|| CameraPlacement::InBounds { eye, look_at, yfov: yfov.to_radians() })
        }
        (None, None, None, Some([azimuth, elevation])) => {
            let is_valid = azimuth.abs() <= 360.0 && elevation.abs() <= 90.0;
            is_valid.then(|| CameraPlacement::Orbit {
                azimuth: azimuth.to_radians(),
                elevation: elevation.to_radians(),
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_manifests_are_errors() {
        let scene = |more: &str| {
            let files = if more.contains("files") { "" } else { "files = ['a.obj']\n" };
            format!("[[scene]]\nname = 'a'\nlicence = 'b'\nsource = 'c'\n{files}{more}\n")
        };
        assert!(parse_manifest(&scene("")).is_ok());
        for (more, message) in [
            ("files = []", "needs a pattern"),
            ("files = ['../a.obj']", "must stay below"),
            ("files = ['/a.obj']", "must stay below"),
            ("files = ['a\\..\\b.obj']", "must stay below"),
            ("sha256 = 'ff'", "64 hexadecimal"),
            ("colour = 1", "colour"),
            ("camera = [{ name = 'x' }]", "camera 'x' needs"),
            ("camera = [{ name = 'x', orbit = [0, 91] }]", "camera 'x' needs"),
            ("camera = [{ name = 'x', orbit = [nan, 0] }]", "camera 'x' needs"),
            (
                "camera = [{ name = 'x', eye = [0, 0, 0], look_at = [0, 0, 0], yfov = 50 }]",
                "camera 'x' needs",
            ),
            ("camera = [{ name = 'x', orbit = [0, 1] }, { name = 'x', orbit = [0, 2] }]", "two cameras 'x'"),
        ] {
            let error = parse_manifest(&scene(more)).unwrap_err().to_string();
            assert!(error.contains(message), "{more}: {error}");
        }
        assert!(parse_manifest("scene = 1").is_err());
        // Licence and source are for readers.
        let shortest = parse_manifest("[[scene]]\nname = 'a'\nfiles = ['a.obj']\n").unwrap();
        assert_eq!((&shortest.scenes[0].licence, &shortest.scenes[0].source), (&None, &None));
    }
}
