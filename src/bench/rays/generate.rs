//! Generates the rays of each stage from the hits of the stage before.

use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;

use super::ray_set::{RaySet, TileBatch, TileRays};
use crate::scenes::noise::mix;
use crate::stage::BenchStage;
use blinn_accel::{Coherence, HitBatch, RayBatch, ShadowRayBatch};
use blinn_core::geometry::{Hit, HitId, Ray, cosine_hemisphere, offset_ray_origin};
use blinn_render::integrator::{Frame, SurfacePoint};
use blinn_render::{Film, PixelRect, RenderSettings};
use blinn_scene::{PosedLightKind, Projection};

/// The length of ambient occlusion segments as a fraction of the scene's diagonal, as `blinn render --ao` has it.
const OCCLUSION_DISTANCE: f64 = 0.25;
/// Direction from the scene's centre to lights that the scene does not have.
const DEFAULT_LIGHT: DVec3 = DVec3::new(0.4, 1.0, 0.3);

/// Generates the rays of every stage that traces rays, one stage after the other in the order of [`BenchStage::ALL`].
///
/// Each set is generated when it is requested, on the current thread pool, and dropped for the next one. At most two
/// sets are in memory, with the hits of one.
#[derive(Debug)]
pub struct RaySets<'f, 's> {
    frame: &'f Frame<'s>,
    settings: RenderSettings,
    lights: LightTargets,
    stages: std::slice::Iter<'static, BenchStage>,
    /// The rays whose hits further rays start from.
    source: RaySet,
    hits: Vec<HitBatch>,
    /// Rays that no others start from.
    current: Option<RaySet>,
}

impl<'f, 's> RaySets<'f, 's> {
    /// Prepares the rays of images of the size and the tiles of `settings`.
    pub fn new(frame: &'f Frame<'s>, settings: &RenderSettings) -> RaySets<'f, 's> {
        RaySets {
            frame,
            settings: *settings,
            lights: LightTargets::new(frame),
            stages: BenchStage::ALL.iter(),
            source: RaySet { stage: BenchStage::Eye, tiles: Vec::new() },
            hits: Vec::new(),
            current: None,
        }
    }

    /// Generates the rays of the next stage. `None` after the last one, or where no ray has hit anything.
    pub fn next_set(&mut self) -> Option<&RaySet> {
        self.current = None;
        let stage = *self.stages.find(|stage| stage.traces_rays())?;
        let set = match stage {
            BenchStage::Eye => eye_rays(self.frame, &self.settings),
            _ => derive(self.frame, &self.lights, &self.source, &self.hits, stage),
        };
        if set.is_empty() {
            self.stages = [].iter();
            return None;
        }
        if stage == BenchStage::Eye || BenchStage::BOUNCES.contains(&stage) {
            self.hits = set.hits(self.frame.accel, self.frame.posed);
            self.source = set;
            return Some(&self.source);
        }
        Some(self.current.insert(set))
    }
}

/// The lights that shadow rays go to.
#[derive(Debug)]
struct LightTargets {
    /// The position of the scene's first local light, or a point above the scene.
    point: Vec3,
    /// The direction to the scene's first directional light, or to one above the scene. Unit length.
    to_sun: Vec3,
    /// The length of ambient occlusion segments in metres.
    occlusion_distance: f64,
}

impl LightTargets {
    fn new(frame: &Frame) -> LightTargets {
        let above = || {
            let sphere = frame.posed.bounding_sphere();
            (sphere.centre - frame.posed.centre + DEFAULT_LIGHT * 1.5 * sphere.radius).as_vec3()
        };
        let to_sun = frame.lights.iter().find_map(|light| match light.kind {
            PosedLightKind::Directional { direction } => Some(-direction),
            _ => None,
        });
        LightTargets {
            point: frame.lights.iter().find_map(|light| light.position()).unwrap_or_else(above),
            to_sun: to_sun.unwrap_or_else(|| DEFAULT_LIGHT.normalize().as_vec3()),
            occlusion_distance: OCCLUSION_DISTANCE * 2.0 * frame.posed.bounding_radius(),
        }
    }
}

/// Eye rays through the centres of all pixels.
fn eye_rays(frame: &Frame, settings: &RenderSettings) -> RaySet {
    let tiles = Film::new(settings.window()).tiles(settings.tile);
    let tiles = tiles.into_par_iter().map(|tile| tile_eye_rays(frame, settings, tile)).collect();
    RaySet { stage: BenchStage::Eye, tiles }
}

fn tile_eye_rays(frame: &Frame, settings: &RenderSettings, tile: PixelRect) -> TileRays {
    let width = f64::from(settings.width);
    let height = f64::from(settings.height);
    let mut rays = RayBatch { cull_back_faces: frame.cull_back_faces, ..RayBatch::default() };
    let pixels: Vec<UVec2> = tile.pixels().collect();
    for p in &pixels {
        let x = (f64::from(p.x) + 0.5) / width;
        let y = 1.0 - (f64::from(p.y) + 0.5) / height;
        let ray = frame.camera.eye_ray(x, y, frame.posed.centre);
        rays.coherence = match frame.camera.projection {
            Projection::Perspective => Coherence::Origin(ray.o),
            Projection::Orthographic => Coherence::Direction(ray.d),
        };
        rays.push(ray.o, ray.d);
    }
    TileRays { batch: TileBatch::Closest(rays), pixels }
}

/// The rays of `stage` from the hits of `set`.
fn derive(
    frame: &Frame,
    lights: &LightTargets,
    set: &RaySet,
    hits: &[HitBatch],
    stage: BenchStage,
) -> RaySet {
    let derive_tile = |(tile, hits): (&TileRays, &HitBatch)| {
        let (mut batch, mut pixels) = (empty_batch(lights, stage), Vec::new());
        if let TileBatch::Closest(rays) = &tile.batch {
            for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| !hit.is_miss()) {
                let ray = Ray { o: rays.origins[i], d: rays.directions[i] };
                let point = HitPoint::new(frame, hit, ray, tile.pixels[i]);
                point.push_ray(lights, stage, &mut batch);
                pixels.push(tile.pixels[i]);
            }
        }
        TileRays { batch, pixels }
    };
    RaySet { stage, tiles: set.tiles.par_iter().zip(hits).map(derive_tile).collect() }
}

fn empty_batch(lights: &LightTargets, stage: BenchStage) -> TileBatch {
    let segments = |coherence| TileBatch::Any(ShadowRayBatch { coherence, ..ShadowRayBatch::default() });
    match stage {
        BenchStage::Shadow => segments(Coherence::Origin(lights.point)),
        BenchStage::Sun => segments(Coherence::Direction(lights.to_sun)),
        BenchStage::AmbientOcclusion => segments(Coherence::None),
        _ => TileBatch::Closest(RayBatch::default()),
    }
}

/// A hit that further rays start from.
struct HitPoint<'s> {
    surface: SurfacePoint<'s>,
    /// The geometric and the interpolated normal on the side that was hit.
    n_g: DVec3,
    n_v: DVec3,
    /// The unit direction of the ray that hit it.
    d: DVec3,
    id: HitId,
    pixel: UVec2,
}

impl<'s> HitPoint<'s> {
    fn new(frame: &Frame<'s>, hit: &Hit, ray: Ray, pixel: UVec2) -> HitPoint<'s> {
        let surface = SurfacePoint::at(frame.posed, hit, ray);
        let id = hit.id;
        let d = ray.d.as_dvec3().normalize();
        let side = if surface.n_g.dot(d) > 0.0 { -1.0 } else { 1.0 };
        HitPoint { n_g: surface.n_g * side, n_v: surface.n_v * side, surface, d, id, pixel }
    }

    /// Adds the ray of `stage` from this hit.
    fn push_ray(&self, lights: &LightTargets, stage: BenchStage, batch: &mut TileBatch) {
        match batch {
            TileBatch::Closest(rays) => {
                let d = match stage {
                    BenchStage::Reflection => self.mirror_direction().as_vec3(),
                    _ => self.random_direction(stage).as_vec3(),
                };
                rays.push(self.origin(d), d);
                rays.source.push(self.id);
            }
            TileBatch::Any(segments) => {
                let (from, to) = match stage {
                    BenchStage::Shadow => (self.origin(lights.point - self.surface.p), lights.point),
                    BenchStage::Sun => (self.origin(lights.to_sun), Vec3::ZERO),
                    _ => {
                        let d = self.random_direction(stage);
                        let from = self.origin(d.as_vec3());
                        (from, (from.as_dvec3() + d * lights.occlusion_distance).as_vec3())
                    }
                };
                segments.push(from, to, self.id);
            }
        }
    }

    /// A ray origin that clears the surface toward `d`.
    fn origin(&self, d: Vec3) -> Vec3 {
        offset_ray_origin(self.surface.p, self.surface.p_error, self.surface.n_g.as_vec3(), d)
    }

    /// A cosine-distributed direction, which depends on the pixel and the stage.
    fn random_direction(&self, stage: BenchStage) -> DVec3 {
        // Bounce 1 has no salt: its rays are those of version 1 of the results.
        let salt = match stage {
            BenchStage::AmbientOcclusion => 5,
            BenchStage::Bounce2 => 2,
            BenchStage::Bounce3 => 3,
            BenchStage::Bounce4 => 4,
            _ => 0,
        };
        let pixel = u64::from(self.pixel.y) << 32 | u64::from(self.pixel.x);
        let bits = mix(pixel ^ mix(salt));
        let unit = |bits: u32| (bits >> 8) as f32 / (1u32 << 24) as f32;
        cosine_hemisphere(self.n_g, [unit(bits as u32), unit((bits >> 32) as u32)])
    }

    /// The mirror direction about the interpolated normal, mirrored out of the surface where it points into it.
    fn mirror_direction(&self) -> DVec3 {
        let r = self.d - self.n_v * (2.0 * self.d.dot(self.n_v));
        (r - self.n_g * (2.0 * r.dot(self.n_g).min(0.0))).normalize()
    }
}
