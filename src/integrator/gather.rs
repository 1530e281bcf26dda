//! Gathers the hits of path rays as shading points, and evaluates everything that does not depend on a light: surface,
//! material, and the radiance k_e + k_a I_a.
//!
//! Hits are grouped by triangle, because the points of one triangle share vertices and material, and are computed eight
//! at a time.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::{HitId, RayDifferential, Rgb};
use crate::integrator::compositor::Compositor;
use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::evaluator::MaterialEvaluator;
use crate::integrator::material::specular_antialiasing::SpecularAntialiasing;
use crate::integrator::path_rays::PathRays;
use crate::integrator::sample::Sample;
use crate::integrator::shading_batch::{BatchBuffers, ShadingBatch, ShadingPoint, TrianglePoints};
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::shading_triangle::{MaterialTraits, ShadingTriangle};
use crate::integrator::surface::soa::{HIT_LANES, dvec3};
use crate::integrator::surface::surface_hit::Ray8;
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texel_batch::TexelBatch;
use crate::integrator::surface::texture_eval::{PointTexels, TextureEvalContext};
use crate::scene::PosedScene;

/// Gathers the points that the rays hit, first those on the ground in front of other surfaces. `base_radiance` computes
/// k_e + k_a I_a from a point's coefficients and shading normal.
pub(crate) fn gather_points<'s>(
    frame: &Frame<'s>,
    compositor: &mut Compositor,
    samples: &[Sample],
    buffers: &mut BatchBuffers,
    reflections_enabled: bool,
    base_radiance: impl Fn(&Coefficients, DVec3) -> Rgb,
) -> ShadingBatch<'s> {
    let mut batch = ShadingBatch::new(buffers);
    // Composited in this order, the ground covers what is behind it. Its points are the first of their paths in the batch.
    frame.gather_ground(&mut batch, &compositor.rays, &mut compositor.ground_t, &base_radiance);
    compute_surface_points(frame, &mut batch, &compositor.rays, samples);
    evaluate_materials(frame, &mut batch, reflections_enabled, base_radiance);
    batch
}

/// Computes the surface points of all hits, triangle by triangle.
fn compute_surface_points<'s>(
    frame: &Frame<'s>,
    batch: &mut ShadingBatch<'s>,
    rays: &PathRays,
    samples: &[Sample],
) {
    let ShadingBatch { points, soa, triangles, hits_by_triangle, .. } = batch;
    hits_by_triangle.group(rays.hits());
    triangles.reserve(hits_by_triangle.len());
    let mut footprints = Footprints::new(frame, rays, samples);
    let mut ray8 = Ray8::ZERO;
    let mut traits = LastTraits(None);
    for (id, first) in hits_by_triangle.iter() {
        let triangle = traits.triangle(frame.posed, id);
        let start = points.len();
        let mut next = Some(first);
        while let Some(hit) = next {
            let capacity = if rays.is_secondary { 1 } else { HIT_LANES.min(soa.free_lanes()) };
            let differential = footprints.differential(hit);
            let mut count = 0;
            while let Some(hit) = next.filter(|&hit| count < capacity && footprints.is_current(hit)) {
                ray8.set(count, rays.ray(hit as usize));
                let path = rays.path(hit as usize);
                points.push(ShadingPoint { path, id, is_shadow_catcher: false, coefficients: 0 });
                count += 1;
                next = hits_by_triangle.next(hit);
            }
            triangle.append_hits(frame.simd(), &ray8, count, differential, soa);
        }
        triangles.push(TrianglePoints { triangle, range: start..points.len() });
    }
}

/// The traits of the last material: consecutive triangles mostly have one.
struct LastTraits(Option<(u32, MaterialTraits)>);

impl LastTraits {
    #[inline(always)]
    fn triangle<'s>(&mut self, posed: &PosedScene<'s>, id: HitId) -> ShadingTriangle<'s> {
        let material = posed.mesh(id.instance).material;
        let traits = match self.0 {
            Some((last, traits)) if last == material => traits,
            _ => MaterialTraits::new(&posed.materials[material as usize]),
        };
        self.0 = Some((material, traits));
        ShadingTriangle::with_traits(posed, id, &traits)
    }
}

/// The ray differentials of hits. Usually all samples have one footprint, and so one differential.
struct Footprints<'a> {
    frame: &'a Frame<'a>,
    rays: &'a PathRays<'a>,
    samples: &'a [Sample],
    /// True if eye rays have different footprints.
    differ: bool,
    /// The last footprint of an eye ray.
    last: [f64; 2],
    /// The differential of `last`.
    last_differential: Option<RayDifferential>,
}

impl<'a> Footprints<'a> {
    fn new(frame: &'a Frame, rays: &'a PathRays, samples: &'a [Sample]) -> Footprints<'a> {
        // Each secondary ray has a differential of its own.
        let differ =
            !rays.is_secondary && samples.iter().any(|sample| sample.footprint != samples[0].footprint);
        Footprints { frame, rays, samples, differ, last: [0.0; 2], last_differential: None }
    }

    #[inline(always)]
    fn footprint(&self, hit: u32) -> [f64; 2] {
        self.samples[self.rays.path(hit as usize)].footprint
    }

    /// The differential of the ray of a hit, which becomes the current one.
    #[inline(always)]
    fn differential(&mut self, hit: u32) -> Option<RayDifferential> {
        if self.rays.is_secondary {
            let state = self.rays.states.get(self.rays.path(hit as usize));
            return state.map(|state| state.ray_differential(self.rays.ray(hit as usize).d));
        }
        let footprint = self.footprint(hit);
        if footprint != self.last {
            self.last = footprint;
            self.last_differential = self.frame.ray_differential(footprint);
        }
        self.last_differential
    }

    /// True if a hit's footprint is the current one.
    #[inline(always)]
    fn is_current(&self, hit: u32) -> bool {
        !self.differ || self.footprint(hit) == self.last
    }
}

/// Evaluates the materials of all triangles' points.
fn evaluate_materials(
    frame: &Frame,
    batch: &mut ShadingBatch,
    reflections_enabled: bool,
    base_radiance: impl Fn(&Coefficients, DVec3) -> Rgb,
) {
    let ShadingBatch { points, coefficients, soa, triangles, .. } = batch;
    let under_sky = frame.sky.is_some();
    let evaluator =
        MaterialEvaluator::new(frame.posed, coefficients, &frame.overrides, under_sky, reflections_enabled);
    let mut pass = MaterialPass { frame, evaluator, texels: TexelBatch::default(), base_radiance, points };
    for TrianglePoints { triangle, range } in triangles.iter() {
        if triangle.is_uniform {
            pass.eval_uniform(triangle, range.clone(), soa);
        } else {
            pass.eval_textured(triangle, range.clone(), soa);
        }
    }
}

/// Evaluates the materials of points.
struct MaterialPass<'a, F> {
    frame: &'a Frame<'a>,
    evaluator: MaterialEvaluator<'a>,
    texels: TexelBatch<'a>,
    base_radiance: F,
    points: &'a mut [ShadingPoint],
}

impl<F: Fn(&Coefficients, DVec3) -> Rgb> MaterialPass<'_, F> {
    /// Points with the same coefficients.
    fn eval_uniform(&mut self, triangle: &ShadingTriangle, range: Range<usize>, soa: &mut PointsSoa) {
        let (block, lane) = soa.lane(range.start);
        let ctx = triangle.texture_context(block.coords(lane));
        let index = self.evaluator.eval_uniform(triangle.material, &ctx);
        let k = self.evaluator.get(index);
        let antialiasing = self.specular_antialiasing(triangle);
        // Only a sky's light depends on the normal.
        let base_radiance = (self.base_radiance)(k, DVec3::ZERO);
        for (block, lanes) in soa.lanes_mut(range.clone()) {
            block.set_uniform_material(lanes.clone(), k, &antialiasing, base_radiance);
            // Where the surface reflects, its specular layers decide how much of that light it gets.
            for lane in lanes.filter(|_| self.frame.sky.is_some() && !k.layers.reflects) {
                block.set_base_radiance(lane, (self.base_radiance)(k, block.n(lane)));
            }
        }
        self.points[range].iter_mut().for_each(|point| point.coefficients = index);
    }

    /// Points whose coefficients or normals depend on textures or vertex colours.
    fn eval_textured(&mut self, triangle: &ShadingTriangle, range: Range<usize>, soa: &mut PointsSoa) {
        let posed = self.frame.posed;
        let antialiasing = self.specular_antialiasing(triangle);
        let has_normal_map = posed.materials[triangle.material as usize].normal.is_some();
        let mut i = range.start;
        for (block, lanes) in soa.lanes_mut(range) {
            let (simd, mesh) = (self.frame.simd(), triangle.triangle);
            self.texels.sample(simd, posed, triangle.material, mesh, block, lanes.clone());
            let mut alpha2_increase = block.curvature_alpha2_increase();
            for lane in lanes.clone() {
                let texels = PointTexels { batch: &self.texels, lane };
                let ctx = triangle.texture_context(block.coords(lane));
                let ctx = TextureEvalContext { texels: Some(texels), ..ctx };
                let mut n = dvec3(&block.n_v, lane);
                if has_normal_map {
                    let surface = SurfacePoint { ctx, ..triangle.surface_from_hit(&block.hit(lane)) };
                    (n, alpha2_increase[lane]) = surface.filtered_normal(posed);
                }
                let index = self.evaluator.eval(triangle.material, &ctx);
                let k = self.evaluator.get(index);
                if k.layers.reflects {
                    // The specular layers set the radiance.
                    block.set_material(lane, n, k, Rgb::ZERO);
                    block.set_reflecting(lane, alpha2_increase[lane]);
                } else {
                    block.set_material(lane, n, k, (self.base_radiance)(k, n));
                }
                self.points[i].coefficients = index;
                i += 1;
            }
            if block.has_specular {
                block.apply_specular_antialiasing(lanes, &antialiasing, &alpha2_increase);
            }
        }
    }

    fn specular_antialiasing(&self, triangle: &ShadingTriangle) -> SpecularAntialiasing {
        let material = &self.frame.posed.materials[triangle.material as usize];
        SpecularAntialiasing::new(material, &self.frame.overrides)
    }
}
