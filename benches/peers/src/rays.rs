//! The rays that both engines trace: generated once from the hits of the eye rays, in a batch per tile.

use blinn::accel::{Accel, Coherence, HitFilter, RayBatch, ShadowRayBatch};
use blinn::geometry::{HitId, Ray, offset_ray_origin};
use blinn::integrator::SurfacePoint;
use blinn::scene::PosedScene;
use blinn_scenes::GeneratedScene;
use glam::{Vec3, vec3};

/// A hit filter for opaque scenes.
pub struct Opaque;

impl HitFilter for Opaque {
    fn accepts(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmittance(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

/// The size of the image, its tiles and its samples.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    pub width: u32,
    pub height: u32,
    /// Side of a tile in pixels.
    pub tile: u32,
    /// Samples per pixel.
    pub samples: u32,
}

/// The rays of a tile in blinn's layout.
pub enum Batch {
    Closest(RayBatch),
    Any(ShadowRayBatch),
}

impl Batch {
    pub fn len(&self) -> usize {
        match self {
            Batch::Closest(rays) => rays.len(),
            Batch::Any(segments) => segments.len(),
        }
    }

    /// Origin, direction and greatest t of ray `i`, as Embree takes it.
    pub fn ray(&self, i: usize) -> (Vec3, Vec3, f32) {
        match self {
            Batch::Closest(rays) => (rays.origins[i], rays.directions[i], rays.t_max),
            Batch::Any(s) => match s.coherence {
                Coherence::Direction(d) => (s.from[i], d, f32::INFINITY),
                Coherence::Origin(light) => (s.from[i], light - s.from[i], 1.0),
                Coherence::None => (s.from[i], s.to[i] - s.from[i], 1.0),
            },
        }
    }
}

/// The rays of one kind.
pub struct RaySet {
    pub name: String,
    /// One batch per tile.
    pub batches: Vec<Batch>,
    /// The indices of each batch's rays in squares of 4 × 4 pixels: the best order for Embree's packets. blinn's
    /// batches are in Morton order.
    pub packet_order: Vec<Vec<u32>>,
    /// Embree's smallest t, against self-intersection. blinn's hits are exact enough not to need it.
    pub margin: f32,
}

/// The margin relative to the size of the scene.
pub const MARGIN: f32 = 1e-4;

/// Lengths of occlusion rays relative to the size of the scene.
const LONG: f32 = 4.0;
const SHORT: f32 = 0.02;

impl RaySet {
    pub fn rays(&self) -> usize {
        self.batches.iter().map(Batch::len).sum()
    }

    /// The point light where all segments end; they can also be traced from there.
    pub fn light(&self) -> Option<Vec3> {
        match self.batches.first() {
            Some(Batch::Any(ShadowRayBatch { coherence: Coherence::Origin(light), .. })) => Some(*light),
            _ => None,
        }
    }
}

/// The samples of a tile: positions on the film in 0…1 with y upward, and the order of Embree's packets.
struct Tile {
    samples: Vec<(f32, f32)>,
    squares: Vec<u32>,
}

/// A random number in 0…1 for a sample and a dimension.
fn random(i: u32, purpose: u32) -> f32 {
    let mut x = i.wrapping_mul(0x9e37_79b9) ^ purpose.wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    ((x ^ (x >> 16)) >> 8) as f32 / (1u32 << 24) as f32
}

fn tiles(film: Film) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for (top, left) in (0..film.height)
        .step_by(film.tile as usize)
        .flat_map(|y| (0..film.width).step_by(film.tile as usize).map(move |x| (y, x)))
    {
        let mut tile = Tile { samples: Vec::new(), squares: Vec::new() };
        for (i, j) in morton_order(film.tile) {
            let (x, y) = (left + i, top + j);
            if x < film.width && y < film.height {
                for s in 0..film.samples {
                    let id = (y * film.width + x) * film.samples + s;
                    let at = |purpose| if film.samples == 1 { 0.5 } else { random(id, purpose) };
                    let (u, v) =
                        ((x as f32 + at(1)) / film.width as f32, (y as f32 + at(2)) / film.height as f32);
                    tile.samples.push((u, 1.0 - v));
                    // Square, then sample, then pixel in the square.
                    let square = (j / 4) * film.tile.div_ceil(4) + i / 4;
                    tile.squares.push((square * film.samples + s) * 16 + (j % 4) * 4 + i % 4);
                }
            }
        }
        tiles.push(tile);
    }
    tiles
}

/// The pixels of a tile in Morton order, as in blinn's renderer.
fn morton_order(side: u32) -> impl Iterator<Item = (u32, u32)> {
    let even = |mut x: u32| {
        x &= 0x5555_5555;
        for (shift, mask) in [(1, 0x3333_3333), (2, 0x0f0f_0f0f), (4, 0x00ff_00ff), (8, 0x0000_ffff)] {
            x = (x | x >> shift) & mask;
        }
        x
    };
    let whole = side.next_power_of_two();
    (0..whole * whole).map(move |i| (even(i), even(i >> 1))).filter(move |&(x, y)| x < side && y < side)
}

/// Indices sorted by their squares.
fn square_order(squares: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..squares.len() as u32).collect();
    order.sort_by_key(|&i| squares[i as usize]);
    order
}

/// All sets of rays of a scene.
pub struct Rays {
    pub eye: RaySet,
    pub orthographic: RaySet,
    /// Shadow rays to the point light, one per hit.
    pub shadow: RaySet,
    /// Shadow rays to the sun, one per hit.
    pub sun: RaySet,
    /// Closest hits of cosine-distributed directions, one per hit.
    pub bounce: RaySet,
    /// Any hits of cosine-distributed directions, one per hit: long, and up to a fiftieth of the scene's size.
    pub open: RaySet,
    pub near: RaySet,
}

impl Rays {
    pub fn all(&self) -> [&RaySet; 7] {
        [&self.eye, &self.shadow, &self.sun, &self.orthographic, &self.bounce, &self.open, &self.near]
    }

    pub fn new(scene: &GeneratedScene, posed: &PosedScene, accel: &Accel, film: Film) -> Rays {
        let (eye, forward) = (Vec3::from(scene.eye), (Vec3::from(scene.target) - Vec3::from(scene.eye)));
        let (right, distance) = (forward.cross(Vec3::Y).normalize(), forward.length());
        let forward = forward.normalize();
        let up = right.cross(forward);
        let high = (scene.yfov.to_radians() * 0.5).tan();
        let wide = high * film.width as f32 / film.height as f32;
        let size = distance.max(1e-3);
        let set = |name: &str, margin| RaySet {
            name: name.into(),
            batches: Vec::new(),
            packet_order: Vec::new(),
            margin,
        };
        let mut rays = Rays {
            eye: set("eye", 0.0),
            orthographic: set("orthographic", 0.0),
            shadow: set("shadow, point", MARGIN),
            sun: set("shadow, sun", MARGIN * size),
            bounce: set("bounce", MARGIN * size),
            open: set("any hit, long", MARGIN / LONG),
            near: set("any hit, short", MARGIN / SHORT),
        };
        let mut id = 0;
        for tile in tiles(film) {
            let mut perspective = RayBatch { coherence: Coherence::Origin(eye), ..RayBatch::default() };
            let mut parallel = RayBatch { coherence: Coherence::Direction(forward), ..RayBatch::default() };
            for &(x, y) in &tile.samples {
                let across = right * ((2.0 * x - 1.0) * wide) + up * ((2.0 * y - 1.0) * high);
                perspective.push(eye, forward + across);
                parallel.push(eye + across * distance, forward);
            }
            let mut hits = Vec::new();
            accel.intersect(&perspective, &Opaque, &mut hits);
            let from_here = |shared| ShadowRayBatch { coherence: shared, ..ShadowRayBatch::default() };
            let (light, to_sun) = (Vec3::from(scene.light), -Vec3::from(scene.sun_direction).normalize());
            let mut shadow = from_here(Coherence::Origin(light));
            let mut sun = from_here(Coherence::Direction(to_sun));
            let (mut open, mut near) = (from_here(Coherence::None), from_here(Coherence::None));
            let mut bounce = RayBatch::default();
            let mut squares = Vec::new();
            for (i, hit) in hits.iter().enumerate() {
                id += 1;
                if hit.is_miss() {
                    continue;
                }
                squares.push(tile.squares[i]);
                let ray = Ray { o: perspective.origins[i], d: perspective.directions[i] };
                let surface = SurfacePoint::at(posed, hit, ray);
                let mut n = surface.n_g.as_vec3();
                let from = |towards: Vec3| offset_ray_origin(surface.p, surface.p_error, n, towards);
                shadow.push(from(light - surface.p), light, hit.id);
                sun.push(from(to_sun), Vec3::ZERO, hit.id);
                if n.dot(ray.d) > 0.0 {
                    n = -n;
                }
                let d = cosine_direction(n, random(id, 3), random(id, 4));
                let o = offset_ray_origin(surface.p, surface.p_error, n, n);
                bounce.push(o, d);
                bounce.source.push(hit.id);
                open.push(o, o + d * (LONG * size), hit.id);
                near.push(o, o + d * (SHORT * size), hit.id);
            }
            let full = square_order(&tile.squares);
            let hit = square_order(&squares);
            for (set, batch, order) in [
                (&mut rays.eye, Batch::Closest(perspective), &full),
                (&mut rays.orthographic, Batch::Closest(parallel), &full),
                (&mut rays.shadow, Batch::Any(shadow), &hit),
                (&mut rays.sun, Batch::Any(sun), &hit),
                (&mut rays.bounce, Batch::Closest(bounce), &hit),
                (&mut rays.open, Batch::Any(open), &hit),
                (&mut rays.near, Batch::Any(near), &hit),
            ] {
                set.batches.push(batch);
                set.packet_order.push(order.clone());
            }
        }
        rays
    }
}

/// A cosine-distributed direction around the unit normal `n`.
fn cosine_direction(n: Vec3, a: f32, b: f32) -> Vec3 {
    let side = if n.y.abs() < 0.9 { vec3(0.0, 1.0, 0.0) } else { vec3(1.0, 0.0, 0.0) };
    let x = side.cross(n).normalize();
    let y = n.cross(x);
    let (sin, cos) = (a * std::f32::consts::TAU).sin_cos();
    let r = b.sqrt();
    x * (r * cos) + y * (r * sin) + n * (1.0 - b).max(0.0).sqrt()
}
