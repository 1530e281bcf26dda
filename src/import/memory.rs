//! What a scene takes in memory while it is read, as far as files say it beforehand.

use std::sync::atomic::{AtomicU64, Ordering};

use super::error::{LoadError, MEMORY};

/// Bytes of a vertex with all that it usually has, as stored and once more as it is read.
const VERTEX: u64 = 120;
/// Bytes of a triangle, as stored and once more as it is read.
const TRIANGLE: u64 = 24;
/// Bytes of an image as it is decoded, for each that it has afterwards.
const DECODING: u64 = 2;
/// Bytes of a JSON document's tree, for each of its text.
const JSON: u64 = 16;
/// Bytes that an OBJ takes while it is read, for each of its text.
const OBJ: u64 = 5;
/// The same where it is repaired.
const OBJ_WITH_CARE: u64 = 12;

/// Memory that is spoken for, and how much that may be.
#[derive(Debug)]
pub(super) struct Budget {
    allowed: u64,
    taken: AtomicU64,
}

impl Budget {
    pub fn of(allowed: u64) -> Budget {
        Budget { allowed, taken: AtomicU64::new(0) }
    }

    /// Speaks for memory before it is taken.
    pub fn charge(&self, bytes: u64) -> Result<(), LoadError> {
        // Half of what u64 counts is more than there is, and two halves do not wrap around.
        let before = self.taken.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        LoadError::check(MEMORY, before.saturating_add(bytes), self.allowed)
    }

    /// The text of a glTF.
    pub fn json(&self, bytes: usize) -> Result<(), LoadError> {
        self.charge((bytes as u64).saturating_mul(JSON))
    }

    /// The text of an OBJ.
    pub fn obj(&self, bytes: u64) -> Result<(), LoadError> {
        self.charge(bytes.saturating_mul(OBJ))
    }

    /// The text of an OBJ that is not well-formed: what is read of it is written out again and read once more.
    pub fn obj_with_care(&self, bytes: u64) -> Result<(), LoadError> {
        self.charge(bytes.saturating_mul(OBJ_WITH_CARE))
    }

    /// Meshes.
    pub fn meshes(&self, vertices: u64, triangles: u64) -> Result<(), LoadError> {
        self.charge(vertices.saturating_mul(VERTEX).saturating_add(triangles.saturating_mul(TRIANGLE)))
    }

    /// Images that will have so many bytes.
    pub fn images(&self, decoded: u64) -> Result<(), LoadError> {
        self.charge(decoded.saturating_mul(DECODING))
    }
}
