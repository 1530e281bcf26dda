//! The manifest of public scenes: which files they are, where they come from, and their cameras.

mod definition;
mod parse;
mod search;

pub use definition::{Manifest, ManifestScene};
pub use parse::{ManifestError, parse_manifest};
pub use search::{find_scene_file, sha256_of_file};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_manifest_is_complete() {
        let manifest = Manifest::built_in().unwrap();
        assert_eq!(manifest.scenes.len(), 15);
        for scene in &manifest.scenes {
            assert_eq!(scene.cameras.len(), 3, "{}", scene.name);
            let is_online = scene.source.as_ref().is_some_and(|source| source.starts_with("https://"));
            assert!(is_online && scene.licence.is_some(), "{}", scene.name);
            for quirk in &scene.quirks {
                assert!(manifest.quirks.iter().any(|(name, _)| name == quirk), "{}: {quirk}", scene.name);
            }
        }
        for (quirk, _) in &manifest.quirks {
            assert!(manifest.scenes.iter().any(|scene| scene.quirks.contains(quirk)), "{quirk} is unused");
        }
    }

    #[test]
    fn other_manifests_add_and_replace_scenes() {
        let mut manifest = Manifest::built_in().unwrap();
        let other = "[[scene]]\nname = 'Lantern'\nfiles = ['mine.glb']\nlicence = 'mine'\nsource = 'here'\n\
                     [[scene]]\nname = 'Mine'\nfiles = ['a/b.obj']\nlicence = 'mine'\nsource = 'here'\n\
                     camera = [{ name = 'a', orbit = [10, 20] }]\n";
        manifest.extend(parse_manifest(other).unwrap());
        assert_eq!(manifest.scenes.len(), 16);
        let find = |name: &str| manifest.scenes.iter().find(|scene| scene.name == name).unwrap();
        assert_eq!(find("Lantern").files, ["mine.glb"]);
        assert_eq!((find("Mine").cameras.len(), find("Lantern").cameras.len()), (1, 0));
    }
}
