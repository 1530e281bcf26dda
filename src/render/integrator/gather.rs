//! Gathers the hits of path rays as shading points, and evaluates everything that does not depend on a light: surface,
//! material, and the radiance k_e + k_a I_a.
//!
//! Hits are grouped by triangle, because the points of one triangle share vertices and material, and are computed eight
//! at a time.

use std::ops::Range;

use glam::DVec3;

use crate::integrator::compositor::Compositor;
use crate::integrator::emitters::Emitters;
use crate::integrator::frame::Frame;
use crate::integrator::layers::layer_inputs::LayerInputs;
use crate::integrator::material::coefficient_lanes::CoefficientLanes;
use crate::integrator::material::coefficients::BaseTerms;
use crate::integrator::material::evaluator::{EvalMaterial, EvalSettings};
use crate::integrator::material::material_inputs::MaterialInputs;
use crate::integrator::material::specular_antialiasing::SpecularAntialiasing;
use crate::integrator::path_rays::PathRays;
use crate::integrator::paths::PathStates;
use crate::integrator::sample::Sample;
use crate::integrator::shading_batch::{BatchBuffers, ShadingBatch, ShadingPoint, TrianglePoints};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::shading_triangle::{MaterialTraits, ShadingTriangle, TriangleSurface};
use crate::integrator::surface::soa::{HIT_LANES, LANES, dvec3, set3, vec3};
use crate::integrator::surface::surface_hit::Ray8;
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_eval::TextureEvalContext;
use blinn_core::geometry::{HitId, RayDifferential, Rgb};
use blinn_core::simd::AutovecKernel;
use blinn_scene::PosedScene;

/// Gathers the points that the rays hit, first those on the ground in front of other surfaces. `base_radiance` computes
/// k_e + k_a I_a from a point's coefficients and shading normal.
pub(crate) fn gather_points<'s>(
    frame: &Frame<'s>,
    compositor: &mut Compositor,
    samples: &[Sample],
    buffers: &mut BatchBuffers,
    reflections_enabled: bool,
    base_radiance: impl Fn(BaseTerms, DVec3) -> Rgb,
) -> ShadingBatch<'s> {
    let mut batch = ShadingBatch::new(buffers);
    batch.spawns_at_triangles = frame.traces_full_paths();
    // Composited in this order, the ground covers what is behind it. Its points are the first of their paths in the batch.
    frame.gather_ground(&mut batch, &compositor.rays, &mut compositor.ground_t, &base_radiance);
    compute_surface_points(frame, &mut batch, &compositor.rays, samples);
    evaluate_materials(frame, &mut batch, compositor.rays.states, reflections_enabled, base_radiance);
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
        let is_round = triangle.is_round();
        let start = points.len();
        let mut next = Some(first);
        while let Some(hit) = next {
            let capacity = if rays.is_secondary || is_round { 1 } else { HIT_LANES.min(soa.free_lanes()) };
            let differential = footprints.differential(hit);
            let mut count = 0;
            while let Some(hit) = next.filter(|&hit| count < capacity && footprints.is_current(hit)) {
                ray8.set(count, rays.ray(hit as usize));
                let path = rays.path(hit as usize);
                points.push(ShadingPoint { path, id, is_shadow_catcher: false });
                count += 1;
                next = hits_by_triangle.next(hit);
            }
            if is_round {
                let (ray, t) = (ray8.get(0), rays.hits()[hit as usize].t);
                let (block, lane) = soa.append(count);
                block.store_hit(lane, ray.d, &triangle.round_hit(ray, t));
                continue;
            }
            triangle.append_hits(frame.simd(), &ray8, count, differential, soa);
            if frame.traces_full_paths() {
                let (block, lane) = soa.lane_mut(points.len() - count);
                triangle.set_envelope_offsets(block, lane..lane + count);
            }
        }
        triangles.push(TrianglePoints { triangle: triangle.surface, range: start..points.len() });
    }
}

/// The traits of the last material: consecutive triangles mostly have one.
struct LastTraits(Option<(u32, MaterialTraits)>);

impl LastTraits {
    #[inline(always)]
    fn triangle<'s>(&mut self, posed: &'s PosedScene<'s>, id: HitId) -> ShadingTriangle<'s> {
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
    states: PathStates,
    reflections_enabled: bool,
    base_radiance: impl Fn(BaseTerms, DVec3) -> Rgb,
) {
    let ShadingBatch { points, soa, triangles, has_transmission, .. } = batch;
    let settings = EvalSettings {
        overrides: &frame.overrides,
        under_sky: frame.sky.is_some(),
        reflections_enabled,
        unlit_scale: frame.unlit_scale,
    };
    let mut pass = MaterialPass {
        frame,
        points,
        states,
        settings,
        inputs: MaterialInputs::new(),
        coefficients: CoefficientLanes::ZERO,
        uniform: None,
        base_radiance,
    };
    let mut remaining = triangles.as_slice();
    let mut start = remaining.first().map_or(0, |of| of.range.start);
    while let Some(run) = MaterialRun::take(&mut remaining, start) {
        start = run.points.end;
        pass.eval(&run, soa);
    }
    let transmits = |of: &TrianglePoints| frame.posed.materials[of.triangle.material as usize].transmits();
    *has_transmission = triangles.iter().any(transmits);
}

/// Consecutive points of a block whose triangles have the same material.
struct MaterialRun<'a, 's> {
    triangles: &'a [TrianglePoints<'s>],
    points: Range<usize>,
}

impl<'a, 's> MaterialRun<'a, 's> {
    /// Takes the run that begins at point `start` from the triangles that remain.
    fn take(remaining: &mut &'a [TrianglePoints<'s>], start: usize) -> Option<MaterialRun<'a, 's>> {
        let block_end = (start / LANES + 1) * LANES;
        let key = |of: &TrianglePoints| (of.triangle.material, of.triangle.has_color);
        let all = *remaining;
        let first = key(all.first()?);
        let belongs = |of: &&TrianglePoints| of.range.start < block_end && key(of) == first;
        let count = all.iter().take_while(belongs).count();
        let triangles = &all[..count];
        let last_end = triangles.last()?.range.end;
        // The rest of the last triangle is in the next block.
        *remaining = &all[if last_end > block_end { count - 1 } else { count }..];
        Some(MaterialRun { triangles, points: start..last_end.min(block_end) })
    }

    /// The triangles, each with the lanes of its points in the block.
    fn triangles(&self) -> impl Iterator<Item = (&'a TriangleSurface<'s>, Range<usize>)> {
        let Range { start, end } = self.points;
        let first = start / LANES * LANES;
        self.triangles.iter().map(move |TrianglePoints { triangle, range }| {
            (triangle, range.start.max(start) - first..range.end.min(end) - first)
        })
    }
}

/// Evaluates the materials of points, run by run.
struct MaterialPass<'a, F> {
    frame: &'a Frame<'a>,
    points: &'a [ShadingPoint],
    states: PathStates<'a>,
    settings: EvalSettings<'a>,
    inputs: MaterialInputs<'a>,
    /// The coefficients of the last run.
    coefficients: CoefficientLanes,
    /// The material of which `coefficients` are, if they are the same at all points.
    uniform: Option<u32>,
    base_radiance: F,
}

impl<F: Fn(BaseTerms, DVec3) -> Rgb> MaterialPass<'_, F> {
    /// Evaluates the material of a run of points.
    fn eval(&mut self, run: &MaterialRun, soa: &mut PointsSoa) {
        let frame = self.frame;
        let (posed, simd) = (frame.posed, frame.simd());
        let [TrianglePoints { triangle: first, .. }, ..] = run.triangles else { return };
        let (index, has_color) = (first.material, first.has_color);
        let material = &posed.materials[index as usize];
        let (block, start) = soa.lane_mut(run.points.start);
        let lanes = start..start + run.points.len();
        let is_uniform = !(has_color || material.is_textured());
        if !is_uniform || material.normal_maps().next().is_some() {
            self.inputs.texels.set_material(posed, index);
            for (triangle, lanes) in run.triangles() {
                self.inputs.set_triangle(posed, triangle, block, lanes);
            }
            self.inputs.texels.sample(simd, posed, block, &lanes);
        }
        if !is_uniform || self.uniform != Some(index) {
            // Coefficients of a whole block need no copy.
            let out = if is_uniform || start > 0 { &mut self.coefficients } else { &mut block.k };
            let (inputs, settings) = (&self.inputs, self.settings);
            simd.run(EvalMaterial { material, inputs, has_color, settings, out });
            self.uniform = is_uniform.then_some(index);
        }
        let mut alpha2_increase = block.curvature_alpha2_increase();
        if let Some(map) = &material.normal {
            let first = run.points.start / LANES * LANES;
            for (triangle, lanes) in run.triangles() {
                for lane in lanes {
                    let ctx = triangle.texture_context(block.coords(lane));
                    let ctx = if self.states.is_indirect(self.points[first + lane].path) {
                        // The mean normal of the wide footprint is nearly flat, and bumps darken.
                        ctx.without_footprint()
                    } else {
                        let sampled_normal = Some(self.inputs.texels.normal(&map.texture, lane));
                        TextureEvalContext { sampled_normal, ..ctx }
                    };
                    let surface = SurfacePoint { ctx, ..triangle.surface_from_hit(&block.hit(lane)) };
                    let (n, increase) = surface.filtered_normal(posed);
                    set3(&mut block.n, lane, n.to_array());
                    alpha2_increase[lane] = increase;
                }
            }
        }
        simd.run(SetCoefficients {
            block: &mut *block,
            lanes: lanes.clone(),
            k: (is_uniform || start > 0).then_some(&self.coefficients),
            alpha2_increase: &alpha2_increase,
            has_normal_map: material.normal.is_some(),
            antialiasing: SpecularAntialiasing::new(material, &frame.overrides),
        });
        if self.settings.reflections_enabled && material.is_layered() {
            let inputs = LayerInputs::new(posed, material, &self.inputs);
            for (triangle, lanes) in run.triangles() {
                for lane in lanes {
                    let point = inputs.layers(triangle, block, lane);
                    block.layered.set(lane, point);
                    inputs.split_ambient(block, lane);
                }
            }
        }
        if let Some(emitters) = &frame.emitters {
            self.weight_emission(emitters, run, block);
        }
        // Where the surface reflects, its specular layers set the radiance.
        for lane in lanes {
            if block.reflects(lane) {
                continue;
            }
            let base_radiance = (self.base_radiance)(block.k.base_terms(lane), block.n(lane));
            block.set_base_radiance(lane, base_radiance);
        }
    }
}

impl<F> MaterialPass<'_, F> {
    /// Scales k_e of the points of a run to the share that shadow rays to glowing surfaces do not find.
    fn weight_emission(&self, emitters: &Emitters, run: &MaterialRun, block: &mut PointBlock) {
        let posed = self.frame.posed;
        let first = run.points.start / LANES * LANES;
        for (triangle, lanes) in run.triangles() {
            if !emitters.glows(triangle.id) {
                continue;
            }
            let is_double_sided = posed.materials[triangle.material as usize].double_sided;
            for lane in lanes {
                let Some(ray) = self.states.secondary(self.points[first + lane].path) else { continue };
                let (p, n_g) = (vec3(&block.p, lane), dvec3(&block.n_g, lane));
                let density = emitters.density(posed, triangle.id, ray.state.origin, p, n_g);
                let emits = is_double_sided || triangle.is_front(n_g);
                let weight = if emits { ray.area_lights.weight(density.unwrap_or(0.0)) } else { 0.0 };
                let k_e: Rgb = vec3(&block.k.k_e, lane);
                set3(&mut block.k.k_e, lane, (k_e * weight).to_array());
            }
        }
    }
}

/// Stores the coefficients of points, and widens their highlights.
struct SetCoefficients<'a> {
    block: &'a mut PointBlock,
    lanes: Range<usize>,
    /// `None` if they are in `block` already.
    k: Option<&'a CoefficientLanes>,
    alpha2_increase: &'a [f32; LANES],
    has_normal_map: bool,
    antialiasing: SpecularAntialiasing,
}

impl AutovecKernel for SetCoefficients<'_> {
    #[inline(always)]
    fn run(self) {
        let SetCoefficients { block, lanes, k, alpha2_increase, has_normal_map, antialiasing } = self;
        if let Some(k) = k {
            block.k.copy_from(lanes.start, k);
        }
        block.finish_coefficients(&lanes, alpha2_increase, has_normal_map);
        if block.has_specular {
            block.apply_specular_antialiasing(lanes.start, &antialiasing);
        }
    }
}
