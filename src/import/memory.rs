//! Memory budget of an import: estimates from counts and sizes in the file, charged before the memory is
//! allocated.

use std::sync::atomic::{AtomicU64, Ordering};

use super::error::{LoadError, MEMORY};
use super::memory_watch::MemoryWatch;
use super::options::LoadOptions;
use blinn_core::cancellation::Cancelled;

/// Bytes per vertex with its usual attributes, as stored and in the scene.
const VERTEX: u64 = 120;
/// Bytes per triangle, as stored and in the scene.
const TRIANGLE: u64 = 24;
/// Peak bytes while an image is decoded, per byte of the decoded image.
const DECODING: u64 = 2;
/// Bytes of the JSON tree per byte of text, most of which may be one long string.
const JSON: u64 = 2;
/// Bytes of the JSON tree and the typed document per object, including its first member.
const JSON_OBJECT: u64 = 768;
/// Bytes of the JSON tree and the typed document per array and per further value.
const JSON_VALUE: u64 = 128;
/// Bytes per node of the scene.
const NODE: u64 = 320;
/// Bytes per instance, as stored and in the scene.
const INSTANCE: u64 = 256;
/// Peak bytes of the fast OBJ parser per byte of text.
const OBJ: u64 = 5;
/// Additional peak bytes of the lenient OBJ parser per byte of text.
const OBJ_LENIENT: u64 = 12;

/// Memory that an import has charged, and its limit.
#[derive(Debug)]
pub(super) struct MemoryBudget {
    allowed: u64,
    charged: AtomicU64,
    watch: MemoryWatch,
}

impl MemoryBudget {
    /// Returns a budget that nothing but a limit bounds.
    pub fn new(allowed: u64) -> MemoryBudget {
        MemoryBudget { allowed, charged: AtomicU64::new(0), watch: MemoryWatch::default() }
    }

    /// Returns the budget of an import.
    pub fn of_import(options: &LoadOptions) -> MemoryBudget {
        MemoryBudget { watch: options.memory.clone(), ..MemoryBudget::new(options.limits.memory_bytes) }
    }

    /// Charges memory that is about to be allocated. Fails if the limit is exceeded.
    pub fn charge(&self, bytes: u64) -> Result<(), LoadError> {
        // Clamped to 2^60, so that concurrent charges do not wrap around.
        let before = self.charged.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        let all = before.saturating_add(bytes);
        LoadError::check_limit(MEMORY, all, self.allowed)?;
        if self.watch.allows(all) { Ok(()) } else { Err(Cancelled.into()) }
    }

    /// Charges the JSON text of a glTF.
    pub fn charge_json(&self, text: &[u8]) -> Result<(), LoadError> {
        let count = |marks: &[u8]| text.iter().filter(|byte| marks.contains(byte)).count() as u64;
        self.charge(JSON * text.len() as u64 + JSON_OBJECT * count(b"{") + JSON_VALUE * count(b"[,"))
    }

    /// Charges nodes and instances.
    pub fn charge_nodes(&self, nodes: u64, instances: u64) -> Result<(), LoadError> {
        self.charge(nodes.saturating_mul(NODE).saturating_add(instances.saturating_mul(INSTANCE)))
    }

    /// Charges the text of an OBJ.
    pub fn charge_obj(&self, bytes: u64) -> Result<(), LoadError> {
        self.charge(bytes.saturating_mul(OBJ))
    }

    /// Charges the text of an OBJ for the lenient parser.
    pub fn charge_obj_lenient(&self, bytes: u64) -> Result<(), LoadError> {
        self.charge(bytes.saturating_mul(OBJ_LENIENT))
    }

    /// Charges the vertices and triangles of all meshes.
    pub fn charge_meshes(&self, vertices: u64, triangles: u64) -> Result<(), LoadError> {
        self.charge(vertices.saturating_mul(VERTEX).saturating_add(triangles.saturating_mul(TRIANGLE)))
    }

    /// Charges images by their decoded size in bytes.
    pub fn charge_images(&self, decoded: u64) -> Result<(), LoadError> {
        self.charge(decoded.saturating_mul(DECODING))
    }
}
