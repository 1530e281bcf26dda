//! What is where a ray hits: the lecture's surface point, with everything shading asks of it.

use glam::{DVec3, Vec3, Vec4};

use crate::geometry::{HitId, Ray};
use crate::integrator::surface::shading_triangle::Facet;
use crate::integrator::surface::texture_eval::OnMesh;
use crate::scene::PosedScene;

/// A point on a surface, seen from somewhere. Positions are relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'s> {
    /// Which triangle.
    pub id: HitId,
    /// The point, from barycentrics: on the triangle, whatever t was rounded to.
    pub p: Vec3,
    /// The true point is within ± this of `p`.
    pub p_error: Vec3,
    /// Geometric normal, unit length, to the viewer's side.
    pub n_g: DVec3,
    /// Vertex normals interpolated (or `n_g`), unit length, on `n_g`'s side.
    pub n_v: DVec3,
    /// True where the front is seen.
    pub front: bool,
    /// Index of the material.
    pub material: u32,
    /// Where it is on its mesh.
    pub(crate) on: OnMesh<'s>,
}

impl<'s> SurfacePoint<'s> {
    /// The point where `ray` meets triangle `id`, which it is known to hit. Its textures are looked
    /// up at their finest.
    pub fn at(posed: &PosedScene<'s>, id: HitId, ray: Ray) -> SurfacePoint<'s> {
        Facet::new(posed, id).seen(ray, None)
    }

    /// Where a shadow ray towards `l` starts: clear of the triangle's rounding, and, where the light
    /// grazes the triangle, above it on the smooth surface, so that neighbours cast no shadow that
    /// the smooth surface would not have. Steeper light starts at the triangle: coarse surfaces
    /// would lose the shadows of what stands on them.
    pub fn shadow_origin(&self, posed: &PosedScene, l: DVec3) -> Vec3 {
        Facet::new(posed, self.id).shadow_origin((self.p, self.on.b), (self.n_g, self.n_v), l)
    }

    /// The shading normal: `n_v`, moved by the material's normal map where there is one and the
    /// mesh has tangents. The bitangent is made in object space, then transformed, so that
    /// mirrored and sheared nodes keep it right; a back face turns the whole frame.
    pub fn shading_normal(&self, posed: &PosedScene) -> DVec3 {
        self.shading_normals(posed).0
    }

    /// The mean of the shading normals that this point stands for, and what their spread adds to a
    /// highlight's α²: of the smooth surface, which turns, and of the normal map.
    pub fn shading_normals(&self, posed: &PosedScene) -> (DVec3, f32) {
        let turns = self.on.spread.roughening();
        let Some(map) = &posed.materials[self.material as usize].normal else { return (self.n_v, turns) };
        let (normals, tangents) = (posed.normals(self.id.instance), posed.tangents(self.id.instance));
        if normals.is_empty() || tangents.is_empty() {
            return (self.n_v, turns);
        }
        let transform = &posed.instances[self.id.instance as usize].transform;
        // Where the map was baked, before anything is scaled: what it makes of the normal is then taken to
        // the world as normals are.
        let (mut n, mut t) = (Vec3::ZERO, Vec4::ZERO);
        for (&corner, b) in self.on.corners.iter().zip(self.on.b) {
            n += normals[corner as usize] * b;
            t += tangents[corner as usize] * b;
        }
        let frame = [t.truncate(), n.cross(t.truncate()) * t.w, n].map(|axis| axis.as_dvec3());
        let (m, variance) = self.on.direction(posed, &map.texture);
        let (m, scale) = (m.as_dvec3(), f64::from(map.scale));
        let to_world = |n: DVec3| transform.normal(n.as_vec3());
        let side = if to_world(frame[2]).dot(self.n_v) < 0.0 { -1.0 } else { 1.0 };
        let up = if map.scale_is_strength { 1.0 + (m.z - 1.0) * scale.min(1.0) } else { m.z };
        let mapped = (frame[0] * m.x + frame[1] * m.y) * scale + frame[2] * up;
        // α² is twice the variance of a slope.
        let roughening = turns + 2.0 * variance * map.scale * map.scale;
        ((to_world(mapped) * side).try_normalize().unwrap_or(self.n_v), roughening)
    }
}
