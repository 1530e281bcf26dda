//! Materials as files describe them. The integrator maps them to the lecture's k_a, k_d, k_s and p.

use std::hint::black_box;

use glam::Vec3;

use super::{
    Anisotropy, Clearcoat, ColorInput, DiffuseTransmission, Iridescence, NormalMap, ScalarInput, Sheen,
    TangentAxes, TexelSemantics, TextureRef, UvTransform,
};
use blinn_core::geometry::Rgb;

/// How alpha affects visibility.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Alpha mask: invisible below the cutoff.
    Mask(f32),
    /// Blended over what is behind.
    Blend,
}

/// The specular reflection of a dielectric (KHR_materials_ior, KHR_materials_specular).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction.
    pub ior: f32,
    /// Weight of the specular reflection (texture: alpha).
    pub specular: ScalarInput,
    /// Colour of the specular reflection at normal incidence.
    pub specular_color: ColorInput,
}

impl Default for Dielectric {
    fn default() -> Self {
        Dielectric { ior: 1.5, specular: ScalarInput::new(1.0), specular_color: ColorInput::new(Vec3::ONE) }
    }
}

/// The lecture's coefficients, as an MTL file gives them.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct MtlReflectance {
    /// k_a. `None` means k_d.
    pub ambient: Option<ColorInput>,
    /// k_s.
    pub specular: ColorInput,
    /// p, unmodified.
    pub shininess: f32,
    /// Index of refraction (Ni); 0 where the file has none.
    pub ior: f32,
}

/// The reflection model of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// MTL's Ka, Ks and Ns. Kd is the material's base colour.
    Mtl(MtlReflectance),
    /// glTF's metallic-roughness model, or an MTL's Pr and Pm.
    MetallicRoughness {
        /// 0 (dielectric) … 1 (metal).
        metallic: ScalarInput,
        /// Perceptual roughness.
        roughness: ScalarInput,
        /// The dielectric part.
        dielectric: Dielectric,
    },
    /// KHR_materials_pbrSpecularGlossiness. The diffuse colour is the base colour.
    SpecularGlossiness {
        /// F0.
        specular: ColorInput,
        /// 1 − roughness (texture: alpha).
        glossiness: ScalarInput,
    },
    /// KHR_materials_unlit: shows the base colour without lighting.
    Unlit,
    /// Points and lines without normals: show the base colour and the emission without lighting (glTF 2.0, “Point and Line
    /// Materials”).
    Unshaded,
}

impl Reflectance {
    /// Returns the metallic-roughness model without textures.
    pub fn metallic_roughness(metallic: f32, roughness: f32) -> Reflectance {
        Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(metallic),
            roughness: ScalarInput::new(roughness),
            dielectric: Dielectric::default(),
        }
    }
}

/// How a surface reflects its surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reflection {
    /// Not at all: the lecture's materials, which reflect light sources only.
    #[default]
    None,
    /// By k_s in every direction (MTL `illum` 3, 4 and 6).
    Constant,
    /// More at grazing angles, as Fresnel's equations say.
    Fresnel,
}

/// The inside of a body (KHR_materials_volume).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Thickness in metres below the surface; above 0. It marks the mesh as the boundary of a body.
    pub thickness: f32,
    /// Colour that white light has after the attenuation distance.
    pub attenuation_color: Rgb,
    /// Mean free path in metres; infinite where nothing is absorbed.
    pub attenuation_distance: f32,
}

/// The largest absorption coefficient per metre; its products with distances stay finite.
const MAX_ABSORPTION: f32 = 1e18;

impl Volume {
    /// Returns the absorption coefficient σ per metre, by colour: light is attenuated by exp(−σ t) over t metres
    /// (Beer's law, as in the extension's specification).
    pub fn absorption(&self) -> Rgb {
        if !(self.attenuation_distance > 0.0 && self.attenuation_distance.is_finite()) {
            return Rgb::ZERO;
        }
        // A channel that is fully absorbed has a large, finite coefficient.
        let sigma = |color: f32| {
            (-libm::logf(color.clamp(1e-6, 1.0)) / self.attenuation_distance).min(MAX_ABSORPTION)
        };
        let color = self.attenuation_color;
        Rgb::new(sigma(color.x), sigma(color.y), sigma(color.z))
    }
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Base colour, diffuse colour or Kd.
    pub base_color: ColorInput,
    /// Opacity, multiplied by the alpha of the base colour's texture if `alpha_from_base` is set.
    pub alpha: ScalarInput,
    /// True if the alpha of the base colour's texture counts (glTF).
    pub alpha_from_base: bool,
    /// How alpha affects visibility.
    pub alpha_mode: AlphaMode,
    /// Reflection model.
    pub reflectance: Reflectance,
    /// Emitted radiance.
    pub emission: ColorInput,
    /// Factor of `emission`.
    pub emission_strength: f32,
    /// Normal map.
    pub normal: Option<NormalMap>,
    /// Ambient occlusion: 1 + strength·(texture − 1).
    pub occlusion: ScalarInput,
    /// Transmission T. It replaces only the diffuse term, which metals do not have.
    pub transmission: ScalarInput,
    /// Colour of the transmitted light (MTL `Tf`); `None` is the base colour.
    pub transmission_color: Option<Rgb>,
    /// How the surroundings are reflected.
    pub reflection: Reflection,
    /// Clear coat.
    pub clearcoat: Clearcoat,
    /// Stretch of highlights; `None` if the material needs no tangents for it.
    pub anisotropy: Option<Anisotropy>,
    /// Sheen.
    pub sheen: Sheen,
    /// Thin film.
    pub iridescence: Iridescence,
    /// Light that is transmitted diffusely.
    pub diffuse_transmission: DiffuseTransmission,
    /// Dispersion of the body: 20 over its Abbe number; 0 for none (KHR_materials_dispersion).
    pub dispersion: f32,
    /// The body that the surface bounds; `None` for a thin wall.
    pub volume: Option<Volume>,
    /// True for a wall that is thin by its material, also where its mesh could bound a body (Blender's *Thin Wall*).
    pub thin_wall: bool,
    /// False makes back faces invisible to eye rays.
    pub double_sided: bool,
}

impl Default for Material {
    /// Returns white, fully rough, not metallic and single-sided. Importers set the defaults of their
    /// format.
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: ColorInput::new(Vec3::ONE),
            alpha: ScalarInput::new(1.0),
            alpha_from_base: false,
            alpha_mode: AlphaMode::Opaque,
            reflectance: Reflectance::metallic_roughness(0.0, 1.0),
            emission: ColorInput::new(Vec3::ZERO),
            emission_strength: 1.0,
            normal: None,
            occlusion: ScalarInput::new(1.0),
            transmission: ScalarInput::new(0.0),
            transmission_color: None,
            reflection: Reflection::None,
            clearcoat: Clearcoat::default(),
            anisotropy: None,
            sheen: Sheen::default(),
            iridescence: Iridescence::default(),
            diffuse_transmission: DiffuseTransmission::default(),
            dispersion: 0.0,
            volume: None,
            thin_wall: false,
            double_sided: false,
        }
    }
}

impl Material {
    /// Returns true if textures other than normal maps vary the material.
    #[inline]
    pub fn is_textured(&self) -> bool {
        self.texture_slots().into_iter().flatten().next().is_some()
    }

    /// Returns all textures, including normal maps.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let normal = self.normal_maps().map(|map| &map.texture);
        self.textures_with_semantics().map(|(texture, _)| texture).chain(normal)
    }

    /// Returns the normal maps of the surface and of its clear coat.
    #[inline]
    pub fn normal_maps(&self) -> impl Iterator<Item = &NormalMap> {
        self.normal.iter().chain(&self.clearcoat.normal)
    }

    /// Returns the texture coordinates whose axes are the tangent space of the material; `None` if it needs none.
    pub fn tangent_axes(&self) -> Option<TangentAxes> {
        let anisotropy = self.anisotropy.iter().filter_map(|anisotropy| anisotropy.texture.as_ref());
        let textures = self.normal_maps().map(|map| &map.texture).chain(anisotropy);
        let first_set = TangentAxes { uv_set: 0, transform: UvTransform::IDENTITY };
        textures.map(TangentAxes::of).next().or(self.anisotropy.map(|_| first_set))
    }

    /// Returns the textures other than normal maps, with their semantics.
    pub fn textures_with_semantics(&self) -> impl Iterator<Item = (&TextureRef, TexelSemantics)> {
        self.texture_slots().into_iter().flatten()
    }

    /// Returns the semantics of the base colour's texture.
    pub fn base_color_semantics(&self) -> TexelSemantics {
        let alpha_counts = self.alpha_from_base && self.alpha_mode != AlphaMode::Opaque;
        if alpha_counts { TexelSemantics::AlphaWeightedColor } else { TexelSemantics::Color }
    }

    /// Returns true if the material may have layers other than a coat over microfacets, both with the normal of the base.
    #[inline]
    pub fn is_layered(&self) -> bool {
        let is_physical = matches!(
            self.reflectance,
            Reflectance::MetallicRoughness { .. } | Reflectance::SpecularGlossiness { .. }
        );
        let has_coat_normal = self.clearcoat.factor.factor > 0.0 && self.normal_maps().next().is_some();
        // Opaque to the compiler, which would else compare the strength before it is known to be there: arbitrary bytes, which may
        // be subnormal numbers.
        let is_anisotropic =
            black_box(self.anisotropy.as_ref()).is_some_and(|anisotropy| anisotropy.strength > 0.0);
        let has_film = self.iridescence.factor.factor > 0.0;
        let transmits = self.diffuse_transmission.factor.factor > 0.0;
        is_physical && (has_coat_normal || is_anisotropic || has_film || transmits || self.has_sheen())
    }

    /// Returns true if the material may have a sheen.
    #[inline]
    fn has_sheen(&self) -> bool {
        self.sheen.color.factor != Rgb::ZERO
    }

    #[inline]
    fn texture_slots(&self) -> [Option<(&TextureRef, TexelSemantics)>; 18] {
        fn color(of: &ColorInput) -> Option<(&TextureRef, TexelSemantics)> {
            of.texture.as_ref().map(|texture| (texture, TexelSemantics::Color))
        }
        fn data(texture: Option<&TextureRef>) -> Option<(&TextureRef, TexelSemantics)> {
            texture.map(|texture| (texture, TexelSemantics::Data))
        }
        fn scalar(of: &ScalarInput) -> Option<(&TextureRef, TexelSemantics)> {
            data(of.texture.as_ref().map(|(texture, _)| texture))
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
            Reflectance::Unlit | Reflectance::Unshaded => [None; 4],
        };
        let [alpha, occlusion, transmission] = [&self.alpha, &self.occlusion, &self.transmission].map(scalar);
        let base = self.base_color.texture.as_ref().map(|texture| (texture, self.base_color_semantics()));
        let [coat, coat_roughness] = [&self.clearcoat.factor, &self.clearcoat.roughness].map(scalar);
        let anisotropy = data(self.anisotropy.as_ref().and_then(|anisotropy| anisotropy.texture.as_ref()));
        let [sheen, sheen_roughness] = [color(&self.sheen.color), scalar(&self.sheen.roughness)];
        let emission = color(&self.emission);
        let film = scalar(&self.iridescence.factor);
        let film_thickness = data(self.iridescence.thickness_texture.as_ref());
        let DiffuseTransmission { factor, color: diffuse_color } = &self.diffuse_transmission;
        let [diffuse, diffuse_color] = [scalar(factor), color(diffuse_color)];
        let layers = [coat, coat_roughness, anisotropy, sheen, sheen_roughness];
        let [e, f, g, h, i] = layers;
        let [j, k, l, m] = [film, film_thickness, diffuse, diffuse_color];
        [base, emission, alpha, occlusion, transmission, a, b, c, d, e, f, g, h, i, j, k, l, m]
    }

    /// Returns true if the material may reflect its surroundings.
    pub fn reflects(&self) -> bool {
        let may_be_positive = |scalar: &ScalarInput| scalar.factor > 0.0;
        let reflects = match &self.reflectance {
            Reflectance::Mtl(mtl) => mtl.specular.factor != Rgb::ZERO || may_be_positive(&self.transmission),
            Reflectance::MetallicRoughness { metallic, dielectric, .. } => {
                may_be_positive(metallic) || may_be_positive(&dielectric.specular)
            }
            Reflectance::SpecularGlossiness { specular, .. } => specular.factor != Rgb::ZERO,
            Reflectance::Unlit | Reflectance::Unshaded => return false,
        };
        let has_layers = may_be_positive(&self.clearcoat.factor) || self.has_sheen();
        self.reflection != Reflection::None && (reflects || has_layers)
    }

    /// Returns true if the material may be a rough metal.
    pub fn is_rough_metal(&self) -> bool {
        match &self.reflectance {
            Reflectance::MetallicRoughness { metallic, roughness, .. } => {
                self.reflects() && metallic.factor > 0.0 && roughness.factor > 0.0
            }
            _ => false,
        }
    }

    /// Returns the index of refraction of the inside; 1.5 where the file has none.
    pub fn ior(&self) -> f32 {
        let ior = match &self.reflectance {
            Reflectance::Mtl(mtl) => mtl.ior,
            Reflectance::MetallicRoughness { dielectric, .. } => dielectric.ior,
            Reflectance::SpecularGlossiness { .. } | Reflectance::Unlit | Reflectance::Unshaded => 0.0,
        };
        if ior > 0.0 { ior } else { Dielectric::default().ior }
    }

    /// Returns half the difference of the indices of refraction in blue and red light: (n − 1) × dispersion / 40.
    pub fn half_spread_of_ior(&self) -> f32 {
        ((self.ior() - 1.0).max(0.0) * self.dispersion / 40.0).min(1e6)
    }

    /// Returns true if rays can pass partially through this material.
    pub fn is_translucent(&self) -> bool {
        self.alpha_mode == AlphaMode::Blend || self.transmits() || self.diffuses_inside()
    }

    /// Returns true if light is transmitted diffusely into a body.
    pub fn diffuses_inside(&self) -> bool {
        self.diffuse_transmission.factor.factor > 0.0 && self.volume.is_some()
    }

    /// Returns true if light passes through the covered part. The transmitted light is part of what a
    /// dielectric would scatter, so metals and unlit materials transmit nothing.
    pub fn transmits(&self) -> bool {
        let scatters = match &self.reflectance {
            Reflectance::MetallicRoughness { metallic, .. } => {
                metallic.factor < 1.0 || metallic.texture.is_some()
            }
            Reflectance::Mtl(_) | Reflectance::SpecularGlossiness { .. } => true,
            Reflectance::Unlit | Reflectance::Unshaded => false,
        };
        self.transmission.factor > 0.0 && scatters
    }
}

/// Classification of a material for ray traversal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SurfaceClass {
    /// Blocks all light.
    #[default]
    Opaque,
    /// Alpha-masked: opaque where it is visible.
    Cutout,
    /// Alpha-blended or transmissive.
    Translucent,
}

impl Material {
    /// Returns the class of the material.
    pub fn surface_class(&self) -> SurfaceClass {
        match self.alpha_mode {
            _ if self.is_translucent() => SurfaceClass::Translucent,
            AlphaMode::Mask(_) => SurfaceClass::Cutout,
            _ => SurfaceClass::Opaque,
        }
    }
}
