//! What was in the files that a scene is made of, when they were read.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use crate::scene::{Content, SourceFile};

/// Files that were looked for, there or not.
#[derive(Debug, Default)]
pub(crate) struct Found {
    own: Mutex<Option<Content>>,
    asked: Mutex<BTreeMap<String, Content>>,
}

impl Found {
    /// Notes what was in the scene's own file.
    pub fn scene(&self, content: Content) {
        let mut own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        *own = Some(own.map_or(content, |before| before.again(content)));
    }

    /// Notes what was in a file that the scene refers to.
    pub fn file(&self, name: String, content: Content) {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let known = asked.entry(name).or_insert(content);
        *known = known.again(content);
    }

    /// What was in the scene's own file, and in all others, by their names.
    pub fn all(self) -> (Content, Vec<SourceFile>) {
        let own = self.own.into_inner().unwrap_or_else(PoisonError::into_inner);
        let asked = self.asked.into_inner().unwrap_or_else(PoisonError::into_inner);
        let files = asked.into_iter().map(|(name, content)| SourceFile { name, content });
        (own.unwrap_or_default(), files.collect())
    }
}
