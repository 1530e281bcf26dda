//! KHR_animation_pointer: which numbers of the file a JSON pointer means.

use crate::scene::{CameraProperty, LightProperty, MaterialProperty, TextureSlot};

/// What a pointer drives, by the file's own indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pointed {
    /// KHR_node_visibility of a node.
    Visibility(usize),
    /// One of a node's morph weights.
    Weight(usize, u32),
    /// The default morph weights of a mesh.
    MeshWeights(usize),
    /// One of them.
    MeshWeight(usize, u32),
    Material(usize, MaterialProperty),
    Light(usize, LightProperty),
    Camera(usize, CameraProperty),
}

/// Reads a pointer; `None` for what is not rendered. Pointers to a node's transform and weights are
/// core channels by now.
pub(super) fn read(pointer: &str) -> Option<Pointed> {
    let parts: Vec<&str> = pointer.strip_prefix('/')?.split('/').collect();
    Some(match *parts.as_slice() {
        ["nodes", i, "extensions", "KHR_node_visibility", "visible"] => Pointed::Visibility(index(i)?),
        ["nodes", i, "weights", k] => Pointed::Weight(index(i)?, k.parse().ok()?),
        ["meshes", i, "weights"] => Pointed::MeshWeights(index(i)?),
        ["meshes", i, "weights", k] => Pointed::MeshWeight(index(i)?, k.parse().ok()?),
        ["materials", i, ref field @ ..] => Pointed::Material(index(i)?, material(field)?),
        ["extensions", "KHR_lights_punctual", "lights", i, ref field @ ..] => {
            Pointed::Light(index(i)?, light(field)?)
        }
        ["cameras", i, kind @ ("perspective" | "orthographic"), field] => {
            Pointed::Camera(index(i)?, camera(kind, field)?)
        }
        _ => return None,
    })
}

fn index(text: &str) -> Option<usize> {
    text.parse().ok()
}

const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";

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
        ["extensions", GLOSSY, "diffuseFactor"] => F::Diffuse,
        ["extensions", GLOSSY, "specularFactor"] => F::SpecularF0,
        ["extensions", GLOSSY, "glossinessFactor"] => F::Glossiness,
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
        ["extensions", GLOSSY, "diffuseTexture"] => TextureSlot::Diffuse,
        ["extensions", GLOSSY, "specularGlossinessTexture"] => TextureSlot::SpecularGlossiness,
        _ => return None,
    })
}

fn light(field: &[&str]) -> Option<LightProperty> {
    Some(match *field {
        ["color"] => LightProperty::Color,
        ["intensity"] => LightProperty::Intensity,
        ["range"] => LightProperty::Range,
        // Some exporters join the last two names with a dot.
        ["spot", "innerConeAngle"] | ["spot.innerConeAngle"] => LightProperty::InnerCone,
        ["spot", "outerConeAngle"] | ["spot.outerConeAngle"] => LightProperty::OuterCone,
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
