//! Limits of an import, checked before memory is allocated.

/// Upper limits of one import. The defaults are far above real scenes and below what exhausts a machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of any one file.
    pub file_bytes: u64,
    /// Vertices of all meshes, as stored.
    pub vertices: u64,
    /// Triangles of all meshes, as stored.
    pub triangles: u64,
    /// Nodes of the scene.
    pub nodes: u64,
    /// Instances of meshes.
    pub instances: u64,
    /// Bytes of all compressed buffer views after decompression.
    pub decompressed_bytes: u64,
    /// Pixels of one image.
    pub image_pixels: u64,
    /// Bytes of all images after decoding.
    pub texture_bytes: u64,
    /// Bytes of memory that the process needs, by an estimate made before allocation.
    pub memory_bytes: u64,
    /// Bytes of them that are taken already: by the program itself, and by what it has read before.
    pub taken_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            file_bytes: 8 << 30,
            vertices: 1 << 30,
            triangles: 1 << 29,
            nodes: 4 << 20,
            instances: 4 << 20,
            decompressed_bytes: 16 << 30,
            image_pixels: 1 << 28,
            texture_bytes: 16 << 30,
            memory_bytes: u64::MAX,
            taken_bytes: 0,
        }
    }
}

impl Limits {
    /// Returns the bytes of memory that are left for the import.
    pub(crate) fn free_bytes(&self) -> u64 {
        self.memory_bytes.saturating_sub(self.taken_bytes)
    }

    /// The default limits, lowered so that the process needs at most `bytes` of memory.
    pub fn with_memory(bytes: u64) -> Limits {
        let default = Limits::default();
        Limits {
            file_bytes: default.file_bytes.min(bytes),
            decompressed_bytes: default.decompressed_bytes.min(bytes),
            texture_bytes: default.texture_bytes.min(bytes),
            memory_bytes: bytes,
            ..default
        }
    }
}
