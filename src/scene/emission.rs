//! Surfaces that emit light: their power, and which of them count as light sources of the file.

use std::f64::consts::PI;

use glam::{Vec2, Vec4Swizzles};

use crate::{Material, PosedScene, Reflectance, TexelSemantics, uvs_at};
use blinn_core::geometry::{HitId, Rgb};

/// Brightness of a triangle with a dark texture, relative to one with a white texture: bright spots between the sampled
/// texels are found, too.
const MIN_TEXTURE_BRIGHTNESS: f32 = 0.05;
/// Barycentric coordinates at which a triangle's texture is sampled.
const TEXTURE_SAMPLES: [[f32; 3]; 4] = [[1.0 / 3.0; 3], [0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]];
/// Least mean irradiance of glowing surfaces that light a scene without other lights, in the lecture's units: a white
/// surface of the scene's size is shown as dark grey.
const MIN_GLOWING_IRRADIANCE: f64 = 0.02;

impl Material {
    /// Returns the emitted radiance without textures, finite and not negative.
    pub fn emitted_radiance(&self) -> Rgb {
        let radiance = self.emission.factor * self.emission_strength;
        if radiance.is_finite() { radiance.max(Rgb::ZERO) } else { Rgb::ZERO }
    }

    /// Returns true if surfaces of the material light others. Those of unlit materials, and points and lines without
    /// normals, do not: photogrammetry is often unlit as a whole.
    pub fn emits_light(&self) -> bool {
        !matches!(self.reflectance, Reflectance::Unlit | Reflectance::Unshaded)
            && self.emitted_radiance().max_element() > 0.0
    }

    /// Returns true if surfaces of the material emit more than white surfaces show: lamps, not displays and textures that
    /// are to look lit.
    pub fn is_brighter_than_white(&self) -> bool {
        self.emits_light() && self.emitted_radiance().max_element() > 1.0
    }
}

impl PosedScene<'_> {
    /// Returns true if surfaces glow brighter than white: they are light sources of the file.
    pub fn has_glowing_lights(&self) -> bool {
        self.has_glowing_instances(Material::is_brighter_than_white)
    }

    /// Returns true if the glowing surfaces of [`PosedScene::has_glowing_lights`] alone light the scene.
    pub(crate) fn is_lit_by_glowing_surfaces(&self) -> bool {
        self.has_glowing_lights() && self.glowing_irradiance() >= MIN_GLOWING_IRRADIANCE
    }

    fn has_glowing_instances(&self, glows: fn(&Material) -> bool) -> bool {
        self.glowing_instances(glows).next().is_some()
    }

    /// The visible instances whose material glows.
    pub fn glowing_instances(&self, glows: fn(&Material) -> bool) -> impl Iterator<Item = u32> {
        let instances = self.instances.iter().enumerate().filter(|(_, instance)| instance.visible);
        let indices = instances.map(|(index, _)| index as u32);
        indices.filter(move |&index| glows(&self.materials[self.mesh(index).material as usize]))
    }

    /// The mean irradiance that surfaces brighter than white give to a sphere around the scene, in the lecture's units.
    pub(crate) fn glowing_irradiance(&self) -> f64 {
        let radius = self.bounding_sphere().radius;
        let power: f64 = self
            .glowing_instances(Material::is_brighter_than_white)
            .flat_map(|instance| {
                let triangles = self.mesh(instance).triangles.len() as u32;
                (0..triangles).map(move |triangle| HitId { instance, triangle })
            })
            .map(|id| f64::from(self.emitted_power(id)) / 3.0)
            .sum();
        // The flux is π times the power, over the area of the sphere; the lecture's units divide it by π.
        power / (4.0 * PI * radius * radius)
    }

    /// Returns a triangle's area times the sum of its mean radiance's components, on both sides if they emit; 0 where it is not
    /// finite.
    pub fn emitted_power(&self, id: HitId) -> f32 {
        let mesh = self.mesh(id.instance);
        let material = &self.materials[mesh.material as usize];
        let mut power = self.triangle_area(id) * material.emitted_radiance().element_sum();
        if let Some(texture) = &material.emission.texture {
            let corners = mesh.triangles[id.triangle as usize];
            let uvs = uvs_at(self.uvs(id.instance), corners, texture.uv_set);
            let sampled = &self.scene.textures[texture.texture as usize];
            let brightness = |b: [f32; 3]| {
                let uv: Vec2 = uvs[0] * b[0] + uvs[1] * b[1] + uvs[2] * b[2];
                let uv = texture.transform.apply(uv);
                sampled.sample(&self.scene.images, uv, TexelSemantics::Color).xyz().element_sum() / 3.0
            };
            let mean: f32 = TEXTURE_SAMPLES.into_iter().map(brightness).sum::<f32>() * 0.25;
            power *= mean.max(MIN_TEXTURE_BRIGHTNESS);
        }
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        if power.is_finite() { power * sides } else { 0.0 }
    }

    /// Returns a triangle's area in square metres.
    pub fn triangle_area(&self, id: HitId) -> f32 {
        let [a, b, c] = self.world_triangle(id).map(|p| p.as_dvec3());
        (0.5 * (b - a).cross(c - a).length()) as f32
    }
}
