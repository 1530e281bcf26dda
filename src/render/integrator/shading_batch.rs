//! The shading points of a batch of path rays.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::integrator::light_layers::LightLayer;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::point_layers::PointLayers;
use crate::integrator::surface::hits_by_triangle::HitsByTriangle;
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::shading_triangle::TriangleSurface;
use crate::integrator::surface::shadow_terminator::offset_to_smooth_surface;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};
use blinn_core::geometry::{HitId, Rgb, offset_ray_origin};

/// Memory that is reused from batch to batch.
#[derive(Default)]
pub(crate) struct BatchBuffers {
    soa: PointsSoa,
    points: Vec<ShadingPoint>,
    hits_by_triangle: HitsByTriangle,
}

/// Data of a shading point besides its lane in [`PointsSoa`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingPoint {
    /// Index of the path whose ray hit it.
    pub path: usize,
    /// Its triangle; [`HitId::NONE`] on the ground.
    pub id: HitId,
    /// True on a ground of which only shadows are seen.
    pub is_shadow_catcher: bool,
}

/// A triangle and its points, which follow each other.
pub(crate) struct TrianglePoints<'s> {
    pub triangle: TriangleSurface<'s>,
    pub range: Range<usize>,
}

/// The shading points of a batch, and the triangles that they are on.
pub(crate) struct ShadingBatch<'s> {
    pub points: Vec<ShadingPoint>,
    /// As many points as in `points`.
    pub soa: PointsSoa,
    pub triangles: Vec<TrianglePoints<'s>>,
    pub hits_by_triangle: HitsByTriangle,
    /// True if a material of `triangles` transmits light.
    pub has_transmission: bool,
    /// True if the rays that points spawn start at their triangles, and false if they start at the smooth surface.
    pub spawns_at_triangles: bool,
    /// True if the points are the back sides of others.
    pub is_back: bool,
    /// The light of the points by layer; empty where that is not wanted.
    pub layers: PointLayers,
}

impl ShadingBatch<'_> {
    /// An empty batch, in the memory of `buffers`.
    pub fn new(buffers: &mut BatchBuffers) -> Self {
        let BatchBuffers { mut soa, mut points, hits_by_triangle } = std::mem::take(buffers);
        soa.clear();
        points.clear();
        ShadingBatch {
            points,
            soa,
            triangles: Vec::new(),
            hits_by_triangle,
            has_transmission: false,
            spawns_at_triangles: false,
            is_back: false,
            layers: PointLayers::default(),
        }
    }

    /// Gives the memory back.
    pub fn recycle(self, buffers: &mut BatchBuffers) {
        let ShadingBatch { points, soa, hits_by_triangle, .. } = self;
        *buffers = BatchBuffers { soa, points, hits_by_triangle };
    }

    /// The points of the block whose first point is `first`.
    #[inline(always)]
    pub fn block_points(&self, first: usize) -> &[ShadingPoint] {
        &self.points[first..self.points.len().min(first + LANES)]
    }

    /// Coefficients of point `i`.
    #[inline(always)]
    pub fn coefficients(&self, i: usize) -> Coefficients {
        let (block, lane) = self.soa.lane(i);
        block.k.get(lane)
    }

    /// k_e and k_a of point `i`, as far as its specular layers let light through.
    #[inline(always)]
    pub fn layered_ke_ka(&self, i: usize) -> (Rgb, Rgb) {
        let k = self.coefficients(i);
        let (block, lane) = self.soa.lane(i);
        if block.reflects(lane) {
            let of_layers = block.layered.get(lane).map(|point| point.k_a);
            let of_base = k.k_a * block.base_share[lane];
            (k.k_e * (1.0 - block.k_r_coat[lane]), of_layers.map_or(of_base, |k_a| of_base + k_a))
        } else {
            (k.k_e, k.k_a)
        }
    }

    /// The share of light from behind that point `i` transmits diffusely, as far as its layers let light through.
    pub fn transmitted(&self, i: usize) -> Rgb {
        let (block, lane) = self.soa.lane(i);
        block.layered.get(lane).map_or(Rgb::ZERO, |point| point.transmitted)
    }

    /// Adds the light of point `j` of `other`, at the same place, to point `i`.
    pub fn add_light_of(&mut self, i: usize, other: &ShadingBatch, j: usize) {
        let (from, from_lane) = other.soa.lane(j);
        let (to, lane) = self.soa.lane_mut(i);
        for (to, from) in [
            (&mut to.radiance, &from.radiance),
            (&mut to.unshadowed, &from.unshadowed),
            (&mut to.noisy_diffuse, &from.noisy_diffuse),
        ] {
            let sum: Rgb = vec3(to, lane) + vec3(from, from_lane);
            set3(to, lane, sum.to_array());
        }
        if self.layers.len() > 0 {
            self.layers.add(i, other.layers.get(j), other.radiance(j));
        }
    }

    /// Starts the layers of all points with k_e and k_a I_a, their light so far.
    pub fn start_layers(&mut self) {
        let mut layers = PointLayers::default();
        for i in 0..self.points.len() {
            layers.push(self.radiance(i), self.layered_ke_ka(i).0);
        }
        self.layers = layers;
    }

    /// Adds the light of all points that is in no layer yet to `layer`.
    pub fn assign_light_to(&mut self, layer: LightLayer) {
        for i in 0..self.layers.len() {
            self.layers.assign(i, self.radiance(i), layer);
        }
    }

    /// Adds the light of a source, which is in no layer yet, to the direct layers.
    pub fn assign_direct_light(&mut self) {
        for i in 0..self.layers.len() {
            let (block, lane) = self.soa.lane(i);
            let specular: Rgb = vec3(&block.current_specular, lane);
            self.layers.assign_direct(i, self.radiance(i), specular);
        }
    }

    /// The share of light that the specular layers of point `i` let through.
    #[inline(always)]
    pub fn base_share(&self, i: usize) -> f32 {
        let (block, lane) = self.soa.lane(i);
        if block.reflects(lane) { block.base_share[lane] } else { 1.0 }
    }

    /// True if point `i` is seen from the front of its triangle; `None` on the ground.
    pub fn is_front(&self, i: usize) -> Option<bool> {
        let after = self.triangles.partition_point(|points| points.range.start <= i);
        let points = &self.triangles[after.checked_sub(1)?];
        let (block, lane) = self.soa.lane(i);
        points.range.contains(&i).then(|| points.triangle.is_front(dvec3(&block.n_g, lane)))
    }

    /// Shading normal of point `i`.
    #[inline(always)]
    pub fn n(&self, i: usize) -> DVec3 {
        let (block, lane) = self.soa.lane(i);
        block.n(lane)
    }

    /// L of point `i` so far.
    #[inline(always)]
    pub fn radiance(&self, i: usize) -> Rgb {
        let (block, lane) = self.soa.lane(i);
        vec3(&block.radiance, lane)
    }

    /// Origin of a ray that leaves point `i` in `direction`, and the triangle that it must not hit.
    pub fn offset_origin(&self, i: usize, direction: DVec3) -> (Vec3, HitId) {
        let (block, lane) = self.soa.lane(i);
        let cos = dvec3(&block.n_g, lane).dot(direction);
        let origin = vec3(&block.ray_origin, lane);
        let source = self.excluded_triangle(i, cos > 0.0);
        if self.spawns_at_triangles {
            return (origin, source);
        }
        let offset = vec3(&block.terminator_offset, lane);
        (offset_to_smooth_surface(origin, offset, cos), source)
    }

    /// Origin of a ray that leaves point `i` on the viewer's side of its triangle: clear of the error bound of the point.
    pub fn origin_in_front(&self, i: usize) -> Vec3 {
        let (block, lane) = self.soa.lane(i);
        vec3(&block.ray_origin, lane)
    }

    /// Origin of a ray that leaves point `i` behind its triangle.
    pub fn origin_behind(&self, i: usize) -> Vec3 {
        let (block, lane) = self.soa.lane(i);
        let p: Vec3 = vec3(&block.p, lane);
        let n_g = -dvec3(&block.n_g, lane).as_vec3();
        offset_ray_origin(p - (self.origin_in_front(i) - p), Vec3::ZERO, n_g, n_g)
    }

    /// The triangle that a ray from point `i` must not hit: its own, if the ray leaves it on the front (n_g·l > 0). Light
    /// behind the triangle that the smooth surface still faces has to pass the triangle's edge.
    #[inline(always)]
    pub fn excluded_triangle(&self, i: usize, in_front: bool) -> HitId {
        if in_front { self.points[i].id } else { HitId::NONE }
    }
}
