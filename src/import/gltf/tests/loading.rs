//! Loads files of the builder through the private parts of the importer.

use super::super::document::Document;
use super::super::fixture::Fixture;
use super::super::{container, load};
use crate::error::{LoadError, Warnings};
use crate::files::scene_folder::SceneFolder;
use crate::{LoadOptions, Warning};
use blinn_scene::Scene;

impl Fixture {
    pub fn try_load_with(&self, options: &LoadOptions) -> Result<(Scene, Vec<Warning>), LoadError> {
        load(&self.glb(), &folder(), options)
    }

    pub fn load_with(&self, options: &LoadOptions) -> (Scene, Vec<String>) {
        let (scene, warnings) = self.try_load_with(options).unwrap();
        (scene, warnings.iter().map(ToString::to_string).collect())
    }

    pub fn load(&self) -> (Scene, Vec<String>) {
        self.load_with(&LoadOptions::default())
    }

    /// Loads the file with a part of its JSON text replaced, which must exist.
    pub fn load_replaced(&self, from: &str, to: &str) -> Result<(Scene, Vec<String>), String> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = self.bin.len().into();
        let text = json.to_string();
        assert!(text.contains(from), "{from} is not in {text}");
        let glb = self.glb_of(&text.replacen(from, to, 1));
        let (scene, warnings) = load(&glb, &folder(), &LoadOptions::default()).map_err(|e| e.to_string())?;
        Ok((scene, warnings.iter().map(ToString::to_string).collect()))
    }

    pub fn error(&self) -> String {
        self.try_load_with(&LoadOptions::default()).map(|_| ()).unwrap_err().to_string()
    }

    pub fn with_document<T>(&self, read: impl FnOnce(&Document<'_>) -> T) -> T {
        let glb = self.glb();
        let folder = folder();
        let options = LoadOptions::default();
        let mut warnings = Warnings::default();
        let container = container::split(&glb, &mut warnings).unwrap();
        let document = Document::open(&container, &folder, &options, &mut warnings).unwrap();
        read(&document)
    }
}

/// A folder without the files that tests refer to.
pub fn folder() -> SceneFolder {
    SceneFolder::of(std::path::Path::new("src/scene.gltf"), false)
}
