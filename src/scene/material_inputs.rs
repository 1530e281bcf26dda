//! Inputs of materials: factors with textures, and normal maps.

use super::{TextureChannel, TextureRef, UvTransform};
use blinn_core::geometry::Rgb;

/// A colour: a factor times an sRGB texture.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ColorInput {
    /// Linear factor.
    pub factor: Rgb,
    /// Texture.
    pub texture: Option<TextureRef>,
}

impl ColorInput {
    /// Returns a constant colour.
    pub fn new(factor: Rgb) -> ColorInput {
        ColorInput { factor, texture: None }
    }
}

/// A number: a factor times a channel of a linear texture.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ScalarInput {
    /// Factor.
    pub factor: f32,
    /// Texture and channel.
    pub texture: Option<(TextureRef, TextureChannel)>,
}

impl ScalarInput {
    /// Returns a constant number.
    pub fn new(factor: f32) -> ScalarInput {
        ScalarInput { factor, texture: None }
    }
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Texture, read as linear data.
    pub texture: TextureRef,
    /// Scale of the slopes; 1 is the full map.
    pub scale: f32,
    /// False multiplies x and y by `scale` (glTF). True also blends z towards 1 for scales below 1, so
    /// that the normal goes from the surface's own to the map's, like Blender's strength.
    pub scale_is_strength: bool,
}

/// Texture coordinates along whose axes tangents are generated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentAxes {
    /// Set of texture coordinates.
    pub uv_set: u32,
    /// Transform of the coordinates.
    pub transform: UvTransform,
}

impl TangentAxes {
    /// Returns the axes of a texture.
    pub fn of(texture: &TextureRef) -> TangentAxes {
        TangentAxes { uv_set: texture.uv_set, transform: texture.transform }
    }
}
