//! Glowing surfaces as light sources: the triangles of emissive materials, of which shadow rays sample random points.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec4Swizzles};

use crate::integrator::light_tree::{Emitter, LightTree};
use crate::integrator::material::opacity::opacity;
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::shading_triangle::ShadingTriangle;
use crate::integrator::surface::triangle_plane::TrianglePlane;
use blinn_core::geometry::{HitId, Rgb, offset_ray_origin};
use blinn_scene::{Material, PosedScene, TexelSemantics};

/// The triangles of emissive materials. A point picks a triangle by the light that it may send there.
#[derive(Debug)]
pub struct Emitters {
    triangles: Vec<HitId>,
    tree: LightTree,
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
        let mut emitters = Vec::new();
        let mut first_of_instance = HashMap::new();
        for instance in posed.glowing_instances(Material::emits_light) {
            first_of_instance.insert(instance, triangles.len() as u32);
            let flips_winding = posed.instances[instance as usize].transform.flips_winding;
            for triangle in 0..posed.mesh(instance).triangles.len() as u32 {
                let id = HitId { instance, triangle };
                let corners = posed.world_triangle(id);
                let normal = TrianglePlane::new(corners, flips_winding).front_normal;
                emitters.push(Emitter {
                    index: triangles.len() as u32,
                    corners,
                    normal: normal.map_or(Vec3::ZERO, |n| n.as_vec3()),
                    power: posed.emitted_power(id),
                });
                triangles.push(id);
            }
        }
        let tree = LightTree::new(emitters, triangles.len())?;
        Some(Emitters { triangles, tree, first_of_instance })
    }

    /// The number of a triangle; `None` if it does not glow.
    fn index(&self, id: HitId) -> Option<u32> {
        Some(self.first_of_instance.get(&id.instance)? + id.triangle)
    }

    /// True if a triangle is of an emissive material.
    pub(crate) fn glows(&self, id: HitId) -> bool {
        self.first_of_instance.contains_key(&id.instance)
    }

    /// A random point of a random triangle as it is seen from `from`: `choice` selects the triangle and `u` the point.
    pub(crate) fn sample(
        &self,
        posed: &PosedScene,
        from: Vec3,
        choice: f32,
        u: [f32; 2],
    ) -> Option<EmitterPoint> {
        let (i, probability) = self.tree.sample(from, choice);
        let id = self.triangles[i as usize];
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
        let probability = self.tree.probability(self.index(id)?, from);
        let offset = from.as_dvec3() - p.as_dvec3();
        let r2 = offset.length_squared();
        let cos = n_g.dot(offset).abs() / r2.sqrt();
        let density = probability * r2 / (f64::from(posed.triangle_area(id)) * cos);
        Some(density as f32)
    }
}
