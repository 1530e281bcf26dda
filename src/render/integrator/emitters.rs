//! Glowing surfaces as light sources: the triangles of emissive materials, of which shadow rays sample random points.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec4Swizzles};

use crate::integrator::material::opacity::opacity;
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::shading_triangle::ShadingTriangle;
use blinn_core::geometry::{HitId, Rgb, offset_ray_origin};
use blinn_scene::{Material, PosedScene, TexelSemantics};

/// The triangles of emissive materials. A triangle is chosen with a probability in proportion to its power.
#[derive(Debug)]
pub struct Emitters {
    triangles: Vec<HitId>,
    /// Sum of the probabilities of the triangles up to and including each.
    cumulative: Vec<f64>,
    /// Index of the first triangle of each glowing instance.
    first_of_instance: HashMap<u32, u32>,
}

/// A random point of a glowing surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterPoint {
    /// The point, clear of the error bound of the surface.
    pub p: Vec3,
    /// Unit normal of the side that is seen.
    pub normal: Vec3,
    /// Radiance; 0 on a side that does not emit.
    pub radiance: Rgb,
    /// 1 over the density of the point per square metre.
    pub area: f32,
}

impl Emitters {
    /// Collects the glowing triangles of a scene; `None` if there are none.
    pub fn new(posed: &PosedScene) -> Option<Emitters> {
        let mut triangles = Vec::new();
        let mut power = Vec::new();
        let mut first_of_instance = HashMap::new();
        for instance in posed.glowing_instances(Material::emits_light) {
            first_of_instance.insert(instance, triangles.len() as u32);
            for triangle in 0..posed.mesh(instance).triangles.len() as u32 {
                let id = HitId { instance, triangle };
                triangles.push(id);
                power.push(f64::from(posed.emitted_power(id)));
            }
        }
        let total: f64 = power.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut sum = 0.0;
        let cumulative = power
            .iter()
            .map(|power| {
                sum += power / total;
                sum
            })
            .collect();
        Some(Emitters { triangles, cumulative, first_of_instance })
    }

    /// The probability with which triangle number `i` is chosen.
    fn probability_at(&self, i: usize) -> f64 {
        self.cumulative[i] - if i > 0 { self.cumulative[i - 1] } else { 0.0 }
    }

    /// The probability with which a triangle is chosen; `None` if it does not glow.
    pub(crate) fn probability(&self, id: HitId) -> Option<f64> {
        let first = *self.first_of_instance.get(&id.instance)?;
        Some(self.probability_at(first as usize + id.triangle as usize))
    }

    /// A random point of a random triangle as it is seen from `from`: `choice` selects the triangle and `u` the point.
    pub(crate) fn sample(
        &self,
        posed: &PosedScene,
        from: Vec3,
        choice: f32,
        u: [f32; 2],
    ) -> Option<EmitterPoint> {
        let last = self.triangles.len() - 1;
        let i = self.cumulative.partition_point(|&sum| sum <= f64::from(choice)).min(last);
        let id = self.triangles[i];
        let probability = self.probability_at(i);
        let surface = ShadingTriangle::new(posed, id).surface;
        let normal = surface.front_normal?;
        // Uniform barycentrics (Turk, “Generating Random Points in Triangles”, Graphics Gems, 1990).
        let root = u[0].sqrt();
        let b = [1.0 - root, root * (1.0 - u[1]), root * u[1]];
        let corners = posed.world_triangle(id);
        let p = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2];
        let is_front = normal.dot((from - p).as_dvec3()) > 0.0;
        let material = &posed.materials[posed.mesh(id.instance).material as usize];
        if !(is_front || material.double_sided) {
            return None;
        }
        let normal = if is_front { normal } else { -normal }.as_vec3();
        let coords = TriangleCoords { b, differentials: BarycentricDifferentials::POINT };
        let ctx = surface.texture_context(coords);
        let texel = ctx.texture(posed, material.emission.texture.as_ref(), TexelSemantics::Color).xyz();
        let radiance = material.emitted_radiance() * texel * opacity(posed, material, &ctx);
        let area = (f64::from(posed.triangle_area(id)) / probability) as f32;
        let p = offset_ray_origin(p, surface.p_error, normal, normal);
        (radiance.is_finite() && area.is_finite()).then_some(EmitterPoint { p, normal, radiance, area })
    }

    /// Density per steradian with which shadow rays from `from` find the point `p` of a triangle; `None` if it does not
    /// glow.
    pub(crate) fn density(
        &self,
        posed: &PosedScene,
        id: HitId,
        from: Vec3,
        p: Vec3,
        n_g: DVec3,
    ) -> Option<f32> {
        let probability = self.probability(id)?;
        let offset = from.as_dvec3() - p.as_dvec3();
        let r2 = offset.length_squared();
        let cos = n_g.dot(offset).abs() / r2.sqrt();
        let density = probability * r2 / (f64::from(posed.triangle_area(id)) * cos);
        Some(density as f32)
    }
}
