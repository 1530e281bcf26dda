//! A watch on the memory that an import needs.

use std::fmt;
use std::sync::Arc;

/// A function that is told how many bytes an import needs, before it allocates them. Where it returns false, the import
/// is cancelled. The default allows all.
#[derive(Clone, Default)]
pub struct MemoryWatch(Option<Arc<dyn Fn(u64) -> bool + Send + Sync>>);

impl MemoryWatch {
    /// Returns a watch that calls `allows` with the bytes of all charges so far.
    pub fn new(allows: impl Fn(u64) -> bool + Send + Sync + 'static) -> MemoryWatch {
        MemoryWatch(Some(Arc::new(allows)))
    }

    /// Returns false if the import has to end.
    pub(super) fn allows(&self, bytes: u64) -> bool {
        self.0.as_ref().is_none_or(|allows| allows(bytes))
    }
}

impl fmt::Debug for MemoryWatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("MemoryWatch")
    }
}

/// Watches are equal if they are the same.
impl PartialEq for MemoryWatch {
    fn eq(&self, other: &MemoryWatch) -> bool {
        match (&self.0, &other.0) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}
