//! The lecture's last slide:
//!
//! L = k_a I_a + Σ [ k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p ]
//!
//! over the lights that a shadow ray reaches, plus what the surface emits itself.

use glam::DVec3;

use super::point::Point;
use super::{
    Coefficients, Frame, Integrator, LowDiscrepancySampler, MaterialHitFilter, Sample, Scratch, SurfacePoint,
};
use crate::geometry::{Ray, Rgb, Rgba};
use crate::integrator::ambient_occlusion::ambient_free;
use crate::integrator::direct_light::{look_back, reach, sum_up};
use crate::integrator::material::coefficients::{Look, Lookup};
use crate::integrator::sample_stream::Draws;
use crate::integrator::shading_batch::Seen;
use crate::integrator::shadow_rays::find_free;
use crate::integrator::surface::points::vector;
use crate::integrator::surface::texture_batch::Fetched;
use crate::integrator::surface::texture_eval::OnMesh;

/// The lecture's stages: each adds to the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// The surface's colour, or the background.
    Color,
    /// Lambert.
    Diffuse,
    /// Lambert with shadows.
    Shadow,
    /// Ambient, diffuse, specular, shadows, emission.
    #[default]
    Phong,
}

impl Stage {
    /// What needs no light in particular: k_e + k_a I_a, where all stages count; the ambient term as if
    /// all of it arrived.
    #[inline(always)]
    pub(super) fn unlit(self, frame: &Frame, k: &Coefficients, n: DVec3) -> Rgb {
        match self {
            Stage::Color => k.color,
            Stage::Diffuse | Stage::Shadow => Rgb::ZERO,
            Stage::Phong => k.k_e + k.k_a * frame.ambient_at(n),
        }
    }
}

/// Blinn-Phong, to the stage that is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Phong {
    /// How far through the lecture.
    pub stage: Stage,
}

/// Surfaces along one eye ray that are looked through before the rest is let go.
const MAX_LAYERS: usize = 4096;
/// Less than this share of what is behind is nothing: of white behind black, not half a byte.
const FAINT: f32 = 1.0 / (1 << 13) as f32;

impl Integrator for Phong {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        let materials = MaterialHitFilter(frame.posed);
        let draws = Draws { samples, sampler };
        // What of the background still shows through, by colour.
        let mut open = vec![Rgb::ONE; samples.len()];
        let mut seen = vec![Rgb::ZERO; samples.len()];
        let mut whose: Vec<usize> = (0..samples.len()).collect();
        frame.eye_rays(samples, &mut scratch.rays);
        let mut ground = frame.meet_ground(&scratch.rays);
        for _ in 0..MAX_LAYERS {
            frame.accel.intersect(&scratch.rays, &materials, &mut scratch.hits);
            let mut layer = self.points(frame, scratch, samples, &whose, &mut ground);
            self.occlude(frame, &mut layer, draws, scratch);
            self.shade(frame, &mut layer, draws, scratch);
            let mut all = true;
            for (i, point) in layer.points.iter().enumerate() {
                let (shown, passes) = point.layer(layer.k(i), layer.columns.light(i));
                let (seen, open) = (&mut seen[point.sample], &mut open[point.sample]);
                *seen += *open * shown;
                *open *= passes;
                if open.max_element() < FAINT {
                    *open = Rgb::ZERO;
                } else {
                    all = false;
                }
            }
            layer.give_back(&mut scratch.kept);
            if all {
                break;
            }
            self.go_on_behind(scratch, &mut whose, &open);
            if whose.is_empty() {
                break;
            }
        }
        for ((out, seen), open) in out.iter_mut().zip(&seen).zip(&open) {
            *out = seen.extend(1.0 - (open.x + open.y + open.z) / 3.0);
        }
    }

    fn may_hit(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        frame.may_hit(low, high)
    }
}

impl Phong {
    /// The points of a batch of hits, and those of the ground where it comes first, with all that
    /// does not depend on light.
    fn points<'s>(
        &self,
        frame: &Frame<'s>,
        scratch: &mut Scratch,
        samples: &[Sample],
        whose: &[usize],
        ground: &mut [Option<f64>],
    ) -> Seen<'s> {
        let mut seen = Seen::nothing(&mut scratch.kept);
        // The ground goes first, for it is before what a sample sees besides.
        let on_ground = if ground.is_empty() { 0 } else { whose.len() };
        for (i, (hit, &sample)) in scratch.hits.iter().zip(whose).enumerate().take(on_ground) {
            let ray = Ray { o: scratch.rays.origins[i], d: scratch.rays.directions[i] };
            // t of a hit is right to an ulp or so: what lies on the ground is before it.
            let before = |t: &mut f64| hit.is_miss() || (*t as f32) < hit.t.next_down();
            if let Some(t) = ground.get_mut(sample).and_then(|t| t.take_if(before)) {
                frame.add_ground(&mut seen, self.stage, sample, ray, t);
            }
        }
        seen.find(frame, scratch, samples, whose);
        let Seen { points, looks, columns, facets, samples, .. } = &mut seen;
        let mut fetched = Fetched::default();
        let mut lookup = Lookup::new(looks, &frame.overrides, frame.sky.is_some());
        for (facet, end) in facets.iter() {
            let on = points.len()..*end;
            let material = &frame.posed.materials[facet.material as usize];
            let gloss = lookup.gloss(material);
            let point = |i: usize, look: Look| Point::on(samples[i], facet.id, look.index);
            if facet.plain {
                let (b, spread) = columns.place(on.start);
                let look = lookup.plain(frame.posed, facet.material, &facet.on_mesh(b, spread));
                let k = lookup.k(look);
                // Without a sky it is the same wherever they face.
                let unlit = self.stage.unlit(frame, k, DVec3::ZERO);
                for (group, at) in columns.stretches(on.clone()) {
                    group.put_alike(at.clone(), (k, look.shininess), &gloss, unlit);
                    for i in at.filter(|_| frame.sky.is_some()) {
                        let shading = &mut group.shading;
                        shading.put_unlit(i, self.stage.unlit(frame, k, shading.n(i)));
                    }
                }
                points.extend(on.map(|i| point(i, look)));
                continue;
            }
            let mut i = on.start;
            for (group, at) in columns.stretches(on) {
                fetched.fetch(frame.accel, frame.posed, facet, (group, at.clone()));
                let mut roughening = group.roughening();
                for at in at.clone() {
                    let (b, spread) = group.place(at);
                    let on = OnMesh { fetched: Some((&fetched, at)), ..facet.on_mesh(b, spread) };
                    let mut n = vector(&group.n_v, at);
                    if material.normal.is_some() {
                        let surface = SurfacePoint { on, ..facet.surface(&group.met(at)) };
                        (n, roughening[at]) = surface.shading_normals(frame.posed);
                    }
                    let look = lookup.at(frame.posed, facet.material, &on);
                    let k = lookup.k(look);
                    group.shading.put(at, n, (k, look.shininess), self.stage.unlit(frame, k, n));
                    points.push(point(i, look));
                    i += 1;
                }
                group.shading.widen(at, &gloss, &roughening);
            }
        }
        seen
    }

    /// Where ambient light does not arrive whole: how much does.
    fn occlude(&self, frame: &Frame, seen: &mut Seen, draws: Draws, scratch: &mut Scratch) {
        let Some(occlusion) = frame.ambient_occlusion.filter(|_| self.stage == Stage::Phong) else { return };
        let ambient = |i: usize| seen.k(i).k_a * frame.ambient_at(seen.n(i));
        let lit = |&i: &usize| seen.k(i).alpha > 0.0 && ambient(i) != Rgb::ZERO;
        let asked: Vec<usize> = (0..seen.points.len()).filter(lit).collect();
        let free = ambient_free(frame, occlusion, seen, &asked, draws, scratch);
        for (i, free) in asked.into_iter().zip(free) {
            let (k, n) = (seen.k(i), seen.n(i));
            let shadowed = k.k_e + k.k_a * frame.ambient_at(n) * free;
            let (group, at) = seen.columns.of_mut(i);
            group.shading.put_shadowed(at, shadowed);
        }
    }

    /// Loops over the lights and adds what each contributes where it is not blocked.
    fn shade(&self, frame: &Frame, seen: &mut Seen, draws: Draws, scratch: &mut Scratch) {
        if self.stage == Stage::Color {
            return;
        }
        let highlights = self.stage == Stage::Phong;
        if highlights {
            look_back(frame.accel, &mut seen.columns);
        }
        for (which, light) in frame.lights.iter().enumerate() {
            reach(frame, seen, light, highlights);
            if frame.shadows && self.stage != Stage::Diffuse {
                find_free(frame, which, seen, draws, scratch);
                for (to, &free) in
                    seen.reached.iter().zip(&scratch.free).filter(|(_, free)| **free != Rgb::ONE)
                {
                    let (group, at) = seen.columns.of_mut(to.point);
                    group.shading.withhold(at, free);
                }
            }
            sum_up(frame.accel, &mut seen.columns);
        }
    }

    /// Keeps the rays that something still shows through, each to go on behind its hit.
    fn go_on_behind(&self, scratch: &mut Scratch, whose: &mut Vec<usize>, open: &[Rgb]) {
        let goes_on = |i: &usize| !scratch.hits[*i].is_miss() && open[whose[*i]].max_element() > 0.0;
        let kept: Vec<usize> = (0..scratch.hits.len()).filter(goes_on).collect();
        scratch.rays.continue_behind(&kept, &scratch.hits);
        *whose = kept.iter().map(|&i| whose[i]).collect();
    }
}
