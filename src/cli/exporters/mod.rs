//! Known facts about the files of other programs, found by the generator that they name.

mod version;

use std::sync::LazyLock;

use serde::Deserialize;

use blinn_scene::{Node, PosedScene, Source, SourceFormat};
pub use version::version_of;

const TABLE: &str = include_str!("exporters.toml");

/// The page that has a section for each exporter.
const PAGE: &str = "docs/reference/exporters.md";

/// A program and one format that it writes: an entry of `exporters.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(not(test), expect(dead_code, reason = "the page shows the other columns"))]
pub struct Exporter {
    pub name: String,
    version: String,
    format: Format,
    files: Option<String>,
    generator: Vec<String>,
    unit: Option<String>,
    up: Option<String>,
    colors: Option<String>,
    material: Option<String>,
    normals: Option<String>,
    alpha: Option<String>,
    lights: Option<String>,
    cameras: Option<String>,
    #[serde(default)]
    pub quirks: Vec<Quirk>,
    check: Option<String>,
    unrepeated: Option<String>,
}

/// A surprise in the files of an exporter.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(not(test), expect(dead_code, reason = "the page shows the other columns"))]
pub struct Quirk {
    fact: String,
    shown: String,
    help: Option<String>,
    /// Text of the warning that the quirk causes.
    warning: Option<String>,
    /// A property of files with the quirk; `None` if all may have it.
    when: Option<Sign>,
}

/// A property of the files that a quirk occurs in.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Sign {
    /// No root node turns Z up, to Y.
    Unturned,
    /// The scene is a metre long or longer: lengths in millimetres may be written as metres.
    Large,
    /// Lights or cameras are missing. Files that name the unit of lights, as conversions of .blend files do, have those that
    /// there are.
    Unlit,
    /// There are lights, and the file does not name their unit.
    LightsWithoutUnit,
}

impl Sign {
    fn is_in(self, posed: &PosedScene) -> bool {
        match self {
            Sign::Unturned => {
                let roots = posed.scene.nodes.iter().filter(|node| node.parent.is_none());
                let up = |node: &Node| node.local.affine().matrix3.z_axis;
                !roots.map(up).any(|up| up.y > 0.9 * up.length())
            }
            Sign::Large => posed.bounds().extent().max_element() >= 1.0,
            Sign::Unlit => {
                let is_missing = posed.scene.lights.is_empty() || posed.scene.cameras.is_empty();
                is_missing && posed.scene.source.light_units.is_none()
            }
            Sign::LightsWithoutUnit => {
                !posed.scene.lights.is_empty() && posed.scene.source.light_units.is_none()
            }
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
enum Format {
    #[serde(rename = "glTF")]
    Gltf,
    #[serde(rename = "OBJ")]
    Obj,
}

impl Format {
    /// Returns the format of a scene. The page has no exporters of STL and PLY.
    fn of(format: SourceFormat) -> Option<Format> {
        match format {
            SourceFormat::Gltf => Some(Format::Gltf),
            SourceFormat::Obj => Some(Format::Obj),
            SourceFormat::Stl | SourceFormat::Ply => None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    exporter: Vec<Exporter>,
}

/// All exporters, in the order of the page. A test checks that the table parses.
static EXPORTERS: LazyLock<Vec<Exporter>> =
    LazyLock::new(|| toml::from_str::<Table>(TABLE).unwrap_or_default().exporter);

/// Returns the exporters that may have written a scene: those with the longest text that its generator contains.
/// Programs that share a library share its generator.
pub fn candidates(source: &Source) -> Vec<&'static Exporter> {
    let length = |exporter: &Exporter| {
        let marks = exporter.generator.iter().filter(|mark| source.generator.contains(mark.as_str()));
        marks.map(String::len).max().filter(|_| Some(exporter.format) == Format::of(source.format))
    };
    let longest = EXPORTERS.iter().filter_map(length).max();
    EXPORTERS.iter().filter(|exporter| longest.is_some() && length(exporter) == longest).collect()
}

impl Exporter {
    /// Returns the place of the exporter's section: a page and an anchor.
    pub fn section(&self) -> String {
        format!("{PAGE}#{}", self.anchor())
    }

    /// Returns the anchor of the exporter's section: letters and digits joined by hyphens.
    fn anchor(&self) -> String {
        let format = match self.format {
            Format::Gltf => "gltf",
            Format::Obj => "obj",
        };
        let name = self.name.to_lowercase();
        let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        words.chain([format]).take(5).collect::<Vec<_>>().join("-")
    }
}

impl Quirk {
    /// Returns false if a scene has what files with the quirk do not have.
    pub fn may_apply(&self, posed: &PosedScene) -> bool {
        self.when.is_none_or(|sign| sign.is_in(posed))
    }

    /// Returns the fact and what helps, on one line.
    pub fn line(&self) -> String {
        match &self.help {
            Some(help) => format!("{}: {help}", self.fact),
            None => self.fact.clone(),
        }
    }
}

/// Returns the section about a warning of a scene, if one of its exporters is known to cause it.
pub fn section_about(source: &Source, warning: &str) -> Option<String> {
    let causes = |exporter: &&Exporter| {
        exporter.quirks.iter().filter_map(|quirk| quirk.warning.as_deref()).any(|text| warning.contains(text))
    };
    candidates(source).into_iter().find(causes).map(Exporter::section)
}

#[cfg(test)]
mod page;
#[cfg(test)]
mod tests;
