//! The rays that are traced: made once from a frame, in the batches that its tiles give.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::scenes::noise::mix;
use crate::accel::{Accel, Coherence, HitBatch, RayBatch, SegmentBatch};
use crate::geometry::{Ray, cosine_hemisphere, offset_ray_origin};
use crate::integrator::{Frame, MaterialHitFilter, SurfacePoint};
use crate::render::{Film, PixelRect, RenderSettings};
use crate::scene::{PosedScene, Projection};

/// The rays of a tile.
struct Batches {
    eye: RayBatch,
    shadow: SegmentBatch,
    incoherent: RayBatch,
}

/// The rays of a picture: those of the eye, and of each that hits something one to a point light and one
/// anywhere.
pub struct BenchRays {
    tiles: Vec<Batches>,
}

impl BenchRays {
    /// Through the centres of all pixels, and from what they hit.
    pub fn new(frame: &Frame, settings: &RenderSettings) -> BenchRays {
        let light = light(frame);
        let tiles = Film::new(settings.window()).tiles(settings.tile);
        BenchRays { tiles: tiles.into_par_iter().map(|tile| batches(frame, settings, tile, light)).collect() }
    }

    /// Number of eye rays.
    pub fn eye_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.eye.len() as u64).sum()
    }

    /// Number of eye rays that hit something: as many go on to the light, and as many anywhere.
    pub fn hit_count(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.shadow.len() as u64).sum()
    }

    /// Traces the eye rays on all threads of the current pool. Number of those that hit something.
    pub fn trace_eye(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        self.closest(accel, posed, |tile| &tile.eye)
    }

    /// The same of rays from there to anywhere above the surface, as dense as their cosine.
    pub fn trace_incoherent(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        self.closest(accel, posed, |tile| &tile.incoherent)
    }

    /// The same of the ways from there to the light. Number of those that something blocks.
    pub fn trace_shadow(&self, accel: &Accel, posed: &PosedScene) -> u64 {
        let blocked = |out: &mut Vec<bool>, tile: &Batches| {
            accel.occluded(&tile.shadow, &MaterialHitFilter(posed), out);
            out.iter().filter(|&&blocked| blocked).count() as u64
        };
        self.tiles.par_iter().map_init(Vec::new, blocked).sum()
    }

    /// Number of rays that hit something.
    fn closest(&self, accel: &Accel, posed: &PosedScene, of: fn(&Batches) -> &RayBatch) -> u64 {
        let hits = |out: &mut HitBatch, tile: &Batches| {
            accel.intersect(of(tile), &MaterialHitFilter(posed), out);
            out.iter().filter(|hit| !hit.is_miss()).count() as u64
        };
        self.tiles.par_iter().map_init(HitBatch::new, hits).sum()
    }
}

/// The scene's first light that has a place, or a place above the scene and aside.
fn light(frame: &Frame) -> Vec3 {
    let placed = frame.lights.iter().find_map(|light| light.position());
    placed.unwrap_or_else(|| {
        let sphere = frame.posed.bounding_sphere();
        let above = DVec3::new(0.4, 1.0, 0.3) * 1.5 * sphere.radius;
        (sphere.centre - frame.posed.centre + above).as_vec3()
    })
}

fn batches(frame: &Frame, settings: &RenderSettings, tile: PixelRect, light: Vec3) -> Batches {
    let (width, height) = (f64::from(settings.width), f64::from(settings.height));
    let mut eye = RayBatch { cull_back_faces: frame.cull_back_faces, ..RayBatch::default() };
    for p in tile.pixels() {
        let (x, y) = ((f64::from(p.x) + 0.5) / width, 1.0 - (f64::from(p.y) + 0.5) / height);
        let ray = frame.camera.eye_ray(x, y, frame.posed.centre);
        eye.coherence = match frame.camera.projection {
            Projection::Perspective => Coherence::Origin(ray.o),
            Projection::Orthographic => Coherence::Direction(ray.d),
        };
        eye.push(ray.o, ray.d);
    }
    let mut hits = HitBatch::new();
    frame.accel.intersect(&eye, &MaterialHitFilter(frame.posed), &mut hits);
    let mut shadow = SegmentBatch { coherence: Coherence::Origin(light), ..SegmentBatch::default() };
    let mut incoherent = RayBatch::default();
    for (i, (hit, pixel)) in hits.iter().zip(tile.pixels()).enumerate().filter(|(_, (hit, _))| !hit.is_miss())
    {
        let ray = Ray { o: eye.origins[i], d: eye.directions[i] };
        let surface = SurfacePoint::at(frame.posed, hit.id, ray);
        let facing = if surface.n_g.dot(ray.d.as_dvec3()) > 0.0 { -surface.n_g } else { surface.n_g };
        let lifted =
            |towards: Vec3| offset_ray_origin(surface.p, surface.p_error, surface.n_g.as_vec3(), towards);
        shadow.push(lifted(light - surface.p), light, hit.id);
        let bits = mix(u64::from(pixel.y) << 32 | u64::from(pixel.x));
        let unit = |bits: u32| (bits >> 8) as f32 / (1u32 << 24) as f32;
        let d = cosine_hemisphere(facing, [unit(bits as u32), unit((bits >> 32) as u32)]).as_vec3();
        incoherent.push(lifted(d), d);
    }
    Batches { eye, shadow, incoherent }
}
