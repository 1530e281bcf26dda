//! How much a file may ask for, checked before memory is taken.

/// Upper limits. The defaults are far above real scenes and below what takes a machine down.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of any one file read.
    pub file_bytes: u64,
    /// Vertices of all meshes, as stored.
    pub vertices: u64,
    /// Triangles of all meshes, as stored.
    pub triangles: u64,
    /// Nodes after shared ones are repeated.
    pub nodes: u64,
    /// Instances drawn.
    pub instances: u64,
    /// Bytes of all compressed buffer views once decompressed.
    pub decompressed_bytes: u64,
    /// Texels of one image.
    pub image_pixels: u64,
    /// Bytes of all images once decoded.
    pub texture_bytes: u64,
    /// Bytes of memory that the scene takes while it is read, by an estimate made beforehand.
    pub memory_bytes: u64,
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
        }
    }
}

impl Limits {
    /// The usual limits, for a scene that takes no more than `bytes` of memory while it is read.
    pub fn within(bytes: u64) -> Limits {
        let usual = Limits::default();
        Limits {
            file_bytes: usual.file_bytes.min(bytes),
            decompressed_bytes: usual.decompressed_bytes.min(bytes),
            texture_bytes: usual.texture_bytes.min(bytes),
            memory_bytes: bytes,
            ..usual
        }
    }
}
