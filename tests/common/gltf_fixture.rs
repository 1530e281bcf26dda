//! The builder of glTF files, with ways to save and load them as a user's program would.

#[path = "../../src/import/gltf/fixture.rs"]
mod builder;

use std::path::PathBuf;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use blinn::import::{LoadOptions, Warning, load};
use blinn::scene::Scene;
pub use builder::{Fixture, bytes_of};
use serde_json::{Value, json};

pub fn data_uri(bytes: &[u8]) -> String {
    format!("data:;base64,{}", BASE64_STANDARD.encode(bytes))
}

impl Fixture {
    /// Replaces top-level members of the JSON.
    pub fn with(mut self, members: Value) -> Fixture {
        for (key, value) in members.as_object().unwrap() {
            self.json[key] = value.clone();
        }
        self
    }

    /// Sets an attribute of the first primitive.
    pub fn attribute(&mut self, name: &str, accessor: usize) {
        self.primitive()["attributes"][name] = json!(accessor);
    }

    /// Adds a material for the first primitive.
    pub fn material(&mut self, material: Value) {
        let index = self.push("materials", material);
        self.primitive()["material"] = json!(index);
    }

    /// The file as glTF, its buffer in a data URI.
    pub fn gltf(&self) -> Vec<u8> {
        self.json_with_buffer(&data_uri(&self.bin))
    }

    fn json_with_buffer(&self, uri: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bin.len(), "uri": uri}]);
        serde_json::to_vec(&json).unwrap()
    }

    /// Writes `scene.gltf` and its buffer to a folder of their own.
    pub fn save(&self) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.gltf");
        std::fs::write(folder.path().join("scene.bin"), &self.bin).unwrap();
        std::fs::write(&path, self.json_with_buffer("scene.bin")).unwrap();
        (folder, path)
    }

    pub fn try_load(&self) -> Result<(Scene, Vec<Warning>), String> {
        let (_folder, path) = self.save();
        load(&path, &LoadOptions::default()).map_err(|e| e.to_string())
    }

    pub fn load(&self) -> (Scene, Vec<String>) {
        let (scene, warnings) = self.try_load().unwrap();
        (scene, warnings.iter().map(ToString::to_string).collect())
    }
}
