//! Maps MTL materials to scene materials: directly to the lecture's k_a, k_d, k_s and p, or to
//! metallic-roughness if the exporter wrote a physically based material.

use glam::Vec3;

use super::super::error::Warnings;
use super::mtl::MtlMaterial;
use super::mtl_writer::MtlWriter;
use super::texture_map::TextureMap;
use super::textures::TextureLibrary;
use crate::files::escape::printable;
use blinn_core::geometry::Rgb;
use blinn_scene::{
    AlphaMode, Anisotropy, AnisotropyModel, Clearcoat, ColorInput, Dielectric, Material, MtlReflectance,
    NormalMap, Reflectance, Reflection, ScalarInput, Sheen, SheenModel, TextureChannel, TextureRef,
};

/// Returns a material that no library defines: matte, and white unless its name is that of a colour.
pub(super) fn undefined_material(name: &str, color: Option<Rgb>) -> Material {
    Material {
        base_color: ColorInput::new(color.unwrap_or(Rgb::ONE)),
        name: name.to_string(),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Default::default()
    }
}

/// Builds the scene material of an MTL material.
pub(super) fn build_material(
    mtl: &MtlMaterial,
    library: &mut TextureLibrary,
    warnings: &mut Warnings,
) -> Material {
    let texture = library.color(mtl, mtl.map_kd.as_ref());
    let base = ColorInput { factor: mtl.factor_with_map(mtl.kd, &texture).unwrap_or(Rgb::ONE), texture };
    let texture = library.color(mtl, mtl.map_ke.as_ref());
    let default_emission = if mtl.map_ke.is_some() { Rgb::ONE } else { Rgb::ZERO };
    let emission =
        ColorInput { factor: mtl.factor_with_map(mtl.ke, &texture).unwrap_or(default_emission), texture };
    let (mut alpha, mut alpha_mode) = alpha(mtl, library, warnings);
    let transmission = transmission(mtl, &alpha, warnings);
    if transmission.replaces_alpha {
        (alpha, alpha_mode) = (ScalarInput::new(1.0), AlphaMode::Opaque);
    }
    // Colour and alpha in one image: texels of alpha 0 are left out when colours are averaged.
    let alpha_from_base =
        base.texture.as_ref().is_some_and(|base| alpha.texture == Some((*base, TextureChannel::A)));
    if alpha_from_base {
        alpha.texture = None;
    }
    let reflectance =
        if mtl.is_physical() { metallic_roughness(mtl, library) } else { blinn_phong(mtl, library) };
    Material {
        name: mtl.name.clone(),
        base_color: base,
        alpha,
        alpha_from_base,
        alpha_mode,
        reflectance,
        emission,
        normal: normal(mtl, library),
        transmission: ScalarInput::new(transmission.share),
        transmission_color: transmission.color,
        reflection: reflection(mtl, transmission.share > 0.0),
        clearcoat: mtl.clearcoat(library),
        anisotropy: mtl.anisotropy(),
        sheen: mtl.sheen(library),
        double_sided: true,
        ..Default::default()
    }
}

impl MtlMaterial {
    /// Returns true for a physically based material. Blender always writes one: its Ns encodes the roughness.
    fn is_physical(&self) -> bool {
        let maps = self.map_roughness.is_some() || self.map_metallic.is_some();
        self.writer.is_blender()
            || self.roughness.is_some()
            || self.metallic.is_some()
            || maps
            || self.coat_share() > 0.0
            || self.sheen_weight() > 0.0
            || self.anisotropy().is_some()
    }

    /// Returns true for a material with a clear coat or a sheen, which reflect whatever `illum` says.
    fn has_layers(&self) -> bool {
        self.coat_share() > 0.0 || self.sheen_weight() > 0.0
    }

    /// Returns the share of the surface under a clear coat. Pc is the clearcoat of Disney's BRDF, a quarter of which is
    /// the weight of a dielectric layer (Burley, “Physically Based Shading at Disney”, 2012), as Blender reads and writes it.
    fn coat_share(&self) -> f32 {
        // A map without a value, or with 0 as Maya writes it, is used as it is.
        let with_map = self.map_coat.as_ref().map(|_| 4.0);
        let coat = self.coat.filter(|&coat| coat > 0.0 || with_map.is_none());
        (0.25 * coat.or(with_map).unwrap_or(0.0)).clamp(0.0, 1.0)
    }

    /// The clear coat; smooth without Pcr.
    fn clearcoat(&self, library: &mut TextureLibrary) -> Clearcoat {
        let roughness = self.coat_roughness.or(self.map_coat_roughness.as_ref().map(|_| 1.0)).unwrap_or(0.0);
        Clearcoat {
            factor: self.scalar(self.coat_share(), self.map_coat.as_ref(), library),
            roughness: self.scalar(roughness.clamp(0.0, 1.0), self.map_coat_roughness.as_ref(), library),
            normal: None,
        }
    }

    /// A factor times a channel of a map: the mean unless it chooses another.
    fn scalar(&self, factor: f32, map: Option<&TextureMap>, library: &mut TextureLibrary) -> ScalarInput {
        let channel = map.and_then(|map| map.channel).unwrap_or(TextureChannel::Mean);
        ScalarInput { factor, texture: library.texture(self, map).map(|texture| (texture, channel)) }
    }

    /// Returns the weight of the sheen.
    fn sheen_weight(&self) -> f32 {
        let with_map = self.map_sheen.as_ref().map(|_| 1.0);
        let weight = self.sheen.filter(|&weight| weight > 0.0 || with_map.is_none());
        weight.or(with_map).unwrap_or(0.0).clamp(0.0, 1.0)
    }

    /// The sheen: white, with the roughness of Blender's default.
    fn sheen(&self, library: &mut TextureLibrary) -> Sheen {
        let weight = self.sheen_weight();
        if weight == 0.0 {
            return Sheen::default();
        }
        let texture = library.scalar_as_color(self, self.map_sheen.as_ref());
        Sheen {
            color: ColorInput { factor: Rgb::splat(weight), texture },
            roughness: ScalarInput::new(0.5),
            model: if self.writer.is_blender() { SheenModel::Microfibres } else { SheenModel::Charlie },
        }
    }

    /// The anisotropy; `None` without strength.
    fn anisotropy(&self) -> Option<Anisotropy> {
        let strength = self.anisotropy.filter(|&strength| strength > 0.0)?.min(1.0);
        let rotation = self.anisotropy_rotation.unwrap_or(0.0) * std::f32::consts::TAU;
        let is_blender = self.writer.is_blender();
        let model = if is_blender { AnisotropyModel::Principled } else { AnisotropyModel::Gltf };
        Some(Anisotropy { strength, rotation, texture: None, model })
    }

    /// Returns a factor unless it has to be ignored next to a map: Blender then writes the value of the unconnected
    /// input, Maya and others 0, which would make the map black.
    fn factor_with_map<T: Default + PartialEq>(
        &self,
        factor: Option<T>,
        map: &Option<TextureRef>,
    ) -> Option<T> {
        factor.filter(|factor| map.is_none() || !self.writer.is_blender() && *factor != T::default())
    }

    /// Inverts Blender's Ns = 1000·(1 − r)², or ((1 − r)·30)² of its old exporter.
    fn roughness_of_ns(&self) -> Option<f32> {
        let max = if self.writer == MtlWriter::OldBlender { 900.0 } else { 1000.0 };
        self.ns.map(|ns| 1.0 - (ns.clamp(0.0, max) / max).sqrt())
    }

    /// Returns the illumination model; 2 if it is missing.
    fn illum(&self) -> i64 {
        self.illum.unwrap_or(2)
    }
}

/// Uses k_a = Ka, k_d = Kd, k_s = Ks, p = Ns, as far as `illum` enables them.
fn blinn_phong(mtl: &MtlMaterial, library: &mut TextureLibrary) -> Reflectance {
    if mtl.illum() == 0 {
        return Reflectance::Unlit;
    }
    // Ka 1 1 1, and a map_Ka equal to map_Kd, are defaults of exporters and carry no information.
    let own_map = mtl.map_ka.as_ref().filter(|map| Some(*map) != mtl.map_kd.as_ref());
    let own_factor = mtl.ka.filter(|&ka| ka != Rgb::ONE);
    let ambient = (own_map.is_some() || own_factor.is_some()).then(|| ColorInput {
        factor: mtl.ka.unwrap_or(Rgb::ONE),
        texture: library.texture(mtl, mtl.map_ka.as_ref()),
    });
    let shininess = mtl.ns.unwrap_or(0.0);
    // With Ns 0 the highlight would cover the whole surface.
    let shiny = mtl.illum() >= 2 && shininess > 0.0;
    let ks = mtl.ks.unwrap_or(if mtl.map_ks.is_some() { Rgb::ONE } else { Rgb::ZERO });
    let specular = if shiny {
        ColorInput { factor: ks, texture: library.texture(mtl, mtl.map_ks.as_ref()) }
    } else {
        ColorInput::new(Vec3::ZERO)
    };
    Reflectance::Mtl(MtlReflectance {
        ambient,
        specular,
        shininess: shininess.max(0.0),
        ior: ior(mtl).unwrap_or(0.0),
    })
}

/// Uses Pr and Pm, or Blender's encoding without them: Ns = 1000·(1 − r)², and the metallic value in Ka if illum
/// is 3.
fn metallic_roughness(mtl: &MtlMaterial, library: &mut TextureLibrary) -> Reflectance {
    let metallic_from_ka =
        if mtl.writer.is_blender() && mtl.illum == Some(3) { mtl.ka.map(|ka| ka.x) } else { None };
    let mut scalar = |value: Option<f32>, map: &Option<TextureMap>, default: f32| {
        let texture = library.texture(mtl, map.as_ref());
        // A map without a value is used as it is.
        let default = if map.is_some() { 1.0 } else { default };
        let factor = mtl.factor_with_map(value, &texture).unwrap_or(default).clamp(0.0, 1.0);
        let channel = map.as_ref().and_then(|map| map.channel).unwrap_or(TextureChannel::Mean);
        ScalarInput { factor, texture: texture.map(|t| (t, channel)) }
    };
    Reflectance::MetallicRoughness {
        metallic: scalar(mtl.metallic.or(metallic_from_ka), &mtl.map_metallic, 0.0),
        roughness: scalar(mtl.roughness.or(mtl.roughness_of_ns()), &mtl.map_roughness, 0.5),
        dielectric: dielectric(mtl, library),
    }
}

/// Reads the index of refraction from Ni. Blender writes
/// its specular level into Ks or map_Ks: 0.5 is the reflectance of the index, 0 is none.
fn dielectric(mtl: &MtlMaterial, library: &mut TextureLibrary) -> Dielectric {
    let default = Dielectric::default();
    let map = if mtl.writer.is_blender() { library.texture(mtl, mtl.map_ks.as_ref()) } else { None };
    let blender_level = mtl.ks.filter(|_| mtl.writer.is_blender());
    let level = if map.is_some() { 2.0 } else { blender_level.map_or(1.0, |ks| 2.0 * ks.max_element()) };
    Dielectric {
        ior: ior(mtl).unwrap_or(default.ior),
        specular: ScalarInput { factor: level.min(1.0), texture: map.map(|t| (t, TextureChannel::Mean)) },
        specular_color: ColorInput::new(Vec3::splat(level.max(1.0))),
    }
}

/// Returns how `illum` reflects the surroundings. From 3 on, it stands for ray-traced reflection; 5 and 7 add Fresnel's
/// equations, and so does glass, 4. Physically based glass refracts, and a clear coat reflects, whatever `illum` says: Blender
/// writes 2.
fn reflection(mtl: &MtlMaterial, is_glass: bool) -> Reflection {
    match mtl.illum() {
        _ if mtl.is_physical() && (is_glass || mtl.has_layers()) => Reflection::Fresnel,
        ..=2 => Reflection::None,
        5 | 7 => Reflection::Fresnel,
        4 if is_glass => Reflection::Fresnel,
        _ if mtl.is_physical() => Reflection::Fresnel,
        3..=9 => Reflection::Constant,
        _ => Reflection::None,
    }
}

/// The light that passes through a surface.
struct Transmission {
    share: f32,
    /// `None` is the base colour.
    color: Option<Rgb>,
    /// True if d described the same transparency.
    replaces_alpha: bool,
}

/// Returns the transmission of a material: of physically based ones the mean of Tf, as Blender does; of others what `illum`
/// 4 (glass), 6 and 7 (refraction) say. Exporters write illum 4 with Tf 1 1 1 for opaque materials, so that glass of
/// illum 4 is as transparent as its d; materials that refract are fully so, unless d or Tf reduce it.
fn transmission(mtl: &MtlMaterial, alpha: &ScalarInput, warnings: &mut Warnings) -> Transmission {
    const NONE: Transmission = Transmission { share: 0.0, color: None, replaces_alpha: false };
    if mtl.is_physical() {
        let share = mtl.tf.map_or(0.0, |tf| tf.element_sum().clamp(0.0, 3.0) / 3.0);
        return Transmission { share, ..NONE };
    }
    // 0 0 0 is a default of exporters.
    let filter = mtl.tf.filter(|&tf| tf != Rgb::ZERO).map(|tf| tf.min(Rgb::ONE));
    let transparency = 1.0 - alpha.factor;
    let (share, color) = match mtl.illum() {
        // A map of opacity leaves holes in the glass.
        4 | 6 | 7 if alpha.texture.is_some() => (0.0, Rgb::ONE),
        4 => (transparency, filter.unwrap_or(Rgb::ONE)),
        6 | 7 => match filter {
            // d repeats the brightness of a grey filter.
            Some(filter) => (1.0, filter),
            None if transparency > 0.0 => (transparency, Rgb::ONE),
            None => (1.0, Rgb::ONE),
        },
        _ => {
            if filter.is_some_and(|filter| filter != Rgb::ONE) {
                let name = printable(&mtl.name);
                let message = "ignored the transmission filter Tf, which needs illum 4, 6 or 7";
                warnings.add("", format!("material '{name}': {message}"));
            }
            return NONE;
        }
    };
    if share > 0.0 { Transmission { share, color: Some(color), replaces_alpha: true } } else { NONE }
}

/// Returns a plausible index of refraction; exporters other than Blender write 1 for an unknown one.
fn ior(mtl: &MtlMaterial) -> Option<f32> {
    mtl.ni.filter(|&ni| ni <= 10.0 && (ni > 1.0 || mtl.writer.is_blender() && ni == 1.0))
}

/// Returns the opacity of d, Tr and map_d, and how to apply it.
fn alpha(
    mtl: &MtlMaterial,
    library: &mut TextureLibrary,
    warnings: &mut Warnings,
) -> (ScalarInput, AlphaMode) {
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
    // Some exporters write the transparency instead. Blender writes illum > 2 for a transparent material. Next to a
    // map, 0 is the unconnected input, as with other factors.
    let is_transparent = mtl.writer.is_blender() && mtl.illum() > 2;
    if factor == 0.0 && (texture.is_some() || !is_transparent) {
        if texture.is_none() {
            let name = printable(&mtl.name);
            warnings.add(
                "",
                format!("material '{name}': d or Tr make it fully transparent: used opaque instead"),
            );
        }
        factor = 1.0;
    }
    let is_blended = factor < 1.0 || texture.is_some();
    (ScalarInput { factor, texture }, if is_blended { AlphaMode::Blend } else { AlphaMode::Opaque })
}

/// Returns the normal map, or that of a bump map of heights.
fn normal(mtl: &MtlMaterial, library: &mut TextureLibrary) -> Option<NormalMap> {
    let map = mtl.map_normal.as_ref()?;
    let image = library.image(mtl, map)?;
    // Blender writes only normal maps into bump; its old exporter also wrote heights.
    let is_normal_map = !mtl.normal_is_bump || mtl.writer.is_blender() && mtl.writer != MtlWriter::OldBlender;
    if !is_normal_map && !library.looks_like_normals(image) {
        let texture = library.normals_of_heights(mtl, map)?;
        return Some(NormalMap { texture, scale: map.bump, scale_is_strength: false });
    }
    Some(NormalMap {
        texture: library.texture(mtl, Some(map))?,
        scale: map.bump,
        scale_is_strength: mtl.writer.is_blender(),
    })
}
