//! Records the content of every file that a scene was loaded from, so that later runs detect changes.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use blinn_scene::{FileDigest, SourceFile};

/// Contents of the scene's own file and of all files that it refers to, including missing ones.
#[derive(Debug, Default)]
pub(crate) struct SourceTracker {
    scene: Mutex<Option<FileDigest>>,
    references: Mutex<BTreeMap<String, FileDigest>>,
}

impl SourceTracker {
    /// Records the content of the scene's own file.
    pub fn record_scene(&self, content: FileDigest) {
        let mut scene = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        *scene = Some(scene.map_or(content, |before| before.merge(content)));
    }

    /// Records the content of a file that the scene refers to.
    pub fn record_file(&self, name: String, content: FileDigest) {
        let mut references = self.references.lock().unwrap_or_else(PoisonError::into_inner);
        let recorded = references.entry(name).or_insert(content);
        *recorded = recorded.merge(content);
    }

    /// Returns the content of the scene's own file, and the other files ordered by name.
    pub fn into_contents(self) -> (FileDigest, Vec<SourceFile>) {
        let scene = self.scene.into_inner().unwrap_or_else(PoisonError::into_inner);
        let references = self.references.into_inner().unwrap_or_else(PoisonError::into_inner);
        let files = references.into_iter().map(|(name, content)| SourceFile { name, digest: content });
        (scene.unwrap_or_default(), files.collect())
    }
}
