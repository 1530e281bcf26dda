//! A surface point with its normals and material, and its normal map.

use glam::{DVec3, Vec3, Vec4};

use crate::integrator::surface::texture_eval::TextureEvalContext;
use blinn_core::geometry::HitId;
use blinn_scene::{NormalMap, PosedScene};

/// A point on a surface, seen along a ray. Positions are metres relative to the scene's centre. Normals are in the
/// coordinates of the posed scene, which `Frame::scene_to_world` turns to the world's.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'s> {
    /// The triangle.
    pub id: HitId,
    /// The point, computed from barycentrics: it lies on the triangle whatever t was rounded to.
    pub p: Vec3,
    /// The true point is within ± this of `p` (pbrt's error bounds).
    pub p_error: Vec3,
    /// Geometric normal, unit length, on the viewer's side.
    pub n_g: DVec3,
    /// Interpolated vertex normal (or `n_g`), unit length, on the side of `n_g` unless the mesh keeps the side of its normals.
    pub n_v: DVec3,
    /// True if the front face is seen.
    pub front: bool,
    /// Index of the material.
    pub material: u32,
    pub(crate) ctx: TextureEvalContext<'s>,
}

impl SurfacePoint<'_> {
    /// The barycentrics of the triangle's second and third vertex, in the order of its mesh.
    pub fn barycentrics(&self) -> [f32; 2] {
        let [_, b1, b2] = self.ctx.coords.b;
        [b1, b2]
    }

    /// The shading normal: `n_v`, perturbed by the material's normal map if there is one and the mesh has tangents. The
    /// bitangent is computed in object space and then transformed, which keeps mirrored and sheared nodes right; a back
    /// face flips the whole frame.
    pub fn shading_normal(&self, posed: &PosedScene) -> DVec3 {
        self.filtered_normal(posed).0
    }

    /// The mean shading normal over the footprint, and the increase of a highlight's α²: twice the variance of the normals,
    /// by the curvature of the smooth surface and by the slopes of the normal map.
    pub fn filtered_normal(&self, posed: &PosedScene) -> (DVec3, f32) {
        self.mapped_normal(posed, posed.materials[self.material as usize].normal.as_ref())
    }

    /// The directions of the tangent and of the bitangent in the world; `None` on a mesh without them.
    pub(crate) fn tangents(&self, posed: &PosedScene) -> Option<[DVec3; 2]> {
        let [t, b, _] = self.tangent_frame(posed)?;
        let transform = &posed.instances[self.id.instance as usize].transform;
        Some([t, b].map(|axis| transform.vector(axis.as_vec3())))
    }

    /// Tangent, bitangent and normal in object space; `None` on a mesh without tangents.
    fn tangent_frame(&self, posed: &PosedScene) -> Option<[DVec3; 3]> {
        let normals = posed.normals(self.id.instance);
        let tangents = posed.tangents(self.id.instance);
        if normals.is_empty() || tangents.is_empty() {
            return None;
        }
        let mut n = Vec3::ZERO;
        let mut t = Vec4::ZERO;
        for (&corner, b) in self.ctx.triangle.corners.iter().zip(self.ctx.coords.b) {
            n += normals[corner as usize] * b;
            t += tangents[corner as usize] * b;
        }
        Some([t.truncate(), n.cross(t.truncate()) * t.w, n].map(|axis| axis.as_dvec3()))
    }

    /// [`SurfacePoint::filtered_normal`] by one of the normal maps of the material, or without one.
    pub(crate) fn mapped_normal(&self, posed: &PosedScene, map: Option<&NormalMap>) -> (DVec3, f32) {
        let curvature = self.ctx.coords.differentials.alpha2_increase();
        let Some(map) = map else { return (self.n_v, curvature) };
        // In object space, where the map was baked. The perturbed normal is then transformed as normals are.
        let Some([t, b, n]) = self.tangent_frame(posed) else { return (self.n_v, curvature) };
        let (m, variance) = self.ctx.normal_map(posed, &map.texture);
        let m = m.as_dvec3();
        let scale = f64::from(map.scale);
        let transform = &posed.instances[self.id.instance as usize].transform;
        let to_world = |n: DVec3| transform.normal(n.as_vec3());
        let side = if to_world(n).dot(self.n_v) < 0.0 { -1.0 } else { 1.0 };
        let m_z = if map.scale_is_strength { 1.0 + (m.z - 1.0) * scale.min(1.0) } else { m.z };
        let perturbed = (t * m.x + b * m.y) * scale + n * m_z;
        // α² is twice the variance of slopes.
        let alpha2_increase = curvature + 2.0 * variance * map.scale * map.scale;
        ((to_world(perturbed) * side).try_normalize().unwrap_or(self.n_v), alpha2_increase)
    }
}
