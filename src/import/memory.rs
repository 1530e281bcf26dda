//! What a scene takes in memory while it is read, as far as files say it beforehand.

use std::sync::atomic::{AtomicU64, Ordering};

use super::error::{LoadError, MEMORY};

/// Bytes of a vertex with all that it usually has, as stored and once more as it is read.
const VERTEX: u64 = 120;
/// Bytes of a triangle, as stored and once more as it is read.
const TRIANGLE: u64 = 24;
/// Bytes of an image as it is decoded, for each that it has afterwards.
const DECODING: u64 = 2;
/// Bytes of a JSON document's tree: for each of its text, of which most may be one long word; for each object
/// with its first value, typed once more; and for each further value and each array.
const JSON: u64 = 2;
const JSON_OBJECT: u64 = 768;
const JSON_VALUE: u64 = 128;
/// Bytes of a node as it is placed, once for each path to it.
const NODE: u64 = 320;
/// Bytes of an instance, as stored and as it is read.
const INSTANCE: u64 = 256;
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
    pub fn json(&self, text: &[u8]) -> Result<(), LoadError> {
        let count = |marks: &[u8]| text.iter().filter(|byte| marks.contains(byte)).count() as u64;
        self.charge(JSON * text.len() as u64 + JSON_OBJECT * count(b"{") + JSON_VALUE * count(b"[,"))
    }

    /// What is drawn, and what places it.
    pub fn places(&self, nodes: u64, instances: u64) -> Result<(), LoadError> {
        self.charge(nodes.saturating_mul(NODE).saturating_add(instances.saturating_mul(INSTANCE)))
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
