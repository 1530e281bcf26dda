//! Ids of COCO's categories that all scenes in archives share.
//!
//! A sample of an archive has the annotations of one image. Readers put samples of all archives together, so a category must
//! have one id in all of them, whichever share renders it, and before any scene is read.

use std::collections::HashMap;
use std::path::Path;

use super::scene_list::SceneList;
use crate::args::values::CategoryRule;
use crate::usage::UsageError;
use blinn_session::folder_name;

/// The categories that follow from rules and from the names of scenes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SharedCategories {
    ids: HashMap<String, usize>,
}

/// The names that a scene has in rules for categories.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneNames {
    /// The name of its file, without extension.
    pub stem: String,
    /// The name of the folder of its file.
    pub folder: String,
    /// Its path below the folder of all scenes.
    pub path: String,
}

impl SceneNames {
    /// The names of a scene of a list.
    pub fn new(scenes: &SceneList, scene: &Path) -> SceneNames {
        SceneNames {
            stem: scene.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            folder: folder_name(scene).to_string_lossy().into_owned(),
            path: scenes.name(scene),
        }
    }
}

impl SharedCategories {
    /// Numbers the categories in the order of rules, then of scenes.
    ///
    /// # Errors
    /// The list of scenes cannot be read.
    pub fn new(rules: &[CategoryRule], scenes: &SceneList) -> Result<SharedCategories, UsageError> {
        let mut shared = SharedCategories::default();
        for rule in rules {
            match rule {
                CategoryRule::Object | CategoryRule::Material => {}
                CategoryRule::Scene | CategoryRule::Folder => {
                    for scene in scenes.iter() {
                        let SceneNames { stem, folder, .. } = SceneNames::new(scenes, &scene?);
                        shared.add(if *rule == CategoryRule::Scene { &stem } else { &folder });
                    }
                }
                CategoryRule::Objects { category, .. }
                | CategoryRule::Materials { category, .. }
                | CategoryRule::Scenes { category, .. } => shared.add(category),
            }
        }
        Ok(shared)
    }

    /// The id of a category, from 1; `None` for those that follow from the content of scenes.
    pub fn id(&self, name: &str) -> Option<usize> {
        self.ids.get(name).copied()
    }

    /// Number of categories.
    pub fn count(&self) -> usize {
        self.ids.len()
    }

    /// The ids of the categories that a scene may have.
    pub fn of_scene(&self, rules: &[CategoryRule], names: &SceneNames) -> Vec<usize> {
        let known = rules.iter().filter_map(|rule| match rule {
            CategoryRule::Object | CategoryRule::Material => None,
            CategoryRule::Scene => Some(&names.stem),
            CategoryRule::Folder => Some(&names.folder),
            CategoryRule::Objects { category, .. }
            | CategoryRule::Materials { category, .. }
            | CategoryRule::Scenes { category, .. } => Some(category),
        });
        known.filter_map(|name| self.id(name)).collect()
    }

    fn add(&mut self, name: &str) {
        if !self.ids.contains_key(name) {
            let id = self.ids.len() + 1;
            self.ids.insert(name.to_string(), id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::values::category_rule;
    use crate::plan::scene_list;

    #[test]
    fn ids_follow_from_rules_and_names() {
        let paths = ["in/b/1.glb", "in/a/2.glb", "in/b/2.glb"].map(std::path::PathBuf::from);
        let scenes = scene_list(&paths).unwrap();
        let rules = ["lamp=scene:l*", "folder", "object", "scene"].map(|rule| category_rule(rule).unwrap());
        let shared = SharedCategories::new(&rules, &scenes).unwrap();
        let ids = ["lamp", "b", "a", "1", "2", "object 1"].map(|name| shared.id(name));
        assert_eq!(ids, [Some(1), Some(2), Some(3), Some(4), Some(5), None]);
        let names = SceneNames::new(&scenes, &paths[1]);
        assert_eq!((names.path.as_str(), shared.count()), ("a/2.glb", 5));
        assert_eq!(shared.of_scene(&rules, &names), [1, 3, 5]);
    }
}
