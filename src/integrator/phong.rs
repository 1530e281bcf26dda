//! The lecture's last slide:
//!
//! L = k_a I_a + Σ [ k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p ]
//!
//! over the lights that a shadow ray reaches, plus what the surface emits itself.

use super::coefficients::Lookup;
use super::draws::Draws;
use super::facet::Facets;
use super::occlusion::ambient_free;
use super::point::{Place, Point};
use super::shadow::find_free;
use super::{Frame, Integrator, LowDiscrepancy, Materials, Sample, Scratch};
use crate::geometry::{Ray, Rgb, Rgba};

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

/// Blinn-Phong, to the stage that is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Phong {
    /// How far through the lecture.
    pub stage: Stage,
}

/// Surfaces along one eye ray that are looked through before the rest is let go.
const MAX_LAYERS: usize = 4096;
/// Less than this share of what is behind is nothing.
const FAINT: f32 = 1.0 / (1 << 20) as f32;

impl Integrator for Phong {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancy,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        let materials = Materials(frame.posed);
        let draws = Draws { samples, sampler };
        // What of the background still shows through, by colour.
        let mut open = vec![Rgb::ONE; samples.len()];
        let mut seen = vec![Rgb::ZERO; samples.len()];
        let mut whose: Vec<usize> = (0..samples.len()).collect();
        frame.eye_rays(samples, &mut scratch.rays);
        let mut ground = frame.meet_ground(&scratch.rays);
        for _ in 0..MAX_LAYERS {
            frame.accel.intersect(&scratch.rays, &materials, &mut scratch.hits);
            let mut points = self.points(frame, scratch, samples, &whose, &mut ground);
            self.ambient(frame, &mut points, draws, scratch);
            self.shade(frame, &mut points, draws, scratch);
            for point in &points {
                let (shown, passes) = point.layer();
                seen[point.sample] += open[point.sample] * shown;
                open[point.sample] *= passes;
                if open[point.sample].max_element() < FAINT {
                    open[point.sample] = Rgb::ZERO;
                }
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

    fn may_see(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        frame.may_see(low, high)
    }
}

impl Phong {
    /// The points of a batch of hits, and those of the ground where it comes first, with all that
    /// does not depend on light.
    fn points<'s>(
        &self,
        frame: &Frame<'s>,
        scratch: &Scratch,
        samples: &[Sample],
        whose: &[usize],
        ground: &mut [Option<f64>],
    ) -> Vec<Point<'s>> {
        let mut points = Vec::with_capacity(whose.len());
        let (mut facets, mut coefficients) = (Facets::new(), Lookup::new(frame.sky.is_some()));
        let (mut size, mut differential) = ([0.0; 2], None);
        for (i, (hit, &sample)) in scratch.hits.iter().zip(whose).enumerate() {
            let ray = Ray { o: scratch.rays.origins[i], d: scratch.rays.directions[i] };
            // t of a hit is right to an ulp or so: what lies on the ground is before it.
            let before = |t: &mut f64| hit.is_miss() || (*t as f32) < hit.t.next_down();
            if let Some(t) = ground.get_mut(sample).and_then(|t| t.take_if(before)) {
                points.extend(frame.ground_point(sample, ray, t));
            }
            if hit.is_miss() {
                continue;
            }
            if samples[sample].size != size {
                size = samples[sample].size;
                differential = frame.differential(size);
            }
            let surface = facets.of(frame.posed, hit.id).seen(ray, differential.as_ref());
            let (n, roughening) = surface.shading_normals(frame.posed);
            let k = coefficients.at(frame.posed, &surface, roughening, &frame.overrides);
            let (radiance, unshadowed) = (Rgb::ZERO, Rgb::ZERO);
            // Nobody sees how what is not there is lit.
            if k.alpha == 0.0 {
                continue;
            }
            let place = Place::Surface(surface);
            points.push(Point { sample, place, k, n, d: ray.d, radiance, unshadowed });
        }
        points
    }

    /// k_e + k_a I_a: what needs no light in particular, the ambient term as far as it arrives.
    fn ambient(&self, frame: &Frame, points: &mut [Point], draws: Draws, scratch: &mut Scratch) {
        for point in points.iter_mut() {
            point.radiance = match self.stage {
                Stage::Color => point.k.color,
                Stage::Diffuse | Stage::Shadow => Rgb::ZERO,
                Stage::Phong => point.k.k_e + point.k.k_a * frame.ambient_at(point.n),
            };
            point.unshadowed = point.radiance;
        }
        let Some(occlusion) = frame.occlusion.filter(|_| self.stage == Stage::Phong) else { return };
        let lit = |&i: &usize| points[i].k.k_a * frame.ambient_at(points[i].n) != Rgb::ZERO;
        let asked: Vec<usize> = (0..points.len()).filter(lit).collect();
        let free = ambient_free(frame, occlusion, points, &asked, draws, scratch);
        for (i, free) in asked.into_iter().zip(free) {
            let k = &points[i].k;
            points[i].radiance = k.k_e + k.k_a * frame.ambient_at(points[i].n) * free;
        }
    }

    /// Loops over the lights and adds what each contributes where it is not blocked.
    fn shade(&self, frame: &Frame, points: &mut [Point], draws: Draws, scratch: &mut Scratch) {
        if self.stage == Stage::Color {
            return;
        }
        let mut columns = std::mem::take(&mut scratch.columns);
        columns.set(frame.accel, points);
        for (which, light) in frame.lights.iter().enumerate() {
            let reached = columns.reached(frame.accel, light, self.stage == Stage::Phong);
            if frame.shadows && self.stage != Stage::Diffuse {
                find_free(frame, which, points, &reached, draws, scratch);
            } else {
                scratch.free.clear();
                scratch.free.resize(reached.len(), Rgb::ONE);
            }
            for (light, &free) in reached.iter().zip(&scratch.free) {
                let point = &mut points[light.point];
                let reflected = light.reflected(&point.k);
                point.radiance += free * reflected;
                point.unshadowed += reflected;
            }
        }
        scratch.columns = columns;
    }

    /// Keeps the rays that something still shows through, each to go on behind its hit.
    fn go_on_behind(&self, scratch: &mut Scratch, whose: &mut Vec<usize>, open: &[Rgb]) {
        let goes_on = |i: &usize| !scratch.hits[*i].is_miss() && open[whose[*i]].max_element() > 0.0;
        let kept: Vec<usize> = (0..scratch.hits.len()).filter(goes_on).collect();
        scratch.rays.keep_behind(&kept, &scratch.hits);
        *whose = kept.iter().map(|&i| whose[i]).collect();
    }
}
