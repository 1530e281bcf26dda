//! The rays of a packet as structure of arrays, and how they are loaded from a batch.

use glam::{DVec3, Vec3};

use crate::packet::packet_frustum::PacketFrustum;
use crate::packet::per_ray::{
    GROUPS_PER_PACKET, GROUPS_PER_QUAD, PACKET_SIZE, PerRay, RAYS_PER_GROUP, RayMask,
};
use crate::traverse::box_test::MIN_DIRECTION;
use crate::traverse::exact_triangle_test::{floor_power_of_two, invert_power_of_two};
use blinn_core::geometry::EPSILON;
use blinn_core::simd::{Lanes, Simd, prefetch};

/// Directions whose largest component is between these are used as they are; others are scaled.
const UNSCALED_DIRECTIONS: [f32; 2] = [1.0 / 4096.0, 4096.0];

/// Coordinates of rays have to be less than this.
const MAX_COORDINATE: f32 = 1e30;

/// Rays that share an origin or a direction. Their directions are divided by `t_scale`.
#[derive(Debug)]
pub(super) struct RayPacket {
    /// The vectors that differ between rays, by axis: directions or origins.
    pub varying: [PerRay<f32>; 3],
    /// 1/direction, where directions vary.
    pub reciprocal: [PerRay<f32>; 3],
    /// Hits certainly before this have no effect.
    pub t_min: PerRay<f32>,
    /// Lower bound on the t beyond which hits have no effect; −1 for inactive rays.
    pub t_max_lower: PerRay<f32>,
    /// Upper bound on the same; −1 for inactive rays.
    pub t_max_upper: PerRay<f32>,
    /// Rays that are still traced.
    pub active: RayMask,
    /// Quads in use.
    pub quads: usize,
    /// Hits before this take the exact test.
    pub certain_t_min: f32,
    /// Upper bound on the coordinates of origins, where these vary.
    pub max_coordinate: f32,
    /// Bounds on the directions, where these vary.
    pub frustum: PacketFrustum,
    /// A packet's t is this many times a caller's t. A power of two, and 1 for directions of ordinary length.
    pub t_scale: f64,
}

impl Default for RayPacket {
    fn default() -> Self {
        let zero = PerRay::splat(0.0);
        RayPacket {
            varying: [zero.clone(), zero.clone(), zero.clone()],
            reciprocal: [zero.clone(), zero.clone(), zero.clone()],
            t_min: zero.clone(),
            t_max_lower: zero.clone(),
            t_max_upper: zero,
            active: [0; GROUPS_PER_PACKET],
            quads: 0,
            certain_t_min: 0.0,
            max_coordinate: 0.0,
            frustum: PacketFrustum::default(),
            t_scale: 1.0,
        }
    }
}

impl RayPacket {
    /// Loads the directions from `base` to `points` of `count` rays from one origin. Returns false if they do not
    /// make a packet.
    #[inline(always)]
    pub fn load_directions<S: Simd>(
        &mut self,
        origin: Vec3,
        points: &[Vec3; PACKET_SIZE],
        count: usize,
        base: Vec3,
    ) -> bool {
        self.quads = count.div_ceil(GROUPS_PER_QUAD * RAYS_PER_GROUP);
        if !(origin.abs().max_element() < MAX_COORDINATE) {
            return false;
        }
        self.t_scale = 1.0;
        let mean = 0.5 * ((points[0] - base) + (points[PACKET_SIZE - 1] - base));
        let max_component = mean.abs().max_element();
        if max_component > UNSCALED_DIRECTIONS[0] && max_component < UNSCALED_DIRECTIONS[1] {
            self.store_directions::<S>(points, base);
            return self.frustum.bound::<S>(&self.varying, &self.reciprocal, self.quads, mean);
        }
        let max_component = points.iter().map(|p| (p - base).abs().max_element()).fold(0.0, f32::max);
        if !(max_component > MIN_DIRECTION && max_component < MAX_COORDINATE) {
            return false;
        }
        self.t_scale = floor_power_of_two(f64::from(max_component));
        let scale = invert_power_of_two(self.t_scale) as f32;
        self.store_directions::<S>(&points.map(|p| (p - base) * scale), Vec3::ZERO);
        self.frustum.bound::<S>(&self.varying, &self.reciprocal, self.quads, mean * scale)
    }

    /// Stores directions and their reciprocals.
    #[inline(always)]
    fn store_directions<S: Simd>(&mut self, points: &[Vec3; PACKET_SIZE], base: Vec3) {
        let min_direction = S::F32x16::splat(MIN_DIRECTION);
        for (g, points) in points.as_chunks().0.iter().enumerate().take(self.quads * GROUPS_PER_QUAD) {
            let columns = S::deinterleave3(points);
            for axis in 0..3 {
                let d = columns[axis] - S::F32x16::splat(base[axis]);
                d.store(self.varying[axis].group_mut(g));
                let r = d.abs().max(min_direction).rcp().xor_sign(d);
                r.store(self.reciprocal[axis].group_mut(g));
            }
        }
    }

    /// Loads the origins of `count` rays of one direction. Returns the direction divided by the packet's `t_scale`, or
    /// `None` where they do not make a packet.
    #[inline(always)]
    pub fn load_origins<S: Simd>(
        &mut self,
        direction: Vec3,
        origins: &[Vec3; PACKET_SIZE],
        count: usize,
    ) -> Option<Vec3> {
        self.quads = count.div_ceil(GROUPS_PER_QUAD * RAYS_PER_GROUP);
        let zero = S::F32x16::splat(0.0);
        let mut non_finite = zero;
        let mut max_coordinate = zero;
        for (g, origins) in origins.as_chunks().0.iter().enumerate().take(self.quads * GROUPS_PER_QUAD) {
            for (varying, x) in self.varying.iter_mut().zip(S::deinterleave3(origins)) {
                x.store(varying.group_mut(g));
                // Infinity and NaN times 0 are NaN.
                non_finite = x.mul_add(zero, non_finite);
                max_coordinate = x.abs().max(max_coordinate);
            }
        }
        let max_component = direction.abs().max_element();
        self.max_coordinate = max_coordinate.reduce_max();
        let fits = non_finite.reduce_sum() == 0.0
            && self.max_coordinate < MAX_COORDINATE
            && max_component > MIN_DIRECTION
            && max_component < MAX_COORDINATE;
        if !fits {
            return None;
        }
        self.t_scale = floor_power_of_two(f64::from(max_component));
        Some(direction * invert_power_of_two(self.t_scale) as f32)
    }

    /// Activates the first `count` rays with an interval from `t_min` to `t_max`, a caller's t.
    #[inline(always)]
    pub fn activate<S: Simd>(&mut self, count: usize, t_min: f32, t_max: f32) {
        let t_scale = self.t_scale as f32;
        let t_min = S::F32x16::splat(t_min * t_scale);
        let t_max = S::F32x16::splat(t_max * t_scale);
        let inactive = S::F32x16::splat(-1.0);
        self.active = [0; GROUPS_PER_PACKET];
        for g in 0..self.quads * GROUPS_PER_QUAD {
            let rays = count.saturating_sub(g * RAYS_PER_GROUP).min(RAYS_PER_GROUP);
            self.active[g] = (1 << rays) - 1;
            t_min.store(self.t_min.group_mut(g));
            let t_max = t_max.select(self.active[g], inactive);
            t_max.store(self.t_max_lower.group_mut(g));
            t_max.store(self.t_max_upper.group_mut(g));
        }
        self.certain_t_min = 0.0;
    }

    /// Returns a bit for each group with an active ray.
    #[inline(always)]
    pub fn active_groups(&self) -> u32 {
        let mut groups = 0;
        for g in 0..GROUPS_PER_PACKET {
            groups |= u32::from(self.active[g] != 0) << g;
        }
        groups
    }

    /// Returns an upper bound on the distance of origins from `centre`, where these vary.
    #[inline(always)]
    pub fn max_origin_distance<S: Simd>(&self, centre: DVec3) -> f64 {
        let centre32 = centre.as_vec3();
        let mut max = S::F32x16::splat(0.0);
        for axis in 0..3 {
            for g in 0..self.quads * GROUPS_PER_QUAD {
                let origin = S::F32x16::load(self.varying[axis].group(g));
                max = (origin - S::F32x16::splat(centre32[axis])).abs().max(max);
            }
        }
        let max = f64::from(max.reduce_max());
        let rounding = 4.0 * f64::from(EPSILON) * (max + centre.length());
        max * 3f64.sqrt() + rounding
    }

    /// Returns the least `t_min` of all rays.
    #[inline(always)]
    pub fn min_t_min<S: Simd>(&self) -> f32 {
        let mut min = S::F32x16::load(self.t_min.group(0));
        for g in 1..self.quads * GROUPS_PER_QUAD {
            min = min.min(S::F32x16::load(self.t_min.group(g)));
        }
        min.reduce_min()
    }

    /// Ends the tracing of a ray.
    pub fn deactivate(&mut self, ray: usize) {
        self.active[ray / RAYS_PER_GROUP] &= !(1 << (ray % RAYS_PER_GROUP));
        self.t_max_lower.set(ray, -1.0);
        self.t_max_upper.set(ray, -1.0);
    }

    /// Sets the t of a ray's closest hit so far, a caller's t.
    pub fn set_t_max(&mut self, ray: usize, t: f32) {
        let t = (f64::from(t) * self.t_scale) as f32;
        self.t_max_lower.set(ray, t);
        self.t_max_upper.set(ray, t);
    }
}

/// Pads the rays of a packet to a full one by repeating the last. `room` is used where there are too few.
#[inline(always)]
pub(super) fn pad_to_packet<'a, T: Copy>(
    rays: &'a [T],
    room: &'a mut Option<[T; PACKET_SIZE]>,
) -> Option<&'a [T; PACKET_SIZE]> {
    if let Some(packet) = rays.first_chunk() {
        return Some(packet);
    }
    let room = room.insert([*rays.last()?; PACKET_SIZE]);
    room[..rays.len()].copy_from_slice(rays);
    Some(room)
}

/// Prefetches the first quad of the next packet's vectors, if there is one. The hardware prefetcher does the rest.
#[inline(always)]
pub(super) fn prefetch_next_packet(vectors: Option<&[Vec3]>) {
    let vectors = vectors.unwrap_or_default();
    // Cache lines have 64 bytes.
    vectors[..vectors.len().min(GROUPS_PER_QUAD * RAYS_PER_GROUP)]
        .chunks(64 / size_of::<Vec3>())
        .for_each(prefetch);
}
