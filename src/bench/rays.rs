//! The rays that a benchmark traces, in the batches of a frame's tiles. They are generated once.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::scenes::noise::mix;
use crate::accel::{Accel, Coherence, HitBatch, RayBatch, ShadowRayBatch};
use crate::geometry::{Ray, cosine_hemisphere, offset_ray_origin};
use crate::integrator::{Frame, MaterialHitFilter, SurfacePoint};
use crate::render::{Film, PixelRect, RenderSettings};
use crate::scene::{PosedScene, Projection};

/// The rays of a tile.
struct TileRays {
    eye: RayBatch,
    shadow: ShadowRayBatch,
    incoherent: RayBatch,
}

/// The rays of a frame: eye rays, and from each of their hits a shadow ray to a point light and a random ray.
pub struct BenchRays {
    tiles: Vec<TileRays>,
}

impl BenchRays {
    /// Generates eye rays through the centres of all pixels, and the rays from their hits.
    pub fn new(frame: &Frame, settings: &RenderSettings) -> BenchRays {
        let light = light_position(frame);
        let tiles = Film::new(settings.window()).tiles(settings.tile);
        BenchRays {
            tiles: tiles.into_par_iter().map(|tile| tile_rays(frame, settings, tile, light)).collect(),
        }
    }

    /// The number of eye rays.
    pub fn eye_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.eye.len() as u64).sum()
    }

    /// The number of eye rays that hit something, which is the number of shadow rays and of incoherent rays.
    pub fn hit_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.shadow.len() as u64).sum()
    }

    /// Traces the eye rays on the current thread pool. Returns the number of hits.
    pub fn trace_eye(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        self.count_hits(accel, posed, |tile| &tile.eye)
    }

    /// Traces the cosine-distributed rays. Returns the number of hits.
    pub fn trace_incoherent(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        self.count_hits(accel, posed, |tile| &tile.incoherent)
    }

    /// Traces the shadow rays. Returns the number of occluded ones.
    pub fn trace_shadow(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        let count = |occluded: &mut Vec<bool>, tile: &TileRays| {
            accel.occluded(&tile.shadow, &MaterialHitFilter(posed), occluded);
            occluded.iter().filter(|&&occluded| occluded).count() as u64
        };
        self.tiles.par_iter().map_init(Vec::new, count).sum()
    }

    fn count_hits(&self, accel: &Accel, posed: &PosedScene, rays: fn(&TileRays) -> &RayBatch) -> u64 {
        let count = |hits: &mut HitBatch, tile: &TileRays| {
            accel.intersect(rays(tile), &MaterialHitFilter(posed), hits);
            hits.iter().filter(|hit| !hit.is_miss()).count() as u64
        };
        self.tiles.par_iter().map_init(HitBatch::new, count).sum()
    }
}

/// The position of the scene's first local light, or a point above the scene.
fn light_position(frame: &Frame) -> Vec3 {
    let position = frame.lights.iter().find_map(|light| light.position());
    position.unwrap_or_else(|| {
        let sphere = frame.posed.bounding_sphere();
        let above = DVec3::new(0.4, 1.0, 0.3) * 1.5 * sphere.radius;
        (sphere.centre - frame.posed.centre + above).as_vec3()
    })
}

fn tile_rays(frame: &Frame, settings: &RenderSettings, tile: PixelRect, light: Vec3) -> TileRays {
    let eye = eye_rays(frame, settings, tile);
    let mut hits = HitBatch::new();
    frame.accel.intersect(&eye, &MaterialHitFilter(frame.posed), &mut hits);
    let mut shadow = ShadowRayBatch { coherence: Coherence::Origin(light), ..ShadowRayBatch::default() };
    let mut incoherent = RayBatch::default();
    for (i, (hit, pixel)) in hits.iter().zip(tile.pixels()).enumerate().filter(|(_, (hit, _))| !hit.is_miss())
    {
        let ray = Ray { o: eye.origins[i], d: eye.directions[i] };
        let surface = SurfacePoint::at(frame.posed, hit.id, ray);
        let facing = if surface.n_g.dot(ray.d.as_dvec3()) > 0.0 { -surface.n_g } else { surface.n_g };
        let origin = |d: Vec3| offset_ray_origin(surface.p, surface.p_error, surface.n_g.as_vec3(), d);
        shadow.push(origin(light - surface.p), light, hit.id);
        let bits = mix(u64::from(pixel.y) << 32 | u64::from(pixel.x));
        let unit = |bits: u32| (bits >> 8) as f32 / (1u32 << 24) as f32;
        let d = cosine_hemisphere(facing, [unit(bits as u32), unit((bits >> 32) as u32)]).as_vec3();
        incoherent.push(origin(d), d);
    }
    TileRays { eye, shadow, incoherent }
}

fn eye_rays(frame: &Frame, settings: &RenderSettings, tile: PixelRect) -> RayBatch {
    let width = f64::from(settings.width);
    let height = f64::from(settings.height);
    let mut rays = RayBatch { cull_back_faces: frame.cull_back_faces, ..RayBatch::default() };
    for p in tile.pixels() {
        let x = (f64::from(p.x) + 0.5) / width;
        let y = 1.0 - (f64::from(p.y) + 0.5) / height;
        let ray = frame.camera.eye_ray(x, y, frame.posed.centre);
        rays.coherence = match frame.camera.projection {
            Projection::Perspective => Coherence::Origin(ray.o),
            Projection::Orthographic => Coherence::Direction(ray.d),
        };
        rays.push(ray.o, ray.d);
    }
    rays
}
