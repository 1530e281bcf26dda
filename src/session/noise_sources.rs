//! Sources of noise in the pictures of a scene, as far as they are known before the scene is posed.

use crate::options::Options;
use blinn_render::NoiseSources;
use blinn_render::integrator::MaterialOverrides;
use blinn_scene::{ChannelTarget, LightSet, Material, Scene, UserLight};

/// The sources of noise that pictures of a scene may have at any time. Options that are not given are those of its file.
pub fn noise_sources(options: &Options, scene: &Scene) -> NoiseSources {
    let is_material = |target: &ChannelTarget| matches!(target, ChannelTarget::Material(..));
    let mut channels = scene.animations.iter().flat_map(|animation| &animation.channels);
    let has_animated_materials = channels.any(|channel| is_material(&channel.target));
    let reflections_enabled = options.bounces > 0 && options.overrides == MaterialOverrides::default();
    let has_metals = has_animated_materials || scene.materials.iter().any(Material::is_rough_metal);
    NoiseSources {
        random_light: has_random_light(options, scene, has_animated_materials),
        rough_metals: reflections_enabled && has_metals,
        lens: match options.view.aperture_radius {
            Some(radius) => radius > 0.0,
            None => {
                let mut of_file = scene.cameras.iter().map(|camera| camera.lens.is_some());
                options.view.complete.is_some_and(|camera| camera.lens.is_some()) || of_file.any(|has| has)
            }
        },
    }
}

/// True if random estimators may find part of the light.
fn has_random_light(options: &Options, scene: &Scene, has_animated_materials: bool) -> bool {
    let lighting = &options.lighting;
    let uses_file = lighting.sets.as_ref().is_none_or(|sets| sets.contains(&LightSet::File));
    let may_glow = || has_animated_materials || scene.materials.iter().any(Material::is_brighter_than_white);
    let glows = uses_file && lighting.glowing_surfaces.unwrap_or_else(may_glow);
    let has_area_light = uses_file && !scene.area_lights.is_empty()
        || lighting.user_lights.iter().any(|light| matches!(light, UserLight::Area { .. }));
    let has_radius = match lighting.radius {
        Some(radius) => radius > 0.0,
        None => uses_file && scene.lights.iter().any(|light| light.radius > 0.0),
    };
    let of_file = scene.environment.as_ref().map(|environment| &environment.map);
    let mut environments = of_file.into_iter().chain(&lighting.environment);
    options.indirect.unwrap_or(0) > 0
        || options.ao.is_some()
        || glows
        || has_area_light
        || has_radius
        || environments.any(|environment| environment.has_light_sources())
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgb;
    use blinn_scene::{AreaLight, AreaLightShape, Light, LightKind, Lighting, Reflectance, Reflection};
    use glam::DVec3;

    fn light(radius: f32) -> Light {
        let (name, kind) = (String::new(), LightKind::Point);
        Light { name, node: 0, kind, color: Rgb::ONE, intensity: 1.0, range: f32::INFINITY, radius }
    }

    fn area_light() -> AreaLight {
        let (name, shape) = (String::new(), AreaLightShape::Rect);
        AreaLight { name, node: 0, shape, size: [1.0; 2], color: Rgb::ONE, intensity: 1.0 }
    }

    fn is_random(options: Options, scene: &Scene) -> bool {
        noise_sources(&options, scene).random_light
    }

    fn lit(lighting: Lighting) -> Options {
        Options { lighting, ..Options::default() }
    }

    #[test]
    fn scenes_of_points_of_light_have_no_noise() {
        let materials = vec![Material::default()];
        let scene = Scene { lights: vec![light(0.0)], materials, ..Scene::default() };
        assert!(!is_random(Options::default(), &scene));
        assert!(is_random(Options { indirect: Some(1), ..Options::default() }, &scene));
        assert!(is_random(lit(Lighting { radius: Some(0.1), ..Lighting::default() }), &scene));
        let area = UserLight::Area {
            position: DVec3::Y,
            direction: DVec3::NEG_Y,
            size: [1.0; 2],
            radiance: Rgb::ONE,
        };
        assert!(is_random(lit(Lighting { user_lights: vec![area], ..Lighting::default() }), &scene));
    }

    #[test]
    fn lights_of_the_file_count_where_they_are_in_use() {
        let headlight = || Lighting { sets: Some(vec![LightSet::Headlight]), ..Lighting::default() };
        let mut lamp = Material::default();
        lamp.emission.factor = Rgb::splat(5.0);
        for scene in [
            Scene { lights: vec![light(0.1)], ..Scene::default() },
            Scene { area_lights: vec![area_light()], ..Scene::default() },
            Scene { materials: vec![lamp], ..Scene::default() },
        ] {
            assert!(is_random(Options::default(), &scene));
            assert!(!is_random(lit(headlight()), &scene));
        }
    }

    #[test]
    fn metals_count_where_they_reflect() {
        let of = |metallic: f32, roughness: f32| Material {
            reflectance: Reflectance::metallic_roughness(metallic, roughness),
            reflection: Reflection::Fresnel,
            ..Material::default()
        };
        let metals = |material: Material, bounces| {
            let scene = Scene { materials: vec![material], ..Scene::default() };
            noise_sources(&Options { bounces, ..Options::default() }, &scene).rough_metals
        };
        assert!(metals(of(1.0, 0.5), 4));
        assert!(!metals(of(1.0, 0.5), 0) && !metals(of(0.0, 0.5), 4) && !metals(of(1.0, 0.0), 4));
    }
}
