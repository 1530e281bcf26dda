//! The rays of a stream, prepared for box tests and triangle tests: a cache line for each.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::bvh::bvh8::OCTANTS;
use crate::packet::RAYS_PER_GROUP;
use crate::traverse::box_test::{BoxTestRay, FAR_FACTOR, MAX_SHIFT, MIN_DIRECTION, NEAR_FACTOR};
use crate::traverse::conservative_triangle_test::LIGHT_MARGIN;
use crate::traverse::error_bounds::EdgeFunctionBounds;
use blinn_core::geometry::EPSILON;
use blinn_core::simd::vec3::{Vec3Lanes, dot};
use blinn_core::simd::{Lanes, Simd};

/// Maximum number of rays in a stream.
pub(crate) const STREAM_RAYS: usize = 1024;

/// Fewer rays are traced as single rays.
pub(super) const MIN_STREAM_RAYS: usize = 8;

/// The octant of rays that take no part in the stream.
pub(super) const NO_OCTANT: u8 = OCTANTS as u8;

/// Origins and directions with larger or smaller components are left to single rays.
const MAX_ORIGIN: f32 = 1e18;
const MAX_DIRECTION: f32 = 1e30;
const MIN_LENGTH: f32 = 1e-30;

/// Added to the number of an octant, it gives a float with that number in its lowest bits.
const OCTANT_BASE: f32 = (1 << 23) as f32;

/// A ray prepared for box tests, as a [`BoxTestRay`] is.
///
/// Instead of a scale for near planes and one for far planes, one reciprocal serves both, and entry distances are
/// multiplied by [`NEAR_FACTOR`]: the relative error of the reciprocal is one of the distance, which is not negative, being
/// no less than `t_min`.
///
/// [`BoxTestRay`]: crate::traverse::box_test::BoxTestRay
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct BoxTestData {
    /// 1/d.
    pub scale: [f32; 3],
    pub near_shift: [f32; 3],
    pub far_shift: [f32; 3],
    /// Boxes that begin beyond this are out of reach; −∞ once the ray has ended.
    pub limit: f32,
    /// Boxes that end before this are behind the ray.
    pub t_min: f32,
    octant: f32,
    unused: [f32; 4],
}

/// A ray prepared for triangle tests, as a [`TriangleTestRay`] is.
///
/// [`TriangleTestRay`]: crate::traverse::conservative_triangle_test::TriangleTestRay
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct TriangleTestData {
    pub o: [f32; 3],
    pub d: [f32; 3],
    /// As in the [`BoxTestData`].
    pub limit: f32,
    pub early_exit_t_min: f32,
    pub early_exit_t_max: f32,
    /// The ray's own t is this many times the caller's.
    pub t_scale: f32,
    /// Index of the triangle that the ray starts on.
    pub source: u32,
    unused: [f32; 5],
}

/// Sixteen rays in the frame of a BVH, with directions of about unit length and t in their own parameter.
pub(super) struct RayGroup<L> {
    pub o: Vec3Lanes<L>,
    pub d: Vec3Lanes<L>,
    /// The caller's t, whose multiples by `t_scale` are the rays' own.
    pub t_min: L,
    pub t_max: L,
    pub t_scale: L,
    /// Shadow rays that start at a light.
    pub is_from_light: bool,
}

/// Boxes count as larger by this on every side.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BoxPadding {
    pub constant: f32,
    /// Additional padding for each unit of the ray origin's largest coordinate.
    pub per_distance: f32,
}

/// The rays of a stream.
#[derive(Debug)]
pub(super) struct PreparedRays {
    pub boxes: Box<[BoxTestData; STREAM_RAYS]>,
    pub triangles: Box<[TriangleTestData; STREAM_RAYS]>,
    /// The number of the octant of each direction.
    pub octants: Box<[u8; STREAM_RAYS]>,
    /// Bounds of the origins.
    min_origin: Vec3,
    max_origin: Vec3,
    /// Square of the greatest length of a direction.
    max_direction_squared: f32,
}

impl Default for PreparedRays {
    fn default() -> Self {
        PreparedRays {
            boxes: boxed_array(BoxTestData::zeroed()),
            triangles: boxed_array(TriangleTestData::zeroed()),
            octants: boxed_array(0),
            min_origin: Vec3::INFINITY,
            max_origin: Vec3::NEG_INFINITY,
            max_direction_squared: 0.0,
        }
    }
}

/// An array with an element for each ray, all equal.
pub(super) fn boxed_array<T: Copy>(element: T) -> Box<[T; STREAM_RAYS]> {
    match vec![element; STREAM_RAYS].into_boxed_slice().try_into() {
        Ok(array) => array,
        Err(_) => unreachable!("the slice has the length of the array"),
    }
}

impl BoxTestData {
    /// The number of the direction's octant.
    #[inline(always)]
    pub fn octant(&self) -> usize {
        self.octant.to_bits() as usize & (OCTANTS - 1)
    }
}

impl PreparedRays {
    /// Forgets all rays.
    pub fn clear(&mut self) {
        self.min_origin = Vec3::INFINITY;
        self.max_origin = Vec3::NEG_INFINITY;
        self.max_direction_squared = 0.0;
    }

    /// Limits a ray to hits up to `t_max`.
    #[inline(always)]
    pub fn set_t_max(&mut self, ray: usize, t_max: f32) {
        let ray = ray & (STREAM_RAYS - 1);
        let limit = BoxTestRay::limit(t_max * self.triangles[ray].t_scale);
        self.boxes[ray].limit = limit;
        self.triangles[ray].limit = limit;
    }

    /// Returns true once the ray has ended.
    #[inline(always)]
    pub fn has_ended(&self, ray: usize) -> bool {
        self.boxes[ray & (STREAM_RAYS - 1)].limit == f32::NEG_INFINITY
    }

    /// Error bounds for all rays and the triangles within `radius` of `centre`. `rounded` says that origins were rounded to
    /// f32.
    pub fn error_bounds(&self, centre: DVec3, radius: f64, rounded: bool) -> EdgeFunctionBounds {
        const SLACK: f64 = 1.0 + 1e-5;
        let (min, max) = (self.min_origin.as_dvec3(), self.max_origin.as_dvec3());
        let rounded_origin = if rounded { SLACK * min.abs().max(max.abs()).length() } else { 0.0 };
        let farthest = (min - centre).abs().max((max - centre).abs());
        let max_distance = farthest.length() + radius + rounded_origin * f64::from(EPSILON);
        let max_direction = f64::from(self.max_direction_squared).sqrt() * SLACK;
        EdgeFunctionBounds::new(max_direction, max_distance, rounded_origin)
    }

    /// Stores group `g`, of which the rays of `valid` are used. Returns those of them that a stream can trace.
    #[inline(always)]
    pub fn store_group<S: Simd>(
        &mut self,
        g: usize,
        group: &RayGroup<S::F32x16>,
        valid: u32,
        padding: BoxPadding,
    ) -> u32 {
        let splat = S::F32x16::splat;
        let zero = splat(0.0);
        let mut ordinary = valid;
        let mut distance = zero;
        for axis in 0..3 {
            let o = group.o[axis].abs();
            ordinary &= o.lt(splat(MAX_ORIGIN));
            distance = distance.max(o);
        }
        let padding = distance.mul_add(splat(padding.per_distance), splat(padding.constant));
        let mut scale = [zero; 3];
        let mut near_shift = [zero; 3];
        let mut far_shift = [zero; 3];
        let mut octant = splat(OCTANT_BASE);
        for axis in 0..3 {
            let (o, d) = (group.o[axis], group.d[axis]);
            let negative = d.lt(zero);
            // Keep o/d finite: a fused b/d − o/d would be infinite with the wrong sign.
            let r = splat(1.0) / d.abs().max(splat(MIN_DIRECTION));
            let r = (splat(MAX_SHIFT) / o.abs()).min(r);
            let slack = o.abs().mul_add(splat(4.0 * EPSILON), padding) * r;
            let r = (zero - r).select(negative, r);
            scale[axis] = r;
            near_shift[axis] = o.mul_add(r, slack);
            far_shift[axis] = o.mul_sub(r, slack);
            octant = octant + zero.select(negative, splat((1 << axis) as f32));
        }
        let t_min = group.t_min * group.t_scale * splat(NEAR_FACTOR);
        let t_max = group.t_max * group.t_scale;
        let limit = splat(f32::NEG_INFINITY).select(!ordinary, t_max * splat(FAR_FACTOR));
        // A hit so near the light that 1 − t rounds to 1 does not occlude.
        let margin = if group.is_from_light { LIGHT_MARGIN } else { 0.0 };
        let early_exit_t_min = group.t_scale * splat(margin);
        let early_exit_t_max = t_max * splat(1.0 - 8.0 * EPSILON);
        let first = (RAYS_PER_GROUP * g) & (STREAM_RAYS - 1);
        let mut columns = [zero; RAYS_PER_GROUP];
        columns[..3].copy_from_slice(&scale);
        columns[3..6].copy_from_slice(&near_shift);
        columns[6..9].copy_from_slice(&far_shift);
        columns[9..12].copy_from_slice(&[limit, t_min, octant]);
        if let Some(to) = self.boxes[first..].first_chunk_mut::<RAYS_PER_GROUP>() {
            S::transpose16(&columns, bytemuck::cast_mut(to));
        }
        let mut columns = [zero; RAYS_PER_GROUP];
        columns[..3].copy_from_slice(&group.o);
        columns[3..6].copy_from_slice(&group.d);
        columns[6..10].copy_from_slice(&[limit, early_exit_t_min, early_exit_t_max, group.t_scale]);
        if let Some(to) = self.triangles[first..].first_chunk_mut::<RAYS_PER_GROUP>() {
            S::transpose16(&columns, bytemuck::cast_mut(to));
        }
        self.bound::<S>(group, ordinary);
        let mut octants = [0.0; RAYS_PER_GROUP];
        octant.store(&mut octants);
        for (i, (to, octant)) in self.octants[first..].iter_mut().zip(octants).enumerate() {
            let number = octant.to_bits() as u8 & (OCTANTS - 1) as u8;
            *to = if ordinary >> i & 1 == 1 { number } else { NO_OCTANT };
        }
        ordinary
    }

    /// Extends the bounds of origins and directions by the rays of a group.
    #[inline(always)]
    fn bound<S: Simd>(&mut self, group: &RayGroup<S::F32x16>, rays: u32) {
        let splat = S::F32x16::splat;
        for axis in 0..3 {
            let o = group.o[axis];
            let min = o.select(rays, splat(f32::INFINITY)).reduce_min();
            let max = o.select(rays, splat(f32::NEG_INFINITY)).reduce_max();
            self.min_origin[axis] = self.min_origin[axis].min(min);
            self.max_origin[axis] = self.max_origin[axis].max(max);
        }
        let length = dot(group.d, group.d).select(rays, splat(0.0)).reduce_max();
        self.max_direction_squared = self.max_direction_squared.max(length);
    }
}

impl<L: Lanes<RAYS_PER_GROUP>> RayGroup<L> {
    /// Scales directions to about unit length by powers of two. Returns the rays for which that is possible, as a mask.
    #[inline(always)]
    pub fn normalize(&mut self) -> u32 {
        let [x, y, z] = self.d.map(|x| x.abs());
        let max_component = x.max(y).max(z);
        let max = L::splat(MAX_DIRECTION);
        let possible = L::splat(MIN_LENGTH).le(max_component) & x.lt(max) & y.lt(max) & z.lt(max);
        self.t_scale = max_component.floor_power_of_two();
        // Exact.
        let inv_t_scale = L::splat(1.0) / self.t_scale;
        self.d = [self.d[0] * inv_t_scale, self.d[1] * inv_t_scale, self.d[2] * inv_t_scale];
        possible
    }
}
