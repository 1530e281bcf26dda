//! MTL statements to materials: literally where they are the lecture's, by the physical mapping
//! where they are a physical renderer's in disguise.

use glam::Vec3;

use super::super::error::Warnings;
use super::map::Map;
use super::mtl::Mtl;
use super::textures::Library;
use crate::geometry::Rgb;
use crate::import::files::escape::printable;
use crate::scene::{
    AlphaMode, ColorInput, Dielectric, Material, MtlReflectance, NormalMap, Reflectance, ScalarInput,
    TextureChannel, TextureRef,
};

/// What faces without a material get: matte white.
pub(super) fn default_material() -> Material {
    Material {
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Default::default()
    }
}

/// The scene's material for an MTL's.
pub(super) fn material(mtl: &Mtl, library: &mut Library, warnings: &mut Warnings) -> Material {
    let texture = library.color(mtl, mtl.map_kd.as_ref());
    let base = ColorInput { factor: mtl.beside(mtl.kd, &texture).unwrap_or(Rgb::ONE), texture };
    let texture = library.texture(mtl, mtl.map_ke.as_ref());
    let unsaid = if mtl.map_ke.is_some() { Rgb::ONE } else { Rgb::ZERO };
    let emission = ColorInput { factor: mtl.beside(mtl.ke, &texture).unwrap_or(unsaid), texture };
    let (mut alpha, alpha_mode) = alpha(mtl, library, warnings);
    // One picture with both: then colours that alpha hides have no say in their mean.
    let own = base.texture.as_ref().is_some_and(|base| alpha.texture == Some((*base, TextureChannel::A)));
    if own {
        alpha.texture = None;
    }
    let reflectance = if mtl.is_physical() { physical(mtl, library) } else { literal(mtl, library) };
    Material {
        name: mtl.name.clone(),
        base_color: base,
        alpha,
        alpha_from_base: own,
        alpha_mode,
        reflectance,
        emission,
        normal: normal(mtl, library, warnings),
        transmission: transmission(mtl, warnings),
        double_sided: true,
        ..Default::default()
    }
}

impl Mtl {
    /// Blender writes its roughness into Ns, and a Ks that means nothing.
    fn is_physical(&self) -> bool {
        let maps = self.map_roughness.is_some() || self.map_metallic.is_some();
        self.by_blender || self.roughness.is_some() || self.metallic.is_some() || maps
    }

    /// A factor, where it means something. Beside a map, Blender writes what an input without the map
    /// would be, and Maya and others 0, which times the map would be black.
    fn beside<T: Default + PartialEq>(&self, factor: Option<T>, map: &Option<TextureRef>) -> Option<T> {
        factor.filter(|factor| map.is_none() || !self.by_blender && *factor != T::default())
    }

    /// The roughness behind Ns by Blender's law, which was ((1 − r)·30)² once.
    fn roughness_of_ns(&self) -> Option<f32> {
        let most = if self.by_old_blender { 900.0 } else { 1000.0 };
        self.ns.map(|ns| 1.0 - (ns.clamp(0.0, most) / most).sqrt())
    }

    /// illum 2 where there is none.
    fn illum(&self) -> i64 {
        self.illum.unwrap_or(2)
    }
}

/// k_a = Ka, k_d = Kd, k_s = Ks, p = Ns, as far as `illum` lets them.
fn literal(mtl: &Mtl, library: &mut Library) -> Reflectance {
    if mtl.illum() == 0 {
        return Reflectance::Unlit;
    }
    // Ka 1 1 1 is what exporters write who mean nothing by it, and so is a map_Ka that repeats map_Kd.
    let own_map = mtl.map_ka.as_ref().filter(|map| Some(*map) != mtl.map_kd.as_ref());
    let own_factor = mtl.ka.filter(|&ka| ka != Rgb::ONE);
    let ambient = (own_map.is_some() || own_factor.is_some()).then(|| ColorInput {
        factor: mtl.ka.unwrap_or(Rgb::ONE),
        texture: library.texture(mtl, mtl.map_ka.as_ref()),
    });
    let shininess = mtl.ns.unwrap_or(0.0);
    // Ns 0 would paint the whole surface with Ks.
    let shiny = mtl.illum() >= 2 && shininess > 0.0;
    let ks = mtl.ks.unwrap_or(if mtl.map_ks.is_some() { Rgb::ONE } else { Rgb::ZERO });
    let specular = if shiny {
        ColorInput { factor: ks, texture: library.texture(mtl, mtl.map_ks.as_ref()) }
    } else {
        ColorInput::new(Vec3::ZERO)
    };
    Reflectance::Mtl(MtlReflectance { ambient, specular, shininess: shininess.max(0.0) })
}

/// Pr and Pm, or what Blender makes of them: Ns = 1000·(1 − r)², and Ka as the metallic value where
/// illum is 3.
fn physical(mtl: &Mtl, library: &mut Library) -> Reflectance {
    let by_ka = if mtl.by_blender && mtl.illum == Some(3) { mtl.ka.map(|ka| ka.x) } else { None };
    let mut scalar = |given: Option<f32>, map: &Option<Map>, missing: f32| {
        let texture = library.texture(mtl, map.as_ref());
        // A map alone counts as it is.
        let unsaid = if map.is_some() { 1.0 } else { missing };
        let factor = mtl.beside(given, &texture).unwrap_or(unsaid).clamp(0.0, 1.0);
        let channel = map.as_ref().and_then(|map| map.channel).unwrap_or(TextureChannel::Mean);
        ScalarInput { factor, texture: texture.map(|t| (t, channel)) }
    };
    Reflectance::MetallicRoughness {
        metallic: scalar(mtl.metallic.or(by_ka), &mtl.map_metallic, 0.0),
        roughness: scalar(mtl.roughness.or(mtl.roughness_of_ns()), &mtl.map_roughness, 0.5),
        dielectric: dielectric(mtl, library),
    }
}

/// Ni is the index of refraction; 1 is what other exporters write who have none. Blender writes its
/// specular level into Ks or map_Ks: .5 is what the index says, 0 is none.
fn dielectric(mtl: &Mtl, library: &mut Library) -> Dielectric {
    let default = Dielectric::default();
    let map = if mtl.by_blender { library.texture(mtl, mtl.map_ks.as_ref()) } else { None };
    let given = mtl.ks.filter(|_| mtl.by_blender);
    let level = if map.is_some() { 2.0 } else { given.map_or(1.0, |ks| 2.0 * ks.max_element()) };
    let meant = |&ni: &f32| ni <= 10.0 && (ni > 1.0 || mtl.by_blender && ni == 1.0);
    Dielectric {
        ior: mtl.ni.filter(meant).unwrap_or(default.ior),
        specular: ScalarInput { factor: level.min(1.0), texture: map.map(|t| (t, TextureChannel::Mean)) },
        specular_color: ColorInput::new(Vec3::splat(level.max(1.0))),
    }
}

/// The mean of Tf, as Blender has it: of physical materials alone, since others write 1 1 1 and
/// mean nothing by it.
fn transmission(mtl: &Mtl, warnings: &mut Warnings) -> ScalarInput {
    let Some(tf) = mtl.tf else { return ScalarInput::new(0.0) };
    if mtl.is_physical() {
        return ScalarInput::new(tf.element_sum().clamp(0.0, 3.0) / 3.0);
    }
    if tf != Rgb::ONE && tf != Rgb::ZERO {
        let name = printable(&mtl.name);
        warnings.add("", format!("material '{name}': its transmission filter Tf is not shown"));
    }
    ScalarInput::new(0.0)
}

fn alpha(mtl: &Mtl, library: &mut Library, warnings: &mut Warnings) -> (ScalarInput, AlphaMode) {
    let texture = mtl.map_d.as_ref().and_then(|map| {
        let image = library.image(mtl, map)?;
        let channel = match map.channel {
            Some(channel) => channel,
            None if library.has_alpha(image) => TextureChannel::A,
            None => TextureChannel::Mean,
        };
        Some((library.texture(mtl, Some(map))?, channel))
    });
    let mut factor = mtl.d.unwrap_or(1.0).clamp(0.0, 1.0);
    // Others mean the opposite; Blender says by illum that it means it. Beside a map 0 is what the map replaces,
    // as with other factors.
    let meant = mtl.by_blender && mtl.illum() > 2;
    if factor == 0.0 && (texture.is_some() || !meant) {
        if texture.is_none() {
            let what = "is wholly transparent by its d or Tr: taken as opaque";
            warnings.add("", format!("material '{}' {what}", printable(&mtl.name)));
        }
        factor = 1.0;
    }
    let blends = factor < 1.0 || texture.is_some();
    (ScalarInput { factor, texture }, if blends { AlphaMode::Blend } else { AlphaMode::Opaque })
}

fn normal(mtl: &Mtl, library: &mut Library, warnings: &mut Warnings) -> Option<NormalMap> {
    let map = mtl.map_normal.as_ref()?;
    let image = library.image(mtl, map)?;
    // Blender writes normal maps alone into bump; its older exporter's may have been heights.
    let certain = !mtl.normal_is_bump || mtl.by_blender && !mtl.by_old_blender;
    if !certain && !library.looks_like_normals(image) {
        warnings.add("", format!("bump map '{}' holds heights, which are not shown", printable(&map.file)));
        return None;
    }
    Some(NormalMap {
        texture: library.texture(mtl, Some(map))?,
        scale: map.bump,
        scale_is_strength: mtl.by_blender,
    })
}
