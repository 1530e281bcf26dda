//! Gathers the hits of eye rays as shading points, and evaluates all of them that depends on no light: surface, material,
//! and the radiance k_e + k_a I_a.
//!
//! Hits are grouped by triangle, because the points of one triangle share vertices and material, and are computed eight
//! at a time.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::Rgb;
use crate::integrator::frame::Frame;
use crate::integrator::layers::Layers;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::evaluator::MaterialEvaluator;
use crate::integrator::material::specular_antialiasing::SpecularAntialiasing;
use crate::integrator::path_rays::PathRays;
use crate::integrator::sample::Sample;
use crate::integrator::shading_batch::{BatchBuffers, ShadingBatch, ShadingPoint, TrianglePoints};
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::shading_triangle::ShadingTriangle;
use crate::integrator::surface::soa::{HIT_LANES, dvec3};
use crate::integrator::surface::surface_hit::Ray8;
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_batch::TextureSamples;
use crate::integrator::surface::texture_eval::{PointSamples, TextureEvalContext};

/// Gathers the current layer's points, first those on the ground in front of it. `unlit` computes k_e + k_a I_a from a
/// point's coefficients and shading normal. `reflects` is true if surfaces reflect their surroundings.
pub(crate) fn gather_points<'s>(
    frame: &Frame<'s>,
    layers: &mut Layers,
    samples: &[Sample],
    buffers: &mut BatchBuffers,
    reflects: bool,
    unlit: impl Fn(&Coefficients, DVec3) -> Rgb,
) -> ShadingBatch<'s> {
    let mut batch = ShadingBatch::new(buffers);
    // Composited in this order, the ground covers what is behind it.
    frame.gather_ground(&mut batch, &layers.rays, &mut layers.ground_t, &unlit);
    compute_hits(frame, &mut batch, &layers.rays, samples);
    evaluate_materials(frame, &mut batch, reflects, unlit);
    batch
}

/// Computes the surface points of all hits, triangle by triangle.
fn compute_hits<'s>(frame: &Frame<'s>, batch: &mut ShadingBatch<'s>, rays: &PathRays, samples: &[Sample]) {
    let ShadingBatch { soa, triangles, samples: point_samples, hits_by_triangle, .. } = batch;
    hits_by_triangle.group(rays.hits());
    triangles.reserve(hits_by_triangle.len());
    let footprint = |hit: u32| samples[rays.sample(hit as usize)].footprint;
    // Usually all samples have one footprint.
    let footprints_differ = samples.iter().any(|sample| sample.footprint != samples[0].footprint);
    let mut last_footprint = [0.0; 2];
    let mut differential = None;
    let mut ray8 = Ray8::ZERO;
    let mut ray8_samples = [0; HIT_LANES];
    for (id, first) in hits_by_triangle.iter() {
        let triangle = ShadingTriangle::new(frame.posed, id);
        let start = point_samples.len();
        let mut next = Some(first);
        while let Some(hit) = next {
            let capacity = HIT_LANES.min(soa.free_lanes());
            let capacity = if rays.is_secondary { 1 } else { capacity };
            if rays.is_secondary {
                let state = &rays.states[rays.sample(hit as usize)];
                differential = Some(state.ray_differential(rays.ray(hit as usize).d));
            } else if footprint(hit) != last_footprint {
                last_footprint = footprint(hit);
                differential = frame.ray_differential(last_footprint);
            }
            let mut count = 0;
            let same_footprint = |hit: &u32| !footprints_differ || footprint(*hit) == last_footprint;
            while let Some(hit) = next.filter(|hit| count < capacity && same_footprint(hit)) {
                ray8.set(count, rays.ray(hit as usize));
                ray8_samples[count] = rays.sample(hit as usize);
                count += 1;
                next = hits_by_triangle.next(hit);
            }
            point_samples.extend_from_slice(&ray8_samples[..count]);
            triangle.append_hits(frame.accel, &ray8, count, differential, soa);
        }
        triangles.push(TrianglePoints { triangle, range: start..point_samples.len() });
    }
}

/// Evaluates the materials of all triangles' points.
fn evaluate_materials(
    frame: &Frame,
    batch: &mut ShadingBatch,
    reflects: bool,
    unlit: impl Fn(&Coefficients, DVec3) -> Rgb,
) {
    let ShadingBatch { points, coefficients, soa, triangles, samples, .. } = batch;
    let overrides = &frame.overrides;
    let evaluator =
        MaterialEvaluator::new(frame.posed, coefficients, overrides, frame.sky.is_some(), reflects);
    let mut stage = MaterialStage {
        frame,
        evaluator,
        texture_samples: TextureSamples::default(),
        unlit,
        samples: &samples[..],
        points,
    };
    for TrianglePoints { triangle, range } in triangles.iter() {
        if triangle.is_uniform {
            stage.eval_uniform(triangle, range.clone(), soa);
        } else {
            stage.eval_textured(triangle, range.clone(), soa);
        }
    }
}

/// Evaluates materials, and appends the points that it has evaluated.
struct MaterialStage<'a, F> {
    frame: &'a Frame<'a>,
    evaluator: MaterialEvaluator<'a>,
    texture_samples: TextureSamples<'a>,
    unlit: F,
    /// The sample of each point.
    samples: &'a [usize],
    points: &'a mut Vec<ShadingPoint>,
}

impl<F: Fn(&Coefficients, DVec3) -> Rgb> MaterialStage<'_, F> {
    /// Points with the same coefficients.
    fn eval_uniform(&mut self, triangle: &ShadingTriangle, range: Range<usize>, soa: &mut PointsSoa) {
        let (block, lane) = soa.lane(range.start);
        let ctx = triangle.texture_context(block.coords(lane));
        let index = self.evaluator.eval_uniform(triangle.material, &ctx);
        let k = self.evaluator.get(index);
        let antialiasing = self.specular_antialiasing(triangle);
        // Only a sky's light depends on the normal.
        let unlit = (self.unlit)(k, DVec3::ZERO);
        for (block, lanes) in soa.lanes_mut(range.clone()) {
            block.set_uniform_material(lanes.clone(), k, &antialiasing, unlit);
            for lane in lanes.filter(|_| self.frame.sky.is_some()) {
                block.set_unlit(lane, (self.unlit)(k, block.n(lane)));
            }
        }
        let samples = &self.samples[range];
        self.points.extend(samples.iter().map(|&sample| ShadingPoint::new(sample, triangle.id, index)));
    }

    /// Points whose coefficients or normals depend on textures or vertex colours.
    fn eval_textured(&mut self, triangle: &ShadingTriangle, range: Range<usize>, soa: &mut PointsSoa) {
        let posed = self.frame.posed;
        let antialiasing = self.specular_antialiasing(triangle);
        let has_normal_map = posed.materials[triangle.material as usize].normal.is_some();
        let mut i = range.start;
        for (block, lanes) in soa.lanes_mut(range) {
            let (accel, mesh) = (self.frame.accel, triangle.triangle);
            self.texture_samples.sample(accel, posed, triangle.material, mesh, block, lanes.clone());
            let mut roughness = block.curvature_roughness();
            for lane in lanes.clone() {
                let samples = PointSamples { samples: &self.texture_samples, lane };
                let ctx = triangle.texture_context(block.coords(lane));
                let ctx = TextureEvalContext { samples: Some(samples), ..ctx };
                let mut n = dvec3(&block.n_v, lane);
                if has_normal_map {
                    let surface = SurfacePoint { ctx, ..triangle.surface_from_hit(&block.hit(lane)) };
                    (n, roughness[lane]) = surface.filtered_normal(posed);
                }
                let index = self.evaluator.eval(triangle.material, &ctx);
                let k = self.evaluator.get(index);
                block.set_material(lane, n, k, (self.unlit)(k, n));
                if k.layers.reflects {
                    block.set_reflecting(lane, roughness[lane]);
                }
                self.points.push(ShadingPoint::new(self.samples[i], triangle.id, index));
                i += 1;
            }
            block.apply_specular_antialiasing(lanes, &antialiasing, &roughness);
        }
    }

    fn specular_antialiasing(&self, triangle: &ShadingTriangle) -> SpecularAntialiasing {
        let material = &self.frame.posed.materials[triangle.material as usize];
        SpecularAntialiasing::new(material, &self.frame.overrides)
    }
}
