//! A triangle prepared for shading: the data that all points on it share, and its intersection with path rays.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::integrator::material::specular_antialiasing::widens_highlights;
use crate::integrator::surface::mesh_triangle::MeshTriangle;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::ray_differentials::{
    BarycentricDifferentials, InterpolatedNormal, TriangleCoords,
};
use crate::integrator::surface::shadow_terminator::{
    TerminatorOffset, envelope_height, offset_to_smooth_surface,
};
use crate::integrator::surface::soa::{HIT_LANES, dvec3, set3};
use crate::integrator::surface::surface_hit::{Ray8, SurfaceHit, SurfaceHit8};
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_eval::TextureEvalContext;
use crate::integrator::surface::triangle_plane::TrianglePlane;
use blinn_core::geometry::{Hit, HitId, Ray, RayDifferential, offset_ray_origin, point_error};
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::{Material, PosedScene};

/// The data of a triangle that textures and normal maps need, besides the hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleSurface<'s> {
    pub id: HitId,
    pub triangle: MeshTriangle<'s>,
    /// Unit normal of the front face; `None` for a degenerate triangle.
    pub front_normal: Option<DVec3>,
    /// Error bound of points on it.
    pub p_error: Vec3,
    /// The instance's own colour.
    tint: Option<Vec3>,
    /// Index of the material.
    pub material: u32,
    /// True if its points have colours of their own: of its vertices, or of its instance.
    pub has_color: bool,
}

/// A triangle in the world, relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingTriangle<'s> {
    pub surface: TriangleSurface<'s>,
    geometry: HitGeometry,
    /// False if the footprint of a sample makes no difference.
    needs_differentials: bool,
}

/// The part of a [`ShadingTriangle`] that hits are computed from.
#[derive(Clone, Copy, Debug)]
struct HitGeometry {
    plane: TrianglePlane,
    /// Vertex normals, as they are interpolated; 0 in a mesh without normals.
    vertex_normals: [DVec3; 3],
    /// See [`Mesh::keeps_normal_side`](blinn_scene::Mesh::keeps_normal_side); false in a degenerate triangle.
    keeps_normal_side: bool,
    terminator: TerminatorOffset,
    /// [`TriangleSurface::p_error`].
    p_error: Vec3,
}

/// Traits that the points of all triangles with a material share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialTraits {
    /// True if the footprint of a sample makes a difference.
    needs_differentials: bool,
}

impl MaterialTraits {
    pub fn new(material: &Material) -> MaterialTraits {
        let has_textures = material.normal_maps().next().is_some() || material.is_textured();
        MaterialTraits {
            needs_differentials: widens_highlights(material) || has_textures || material.reflects(),
        }
    }
}

impl<'s> ShadingTriangle<'s> {
    pub fn new(posed: &'s PosedScene<'s>, id: HitId) -> ShadingTriangle<'s> {
        let material = &posed.materials[posed.mesh(id.instance).material as usize];
        ShadingTriangle::with_traits(posed, id, &MaterialTraits::new(material))
    }

    /// The triangle `id`, whose material has these traits.
    pub fn with_traits(posed: &'s PosedScene<'s>, id: HitId, traits: &MaterialTraits) -> ShadingTriangle<'s> {
        let triangle = MeshTriangle::new(posed, id);
        let MeshTriangle { mesh, corners, .. } = triangle;
        let transform = &posed.instances[id.instance as usize].transform;
        let positions = posed.positions(id.instance);
        let local = corners.map(|c| positions[c as usize]);
        let world = local.map(|p| transform.point(p));
        let normals = posed.normals(id.instance);
        let normal = |c: u32| {
            let n = transform.normal(normals[c as usize]);
            if mesh.interpolate_normals_locally { n } else { n.normalize_or_zero() }
        };
        let vertex_normals = if normals.is_empty() { [DVec3::ZERO; 3] } else { corners.map(normal) };
        let plane = TrianglePlane::new(world, transform.flips_winding);
        let MaterialTraits { needs_differentials } = *traits;
        let tint = posed.scene.instances[id.instance as usize].color;
        let are_normalized = !mesh.interpolate_normals_locally;
        let p_error = point_error(world, local, &transform.affine);
        ShadingTriangle {
            surface: TriangleSurface {
                id,
                triangle,
                front_normal: plane.front_normal,
                p_error,
                tint,
                material: mesh.material,
                has_color: tint.is_some() || !triangle.colors.is_empty(),
            },
            geometry: HitGeometry {
                plane,
                vertex_normals,
                keeps_normal_side: mesh.keeps_normal_side && plane.front_normal.is_some(),
                terminator: TerminatorOffset::new(&plane.vertices, &vertex_normals, are_normalized),
                p_error,
            },
            needs_differentials,
        }
    }

    /// The surface point of `ray`, which is known to hit the triangle.
    pub fn surface_point(&self, ray: Ray, differential: Option<&RayDifferential>) -> SurfacePoint<'s> {
        let differential = differential.filter(|_| self.needs_differentials);
        let geometry = &self.geometry;
        self.surface.surface_from_hit(&geometry.hit(geometry.plane.front_normal_for(ray), ray, differential))
    }

    /// Appends the surface points of the first `count` of `rays`, which are known to hit the triangle.
    pub fn append_hits(
        &self,
        simd: SimdLevel,
        rays: &Ray8,
        count: usize,
        differential: Option<RayDifferential>,
        points: &mut PointsSoa,
    ) {
        let differential = differential.filter(|_| self.needs_differentials);
        let (block, lane) = points.append(count);
        // Not a reference: the loops over it would not be vectorised.
        let geometry = self.geometry;
        match geometry.plane.front_normal {
            Some(front_normal) if count > 1 => {
                simd.run(ComputeHits { geometry, front_normal, rays, differential, block, lane });
            }
            _ => {
                for i in 0..count {
                    let ray = rays.get(i);
                    let front_normal = geometry.plane.front_normal_for(ray);
                    let hit = geometry.hit(front_normal, ray, differential.as_ref());
                    block.store_hit(lane + i, ray.d, &hit);
                }
            }
        }
    }

    /// Offsets the shadow rays of points in `lanes` to the envelope of the smooth surface: see [`envelope_height`].
    pub fn set_envelope_offsets(&self, block: &mut PointBlock, lanes: Range<usize>) {
        let n = self.geometry.vertex_normals.map(DVec3::normalize_or_zero);
        if n.contains(&DVec3::ZERO) {
            return;
        }
        for i in lanes {
            let n_v: DVec3 = dvec3(&block.n_v, i);
            // On the side of the triangle that is seen.
            let n_v = if n_v.dot(dvec3(&block.n_g, i)) < 0.0 { -n_v } else { n_v };
            let b = block.coords(i).b.map(f64::from);
            let side = if (n[0] * b[0] + n[1] * b[1] + n[2] * b[2]).dot(n_v) < 0.0 { -1.0 } else { 1.0 };
            let height = envelope_height(&self.geometry.plane.vertices, &n.map(|n| n * side), b);
            set3(&mut block.terminator_offset, i, (n_v * height).as_vec3().to_array());
        }
    }

    /// The corners.
    pub fn vertices(&self) -> [DVec3; 3] {
        self.geometry.plane.vertices
    }

    /// Vertex normals, as they are interpolated; 0 in a mesh without normals.
    pub fn vertex_normals(&self) -> [DVec3; 3] {
        self.geometry.vertex_normals
    }

    /// The offset to the smooth surface at barycentrics `b`, on the side of `n_g`.
    pub fn terminator_offset(&self, b: Vec3, n_g: DVec3) -> Vec3 {
        let HitGeometry { vertex_normals, terminator, .. } = &self.geometry;
        let b = b.to_array().map(f64::from);
        let flip = InterpolatedNormal::new(vertex_normals, b).n.dot(n_g) < 0.0;
        terminator.at(b, flip)
    }
}

impl HitGeometry {
    #[inline(always)]
    fn hit(&self, front_normal: DVec3, ray: Ray, differential: Option<&RayDifferential>) -> SurfaceHit {
        let plane_hit = self.plane.intersect(front_normal, ray);
        let b = plane_hit.b;
        let [v0, v1, v2] = self.plane.vertices;
        let p = v0 * b[0] + v1 * b[1] + v2 * b[2];
        let is_front = plane_hit.n_dot_d <= 0.0;
        let n_g = if is_front { front_normal } else { -front_normal };
        let mut differentials = BarycentricDifferentials::POINT;
        if let Some(differential) = differential {
            differentials = BarycentricDifferentials::new(differential, &plane_hit, &self.plane.gradients);
        }
        let vertex_normal = InterpolatedNormal::new(&self.vertex_normals, b);
        if differential.is_some() {
            differentials.set_normal_change(&self.vertex_normals, &vertex_normal);
        }
        let flip = vertex_normal.n.dot(n_g) < 0.0;
        let is_reversed = if self.keeps_normal_side { !is_front } else { flip };
        let n_v = if is_reversed { -vertex_normal.n } else { vertex_normal.n };
        let n_v = if vertex_normal.valid { n_v } else { n_g };
        let p = p.as_vec3();
        SurfaceHit {
            p,
            ray_origin: self.ray_origin(p, n_g),
            terminator_offset: self.terminator.at(b, flip),
            n_g,
            n_v,
            coords: TriangleCoords { b: [b[0] as f32, b[1] as f32, b[2] as f32], differentials },
        }
    }

    /// `p` moved by its error bound to the side of `n_g`.
    #[inline(always)]
    fn ray_origin(&self, p: Vec3, n_g: DVec3) -> Vec3 {
        let n_g = n_g.as_vec3();
        offset_ray_origin(p, self.p_error, n_g, n_g)
    }
}

impl<'s> TriangleSurface<'s> {
    /// The surface point of a hit.
    pub fn surface_from_hit(&self, hit: &SurfaceHit) -> SurfacePoint<'s> {
        SurfacePoint {
            id: self.id,
            p: hit.p,
            p_error: self.p_error,
            n_g: hit.n_g,
            n_v: hit.n_v,
            front: self.is_front(hit.n_g),
            material: self.material,
            ctx: self.texture_context(hit.coords),
        }
    }

    /// True if `n_g`, the geometric normal on a ray's side, is that of the front. A degenerate triangle faces every ray.
    pub fn is_front(&self, n_g: DVec3) -> bool {
        self.front_normal.is_none_or(|n| n.dot(n_g) > 0.0)
    }

    /// The context to evaluate textures at a point.
    #[inline(always)]
    pub fn texture_context(&self, coords: TriangleCoords) -> TextureEvalContext<'s> {
        TextureEvalContext { triangle: self.triangle, coords, tint: self.tint, sampled_normal: None }
    }
}

impl<'s> SurfacePoint<'s> {
    /// The surface point of the hit of `ray`. Its textures are evaluated at their finest level.
    pub fn at(posed: &'s PosedScene<'s>, hit: &Hit, ray: Ray) -> SurfacePoint<'s> {
        let triangle = ShadingTriangle::new(posed, hit.id);
        if triangle.is_round() {
            return triangle.surface.surface_from_hit(&triangle.round_hit(ray, hit.t));
        }
        triangle.surface_point(ray, None)
    }

    /// Origin of a shadow ray in direction `l`: outside the error bounds of the point, and offset to the smooth surface
    /// where the light grazes the triangle (the shadow terminator offset).
    pub fn shadow_origin(&self, posed: &PosedScene, l: DVec3) -> Vec3 {
        let geometry = ShadingTriangle::new(posed, self.id).geometry;
        let b = self.ctx.coords.b.map(f64::from);
        let [n0, n1, n2] = geometry.vertex_normals;
        let n = n0 * b[0] + n1 * b[1] + n2 * b[2];
        let flip = n.dot(self.n_g) < 0.0;
        let origin = geometry.ray_origin(self.p, self.n_g);
        offset_to_smooth_surface(origin, geometry.terminator.at(b, flip), self.n_g.dot(l))
    }
}

/// Intersects a triangle with eight rays.
struct ComputeHits<'a> {
    geometry: HitGeometry,
    front_normal: DVec3,
    rays: &'a Ray8,
    differential: Option<RayDifferential>,
    block: &'a mut PointBlock,
    lane: usize,
}

impl AutovecKernel for ComputeHits<'_> {
    #[inline(always)]
    fn run(self) {
        let ComputeHits { geometry, front_normal, rays, differential, block, lane } = self;
        // A copy cannot alias what the loops write.
        let rays = *rays;
        let mut hits = SurfaceHit8::ZERO;
        // One loop for each case, without a branch inside.
        match differential {
            None => {
                for i in 0..HIT_LANES {
                    hits.set(i, &geometry.hit(front_normal, rays.get(i), None));
                }
            }
            Some(differential) => {
                for i in 0..HIT_LANES {
                    hits.set(i, &geometry.hit(front_normal, rays.get(i), Some(&differential)));
                }
            }
        }
        block.store_hits(lane, &rays, &hits);
    }
}

#[cfg(test)]
mod tests;
