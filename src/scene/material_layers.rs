//! The layers that glTF's extensions add to materials.

use super::{NormalMap, ScalarInput};

/// A clear coat over a surface (KHR_materials_clearcoat): a dielectric layer of index 1.5.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clearcoat {
    /// Share of the surface that is coated (texture: red); 0 is no coat.
    pub factor: ScalarInput,
    /// Perceptual roughness (texture: green).
    pub roughness: ScalarInput,
    /// Normal map of the coat. Without one, the coat has the vertex normals, whatever the map of the surface is.
    pub normal: Option<NormalMap>,
}
