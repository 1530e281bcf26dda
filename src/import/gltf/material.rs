//! Materials: metallic-roughness, specular-glossiness and unlit, with their extensions.

use ::gltf::json as gltf;
use ::gltf::json::validation::Checked;
use glam::Vec3;

use super::texture_slots::TextureSlots;
use super::{anisotropy, clearcoat, diffuse_transmission, dispersion, iridescence, sheen};
use blinn_scene::{
    AlphaMode, Dielectric, Material, Reflectance, Reflection, ScalarInput, TextureChannel, Volume,
};

/// glTF's default material: white metal, fully rough.
pub(super) fn default() -> Material {
    let mut resolve = |_| None;
    read(&gltf::Material::default(), &mut resolve)
}

/// Reads a material. `resolve` maps a texture's index in the file to the scene's, or to `None` for white.
pub(super) fn read(json: &gltf::Material, resolve: &mut dyn FnMut(usize) -> Option<u32>) -> Material {
    let mut slots = TextureSlots::new(resolve);
    let pbr = &json.pbr_metallic_roughness;
    let extensions = json.extensions.as_ref();
    let others = extensions.map(|e| &e.others);
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
        normal: json.normal_texture.as_ref().and_then(|n| slots.normal(n)),
        occlusion: json.occlusion_texture.as_ref().map_or(ScalarInput::new(1.0), |o| slots.occlusion(o)),
        transmission: extensions.and_then(|e| e.transmission.as_ref()).map_or(ScalarInput::new(0.0), |t| {
            slots.scalar(t.transmission_factor.0, t.transmission_texture.as_ref(), TextureChannel::R)
        }),
        transmission_color: None,
        reflection: Reflection::Fresnel,
        clearcoat: clearcoat::read(others, &mut slots),
        anisotropy: anisotropy::read(others, &mut slots),
        sheen: sheen::read(others, &mut slots),
        iridescence: iridescence::read(others, &mut slots),
        diffuse_transmission: diffuse_transmission::read(others, &mut slots),
        dispersion: dispersion::read(others),
        volume: extensions.and_then(|e| e.volume.as_ref()).and_then(volume),
        thin_wall: false,
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
