//! The layers that glTF's extensions add to materials.

use super::{ColorInput, NormalMap, ScalarInput, TextureRef};
use blinn_core::geometry::Rgb;

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

/// How much the strength of an anisotropy stretches microfacets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AnisotropyModel {
    /// α + (1 − α) strength² in one direction, and α in the other: KHR_materials_anisotropy.
    #[default]
    Gltf,
    /// α over the aspect, at most 1, in one direction, and α times the aspect in the other, for an aspect of
    /// √(1 − 0.9 strength): the Principled BSDF of Blender (Burley, “Physically Based Shading at Disney”, 2012).
    Principled,
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
    /// How much the strength stretches.
    pub model: AnisotropyModel,
}

/// Light that a surface transmits diffusely, as paper and leaves do (KHR_materials_diffuse_transmission).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the light that is scattered to the other side, 0…1 (texture: alpha).
    pub factor: ScalarInput,
    /// Colour of this light.
    pub color: ColorInput,
}

impl Default for DiffuseTransmission {
    /// Returns none, in white.
    fn default() -> Self {
        DiffuseTransmission { factor: ScalarInput::default(), color: ColorInput::new(Rgb::ONE) }
    }
}

/// A thin film over a surface, whose colours depend on the angle, as on soap bubbles (KHR_materials_iridescence).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Share of the surface that has the film, 0…1.
    pub factor: ScalarInput,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Thickness in nanometres where the texture is 0.
    pub min_thickness: f32,
    /// Thickness in nanometres where the texture is 1, and without a texture.
    pub max_thickness: f32,
    /// Thickness between the two (green).
    pub thickness_texture: Option<TextureRef>,
}

impl Default for Iridescence {
    /// Returns no film.
    fn default() -> Self {
        Iridescence {
            factor: ScalarInput::default(),
            ior: 1.3,
            min_thickness: 100.0,
            max_thickness: 400.0,
            thickness_texture: None,
        }
    }
}

/// How the fibres of a sheen reflect light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SheenModel {
    /// The “Charlie” distribution of KHR_materials_sheen (Estevez and Kulla, “Production Friendly Microfacet Sheen BRDF”, 2017).
    #[default]
    Charlie,
    /// The microfibres of Cycles (Zeltner, Burley and Chiang, “Practical Multiple-Scattering Sheen Using Linearly Transformed
    /// Cosines”, 2022), which Blender shows.
    Microfibres,
}

/// A sheen of fibres over a surface, as on velvet (KHR_materials_sheen).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sheen {
    /// Colour; black is no sheen.
    pub color: ColorInput,
    /// Perceptual roughness (texture: alpha).
    pub roughness: ScalarInput,
    /// How the fibres reflect light.
    pub model: SheenModel,
}
