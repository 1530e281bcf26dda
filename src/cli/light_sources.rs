//! The light sources of a scene, as `blinn info` lists them.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use blinn_core::geometry::{HitId, Rgb};
use blinn_scene::{
    AreaLight, AreaLightShape, LUMENS_PER_WATT, Light, LightKind, LightProfile, LightUnits, PosedAreaLight,
    PosedScene, Source, SourceFormat,
};

/// The total emission of a light or a material in the units that its file is known to have. `flux` is in the unit of the
/// renderer, where a light of Blender's has its watts, and a light of glTF without a known unit its lumens.
struct Emission {
    watts: Option<f32>,
    lumens: Option<f32>,
}

impl Emission {
    /// Returns the emission of a light.
    fn of_light(flux: f64, source: &Source) -> Emission {
        let is_standard = LightUnits::Auto.resolve(source) == LightUnits::Standard;
        match (LightUnits::Auto.is_photometric(source), is_standard) {
            (true, true) => {
                Emission { watts: Some(flux as f32), lumens: Some((flux * LUMENS_PER_WATT) as f32) }
            }
            (true, false) => Emission { watts: None, lumens: Some(flux as f32) },
            (false, _) => Emission { watts: Some(flux as f32), lumens: None },
        }
    }

    /// Returns the emission of a material: nits in glTF (KHR_materials_emissive_strength), W/(m² sr) from Blender and in
    /// other formats.
    fn of_material(flux: f64, source: &Source) -> Emission {
        let is_photometric = source.format == SourceFormat::Gltf && !source.is_blender();
        let flux = Some(flux as f32);
        match is_photometric {
            true => Emission { watts: None, lumens: flux },
            false => Emission { watts: flux, lumens: None },
        }
    }
}

/// The unit of the `intensity` of a light. Radiometric units are those of Blender's export modes Unitless and Raw.
fn intensity_unit(kind: LightKind, source: &Source) -> &'static str {
    let is_sun = kind == LightKind::Directional;
    match (LightUnits::Auto.is_photometric(source), is_sun) {
        (true, true) => "lx",
        (true, false) => "cd",
        (false, true) => "W/m²",
        (false, false) if LightUnits::Auto.resolve(source) == LightUnits::Raw => "W",
        (false, false) => "W/sr",
    }
}

/// Lists the lights of the file, at nodes that are shown or hidden.
///
/// `watts` and `lumens` are the flux of a white light: 4π · intensity for points and, as Blender counts them, spots; 4π ·
/// the mean intensity of photometric lights, whose `intensity` is that of the brightest direction; π · area · radiance for
/// area lights. A file has one of them, files from Blender in its export mode Standard have both. A sun has an
/// irradiance, and no flux.
pub fn lights(posed: &PosedScene) -> Vec<Value> {
    let scene = posed.scene;
    let punctual = scene.lights.iter().map(|light| punctual_light(posed, light));
    punctual.chain(scene.area_lights.iter().map(|light| area_light(posed, light))).collect()
}

fn punctual_light(posed: &PosedScene, light: &Light) -> Value {
    let node = posed.node_to_world(light.node);
    let units = LightUnits::Auto.resolve(&posed.scene.source);
    let is_sun = light.kind == LightKind::Directional;
    // The factor gives the lecture's intensity, which has a factor of 1/π.
    let intensity = posed.scene.peak_intensity(light);
    let mean = posed.scene.light_profile(light).map_or(1.0, LightProfile::relative_mean);
    let flux = f64::from(intensity * units.factor(light.kind) * mean) * 4.0 * PI * PI;
    let emission = (!is_sun).then(|| Emission::of_light(flux, &posed.scene.source));
    json!({
        "name": light.name,
        "node": posed.scene.nodes[light.node as usize].name,
        "kind": light.kind.name(),
        "color": light.color.to_array(),
        "intensity": intensity,
        "unit": intensity_unit(light.kind, &posed.scene.source),
        "watts": emission.as_ref().and_then(|emission| emission.watts),
        "lumens": emission.as_ref().and_then(|emission| emission.lumens),
        "position": (!is_sun).then(|| coordinates(node.translation)),
        "direction": (light.kind != LightKind::Point).then(|| direction(-node.matrix3.z_axis)),
        "radius": (light.radius > 0.0).then_some(light.radius),
    })
}

fn area_light(posed: &PosedScene, light: &AreaLight) -> Value {
    let node = posed.node_to_world(light.node);
    let units = LightUnits::Auto.resolve(&posed.scene.source);
    let radiance = Rgb::splat(light.intensity * units.radiance_factor());
    let light_at_node = PosedAreaLight::new(light.shape, light.size, &node, radiance);
    let size = light_at_node.map(|light| [2.0 * light.half_x.length(), 2.0 * light.half_y.length()]);
    let source = &posed.scene.source;
    let flux = light_at_node.map_or(0.0, |light| light.power().x);
    let emission = Emission::of_light(f64::from(flux), source);
    let mut value = json!({
        "name": light.name,
        "node": posed.scene.nodes[light.node as usize].name,
        "kind": light.shape.name(),
        "color": light.color.to_array(),
        "intensity": light.intensity,
        "unit": if LightUnits::Auto.is_photometric(source) { "nt" } else { "W/(m² sr)" },
        "watts": emission.watts,
        "lumens": emission.lumens,
        "position": coordinates(node.translation),
        "direction": direction(-node.matrix3.z_axis),
    });
    let [width, height] = size.unwrap_or_default();
    match light.shape {
        AreaLightShape::Rect => {
            value["width"] = json!(width);
            value["height"] = json!(height);
        }
        AreaLightShape::Disk => value["diameter"] = json!(width),
    }
    value
}

/// Lists the materials that emit light, with the area of their triangles and π · area · radiance, for both sides where
/// both are shown. The radiance of a texture is not known before it is looked up: its factor counts.
pub fn emissive_materials(posed: &PosedScene) -> Vec<Value> {
    let materials = &posed.materials;
    let radiance = |i: usize| materials[i].emission.factor * materials[i].emission_strength;
    let mut areas = vec![(0u64, 0.0f64); materials.len()];
    for (id, instance) in posed.instances.iter().enumerate() {
        let mesh = posed.mesh(id as u32);
        let material = mesh.material as usize;
        if !instance.visible || radiance(material) == Vec3::ZERO {
            continue;
        }
        for triangle in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = posed.world_triangle(HitId { instance: id as u32, triangle });
            let area = 0.5 * f64::from((b - a).cross(c - a).length());
            areas[material].0 += 1;
            areas[material].1 += if area.is_finite() { area } else { 0.0 };
        }
    }
    let lit = areas.iter().enumerate().filter(|(_, (triangles, _))| *triangles > 0);
    lit.map(|(i, (triangles, area))| {
        let material = &materials[i];
        let radiance = radiance(i);
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        let mean = f64::from(radiance.element_sum() / 3.0);
        let emission = Emission::of_material(PI * area * sides * mean, &posed.scene.source);
        json!({
            "name": material.name,
            "radiance": radiance.to_array(),
            "textured": material.emission.texture.is_some(),
            "triangles": triangles,
            "area": *area as f32,
            "watts": emission.watts,
            "lumens": emission.lumens,
        })
    })
    .collect()
}

/// Lists the empty nodes that were probably area lights.
pub fn lost_lights(posed: &PosedScene) -> Vec<Value> {
    let node = |&id: &u32| {
        let node = posed.node_to_world(id);
        json!({
            "node": posed.scene.nodes[id as usize].name,
            "position": coordinates(node.translation),
            "direction": direction(-node.matrix3.z_axis),
        })
    };
    posed.scene.lost_lights.iter().map(node).collect()
}

/// Rounds to the precision of files.
pub fn coordinates(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

pub fn direction(v: DVec3) -> [f32; 3] {
    // Zeros that rotations leave behind as 1e-8 are zeros.
    v.normalize_or_zero().to_array().map(|v| if v.abs() < 1e-7 { 0.0 } else { v as f32 })
}
