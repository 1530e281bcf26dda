//! KHR_animation_pointer: the property that a JSON pointer animates.

use super::{
    anisotropy, area_light, clearcoat, diffuse_transmission, dispersion, image_based_light, iridescence,
    photometric_light, sheen,
};
use blinn_scene::{CameraProperty, EnvironmentProperty, LightProperty, MaterialProperty, TextureSlot};

/// An animated property, by the indices of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PointerTarget {
    /// KHR_node_visibility of a node.
    Visibility(usize),
    /// One morph weight of a node.
    Weight(usize, u32),
    /// The default morph weights of a mesh.
    MeshWeights(usize),
    /// One default morph weight of a mesh.
    MeshWeight(usize, u32),
    Material(usize, MaterialProperty),
    Light(usize, LightProperty),
    AreaLight(usize, LightProperty),
    /// The photometric light of a node.
    PhotometricLight(usize, LightProperty),
    Camera(usize, CameraProperty),
    /// A light of EXT_lights_image_based.
    Environment(usize, EnvironmentProperty),
}

/// Parses a pointer; `None` for properties that are not supported. Pointers to a node's transform and weights
/// have already become core channels.
pub(super) fn parse(pointer: &str) -> Option<PointerTarget> {
    let parts: Vec<&str> = pointer.strip_prefix('/')?.split('/').collect();
    Some(match *parts.as_slice() {
        ["nodes", i, "extensions", "KHR_node_visibility", "visible"] => PointerTarget::Visibility(index(i)?),
        ["nodes", i, "weights", k] => PointerTarget::Weight(index(i)?, k.parse().ok()?),
        ["meshes", i, "weights"] => PointerTarget::MeshWeights(index(i)?),
        ["meshes", i, "weights", k] => PointerTarget::MeshWeight(index(i)?, k.parse().ok()?),
        ["materials", i, ref field @ ..] => PointerTarget::Material(index(i)?, material(field)?),
        ["extensions", "KHR_lights_punctual", "lights", i, ref field @ ..] => {
            PointerTarget::Light(index(i)?, light(field)?)
        }
        ["nodes", i, "extensions", photometric_light::NAME, field] => {
            PointerTarget::PhotometricLight(index(i)?, photometric_light(field)?)
        }
        ["extensions", area_light::NAME, "lights", i, field] => {
            PointerTarget::AreaLight(index(i)?, area_light(field)?)
        }
        ["extensions", image_based_light::NAME, "lights", i, field] => {
            PointerTarget::Environment(index(i)?, environment(field)?)
        }
        ["cameras", i, kind @ ("perspective" | "orthographic"), field] => {
            PointerTarget::Camera(index(i)?, camera(kind, field)?)
        }
        _ => return None,
    })
}

fn index(text: &str) -> Option<usize> {
    text.parse().ok()
}

const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

fn material(field: &[&str]) -> Option<MaterialProperty> {
    use MaterialProperty as F;
    Some(match *field {
        ["pbrMetallicRoughness", "baseColorFactor"] => F::Base,
        ["pbrMetallicRoughness", "metallicFactor"] => F::Metallic,
        ["pbrMetallicRoughness", "roughnessFactor"] => F::Roughness,
        ["alphaCutoff"] => F::AlphaCutoff,
        ["emissiveFactor"] => F::Emission,
        ["normalTexture", "scale"] => F::NormalScale,
        ["occlusionTexture", "strength"] => F::OcclusionStrength,
        ["extensions", "KHR_materials_emissive_strength", "emissiveStrength"] => F::EmissionStrength,
        ["extensions", "KHR_materials_ior", "ior"] => F::Ior,
        ["extensions", "KHR_materials_specular", "specularFactor"] => F::Specular,
        ["extensions", "KHR_materials_specular", "specularColorFactor"] => F::SpecularColor,
        ["extensions", "KHR_materials_transmission", "transmissionFactor"] => F::Transmission,
        ["extensions", clearcoat::NAME, "clearcoatFactor"] => F::Clearcoat,
        ["extensions", clearcoat::NAME, "clearcoatRoughnessFactor"] => F::ClearcoatRoughness,
        ["extensions", anisotropy::NAME, "anisotropyStrength"] => F::AnisotropyStrength,
        ["extensions", anisotropy::NAME, "anisotropyRotation"] => F::AnisotropyRotation,
        ["extensions", sheen::NAME, "sheenColorFactor"] => F::SheenColor,
        ["extensions", sheen::NAME, "sheenRoughnessFactor"] => F::SheenRoughness,
        ["extensions", dispersion::NAME, "dispersion"] => F::Dispersion,
        ["extensions", diffuse_transmission::NAME, "diffuseTransmissionFactor"] => F::DiffuseTransmission,
        ["extensions", diffuse_transmission::NAME, "diffuseTransmissionColorFactor"] => {
            F::DiffuseTransmissionColor
        }
        ["extensions", iridescence::NAME, "iridescenceFactor"] => F::Iridescence,
        ["extensions", iridescence::NAME, "iridescenceIor"] => F::IridescenceIor,
        ["extensions", iridescence::NAME, "iridescenceThicknessMinimum"] => F::IridescenceMinThickness,
        ["extensions", iridescence::NAME, "iridescenceThicknessMaximum"] => F::IridescenceMaxThickness,
        ["extensions", clearcoat::NAME, "clearcoatNormalTexture", "scale"] => F::ClearcoatNormalScale,
        ["extensions", "KHR_materials_volume", "thicknessFactor"] => F::Thickness,
        ["extensions", "KHR_materials_volume", "attenuationColor"] => F::AttenuationColor,
        ["extensions", "KHR_materials_volume", "attenuationDistance"] => F::AttenuationDistance,
        ["extensions", SPECULAR_GLOSSINESS, "diffuseFactor"] => F::Diffuse,
        ["extensions", SPECULAR_GLOSSINESS, "specularFactor"] => F::SpecularF0,
        ["extensions", SPECULAR_GLOSSINESS, "glossinessFactor"] => F::Glossiness,
        [ref slot @ .., "extensions", "KHR_texture_transform", part] => {
            let slot = self::slot(slot)?;
            match part {
                "offset" => F::Offset(slot),
                "rotation" => F::Rotation(slot),
                "scale" => F::Scale(slot),
                _ => return None,
            }
        }
        _ => return None,
    })
}

fn slot(path: &[&str]) -> Option<TextureSlot> {
    Some(match *path {
        ["pbrMetallicRoughness", "baseColorTexture"] => TextureSlot::Base,
        ["pbrMetallicRoughness", "metallicRoughnessTexture"] => TextureSlot::MetallicRoughness,
        ["normalTexture"] => TextureSlot::Normal,
        ["occlusionTexture"] => TextureSlot::Occlusion,
        ["emissiveTexture"] => TextureSlot::Emission,
        ["extensions", "KHR_materials_specular", "specularTexture"] => TextureSlot::Specular,
        ["extensions", "KHR_materials_specular", "specularColorTexture"] => TextureSlot::SpecularColor,
        ["extensions", "KHR_materials_transmission", "transmissionTexture"] => TextureSlot::Transmission,
        ["extensions", clearcoat::NAME, "clearcoatTexture"] => TextureSlot::Clearcoat,
        ["extensions", clearcoat::NAME, "clearcoatRoughnessTexture"] => TextureSlot::ClearcoatRoughness,
        ["extensions", anisotropy::NAME, "anisotropyTexture"] => TextureSlot::Anisotropy,
        ["extensions", sheen::NAME, "sheenColorTexture"] => TextureSlot::SheenColor,
        ["extensions", sheen::NAME, "sheenRoughnessTexture"] => TextureSlot::SheenRoughness,
        ["extensions", diffuse_transmission::NAME, "diffuseTransmissionTexture"] => {
            TextureSlot::DiffuseTransmission
        }
        ["extensions", diffuse_transmission::NAME, "diffuseTransmissionColorTexture"] => {
            TextureSlot::DiffuseTransmissionColor
        }
        ["extensions", iridescence::NAME, "iridescenceTexture"] => TextureSlot::Iridescence,
        ["extensions", iridescence::NAME, "iridescenceThicknessTexture"] => TextureSlot::IridescenceThickness,
        ["extensions", "KHR_materials_volume", "thicknessTexture"] => TextureSlot::Thickness,
        ["extensions", clearcoat::NAME, "clearcoatNormalTexture"] => TextureSlot::ClearcoatNormal,
        ["extensions", SPECULAR_GLOSSINESS, "diffuseTexture"] => TextureSlot::Diffuse,
        ["extensions", SPECULAR_GLOSSINESS, "specularGlossinessTexture"] => TextureSlot::SpecularGlossiness,
        _ => return None,
    })
}

fn light(field: &[&str]) -> Option<LightProperty> {
    Some(match *field {
        ["color"] => LightProperty::Color,
        ["intensity"] => LightProperty::Intensity,
        ["range"] => LightProperty::Range,
        // Blender's exporter joins the last two names with a dot.
        ["spot", "innerConeAngle"] | ["spot.innerConeAngle"] => LightProperty::InnerCone,
        ["spot", "outerConeAngle"] | ["spot.outerConeAngle"] => LightProperty::OuterCone,
        _ => return None,
    })
}

fn area_light(field: &str) -> Option<LightProperty> {
    Some(match field {
        "color" => LightProperty::Color,
        "intensity" => LightProperty::Intensity,
        _ => return None,
    })
}

fn photometric_light(field: &str) -> Option<LightProperty> {
    Some(match field {
        "color" => LightProperty::Color,
        "multiplier" => LightProperty::Intensity,
        _ => return None,
    })
}

fn environment(field: &str) -> Option<EnvironmentProperty> {
    Some(match field {
        "intensity" => EnvironmentProperty::Intensity,
        "rotation" => EnvironmentProperty::Rotation,
        _ => return None,
    })
}

fn camera(kind: &str, field: &str) -> Option<CameraProperty> {
    Some(match (kind, field) {
        ("perspective", "yfov") => CameraProperty::Yfov,
        ("perspective", "aspectRatio") => CameraProperty::Aspect,
        ("orthographic", "xmag") => CameraProperty::Xmag,
        ("orthographic", "ymag") => CameraProperty::Ymag,
        (_, "znear") => CameraProperty::Znear,
        (_, "zfar") => CameraProperty::Zfar,
        _ => return None,
    })
}
