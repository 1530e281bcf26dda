//! Evaluates materials: the lecture's k_a, k_d, k_s and p at a point, taken literally from MTL, or mapped from physically
//! based materials.
//!
//! The mapping of metallic-roughness: α = clamp(roughness, 0.1, 1)², p = 2/α² − 2, F0_d = reflectance of the dielectric at
//! normal incidence, F0 = mix(F0_d, base, metallic), k_d = base·(1 − metallic)·(1 − max F0_d) + 0.35·F0·α,
//! k_s = F0·(1 − α)·(p + 2)/8, k_a = base·occlusion. It was fitted to GGX on a lit sphere: see
//! docs/decisions/0035-fit-metallic-roughness-to-blinn-phong.md. Where physical materials reflect their surroundings, k_s is
//! 0 and their layers reflect lights as well.

use glam::Vec3;

use crate::geometry::Rgb;
use crate::integrator::material::coefficients::{Coefficients, MaterialOverrides};
use crate::integrator::material::fresnel::{f0_from_ior, ior_from_f0};
use crate::integrator::material::opacity::{
    base_color_from_texel, base_color_texel, opacity, opacity_from_texel, transmission_weight,
};
use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::texture_eval::TextureEvalContext;
use crate::scene::{
    AlphaMode, Clearcoat, Dielectric, Material, MtlReflectance, PosedScene, Reflectance, Reflection,
};

/// Evaluates the materials of the surfaces of a batch, and stores the coefficients. A material that is the same at every
/// point is evaluated once for consecutive surfaces.
#[derive(Debug)]
pub(crate) struct MaterialEvaluator<'a> {
    posed: &'a PosedScene<'a>,
    /// All coefficients so far, which points refer to by index.
    coefficients: &'a mut Vec<Coefficients>,
    overrides: &'a MaterialOverrides,
    /// True if ambient light comes from a sky.
    under_sky: bool,
    /// True if surfaces reflect their surroundings.
    reflections_enabled: bool,
    /// The last uniform material, and the index of its coefficients.
    last_uniform: Option<(u32, u32)>,
}

impl<'a> MaterialEvaluator<'a> {
    pub fn new(
        posed: &'a PosedScene<'a>,
        coefficients: &'a mut Vec<Coefficients>,
        overrides: &'a MaterialOverrides,
        under_sky: bool,
        reflections_enabled: bool,
    ) -> MaterialEvaluator<'a> {
        MaterialEvaluator {
            posed,
            coefficients,
            overrides,
            under_sky,
            reflections_enabled,
            last_uniform: None,
        }
    }

    /// Evaluates a material without textures or vertex colours; `ctx` is any point of its mesh. Returns the
    /// index of its coefficients.
    pub fn eval_uniform(&mut self, material: u32, ctx: &TextureEvalContext) -> u32 {
        match self.last_uniform {
            Some((last, index)) if last == material => index,
            _ => {
                let index = self.eval(material, ctx);
                self.last_uniform = Some((material, index));
                index
            }
        }
    }

    /// Evaluates a material at a point. Returns the index of its coefficients.
    pub fn eval(&mut self, material: u32, ctx: &TextureEvalContext) -> u32 {
        let material = &self.posed.materials[material as usize];
        let reflects = self.reflections_enabled && material.reflects();
        let mut k = Coefficients::eval(self.posed, material, ctx, self.under_sky, reflects);
        self.overrides.apply_to_colors(&mut k);
        self.coefficients.push(k);
        (self.coefficients.len() - 1) as u32
    }

    /// Coefficients by index.
    #[inline(always)]
    pub fn get(&self, index: u32) -> &Coefficients {
        &self.coefficients[index as usize]
    }
}

/// Smallest roughness of Blinn-Phong's highlights: narrower lobes are beyond point lights and f32.
const MIN_HIGHLIGHT_ROUGHNESS: f32 = 0.1;

impl Coefficients {
    #[inline]
    fn eval(
        posed: &PosedScene,
        material: &Material,
        ctx: &TextureEvalContext,
        under_sky: bool,
        reflects: bool,
    ) -> Coefficients {
        let texel = base_color_texel(posed, material, ctx);
        let opacity = match material.alpha_mode {
            // One texture sample has both colour and alpha.
            AlphaMode::Blend if material.alpha_from_base => {
                opacity_from_texel(posed, material, ctx, texel.w).clamp(0.0, 1.0)
            }
            _ => opacity(posed, material, ctx),
        };
        let color = base_color_from_texel(material, ctx, texel);
        let k_e = material.emission.eval(posed, ctx) * material.emission_strength;
        let mut k = Coefficients { k_e, ..Coefficients::matte(color, opacity) };
        match &material.reflectance {
            Reflectance::Mtl(mtl) => k.set_mtl(mtl, material, posed, ctx, under_sky),
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => {
                let metallic = metallic.eval(posed, ctx).clamp(0.0, 1.0);
                let roughness = roughness.eval(posed, ctx).clamp(0.0, 1.0);
                let weight = dielectric.specular.eval(posed, ctx).clamp(0.0, 1.0);
                let f0 = dielectric.f0(posed, ctx, weight);
                k.set_metallic_roughness(metallic, roughness, f0, weight, dielectric.ior);
            }
            Reflectance::SpecularGlossiness { specular, glossiness } => {
                let f0 = specular.eval(posed, ctx).clamp(Vec3::ZERO, Vec3::ONE);
                let roughness = 1.0 - glossiness.eval(posed, ctx).clamp(0.0, 1.0);
                k.set_specular_glossiness(f0, roughness);
            }
            Reflectance::Unlit => {
                k.k_a = Rgb::ZERO;
                k.k_d = Rgb::ZERO;
                k.k_e = color;
            }
        }
        if reflects {
            k.set_clearcoat(&material.clearcoat, posed, ctx);
            if k.layers.covers_base && !matches!(material.reflectance, Reflectance::Mtl(_)) {
                // Highlights are those of the layers.
                k.layers.has_highlights = true;
                k.k_s = Rgb::ZERO;
                // The diffuse colour of the base, as if nothing covered it. Layers reflect the specular share of the ambient
                // light.
                k.k_d = k.color * (1.0 - k.layers.metallic);
                k.k_a = k.k_d;
            }
        } else {
            k.layers = SpecularLayers::NONE;
        }
        k.apply_occlusion(material, posed, ctx);
        k.set_transmission(material, posed, ctx);
        k
    }

    fn apply_occlusion(&mut self, material: &Material, posed: &PosedScene, ctx: &TextureEvalContext) {
        if material.occlusion.texture.is_some() {
            let texel = material.occlusion.eval_texture(posed, ctx);
            let occlusion = 1.0 + material.occlusion.factor * (texel - 1.0);
            self.k_a *= occlusion;
            self.layers.occlusion = occlusion;
        }
    }

    /// Moves light from the diffuse base to what the surface transmits.
    fn set_transmission(&mut self, material: &Material, posed: &PosedScene, ctx: &TextureEvalContext) {
        let weight = transmission_weight(posed, material, ctx);
        if weight > 0.0 {
            self.k_d *= 1.0 - weight;
            self.k_a *= 1.0 - weight;
            self.k_t = material.transmission_color.unwrap_or(self.color) * weight;
            self.transmission_weight = weight;
        }
    }

    fn set_clearcoat(&mut self, coat: &Clearcoat, posed: &PosedScene, ctx: &TextureEvalContext) {
        if coat.factor.factor > 0.0 {
            let roughness = coat.roughness.eval(posed, ctx).clamp(0.0, 1.0);
            self.layers.coat = coat.factor.eval(posed, ctx).clamp(0.0, 1.0);
            self.layers.coat_alpha = roughness * roughness;
        }
    }

    fn set_mtl(
        &mut self,
        mtl: &MtlReflectance,
        material: &Material,
        posed: &PosedScene,
        ctx: &TextureEvalContext,
        under_sky: bool,
    ) {
        // Ka is for the lecture's constant I_a. Light from a sky is reflected by the diffuse colour, as light from any
        // other source.
        if let Some(ambient) = mtl.ambient.as_ref().filter(|_| !under_sky) {
            self.k_a = ambient.eval(posed, ctx);
        }
        self.k_s = mtl.specular.eval(posed, ctx);
        self.shininess = mtl.shininess;
        let ggx_alpha = ggx_alpha_of_shininess(mtl.shininess);
        let k_s = self.k_s.clamp(Vec3::ZERO, Vec3::ONE);
        let constant = material.reflection == Reflection::Constant;
        self.layers = if material.transmits() {
            // Glass transmits what it does not reflect. Its Ks is for highlights, unless it takes the place of Fresnel's
            // equations.
            let f0 = if constant { k_s } else { Rgb::splat(f0_from_ior(f64::from(material.ior())) as f32) };
            let f90 = if constant { k_s.element_sum() / 3.0 } else { 1.0 };
            let ggx_alpha = if mtl.shininess > 0.0 { ggx_alpha } else { 0.0 };
            SpecularLayers {
                alpha: ggx_alpha,
                dielectric_f0: f0,
                dielectric_f90: f90,
                ior: material.ior(),
                ..SpecularLayers::COVERING
            }
        } else {
            // The lecture's sum: what is reflected does not reduce k_d.
            let metal_f90 = if constant { k_s } else { Vec3::ONE };
            SpecularLayers {
                covers_base: false,
                alpha: ggx_alpha,
                metallic: 1.0,
                metal_f0: k_s,
                metal_f90,
                ..SpecularLayers::COVERING
            }
        };
    }

    /// `f0_dielectric` and `f90_dielectric` are the reflectance of the dielectric at normal and at grazing incidence.
    fn set_metallic_roughness(
        &mut self,
        metallic: f32,
        roughness: f32,
        f0_dielectric: Rgb,
        f90_dielectric: f32,
        ior: f32,
    ) {
        let base = self.color;
        let diffuse = base * ((1.0 - metallic) * (1.0 - f0_dielectric.max_element()));
        self.set_microfacets(diffuse, f0_dielectric + (base - f0_dielectric) * metallic, roughness);
        self.layers = SpecularLayers {
            alpha: roughness * roughness,
            metallic,
            metal_f0: base.clamp(Vec3::ZERO, Vec3::ONE),
            metal_f90: Vec3::ONE,
            dielectric_f0: f0_dielectric.clamp(Vec3::ZERO, Vec3::ONE),
            dielectric_f90: f90_dielectric,
            ior,
            ..SpecularLayers::COVERING
        };
    }

    fn set_specular_glossiness(&mut self, f0: Rgb, roughness: f32) {
        let max_f0 = f0.max_element();
        let diffuse = self.color * (1.0 - max_f0);
        // All reflected light, as for the base colour of a metal.
        self.k_a = diffuse + f0;
        self.set_microfacets(diffuse, f0, roughness);
        self.layers = SpecularLayers {
            alpha: roughness * roughness,
            dielectric_f0: f0,
            dielectric_f90: if max_f0 > 0.0 { 1.0 } else { 0.0 },
            ior: ior_from_f0(f64::from(max_f0)) as f32,
            ..SpecularLayers::COVERING
        };
    }

    /// A diffuse layer below microfacets. The rougher the microfacets, the more of F0 is diffuse.
    fn set_microfacets(&mut self, diffuse: Rgb, f0: Rgb, roughness: f32) {
        let roughness = roughness.clamp(MIN_HIGHLIGHT_ROUGHNESS, 1.0);
        let ggx_alpha = roughness * roughness;
        let p = 2.0 / (ggx_alpha * ggx_alpha) - 2.0;
        self.k_d = diffuse + f0 * (0.35 * ggx_alpha);
        self.k_s = f0 * ((1.0 - ggx_alpha) * (p + 2.0) / 8.0);
        self.shininess = p;
    }
}

impl Dielectric {
    /// Reflectance at normal incidence (KHR_materials_ior, KHR_materials_specular): ((ior − 1)/(ior + 1))² × specular
    /// colour, at most 1, × specular weight.
    fn f0(&self, posed: &PosedScene, ctx: &TextureEvalContext, weight: f32) -> Rgb {
        let r = (self.ior - 1.0) / (self.ior + 1.0);
        let tinted = self.specular_color.eval(posed, ctx) * (r * r);
        tinted.min(Vec3::ONE) * weight
    }
}

/// The GGX α whose lobe is as wide as that of exponent p: p = 2/α² − 2.
fn ggx_alpha_of_shininess(p: f32) -> f32 {
    (2.0 / (p + 2.0)).sqrt().min(1.0)
}
