//! Materials, as `blinn info --json` lists them.

use serde_json::{Value, json};

use super::material_layers;
use blinn_core::geometry::Rgb;
use blinn_render::integrator::Coefficients;
use blinn_scene::{AlphaMode, Material, Reflectance};

/// Returns the fields of a material.
pub(crate) fn material(material: &Material) -> Value {
    let kind = match material.reflectance {
        Reflectance::Mtl(_) => "MTL",
        Reflectance::MetallicRoughness { .. } => "metallic-roughness",
        Reflectance::SpecularGlossiness { .. } => "specular-glossiness",
        Reflectance::Unlit | Reflectance::Unshaded => "unlit",
    };
    let emission = material.emission.factor * material.emission_strength;
    json!({
        "name": material.name,
        "kind": kind,
        "base": color(material.base_color.factor),
        "textured": material.base_color.texture.is_some(),
        "double_sided": material.double_sided,
        "reflectance": reflectance(&material.reflectance),
        "phong": phong(material),
        "emission": color(emission),
        "alpha": alpha(material),
        "normal_map": material.normal.map(|map| json!({"scale": map.scale})),
        "layers": material_layers::layers(material),
    })
}

/// Returns the coefficients of the lecture's shading model that the material is converted to: those of its factors. If it is
/// textured, its points have others.
fn phong(material: &Material) -> Value {
    if matches!(material.reflectance, Reflectance::Unlit | Reflectance::Unshaded) {
        return Value::Null;
    }
    let k = Coefficients::of_factors(material);
    json!({
        "k_a": color(k.k_a),
        "k_d": color(k.k_d),
        "k_s": color(k.k_s),
        "shininess": k.shininess,
        "textured": material.is_textured(),
    })
}

/// Returns the parameters of a reflection model by their names in the file's format.
fn reflectance(of: &Reflectance) -> Value {
    match of {
        Reflectance::Mtl(mtl) => json!({
            "ambient": mtl.ambient.map(|ambient| color(ambient.factor)),
            "specular": color(mtl.specular.factor),
            "shininess": mtl.shininess,
            "ior": Some(mtl.ior).filter(|ior| *ior > 0.0),
        }),
        Reflectance::MetallicRoughness { metallic, roughness, dielectric } => json!({
            "metallic": metallic.factor,
            "roughness": roughness.factor,
            "ior": dielectric.ior,
            "specular": dielectric.specular.factor,
            "specular_color": color(dielectric.specular_color.factor),
        }),
        Reflectance::SpecularGlossiness { specular, glossiness } => {
            json!({"specular": color(specular.factor), "glossiness": glossiness.factor})
        }
        Reflectance::Unlit | Reflectance::Unshaded => Value::Null,
    }
}

fn alpha(material: &Material) -> Value {
    let factor = material.alpha.factor;
    match material.alpha_mode {
        AlphaMode::Opaque => json!({"mode": "opaque"}),
        AlphaMode::Mask(cutoff) => json!({"mode": "mask", "factor": factor, "cutoff": cutoff}),
        AlphaMode::Blend => json!({"mode": "blend", "factor": factor}),
    }
}

fn color(color: Rgb) -> [f32; 3] {
    color.to_array()
}
