//! Materials as files describe them. What the lecture's k_a, k_d, k_s and p become of each is the
//! integrator's to say.

use crate::geometry::Rgb;
use glam::Vec3;

use super::{TexelSemantics, TextureRef};

/// A channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureChannel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// The mean of red, green and blue.
    Mean,
}

/// A colour, times a texture read as sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ColorInput {
    /// Linear factor.
    pub factor: Rgb,
    /// Its texture.
    pub texture: Option<TextureRef>,
}

impl ColorInput {
    /// A colour without a texture.
    pub fn new(factor: Rgb) -> ColorInput {
        ColorInput { factor, texture: None }
    }
}

/// A number, times a channel of a texture read as linear data.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ScalarInput {
    /// The factor.
    pub factor: f32,
    /// Its texture and the channel.
    pub texture: Option<(TextureRef, TextureChannel)>,
}

impl ScalarInput {
    /// A number without a texture.
    pub fn new(factor: f32) -> ScalarInput {
        ScalarInput { factor, texture: None }
    }
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The texture, read as linear data.
    pub texture: TextureRef,
    /// How much of it is seen; 1 is all.
    pub scale: f32,
    /// `scale` multiplies x and y. True: below 1 it takes z to 1 as well, as Blender's strength does, so that
    /// the normal goes from the surface's own to the map's.
    pub scale_is_strength: bool,
}

/// What becomes of alpha.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Below the cutoff there is nothing.
    Mask(f32),
    /// Composited over what is behind.
    Blend,
}

/// A dielectric's reflectance at normal incidence: index of refraction and KHR_materials_specular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction.
    pub ior: f32,
    /// Weight of the specular reflection (texture: alpha).
    pub specular: ScalarInput,
    /// Its colour.
    pub specular_color: ColorInput,
}

impl Default for Dielectric {
    fn default() -> Self {
        Dielectric { ior: 1.5, specular: ScalarInput::new(1.0), specular_color: ColorInput::new(Vec3::ONE) }
    }
}

/// The lecture's own coefficients, as an MTL file gives them.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct MtlReflectance {
    /// k_a; `None` means the same as k_d.
    pub ambient: Option<ColorInput>,
    /// k_s.
    pub specular: ColorInput,
    /// p, exactly as written.
    pub shininess: f32,
}

/// How a surface reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// MTL's Ka, Ks and Ns; Kd is the material's base colour.
    Mtl(MtlReflectance),
    /// glTF's metallic-roughness, or an MTL's Pr and Pm.
    MetallicRoughness {
        /// 0 dielectric … 1 metal.
        metallic: ScalarInput,
        /// Perceptual roughness.
        roughness: ScalarInput,
        /// What its dielectric part is.
        dielectric: Dielectric,
    },
    /// KHR_materials_pbrSpecularGlossiness; the diffuse colour is the base colour.
    SpecularGlossiness {
        /// F0.
        specular: ColorInput,
        /// 1 − roughness (texture: alpha).
        glossiness: ScalarInput,
    },
    /// The base colour and nothing else.
    Unlit,
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Base colour, diffuse colour or Kd.
    pub base_color: ColorInput,
    /// Opacity, times the base texture's alpha where `alpha_from_base` says so.
    pub alpha: ScalarInput,
    /// True where the base colour texture's alpha counts (glTF).
    pub alpha_from_base: bool,
    /// What becomes of it.
    pub alpha_mode: AlphaMode,
    /// How it reflects.
    pub reflectance: Reflectance,
    /// Emitted radiance.
    pub emission: ColorInput,
    /// Multiplies `emission`.
    pub emission_strength: f32,
    /// A normal map.
    pub normal: Option<NormalMap>,
    /// Ambient occlusion: 1 + strength·(texture − 1).
    pub occlusion: ScalarInput,
    /// Transmission T: replaces the diffuse term alone, of which metals have none.
    pub transmission: ScalarInput,
    /// False: back faces are not seen by eye rays.
    pub double_sided: bool,
}

impl Default for Material {
    /// White, fully rough, not metallic, single-sided. Importers set what their format says of a
    /// mesh without a material.
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: ColorInput::new(Vec3::ONE),
            alpha: ScalarInput::new(1.0),
            alpha_from_base: false,
            alpha_mode: AlphaMode::Opaque,
            reflectance: Reflectance::MetallicRoughness {
                metallic: ScalarInput::new(0.0),
                roughness: ScalarInput::new(1.0),
                dielectric: Dielectric::default(),
            },
            emission: ColorInput::new(Vec3::ZERO),
            emission_strength: 1.0,
            normal: None,
            occlusion: ScalarInput::new(1.0),
            transmission: ScalarInput::new(0.0),
            double_sided: false,
        }
    }
}

impl Material {
    /// True where textures say what it is from place to place, its normal map aside.
    pub fn is_textured(&self) -> bool {
        self.texture_slots().into_iter().flatten().next().is_some()
    }

    /// Its textures, its normal map among them.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let normal = self.normal.as_ref().map(|map| &map.texture);
        self.textures_with_semantics().map(|(texture, _)| texture).chain(normal)
    }

    /// What it looks up, but for the normal map.
    pub(crate) fn textures_with_semantics(&self) -> impl Iterator<Item = (&TextureRef, TexelSemantics)> {
        self.texture_slots().into_iter().flatten()
    }

    /// What its base colour's texture says.
    pub(crate) fn base_color_semantics(&self) -> TexelSemantics {
        let counts = self.alpha_from_base && self.alpha_mode != AlphaMode::Opaque;
        if counts { TexelSemantics::AlphaWeightedColor } else { TexelSemantics::Color }
    }

    fn texture_slots(&self) -> [Option<(&TextureRef, TexelSemantics)>; 9] {
        fn color(of: &ColorInput) -> Option<(&TextureRef, TexelSemantics)> {
            of.texture.as_ref().map(|texture| (texture, TexelSemantics::Color))
        }
        fn scalar(of: &ScalarInput) -> Option<(&TextureRef, TexelSemantics)> {
            of.texture.as_ref().map(|(texture, _)| (texture, TexelSemantics::Data))
        }
        let [a, b, c, d] = match &self.reflectance {
            Reflectance::Mtl(mtl) => [mtl.ambient.as_ref().and_then(color), color(&mtl.specular), None, None],
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => {
                let Dielectric { specular, specular_color, ior: _ } = dielectric;
                [scalar(metallic), scalar(roughness), scalar(specular), color(specular_color)]
            }
            Reflectance::SpecularGlossiness { specular, glossiness } => {
                [color(specular), scalar(glossiness), None, None]
            }
            Reflectance::Unlit => [None; 4],
        };
        let [alpha, occlusion, transmission] = [&self.alpha, &self.occlusion, &self.transmission].map(scalar);
        let base = self.base_color.texture.as_ref().map(|texture| (texture, self.base_color_semantics()));
        [base, color(&self.emission), alpha, occlusion, transmission, a, b, c, d]
    }

    /// True where a ray may pass through this material in part.
    pub fn is_translucent(&self) -> bool {
        self.alpha_mode == AlphaMode::Blend || self.transmits()
    }

    /// True where light may pass through its covered part. What passes is part of what a dielectric
    /// would scatter: metals let nothing through, and neither does what shows its colour and nothing else.
    pub fn transmits(&self) -> bool {
        let scatters = match &self.reflectance {
            Reflectance::MetallicRoughness { metallic, .. } => {
                metallic.factor < 1.0 || metallic.texture.is_some()
            }
            Reflectance::Mtl(_) | Reflectance::SpecularGlossiness { .. } => true,
            Reflectance::Unlit => false,
        };
        self.transmission.factor > 0.0 && scatters
    }
}

/// What rays need to know of a material without looking at it closely.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SurfaceClass {
    /// Blocks everything.
    #[default]
    Opaque,
    /// There or not there, by an alpha test, and opaque where it is.
    Cutout,
    /// Lets part of the light through, or may not be there.
    Translucent,
}

impl Material {
    /// Its class.
    pub fn surface_class(&self) -> SurfaceClass {
        match self.alpha_mode {
            _ if self.is_translucent() => SurfaceClass::Translucent,
            AlphaMode::Mask(_) => SurfaceClass::Cutout,
            _ => SurfaceClass::Opaque,
        }
    }
}
