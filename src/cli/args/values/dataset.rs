//! Parsers of formats and categories of datasets.

use blinn_core::closest_name::did_you_mean;
use blinn_scene::Glob;
use blinn_session::values::glob;

/// A format of datasets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub enum DatasetFormat {
    Nerf,
    /// Text files.
    Colmap,
    ColmapBinary,
    Bop,
    /// Masks as run lengths.
    Coco,
    CocoPolygons,
}

const FORMATS: [(&str, DatasetFormat); 6] = [
    ("nerf", DatasetFormat::Nerf),
    ("colmap", DatasetFormat::Colmap),
    ("colmap-bin", DatasetFormat::ColmapBinary),
    ("bop", DatasetFormat::Bop),
    ("coco", DatasetFormat::Coco),
    ("coco-polygons", DatasetFormat::CocoPolygons),
];

/// Formats of which a dataset has one at most.
const ALTERNATIVES: [[DatasetFormat; 2]; 2] = [
    [DatasetFormat::Colmap, DatasetFormat::ColmapBinary],
    [DatasetFormat::Coco, DatasetFormat::CocoPolygons],
];

impl DatasetFormat {
    /// Its name.
    pub fn name(self) -> &'static str {
        FORMATS.into_iter().find(|(_, format)| *format == self).map_or("", |(name, _)| name)
    }
}

/// The formats of a dataset, sorted.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DatasetFormats(pub Vec<DatasetFormat>);

impl Default for DatasetFormats {
    fn default() -> DatasetFormats {
        DatasetFormats(vec![DatasetFormat::Nerf])
    }
}

/// A comma-separated list of formats.
pub fn dataset_formats(text: &str) -> Result<DatasetFormats, String> {
    let mut formats = Vec::new();
    for name in text.split(',').map(str::trim) {
        match FORMATS.into_iter().find(|(known, _)| *known == name) {
            Some((_, format)) => formats.push(format),
            None => {
                let known = FORMATS.map(|(name, _)| name);
                let hint = did_you_mean(name, known);
                return Err(format!("unknown format '{name}'{hint}; expected {}", known.join(", ")));
            }
        }
    }
    formats.sort();
    formats.dedup();
    if let Some([a, b]) = ALTERNATIVES.iter().find(|pair| pair.iter().all(|format| formats.contains(format)))
    {
        let (a, b) = (a.name(), b.name());
        return Err(format!("{a} and {b} are two forms of one format; choose one"));
    }
    Ok(DatasetFormats(formats))
}

/// A rule that gives objects a category.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub enum CategoryRule {
    /// Each object name is a category.
    Object,
    /// The material of an object is its category.
    Material,
    /// The file name of the scene, without extension, is the category of all its objects.
    Scene,
    /// The folder of the scene's file is the category of all its objects.
    Folder,
    /// Objects whose name or path matches.
    Objects { category: String, glob: Glob },
    /// Objects with a material whose name matches.
    Materials { category: String, glob: Glob },
    /// All objects of scenes whose name, without extension, matches, or the path below the folder of all scenes.
    Scenes { category: String, glob: Glob },
}

/// `object`, `material`, `scene`, `folder`, `NAME=GLOB`, `NAME=material:GLOB` or `NAME=scene:GLOB`.
pub fn category_rule(text: &str) -> Result<CategoryRule, String> {
    match (text, text.split_once('=')) {
        ("object", _) => Ok(CategoryRule::Object),
        ("material", _) => Ok(CategoryRule::Material),
        ("scene", _) => Ok(CategoryRule::Scene),
        ("folder", _) => Ok(CategoryRule::Folder),
        (_, Some((category, pattern))) if !category.is_empty() && !pattern.is_empty() => {
            let category = category.to_string();
            Ok(match pattern.split_once(':') {
                Some(("material", pattern)) => CategoryRule::Materials { category, glob: glob(pattern)? },
                Some(("scene", pattern)) => CategoryRule::Scenes { category, glob: glob(pattern)? },
                _ => CategoryRule::Objects { category, glob: glob(pattern)? },
            })
        }
        _ => {
            Err("expected object, material, scene, folder, NAME=GLOB, NAME=material:GLOB or NAME=scene:GLOB"
                .into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_a_list_without_order() {
        let formats = |text: &str| dataset_formats(text).map(|formats| formats.0);
        assert_eq!(formats("coco, nerf,coco"), Ok(vec![DatasetFormat::Nerf, DatasetFormat::Coco]));
        assert!(
            formats("nerf,kitti")
                .unwrap_err()
                .contains("'kitti'; expected nerf, colmap, colmap-bin, bop, coco")
        );
        assert!(formats("coco,coco-polygons").unwrap_err().contains("choose one"));
        assert!(formats("colmap-bin,nerf,colmap").unwrap_err().contains("choose one"));
        assert_eq!(DatasetFormats::default().0, [DatasetFormat::Nerf]);
    }

    #[test]
    fn category_rules_are_words_or_patterns() {
        assert_eq!(category_rule("object"), Ok(CategoryRule::Object));
        assert_eq!(category_rule("material"), Ok(CategoryRule::Material));
        assert_eq!(category_rule("scene"), Ok(CategoryRule::Scene));
        assert_eq!(category_rule("folder"), Ok(CategoryRule::Folder));
        assert!(matches!(category_rule("chair=scene:chairs/*"), Ok(CategoryRule::Scenes { .. })));
        // Names of objects may have colons.
        assert!(matches!(category_rule("bolt=M6:*"), Ok(CategoryRule::Objects { .. })));
        assert!(
            matches!(category_rule("wheel=car/wheel*"), Ok(CategoryRule::Objects { category, .. }) if category == "wheel")
        );
        assert!(matches!(category_rule("glass=material:*glass"), Ok(CategoryRule::Materials { .. })));
        for wrong in ["", "objects", "=x", "x=", "x=[", "x=material:[", "x=scene:["] {
            assert!(category_rule(wrong).is_err(), "{wrong}");
        }
    }
}
