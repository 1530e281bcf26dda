//! Glowing surfaces as light sources: the triangles of emissive materials, of which shadow rays sample random points.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec4Swizzles};

use crate::integrator::material::opacity::opacity;
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::shading_triangle::ShadingTriangle;
use blinn_core::geometry::{HitId, Rgb, offset_ray_origin};
use blinn_scene::{Material, PosedScene, Reflectance, TexelSemantics};

/// Probability of a triangle with a dark texture, relative to one with a white texture.
const MIN_TEXTURE_SHARE: f32 = 0.05;

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

/// Returns true if surfaces of the material light others.
fn glows(material: &Material) -> bool {
    !matches!(material.reflectance, Reflectance::Unlit) && emission_factor(material).max_element() > 0.0
}

fn emission_factor(material: &Material) -> Rgb {
    let factor = material.emission.factor * material.emission_strength;
    if factor.is_finite() { factor.max(Rgb::ZERO) } else { Rgb::ZERO }
}

impl Emitters {
    /// Collects the glowing triangles of a scene; `None` if there are none.
    pub fn new(posed: &PosedScene) -> Option<Emitters> {
        let mut triangles = Vec::new();
        let mut power = Vec::new();
        let mut first_of_instance = HashMap::new();
        for (index, _) in posed.instances.iter().enumerate().filter(|(_, instance)| instance.visible) {
            let index = index as u32;
            let mesh = posed.mesh(index);
            let material = &posed.materials[mesh.material as usize];
            if !glows(material) {
                continue;
            }
            first_of_instance.insert(index, triangles.len() as u32);
            for triangle in 0..mesh.triangles.len() as u32 {
                let id = HitId { instance: index, triangle };
                triangles.push(id);
                power.push(f64::from(triangle_power(posed, material, id)));
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
        let radiance = emission_factor(material) * texel * opacity(posed, material, &ctx);
        let area = (f64::from(area(posed, id)) / probability) as f32;
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
        let density = probability * r2 / (f64::from(area(posed, id)) * cos);
        Some(density as f32)
    }
}

fn area(posed: &PosedScene, id: HitId) -> f32 {
    let [a, b, c] = posed.world_triangle(id).map(|p| p.as_dvec3());
    (0.5 * (b - a).cross(c - a).length()) as f32
}

/// Area times the brightness of a triangle, for the choice of triangles.
fn triangle_power(posed: &PosedScene, material: &Material, id: HitId) -> f32 {
    let brightness = emission_factor(material).element_sum();
    let mut power = area(posed, id) * brightness;
    if let Some(texture) = &material.emission.texture {
        let surface = ShadingTriangle::new(posed, id).surface;
        let third = 1.0 / 3.0;
        let at = |b: [f32; 3]| {
            let coords = TriangleCoords { b, differentials: BarycentricDifferentials::POINT };
            let texel = surface.texture_context(coords).texture(posed, Some(texture), TexelSemantics::Color);
            texel.xyz().element_sum() * third
        };
        let mean = (at([third; 3]) + at([0.8, 0.1, 0.1]) + at([0.1, 0.8, 0.1]) + at([0.1, 0.1, 0.8])) * 0.25;
        power *= mean.max(MIN_TEXTURE_SHARE);
    }
    let sides = if material.double_sided { 2.0 } else { 1.0 };
    if power.is_finite() { power * sides } else { 0.0 }
}
