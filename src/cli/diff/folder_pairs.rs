//! Pairs the scene files of two folders by their names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A scene of one folder or of both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FolderScene {
    /// Paths of the files in the old and in the new folder.
    Pair { old: PathBuf, new: PathBuf },
    /// The path of a file that only the old folder has.
    OnlyOld(PathBuf),
    /// The path of a file that only the new folder has.
    OnlyNew(PathBuf),
}

impl FolderScene {
    /// Path relative to its folder: that of the old file, if there is one.
    pub fn name(&self) -> &Path {
        match self {
            FolderScene::Pair { old, .. } | FolderScene::OnlyOld(old) => old,
            FolderScene::OnlyNew(new) => new,
        }
    }
}

/// Pairs files, whose paths are relative to their folders. Files of the same path are a pair. Of the others, an
/// old and a new file whose paths differ by their extension only are a pair if none of the rest is named like them. The result
/// has the order of the names.
pub fn pair_scenes(old: Vec<PathBuf>, new: Vec<PathBuf>) -> Vec<FolderScene> {
    let mut new: BTreeSet<PathBuf> = new.into_iter().collect();
    let mut scenes = Vec::new();
    // Files without a file of the same path, by their paths without extension.
    let mut others: BTreeMap<PathBuf, [Vec<PathBuf>; 2]> = BTreeMap::new();
    for file in old {
        if new.remove(&file) {
            scenes.push(FolderScene::Pair { old: file.clone(), new: file });
        } else {
            others.entry(file.with_extension("")).or_default()[0].push(file);
        }
    }
    for file in new {
        others.entry(file.with_extension("")).or_default()[1].push(file);
    }
    for [mut old, mut new] in others.into_values() {
        if old.len() == 1 && new.len() == 1 {
            let pairs = old.drain(..).zip(new.drain(..));
            scenes.extend(pairs.map(|(old, new)| FolderScene::Pair { old, new }));
        }
        scenes.extend(old.into_iter().map(FolderScene::OnlyOld));
        scenes.extend(new.into_iter().map(FolderScene::OnlyNew));
    }
    scenes.sort_by(|a, b| a.name().cmp(b.name()));
    scenes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(old: &[&str], new: &[&str]) -> Vec<String> {
        let [old, new] = [old, new].map(|names| names.iter().map(PathBuf::from).collect());
        let text = |scene: FolderScene| match scene {
            FolderScene::Pair { old, new } if old == new => format!("= {}", old.display()),
            FolderScene::Pair { old, new } => format!("{} = {}", old.display(), new.display()),
            FolderScene::OnlyOld(old) => format!("< {}", old.display()),
            FolderScene::OnlyNew(new) => format!("> {}", new.display()),
        };
        pair_scenes(old, new).into_iter().map(text).collect()
    }

    #[test]
    fn files_of_one_path_are_pairs() {
        let found = pairs(&["b.glb", "a/b.glb", "a.glb"], &["a/b.glb", "c.glb", "b.glb"]);
        assert_eq!(found, ["= a/b.glb", "< a.glb", "= b.glb", "> c.glb"]);
    }

    #[test]
    fn another_extension_is_paired_if_there_is_one_file_on_each_side() {
        assert_eq!(pairs(&["a.stl"], &["a.glb"]), ["a.stl = a.glb"]);
        assert_eq!(pairs(&["a.GLB", "b.v1.stl"], &["a.glb", "b.v2.stl"]).len(), 3);
        assert_eq!(pairs(&["a.stl"], &["a.glb", "a.obj"]), ["> a.glb", "> a.obj", "< a.stl"]);
        assert_eq!(pairs(&["a.glb", "a.stl"], &["a.glb", "a.obj"]), ["= a.glb", "a.stl = a.obj"]);
        assert_eq!(pairs(&["x/a.stl"], &["y/a.glb"]), ["< x/a.stl", "> y/a.glb"]);
    }
}
