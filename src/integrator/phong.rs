//! The lecture's last slide:
//!
//! L = k_a I_a + Σ [ k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p ]
//!
//! over the lights that a shadow ray reaches, plus what the surface emits itself.

use glam::DVec3;

use super::coefficients::lobe;
use super::{Coefficients, Frame, Integrator, Materials, Sample, Scratch, Surface};
use crate::accel::Shared;
use crate::geometry::{HitId, Ray, Rgb, Rgba};
use crate::scene::{Incident, PosedKind, PosedLight};

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

/// A surface point about to be shaded.
struct Point<'s> {
    sample: usize,
    surface: Surface<'s>,
    k: Coefficients,
    /// Shading normal.
    n: DVec3,
    /// To the eye.
    v: DVec3,
    /// L, as far as it is summed up.
    radiance: Rgb,
}

impl Integrator for Phong {
    fn render(&self, frame: &Frame, samples: &[Sample], scratch: &mut Scratch, out: &mut [Rgba]) {
        let materials = Materials(frame.posed);
        // What of the background still shows through, by colour.
        let mut open = vec![Rgb::ONE; samples.len()];
        let mut seen = vec![Rgb::ZERO; samples.len()];
        let mut whose: Vec<usize> = (0..samples.len()).collect();
        frame.eye_rays(samples, &mut scratch.rays);
        for _ in 0..MAX_LAYERS {
            frame.accel.intersect(&scratch.rays, &materials, &mut scratch.hits);
            let mut points = self.points(frame, scratch, &whose);
            self.shade(frame, &mut points, scratch);
            for point in &points {
                let Coefficients { alpha, through, .. } = point.k;
                let open = &mut open[point.sample];
                seen[point.sample] += *open * point.radiance * alpha;
                *open *= Rgb::splat(1.0 - alpha) + through * alpha;
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
}

impl Phong {
    /// The surface points of a batch of hits, with all that does not depend on lights.
    fn points<'s>(&self, frame: &Frame<'s>, scratch: &Scratch, whose: &[usize]) -> Vec<Point<'s>> {
        let mut points = Vec::with_capacity(whose.len());
        for (i, (hit, &sample)) in scratch.hits.iter().zip(whose).enumerate() {
            if hit.is_miss() {
                continue;
            }
            let ray = Ray { o: scratch.rays.origins[i], d: scratch.rays.directions[i] };
            let surface = Surface::at(frame.posed, hit.id, ray);
            let k = Coefficients::at(frame.posed, &surface, &frame.overrides);
            let radiance = match self.stage {
                Stage::Color => k.color,
                Stage::Diffuse | Stage::Shadow => Rgb::ZERO,
                Stage::Phong => k.k_e + k.k_a * frame.ambient,
            };
            let n = surface.shading_normal(frame.posed);
            points.push(Point { sample, n, v: frame.to_eye(ray.d), surface, k, radiance });
        }
        points
    }

    /// Loops over the lights and adds what each contributes where it is not blocked.
    fn shade(&self, frame: &Frame, points: &mut [Point], scratch: &mut Scratch) {
        if self.stage == Stage::Color {
            return;
        }
        for light in &frame.lights {
            let lit: Vec<(usize, Incident)> = points
                .iter()
                .enumerate()
                .filter_map(|(i, point)| {
                    let incident = light.incident(point.surface.p)?;
                    // Nothing where the light sees one side of the surface and the eye the other.
                    let facing = point.n.dot(incident.l) > 0.0 && point.surface.n_v.dot(incident.l) > 0.0;
                    facing.then_some((i, incident))
                })
                .collect();
            self.find_free(frame, light, points, &lit, scratch);
            for (&(i, incident), &free) in lit.iter().zip(&scratch.free) {
                let point = &mut points[i];
                point.radiance += free * self.reflected(point, incident);
            }
        }
    }

    /// k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p.
    fn reflected(&self, point: &Point, Incident { l, arriving }: Incident) -> Rgb {
        let (n, k) = (point.n, &point.k);
        let diffuse = k.k_d * n.dot(l).max(0.0) as f32;
        if self.stage != Stage::Phong || k.k_s == Rgb::ZERO {
            return arriving * diffuse;
        }
        let specular = k.k_s * lobe(n, l, point.v, k.shininess) as f32;
        arriving * (diffuse + specular)
    }

    /// Fills `scratch.free`: how much of the light's way to each lit point is free, by colour.
    fn find_free(
        &self,
        frame: &Frame,
        light: &PosedLight,
        points: &[Point],
        lit: &[(usize, Incident)],
        scratch: &mut Scratch,
    ) {
        scratch.free.clear();
        if !frame.shadows || self.stage == Stage::Diffuse {
            scratch.free.resize(lit.len(), Rgb::ONE);
            return;
        }
        let segments = &mut scratch.segments;
        segments.clear();
        segments.shared = match light.kind {
            PosedKind::Directional { direction } => Shared::Direction(-direction),
            PosedKind::Point { position } | PosedKind::Spot { position, .. } => Shared::Origin(position),
        };
        for &(i, incident) in lit {
            let s = &points[i].surface;
            let from = s.shadow_origin(frame.posed, incident.l);
            // A light that the smooth surface sees and the triangle does not is seen past the
            // triangle's edge, or not at all.
            let above = s.n_g.dot(incident.l) > 0.0;
            segments.push(from, light.position().unwrap_or_default(), if above { s.id } else { HitId::NONE });
        }
        let materials = Materials(frame.posed);
        if frame.accel.has_translucent() {
            frame.accel.transmittance(segments, &materials, &mut scratch.free);
        } else {
            frame.accel.occluded(segments, &materials, &mut scratch.blocked);
            let free = scratch.blocked.iter().map(|&b| if b { Rgb::ZERO } else { Rgb::ONE });
            scratch.free.extend(free);
        }
    }

    /// Keeps the rays that something still shows through, each to go on behind its hit.
    fn go_on_behind(&self, scratch: &mut Scratch, whose: &mut Vec<usize>, open: &[Rgb]) {
        let goes_on = |i: &usize| !scratch.hits[*i].is_miss() && open[whose[*i]].max_element() > 0.0;
        let kept: Vec<usize> = (0..scratch.hits.len()).filter(goes_on).collect();
        scratch.rays.keep_behind(&kept, &scratch.hits);
        *whose = kept.iter().map(|&i| whose[i]).collect();
    }
}
