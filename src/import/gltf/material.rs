//! Materials: metallic-roughness, specular-glossiness and unlit, with their extensions.

use ::gltf::json as gltf;
use ::gltf::json::extensions::texture::TextureTransform;
use ::gltf::json::validation::Checked;
use glam::Vec3;
use serde_json::{Map, Value};

use blinn_scene::{
    AlphaMode, Clearcoat, ColorInput, Dielectric, Material, NormalMap, Reflectance, Reflection, ScalarInput,
    TextureChannel, TextureRef, UvTransform, Volume,
};

/// glTF's default material: white metal, fully rough.
pub(super) fn default() -> Material {
    let mut resolve = |_| None;
    read(&gltf::Material::default(), &mut resolve)
}

/// Reads a material. `resolve` maps a texture's index in the file to the scene's, or to `None` for white.
pub(super) fn read(json: &gltf::Material, resolve: &mut dyn FnMut(usize) -> Option<u32>) -> Material {
    let mut slots = TextureSlots { resolve };
    let pbr = &json.pbr_metallic_roughness;
    let extensions = json.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref());
    let mut material = Material {
        name: json.name.clone().unwrap_or_default(),
        base_color: slots.color(rgb(pbr.base_color_factor.0), pbr.base_color_texture.as_ref()),
        alpha: ScalarInput::new(pbr.base_color_factor.0[3]),
        alpha_from_base: true,
        alpha_mode: match json.alpha_mode {
            Checked::Valid(gltf::material::AlphaMode::Mask) => {
                AlphaMode::Mask(json.alpha_cutoff.map_or(0.5, |c| c.0))
            }
            Checked::Valid(gltf::material::AlphaMode::Blend) => AlphaMode::Blend,
            Checked::Valid(gltf::material::AlphaMode::Opaque) | Checked::Invalid => AlphaMode::Opaque,
        },
        reflectance: Reflectance::MetallicRoughness {
            metallic: slots.scalar(
                pbr.metallic_factor.0,
                pbr.metallic_roughness_texture.as_ref(),
                TextureChannel::B,
            ),
            roughness: slots.scalar(
                pbr.roughness_factor.0,
                pbr.metallic_roughness_texture.as_ref(),
                TextureChannel::G,
            ),
            dielectric: dielectric(extensions, &mut slots),
        },
        emission: slots.color(Vec3::from(json.emissive_factor.0), json.emissive_texture.as_ref()),
        emission_strength: strength.map_or(1.0, |s| s.emissive_strength.0),
        normal: json.normal_texture.as_ref().and_then(|n| {
            let transform = n.extensions.as_ref().and_then(|e| untyped_transform(&e.others));
            let texture = slots.texture(n.index.value(), n.tex_coord, transform.as_ref())?;
            Some(NormalMap { texture, scale: n.scale, scale_is_strength: false })
        }),
        occlusion: json.occlusion_texture.as_ref().map_or(ScalarInput::new(1.0), |o| {
            let transform = o.extensions.as_ref().and_then(|e| untyped_transform(&e.others));
            let texture = slots.texture(o.index.value(), o.tex_coord, transform.as_ref());
            ScalarInput { factor: o.strength.0, texture: texture.map(|t| (t, TextureChannel::R)) }
        }),
        transmission: extensions.and_then(|e| e.transmission.as_ref()).map_or(ScalarInput::new(0.0), |t| {
            slots.scalar(t.transmission_factor.0, t.transmission_texture.as_ref(), TextureChannel::R)
        }),
        transmission_color: None,
        reflection: Reflection::Fresnel,
        clearcoat: clearcoat(extensions, &mut slots),
        volume: extensions.and_then(|e| e.volume.as_ref()).and_then(volume),
        double_sided: json.double_sided,
    };
    if let Some(glossy) = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref()) {
        material.base_color = slots.color(rgb(glossy.diffuse_factor.0), glossy.diffuse_texture.as_ref());
        let mut alpha = glossy.diffuse_factor.0[3];
        // Assimp writes the opacity of what is blended into the base colour alone.
        if alpha == 1.0 && glossy.diffuse_texture.is_none() && material.alpha_mode == AlphaMode::Blend {
            alpha = material.alpha.factor;
        }
        material.alpha = ScalarInput::new(alpha);
        let texture = glossy.specular_glossiness_texture.as_ref();
        material.reflectance = Reflectance::SpecularGlossiness {
            specular: slots.color(Vec3::from(glossy.specular_factor.0), texture),
            glossiness: slots.scalar(glossy.glossiness_factor.0, texture, TextureChannel::A),
        };
    }
    if extensions.is_some_and(|e| e.unlit.is_some()) {
        material.reflectance = Reflectance::Unlit;
    }
    material
}

fn dielectric(
    extensions: Option<&gltf::extensions::material::Material>,
    slots: &mut TextureSlots<'_>,
) -> Dielectric {
    let mut out = Dielectric::default();
    let Some(extensions) = extensions else { return out };
    if let Some(ior) = &extensions.ior {
        out.ior = ior.ior.0;
    }
    if let Some(s) = &extensions.specular {
        out.specular = slots.scalar(s.specular_factor.0, s.specular_texture.as_ref(), TextureChannel::A);
        out.specular_color =
            slots.color(Vec3::from(s.specular_color_factor.0), s.specular_color_texture.as_ref());
    }
    out
}

fn clearcoat(
    extensions: Option<&gltf::extensions::material::Material>,
    slots: &mut TextureSlots<'_>,
) -> Clearcoat {
    let Some(extensions) = extensions else { return Clearcoat::default() };
    let coat = super::clearcoat::read(&extensions.others);
    Clearcoat {
        factor: slots.scalar(coat.clearcoat_factor, coat.clearcoat_texture.as_ref(), TextureChannel::R),
        roughness: slots.scalar(
            coat.clearcoat_roughness_factor,
            coat.clearcoat_roughness_texture.as_ref(),
            TextureChannel::G,
        ),
    }
}

/// Returns the body that a material bounds; `None` for the infinitely thin wall of a thickness of 0. Only the thickness
/// factor matters: rays measure the true distance.
fn volume(json: &gltf::extensions::material::Volume) -> Option<Volume> {
    let distance = json.attenuation_distance.0;
    (json.thickness_factor.0 > 0.0).then(|| Volume {
        thickness: json.thickness_factor.0,
        attenuation_color: Vec3::from(json.attenuation_color.0).clamp(Vec3::ZERO, Vec3::ONE),
        attenuation_distance: if distance > 0.0 { distance } else { f32::INFINITY },
    })
}

fn rgb([r, g, b, _]: [f32; 4]) -> Vec3 {
    Vec3::new(r, g, b)
}

/// Reads the texture infos of a material.
struct TextureSlots<'f> {
    resolve: &'f mut dyn FnMut(usize) -> Option<u32>,
}

impl TextureSlots<'_> {
    fn color(&mut self, factor: Vec3, info: Option<&gltf::texture::Info>) -> ColorInput {
        ColorInput { factor, texture: self.info(info) }
    }

    fn scalar(
        &mut self,
        factor: f32,
        info: Option<&gltf::texture::Info>,
        channel: TextureChannel,
    ) -> ScalarInput {
        ScalarInput { factor, texture: self.info(info).map(|t| (t, channel)) }
    }

    fn info(&mut self, info: Option<&gltf::texture::Info>) -> Option<TextureRef> {
        let info = info?;
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.texture(info.index.value(), info.tex_coord, transform)
    }

    fn texture(
        &mut self,
        index: usize,
        uv_set: u32,
        transform: Option<&TextureTransform>,
    ) -> Option<TextureRef> {
        let texture = (self.resolve)(index)?;
        let matrix =
            |t: &TextureTransform| UvTransform::khr(t.offset.0.into(), t.rotation.0, t.scale.0.into());
        Some(TextureRef {
            texture,
            uv_set: transform.and_then(|t| t.tex_coord).unwrap_or(uv_set),
            transform: transform.map_or(UvTransform::IDENTITY, matrix),
        })
    }
}

/// KHR_texture_transform of a texture info whose extensions are untyped in `gltf::json`.
fn untyped_transform(others: &Map<String, Value>) -> Option<TextureTransform> {
    serde_json::from_value(others.get("KHR_texture_transform")?.clone()).ok()
}
