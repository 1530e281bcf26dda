//! Evaluates materials: the lecture's k_a, k_d, k_s and p at a point, taken literally from MTL, or mapped from physically
//! based materials.
//!
//! The mapping of metallic-roughness: α = clamp(roughness, 0.1, 1)², p = 2/α² − 2, F0_d = reflectance of the dielectric at
//! normal incidence, F0 = mix(F0_d, base, metallic), k_d = base·(1 − metallic)·(1 − max F0_d) + 0.35·F0·α,
//! k_s = F0·(1 − α)·(p + 2)/8, k_a = base·occlusion. It was fitted to GGX on a lit sphere: see
//! docs/decisions/material-conversion.md. Where physical materials reflect their surroundings, k_s is
//! 0 and their layers reflect lights as well.

use glam::Vec3;

use crate::integrator::material::coefficient_lanes::CoefficientLanes;
use crate::integrator::material::coefficients::{Coefficients, MaterialOverrides};
use crate::integrator::material::fresnel::{f0_from_ior, ior_from_f0};
use crate::integrator::material::material_inputs::MaterialInputs;
use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_core::geometry::Rgb;
use blinn_core::simd::AutovecKernel;
use blinn_scene::{AlphaMode, Material, MtlReflectance, Reflectance, Reflection, TexelSemantics};

/// Settings that all materials of a frame are evaluated with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EvalSettings<'a> {
    pub overrides: &'a MaterialOverrides,
    /// True if ambient light comes from a sky.
    pub under_sky: bool,
    /// True if surfaces reflect their surroundings.
    pub reflections_enabled: bool,
    /// Scale of the colours of unlit materials.
    pub unlit_scale: f32,
}

/// Evaluates a material at the points of a block.
pub(crate) struct EvalMaterial<'a> {
    pub material: &'a Material,
    pub inputs: &'a MaterialInputs<'a>,
    /// True if the points have colours of their own, besides that of the material.
    pub has_color: bool,
    pub settings: EvalSettings<'a>,
    pub out: &'a mut CoefficientLanes,
}

/// Smallest roughness of Blinn-Phong's highlights: narrower lobes are beyond point lights and f32.
const MIN_HIGHLIGHT_ROUGHNESS: f32 = 0.1;

impl AutovecKernel for EvalMaterial<'_> {
    #[inline(always)]
    fn run(self) {
        let EvalMaterial { material, inputs, has_color, settings, out } = self;
        let base = BaseLanes::new(material, inputs, has_color, &settings);
        match &material.reflectance {
            Reflectance::Mtl(mtl) => {
                base.eval(&MtlLanes::new(mtl, material, inputs, settings.under_sky), out);
            }
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => {
                let lanes = MetallicRoughnessLanes {
                    metallic: inputs.share(metallic),
                    roughness: inputs.share(roughness),
                    specular: inputs.share(&dielectric.specular),
                    specular_color: inputs.color(&dielectric.specular_color, TexelSemantics::Color),
                    ior: dielectric.ior,
                };
                base.eval(&lanes, out);
            }
            Reflectance::SpecularGlossiness { specular, glossiness } => {
                let lanes = SpecularGlossinessLanes {
                    specular: inputs.color(specular, TexelSemantics::Color),
                    glossiness: inputs.share(glossiness),
                };
                base.eval(&lanes, out);
            }
            Reflectance::Unlit | Reflectance::Unshaded => {
                let lanes = UnlitLanes {
                    color: settings.overrides.k_d,
                    scale: settings.unlit_scale,
                    has_emission: matches!(material.reflectance, Reflectance::Unshaded),
                };
                base.eval(&lanes, out)
            }
        }
    }
}

/// Inputs that all materials have, by point.
struct BaseLanes {
    color: [[f32; LANES]; 3],
    opacity: [f32; LANES],
    k_e: [[f32; LANES]; 3],
    /// Share of ambient light that the occlusion map leaves.
    occlusion: [f32; LANES],
    transmission: [f32; LANES],
    coat: [f32; LANES],
    coat_roughness: [f32; LANES],
    has_coat: bool,
    transmission_color: Option<Rgb>,
    /// True if the layers of the material reflect their surroundings.
    reflects: bool,
    overrides: MaterialOverrides,
}

/// A model of reflectance with its inputs, by point.
trait ReflectanceLanes {
    /// True if the highlights of a surface that reflects its surroundings are those of its layers.
    const HAS_LAYER_HIGHLIGHTS: bool;
    /// False for materials that light does not change.
    const IS_LIT: bool = true;

    /// Sets the coefficients and layers of point `i`, whose colour is known, and returns the share of its light that is
    /// not reflected by a metal.
    fn apply(&self, i: usize, k: &mut Coefficients) -> f32;
}

impl BaseLanes {
    #[inline(always)]
    fn new(
        material: &Material,
        inputs: &MaterialInputs,
        has_color: bool,
        settings: &EvalSettings,
    ) -> BaseLanes {
        let semantics = material.base_color_semantics();
        let mut color = inputs.color(&material.base_color, semantics);
        if has_color {
            for (color, own) in color.iter_mut().zip(&inputs.own_color) {
                for i in 0..LANES {
                    color[i] *= own[i];
                }
            }
        }
        let mut k_e = inputs.color(&material.emission, TexelSemantics::Color);
        let strength = material.emission_strength;
        k_e.as_flattened_mut().iter_mut().for_each(|x| *x *= strength);
        let mut occlusion = [1.0; LANES];
        if material.occlusion.texture.is_some() {
            let texel = inputs.texel(&material.occlusion);
            let factor = material.occlusion.factor;
            for i in 0..LANES {
                occlusion[i] = 1.0 + factor * (texel[i] - 1.0);
            }
        }
        let transmits = material.transmits();
        BaseLanes {
            color,
            opacity: opacity_lanes(material, inputs, has_color),
            k_e,
            occlusion,
            transmission: if transmits { inputs.share(&material.transmission) } else { [0.0; LANES] },
            coat: inputs.share(&material.clearcoat.factor),
            coat_roughness: inputs.share(&material.clearcoat.roughness),
            has_coat: material.clearcoat.factor.factor > 0.0,
            transmission_color: material.transmission_color,
            reflects: settings.reflections_enabled && material.reflects(),
            overrides: *settings.overrides,
        }
    }

    /// Evaluates the coefficients of all points.
    #[inline(always)]
    fn eval<R: ReflectanceLanes>(&self, reflectance: &R, out: &mut CoefficientLanes) {
        // A local cannot alias what the loop reads, which lets the compiler vectorise it.
        let mut lanes = CoefficientLanes::ZERO;
        for i in 0..LANES {
            let color = vec3(&self.color, i);
            let mut k =
                Coefficients { k_e: vec3(&self.k_e, i), ..Coefficients::matte(color, self.opacity[i]) };
            let not_metal = reflectance.apply(i, &mut k);
            if self.reflects {
                self.set_coat(i, &mut k.layers);
                if R::HAS_LAYER_HIGHLIGHTS {
                    k.use_layer_highlights();
                }
            } else {
                k.layers = SpecularLayers::NONE;
            }
            k.k_a *= self.occlusion[i];
            k.layers.occlusion = self.occlusion[i];
            k.set_transmission(self.transmission[i] * not_metal, self.transmission_color);
            if R::IS_LIT {
                self.overrides.apply_to_colors(&mut k);
            } else if let Some(k_e) = self.overrides.k_e {
                k.k_e = k_e;
            }
            lanes.set(i, &k);
        }
        *out = lanes;
    }

    #[inline(always)]
    fn set_coat(&self, i: usize, layers: &mut SpecularLayers) {
        if self.has_coat {
            layers.coat = self.coat[i];
            layers.coat_alpha = self.coat_roughness[i] * self.coat_roughness[i];
        }
    }
}

/// Opacity of all points: 0 or 1 for MASK, 0…1 for BLEND.
#[inline(always)]
fn opacity_lanes(material: &Material, inputs: &MaterialInputs, has_color: bool) -> [f32; LANES] {
    if material.alpha_mode == AlphaMode::Opaque {
        return [1.0; LANES];
    }
    let base = material.base_color.texture.as_ref().filter(|_| material.alpha_from_base);
    let [.., base_alpha] = &inputs.texels.get(base, material.base_color_semantics()).rgba;
    let is_textured = material.is_textured();
    let mut opacity = inputs.scalar(&material.alpha);
    for i in 0..LANES {
        let own = if has_color { inputs.own_color[3][i] } else { 1.0 };
        let unclamped = opacity[i] * own * base_alpha[i];
        opacity[i] = match material.alpha_mode {
            // Masks are cut from the finest texels.
            AlphaMode::Mask(_) if is_textured => inputs.mask[i],
            AlphaMode::Mask(cutoff) => f32::from(unclamped >= cutoff),
            _ => unclamped.clamp(0.0, 1.0),
        };
    }
    opacity
}

struct MetallicRoughnessLanes {
    metallic: [f32; LANES],
    roughness: [f32; LANES],
    /// Weight of the dielectric's reflectance, which is that at grazing incidence.
    specular: [f32; LANES],
    specular_color: [[f32; LANES]; 3],
    ior: f32,
}

impl ReflectanceLanes for MetallicRoughnessLanes {
    const HAS_LAYER_HIGHLIGHTS: bool = true;

    #[inline(always)]
    fn apply(&self, i: usize, k: &mut Coefficients) -> f32 {
        let base = k.color;
        let (metallic, roughness, weight) = (self.metallic[i], self.roughness[i], self.specular[i]);
        let f0_dielectric = dielectric_f0(self.ior, vec3(&self.specular_color, i), weight);
        let diffuse = base * ((1.0 - metallic) * (1.0 - f0_dielectric.max_element()));
        k.set_microfacets(diffuse, f0_dielectric + (base - f0_dielectric) * metallic, roughness);
        k.layers = SpecularLayers {
            alpha: roughness * roughness,
            metallic,
            metal_f0: base.clamp(Vec3::ZERO, Vec3::ONE),
            metal_f90: Vec3::ONE,
            dielectric_f0: f0_dielectric.clamp(Vec3::ZERO, Vec3::ONE),
            dielectric_f90: weight,
            ior: self.ior,
            ..SpecularLayers::COVERING
        };
        1.0 - metallic
    }
}

/// Reflectance of a dielectric at normal incidence (KHR_materials_ior, KHR_materials_specular):
/// ((ior − 1)/(ior + 1))² × specular colour, at most 1, × specular weight.
#[inline(always)]
fn dielectric_f0(ior: f32, specular_color: Rgb, weight: f32) -> Rgb {
    let r = (ior - 1.0) / (ior + 1.0);
    let tinted = specular_color * (r * r);
    tinted.min(Vec3::ONE) * weight
}

struct SpecularGlossinessLanes {
    specular: [[f32; LANES]; 3],
    glossiness: [f32; LANES],
}

impl ReflectanceLanes for SpecularGlossinessLanes {
    const HAS_LAYER_HIGHLIGHTS: bool = true;

    #[inline(always)]
    fn apply(&self, i: usize, k: &mut Coefficients) -> f32 {
        let f0 = vec3(&self.specular, i).clamp(Vec3::ZERO, Vec3::ONE);
        let roughness = 1.0 - self.glossiness[i];
        let max_f0 = f0.max_element();
        let diffuse = k.color * (1.0 - max_f0);
        // All reflected light, as for the base colour of a metal.
        k.k_a = diffuse + f0;
        k.set_microfacets(diffuse, f0, roughness);
        k.layers = SpecularLayers {
            alpha: roughness * roughness,
            dielectric_f0: f0,
            dielectric_f90: if max_f0 > 0.0 { 1.0 } else { 0.0 },
            ior: ior_from_f0(f64::from(max_f0)) as f32,
            ..SpecularLayers::COVERING
        };
        1.0
    }
}

struct UnlitLanes {
    /// The override of k_d, which replaces the colour.
    color: Option<Rgb>,
    scale: f32,
    /// True if the emission adds to the colour.
    has_emission: bool,
}

impl ReflectanceLanes for UnlitLanes {
    const HAS_LAYER_HIGHLIGHTS: bool = false;
    const IS_LIT: bool = false;

    #[inline(always)]
    fn apply(&self, _: usize, k: &mut Coefficients) -> f32 {
        k.k_a = Rgb::ZERO;
        k.k_d = Rgb::ZERO;
        let emission = if self.has_emission { k.k_e } else { Rgb::ZERO };
        k.k_e = emission + self.color.unwrap_or(k.color) * self.scale;
        1.0
    }
}

struct MtlLanes {
    /// Ka, where it is used.
    ambient: Option<[[f32; LANES]; 3]>,
    specular: [[f32; LANES]; 3],
    shininess: f32,
    ggx_alpha: f32,
    /// True if Ks takes the place of Fresnel's equations.
    constant: bool,
    transmits: bool,
    ior: f32,
}

impl MtlLanes {
    #[inline(always)]
    fn new(mtl: &MtlReflectance, material: &Material, inputs: &MaterialInputs, under_sky: bool) -> MtlLanes {
        // Ka is for the lecture's constant I_a. Light from a sky is reflected by the diffuse colour, as light from any
        // other source.
        let ambient = mtl.ambient.as_ref().filter(|_| !under_sky);
        MtlLanes {
            ambient: ambient.map(|ambient| inputs.color(ambient, TexelSemantics::Color)),
            specular: inputs.color(&mtl.specular, TexelSemantics::Color),
            shininess: mtl.shininess,
            ggx_alpha: ggx_alpha_of_shininess(mtl.shininess),
            constant: material.reflection == Reflection::Constant,
            transmits: material.transmits(),
            ior: material.ior(),
        }
    }
}

impl ReflectanceLanes for MtlLanes {
    const HAS_LAYER_HIGHLIGHTS: bool = false;

    #[inline(always)]
    fn apply(&self, i: usize, k: &mut Coefficients) -> f32 {
        let MtlLanes { shininess, ggx_alpha, constant, ior, .. } = *self;
        if let Some(ambient) = &self.ambient {
            k.k_a = vec3(ambient, i);
        }
        k.k_s = vec3(&self.specular, i);
        k.shininess = shininess;
        let k_s = k.k_s.clamp(Vec3::ZERO, Vec3::ONE);
        k.layers = if self.transmits {
            // Glass transmits what it does not reflect. Its Ks is for highlights, unless it takes the place of Fresnel's
            // equations.
            SpecularLayers {
                alpha: if shininess > 0.0 { ggx_alpha } else { 0.0 },
                dielectric_f0: if constant { k_s } else { Rgb::splat(f0_from_ior(f64::from(ior)) as f32) },
                dielectric_f90: if constant { k_s.element_sum() / 3.0 } else { 1.0 },
                ior,
                ..SpecularLayers::COVERING
            }
        } else {
            // The lecture's sum: what is reflected does not reduce k_d.
            SpecularLayers {
                covers_base: false,
                alpha: ggx_alpha,
                metallic: 1.0,
                metal_f0: k_s,
                metal_f90: if constant { k_s } else { Vec3::ONE },
                ..SpecularLayers::COVERING
            }
        };
        1.0
    }
}

impl Coefficients {
    /// A diffuse layer below microfacets. The rougher the microfacets, the more of F0 is diffuse.
    #[inline(always)]
    fn set_microfacets(&mut self, diffuse: Rgb, f0: Rgb, roughness: f32) {
        let roughness = roughness.clamp(MIN_HIGHLIGHT_ROUGHNESS, 1.0);
        let ggx_alpha = roughness * roughness;
        let p = 2.0 / (ggx_alpha * ggx_alpha) - 2.0;
        self.k_d = diffuse + f0 * (0.35 * ggx_alpha);
        self.k_s = f0 * ((1.0 - ggx_alpha) * (p + 2.0) / 8.0);
        self.shininess = p;
    }

    /// Leaves highlights to the layers.
    #[inline(always)]
    fn use_layer_highlights(&mut self) {
        self.layers.has_highlights = true;
        self.k_s = Rgb::ZERO;
        // The diffuse colour of the base, as if nothing covered it. Layers reflect the specular share of the ambient light.
        self.k_d = self.color * (1.0 - self.layers.metallic);
        self.k_a = self.k_d;
    }

    /// Moves light from the diffuse base to what the surface transmits.
    #[inline(always)]
    fn set_transmission(&mut self, weight: f32, color: Option<Rgb>) {
        let transmits = weight > 0.0;
        let scattered = if transmits { 1.0 - weight } else { 1.0 };
        self.k_d *= scattered;
        self.k_a *= scattered;
        let weight = if transmits { weight } else { 0.0 };
        let k_t = color.unwrap_or(self.color) * weight;
        self.k_t = if transmits { k_t } else { Rgb::ZERO };
        self.transmission_weight = weight;
    }
}

/// The GGX α whose lobe is as wide as that of exponent p: p = 2/α² − 2.
fn ggx_alpha_of_shininess(p: f32) -> f32 {
    (2.0 / (p + 2.0)).sqrt().min(1.0)
}
