//! The layers of materials, as `blinn info --json` lists them.

use serde_json::{Map, Value, json};

use blinn_core::geometry::Rgb;
use blinn_scene::Material;

/// Returns the layers that a material has, by the names of their glTF extensions.
pub(crate) fn layers(material: &Material) -> Value {
    let mut layers = Map::new();
    let coat = &material.clearcoat;
    if coat.factor.factor > 0.0 {
        let normal_map = coat.normal.is_some();
        let roughness = coat.roughness.factor;
        let value = json!({"factor": coat.factor.factor, "roughness": roughness, "normal_map": normal_map});
        layers.insert("clearcoat".into(), value);
    }
    if let Some(anisotropy) = material.anisotropy.filter(|anisotropy| anisotropy.strength > 0.0) {
        let value = json!({"strength": anisotropy.strength, "rotation": anisotropy.rotation});
        layers.insert("anisotropy".into(), value);
    }
    let sheen = &material.sheen;
    if sheen.color.factor != Rgb::ZERO {
        let color = sheen.color.factor.to_array();
        layers.insert("sheen".into(), json!({"color": color, "roughness": sheen.roughness.factor}));
    }
    let film = &material.iridescence;
    if film.factor.factor > 0.0 {
        let thickness = [film.min_thickness, film.max_thickness];
        let value = json!({"factor": film.factor.factor, "ior": film.ior, "thickness_nm": thickness});
        layers.insert("iridescence".into(), value);
    }
    let transmission = &material.diffuse_transmission;
    if transmission.factor.factor > 0.0 {
        let color = transmission.color.factor.to_array();
        let value = json!({"factor": transmission.factor.factor, "color": color});
        layers.insert("diffuse_transmission".into(), value);
    }
    if material.transmission.factor > 0.0 {
        let color = material.transmission_color.map(|color| color.to_array());
        let value = json!({"factor": material.transmission.factor, "color": color});
        layers.insert("transmission".into(), value);
    }
    if let Some(volume) = &material.volume {
        // JSON has no infinity: without a distance, nothing is absorbed.
        let distance = Some(volume.attenuation_distance).filter(|distance| distance.is_finite());
        let value = json!({
            "thickness": volume.thickness,
            "attenuation_color": volume.attenuation_color.to_array(),
            "attenuation_distance": distance,
        });
        layers.insert("volume".into(), value);
    }
    if material.dispersion > 0.0 {
        layers.insert("dispersion".into(), json!(material.dispersion));
    }
    Value::Object(layers)
}
