//! The layers that glTF's extensions add to materials.

use super::{ColorInput, NormalMap, ScalarInput, TextureRef};

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

/// Anisotropic microfacets (KHR_materials_anisotropy): highlights are stretched in a direction of the tangent plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anisotropy {
    /// Strength, 0…1.
    pub strength: f32,
    /// Angle in radians from the tangent to the direction of the stretch, counter-clockwise.
    pub rotation: f32,
    /// Direction before the rotation (red and green, 0…1 for −1…1), and factor of the strength (blue).
    pub texture: Option<TextureRef>,
}

/// A sheen of fibres over a surface, as on velvet (KHR_materials_sheen).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sheen {
    /// Colour; black is no sheen.
    pub color: ColorInput,
    /// Perceptual roughness (texture: alpha).
    pub roughness: ScalarInput,
}
