//! What the lecture's k_a, k_d, k_s and p are at a surface point: from MTL literally, from physical
//! materials by a mapping.
//!
//! The mapping of metallic-roughness: α = clamp(roughness, .1, 1)², p = 2/α² − 2,
//! F0_d = the dielectric's reflectance at normal incidence, F0 = mix(F0_d, base, metallic),
//! k_d = base·(1 − metallic)·(1 − max F0_d) + .35·F0·α, k_s = F0·(1 − α)·(p + 2)/8,
//! k_a = base·occlusion. It was fitted to GGX on a lit sphere: see docs/decisions/0035-fit-metallic-roughness-to-blinn-phong.md.

use glam::{DVec3, Vec3, Vec4, Vec4Swizzles};

use crate::geometry::{Rgb, pow_one_minus};
use crate::integrator::surface::texture_eval::OnMesh;
use crate::scene::{
    AlphaMode, ColorInput, Dielectric, Material, MtlReflectance, PosedScene, Reflectance, ScalarInput,
    TexelSemantics, TextureChannel,
};

/// The lecture's coefficients at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Ambient.
    pub k_a: Rgb,
    /// Diffuse.
    pub k_d: Rgb,
    /// Specular.
    pub k_s: Rgb,
    /// Shininess p.
    pub shininess: f32,
    /// Emitted radiance.
    pub k_e: Rgb,
    /// The surface's own colour: base × texture × vertex colour (AOV `albedo`, integrator `color`).
    pub color: Rgb,
    /// Coverage: 1 opaque … 0 not there.
    pub alpha: f32,
    /// What passes through the covered part: transmission × (1 − metallic) × base colour.
    pub through: Rgb,
}

/// Coefficients given for every material at once, replacing the mapped and textured ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialOverrides {
    /// Replaces k_d.
    pub k_d: Option<Rgb>,
    /// Replaces k_s.
    pub k_s: Option<Rgb>,
    /// Replaces p.
    pub shininess: Option<f32>,
    /// Replaces k_e, and the colour of what is not lit.
    pub k_e: Option<Rgb>,
}

impl ColorInput {
    fn at(&self, posed: &PosedScene, on: &OnMesh) -> Rgb {
        self.factor * on.texture(posed, self.texture.as_ref(), TexelSemantics::Color).xyz()
    }
}

impl ScalarInput {
    fn at(&self, posed: &PosedScene, on: &OnMesh) -> f32 {
        self.factor * self.texel(posed, on)
    }

    /// The texture's channel alone; 1 without a texture.
    fn texel(&self, posed: &PosedScene, on: &OnMesh) -> f32 {
        let Some((texture, channel)) = &self.texture else { return 1.0 };
        let t = on.texture(posed, Some(texture), TexelSemantics::Data);
        match channel {
            TextureChannel::R => t.x,
            TextureChannel::G => t.y,
            TextureChannel::B => t.z,
            TextureChannel::A => t.w,
            TextureChannel::Mean => (t.x + t.y + t.z) / 3.0,
        }
    }
}

/// Opacity of a material at a place: 0 or 1 for MASK, 0…1 for BLEND. Masks are cut from the finest
/// texels: of means, a distant fence would be all there or all gone.
pub(crate) fn alpha(posed: &PosedScene, material: &Material, on: &OnMesh) -> f32 {
    let opacity = |on: &OnMesh| {
        let base = if material.alpha_from_base { material.base_color.texture.as_ref() } else { None };
        covering(posed, material, on, on.coverage(posed, base))
    };
    match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask(cutoff) => f32::from(opacity(&on.as_point()) >= cutoff),
        AlphaMode::Blend => opacity(on).clamp(0.0, 1.0),
    }
}

/// Opacity where the base colour's texture has `texel` of it: before what the mode makes of it.
fn covering(posed: &PosedScene, material: &Material, on: &OnMesh, texel: f32) -> f32 {
    material.alpha.at(posed, on) * on.color().w * texel
}

/// What passes through a material at a point, of each colour: past its alpha, and tinted through
/// what it transmits.
pub(crate) fn transmitted(posed: &PosedScene, material: &Material, on: &OnMesh) -> Rgb {
    let alpha = alpha(posed, material, on);
    let share = transmission(posed, material, on);
    let through = if share > 0.0 { share * base_color(posed, material, on) } else { Rgb::ZERO };
    Rgb::splat(1.0 - alpha) + through * alpha
}

/// How much of what a dielectric would scatter passes through instead: T, where it is no metal.
fn transmission(posed: &PosedScene, material: &Material, on: &OnMesh) -> f32 {
    if !material.transmits() {
        return 0.0;
    }
    let metallic = match &material.reflectance {
        Reflectance::MetallicRoughness { metallic, .. } => metallic.at(posed, on).clamp(0.0, 1.0),
        _ => 0.0,
    };
    material.transmission.at(posed, on).clamp(0.0, 1.0) * (1.0 - metallic)
}

/// Base × texture × vertex colour.
pub(crate) fn base_color(posed: &PosedScene, material: &Material, on: &OnMesh) -> Rgb {
    tinted(material, on, base_texel(posed, material, on))
}

/// What the base colour's texture has at a place.
fn base_texel(posed: &PosedScene, material: &Material, on: &OnMesh) -> Vec4 {
    on.texture(posed, material.base_color.texture.as_ref(), material.base_color_semantics())
}

fn tinted(material: &Material, on: &OnMesh, texel: Vec4) -> Rgb {
    material.base_color.factor * texel.xyz() * on.color().xyz()
}

impl Coefficients {
    /// The coefficients of a material at a place, as it and its textures say.
    fn at(posed: &PosedScene, material: &Material, on: &OnMesh, under_sky: bool) -> Coefficients {
        let texel = base_texel(posed, material, on);
        let alpha = match material.alpha_mode {
            // One look at the texture says both.
            AlphaMode::Blend if material.alpha_from_base => {
                covering(posed, material, on, texel.w).clamp(0.0, 1.0)
            }
            _ => alpha(posed, material, on),
        };
        let color = tinted(material, on, texel);
        let mut k = Coefficients {
            k_a: color,
            k_d: color,
            k_s: Rgb::ZERO,
            shininess: 1.0,
            k_e: material.emission.at(posed, on) * material.emission_strength,
            color,
            alpha,
            through: Rgb::ZERO,
        };
        match &material.reflectance {
            Reflectance::Mtl(mtl) => k.mtl(mtl, posed, on, under_sky),
            Reflectance::MetallicRoughness { metallic, roughness, dielectric } => {
                let metallic = metallic.at(posed, on).clamp(0.0, 1.0);
                let roughness = roughness.at(posed, on).clamp(0.0, 1.0);
                k.metallic_roughness(color, metallic, roughness, dielectric.f0(posed, on));
            }
            Reflectance::SpecularGlossiness { specular, glossiness } => {
                let f0 = specular.at(posed, on).clamp(Vec3::ZERO, Vec3::ONE);
                let roughness = 1.0 - glossiness.at(posed, on).clamp(0.0, 1.0);
                let diffuse = color * (1.0 - f0.max_element());
                // All that it reflects, as a metal's base colour is.
                k.k_a = diffuse + f0;
                k.microfacets(diffuse, f0, roughness);
            }
            Reflectance::Unlit => {
                (k.k_a, k.k_d, k.k_e) = (Rgb::ZERO, Rgb::ZERO, color);
            }
        }
        if material.occlusion.texture.is_some() {
            let texel = material.occlusion.texel(posed, on);
            k.k_a *= 1.0 + material.occlusion.factor * (texel - 1.0);
        }
        let t = transmission(posed, material, on);
        if t > 0.0 {
            k.k_d *= 1.0 - t;
            k.k_a *= 1.0 - t;
            k.through = color * t;
        }
        k
    }

    fn mtl(&mut self, mtl: &MtlReflectance, posed: &PosedScene, on: &OnMesh, under_sky: bool) {
        // Ka weighs the lecture's I_a. What a sky sends is light like any other, which matt surfaces
        // reflect by their diffuse colour.
        if let Some(ambient) = mtl.ambient.as_ref().filter(|_| !under_sky) {
            self.k_a = ambient.at(posed, on);
        }
        self.k_s = mtl.specular.at(posed, on);
        self.shininess = mtl.shininess;
    }

    fn metallic_roughness(&mut self, base: Rgb, metallic: f32, roughness: f32, f0_d: Rgb) {
        let diffuse = base * ((1.0 - metallic) * (1.0 - f0_d.max_element()));
        self.microfacets(diffuse, f0_d + (base - f0_d) * metallic, roughness);
    }

    /// A matt layer under microfacets, which scatter the more the rougher they are.
    fn microfacets(&mut self, diffuse: Rgb, f0: Rgb, roughness: f32) {
        let alpha = alpha_of(roughness);
        self.k_d = diffuse + f0 * (0.35 * alpha);
        (self.k_s, self.shininess) = highlight(f0, alpha);
    }
}

/// What points look like, one surface after the other. Where a material is the same all over, and so for the
/// next surface as for the last, it is computed once.
#[derive(Debug)]
pub(crate) struct Lookup<'a> {
    /// All looks so far; points name theirs by its index.
    looks: &'a mut Vec<Coefficients>,
    overrides: &'a MaterialOverrides,
    /// Whether ambient light comes from a sky.
    under_sky: bool,
    /// The last material that is the same all over.
    last: Option<(u32, Look)>,
}

/// What is known of a look beside its coefficients.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    /// Which it is.
    pub index: u32,
    /// The material's own exponent, whatever is given for all.
    pub shininess: f32,
}

/// How a highlight follows the normals that a sample sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gloss {
    widens: bool,
    /// The exponent that is given for all materials.
    given: Option<f32>,
    /// Whether k_s is.
    fixed: bool,
}

impl<'a> Lookup<'a> {
    pub fn new(
        looks: &'a mut Vec<Coefficients>,
        overrides: &'a MaterialOverrides,
        under_sky: bool,
    ) -> Lookup<'a> {
        Lookup { looks, overrides, under_sky, last: None }
    }

    /// The look of a material that nothing but itself says how it looks, `on` a mesh anywhere.
    pub fn plain(&mut self, posed: &PosedScene, material: u32, on: &OnMesh) -> Look {
        match self.last {
            Some((last, look)) if last == material => look,
            _ => {
                let look = self.at(posed, material, on);
                self.last = Some((material, look));
                look
            }
        }
    }

    /// The look of a material at a place.
    pub fn at(&mut self, posed: &PosedScene, material: u32, on: &OnMesh) -> Look {
        let material = &posed.materials[material as usize];
        let k = Coefficients::at(posed, material, on, self.under_sky);
        let shininess = k.shininess;
        Look { index: add_look(self.looks, k.with(self.overrides)), shininess }
    }

    /// How highlights of a material follow normals.
    pub fn gloss(&self, material: &Material) -> Gloss {
        let MaterialOverrides { k_s, shininess: given, .. } = *self.overrides;
        Gloss { widens: widens(material), given, fixed: k_s.is_some() }
    }

    /// The coefficients of a look, without what normals make of its highlight.
    #[inline(always)]
    pub fn k(&self, look: Look) -> &Coefficients {
        &self.looks[look.index as usize]
    }
}

/// Adds a look, and says which it is.
#[inline(always)]
pub(crate) fn add_look(looks: &mut Vec<Coefficients>, k: Coefficients) -> u32 {
    looks.push(k);
    (looks.len() - 1) as u32
}

impl Gloss {
    /// True where highlights are what the material says, whatever the normals.
    pub fn is_as_said(&self) -> bool {
        !self.widens && self.given.is_none()
    }

    /// The exponent for whoever sees normals spread over a surface with an exponent of its `own`, which adds
    /// `roughening` to α² ([`Surface::shading_normals`](crate::integrator::Surface::shading_normals)), and what k_s is multiplied
    /// by: the sum over those normals of lobes is, nearly, one lobe with a smaller exponent and as much light.
    #[inline(always)]
    pub fn at(&self, own: f32, roughening: f32) -> (f32, f32) {
        // Without branches, so that columns of them go at once.
        let alpha_2 = (2.0 / (own + 2.0) + roughening).min(1.0);
        let wide = 2.0 / alpha_2 - 2.0;
        let widens = self.widens & (roughening > 0.0);
        let p = if widens { wide } else { own };
        let factor = if widens & !self.fixed { (wide + 2.0) / (own + 2.0) } else { 1.0 };
        (self.given.unwrap_or(p), factor)
    }
}

impl Coefficients {
    /// The same where `overrides` say otherwise.
    fn with(mut self, overrides: &MaterialOverrides) -> Coefficients {
        self.k_d = overrides.k_d.unwrap_or(self.k_d);
        self.k_s = overrides.k_s.unwrap_or(self.k_s);
        self.shininess = overrides.shininess.unwrap_or(self.shininess);
        self.k_e = overrides.k_e.unwrap_or(self.k_e);
        self
    }
}

/// Whether highlights widen with the normals that a sample sees: the lecture's own p stays what the file says.
pub(crate) fn widens(material: &Material) -> bool {
    !matches!(material.reflectance, Reflectance::Mtl(_))
}

/// α of a perceptual roughness, kept above what point lights and f32 can show.
fn alpha_of(roughness: f32) -> f32 {
    let r = roughness.clamp(0.1, 1.0);
    r * r
}

/// k_s and p of a microfacet highlight.
fn highlight(f0: Rgb, alpha: f32) -> (Rgb, f32) {
    let p = 2.0 / (alpha * alpha) - 2.0;
    (f0 * ((1.0 - alpha) * (p + 2.0) / 8.0), p)
}

impl Dielectric {
    /// Reflectance at normal incidence: ((ior − 1)/(ior + 1))² × specular colour, at most 1, times
    /// the specular weight.
    fn f0(&self, posed: &PosedScene, on: &OnMesh) -> Rgb {
        let r = (self.ior - 1.0) / (self.ior + 1.0);
        let tinted = self.specular_color.at(posed, on) * (r * r);
        tinted.min(Vec3::ONE) * self.specular.at(posed, on)
    }
}

/// The lecture's specular lobe `max(0, n·h)^p` for unit vectors, h the bisector of v and l.
///
/// n·h loses its digits near 1, just where a narrow lobe needs them, so it comes from the sine: of a
/// vector h of any length, (n·h)² = 1 − |n × h|²/|h|². That takes no root either.
#[inline(always)]
pub fn lobe(n: DVec3, l: DVec3, v: DVec3, p: f32) -> f64 {
    let h = v + l;
    let h2 = h.length_squared();
    let sin2 = n.cross(h).length_squared() / h2;
    // Behind the surface the cosine is 0, and 0⁰ is 1.
    let below_one = if n.dot(h) > 0.0 { sin2.min(1.0) } else { 1.0 };
    let lobe = pow_one_minus(below_one, 0.5 * f64::from(p));
    if h2 > 0.0 { lobe } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lobe_is_the_cosine_to_the_power_p() {
        for p in [10.0f32, 100.0, 1000.0] {
            for step in 0..900 {
                // v and l mirror each other about a direction `angle` away from n, so h lies there.
                let angle = f64::from(step) * 0.1f64.to_radians();
                let expected = angle.cos().powf(f64::from(p));
                let n = DVec3::Z;
                let at = |a: f64| DVec3::new(a.sin(), 0.0, a.cos());
                let got = lobe(n, at(angle + 0.4), at(angle - 0.4), p);
                if expected > 1e-3 {
                    assert!((got / expected - 1.0).abs() < 1e-5, "p {p}, {step}/10 degrees");
                } else {
                    assert!(got < 1.1e-3);
                }
            }
        }
    }

    #[test]
    fn a_bisector_behind_the_surface_gives_nothing() {
        assert_eq!(lobe(DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Z, 10.0), 0.0);
        assert_eq!(lobe(DVec3::Z, DVec3::X, DVec3::NEG_X, 10.0), 0.0);
    }
}
