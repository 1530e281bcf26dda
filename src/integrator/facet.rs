//! A triangle as shading sees it: what all points on it share.

use glam::{DVec3, Vec3};

use super::coefficients::widens;
use super::footprint::{Spread, Steps};
use super::surface::Surface;
use crate::geometry::{HitId, Ray, RayDifferential, point_error};
use crate::scene::{Mesh, PosedScene};

/// A triangle in the world, relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet<'s> {
    /// Which triangle.
    pub id: HitId,
    mesh: &'s Mesh,
    corners: [u32; 3],
    v: [DVec3; 3],
    /// Unit normal of the front; `None` where the triangle has no area to speak of.
    front: Option<DVec3>,
    /// Points on it are right to within ± this.
    p_error: Vec3,
    /// Normals at the corners, as they are blended, where the mesh has any.
    n: Option<[DVec3; 3]>,
    steps: Steps,
    /// The instance's own colour.
    tint: Option<Vec3>,
    /// True where it is the same to what is seen how much of it a sample stands for.
    even: bool,
}

impl<'s> Facet<'s> {
    /// Triangle `id` of a posed scene.
    pub fn new(posed: &PosedScene<'s>, id: HitId) -> Facet<'s> {
        let mesh = posed.mesh(id.instance);
        let corners = mesh.triangles[id.triangle as usize];
        let transform = &posed.instances[id.instance as usize].transform;
        let positions = posed.positions(id.instance);
        let local = corners.map(|c| positions[c as usize]);
        let world = local.map(|p| transform.point(p));
        let v = world.map(|v| v.as_dvec3());
        let e = [v[1] - v[0], v[2] - v[0]];
        let wound = e[0].cross(e[1]) * if transform.flips { -1.0 } else { 1.0 };
        let front = wound.try_normalize();
        let normals = posed.normals(id.instance);
        let normal = |c: u32| {
            let n = transform.normal(normals[c as usize]);
            if mesh.smooth_in_own_frame { n } else { n.normalize_or_zero() }
        };
        let n = (!normals.is_empty()).then(|| corners.map(normal));
        let p_error = point_error(world, local, &transform.affine);
        let steps = Steps::new(e, front.unwrap_or(DVec3::ZERO));
        let material = &posed.materials[mesh.material as usize];
        let even = !widens(material) && material.normal.is_none() && !material.is_textured();
        let tint = posed.scene.instances[id.instance as usize].color;
        Facet { id, mesh, corners, v, front, p_error, n, steps, tint, even }
    }

    /// The point where `ray` meets it, which it is known to do; seen by an eye ray that stands for
    /// those up to `differential` away, if there is one.
    pub fn seen(&self, ray: Ray, differential: Option<&RayDifferential>) -> Surface<'s> {
        let differential = differential.filter(|_| !self.even);
        let [v0, v1, v2] = self.v;
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let wound = self.front.unwrap_or_else(|| -d.normalize_or(DVec3::NEG_Z));
        let facing = wound.dot(d);
        let per_facing = 1.0 / facing;
        let t = (v0 - o).dot(wound) * per_facing;
        let b = on_triangle(self.steps.of(o - v0 + d * t));
        let p = v0 * b[0] + v1 * b[1] + v2 * b[2];
        let front = facing <= 0.0;
        let n_g = if front { wound } else { -wound };
        let over = |by| Spread::over(by, (t, d), &self.steps, (wound, per_facing));
        let mut spread = differential.map_or(Spread::POINT, over);
        let n_v = self.n.map_or(n_g, |n| {
            let sum = n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
            let per_length = sum.length_recip();
            let middle = sum * per_length;
            let fits = per_length.is_finite() && per_length > 0.0;
            if fits && differential.is_some() {
                spread.bend(n, middle, per_length);
            }
            // Files whose normals point against their winding are lit all the same.
            let n = if fits { middle } else { n_g };
            if n.dot(n_g) < 0.0 { -n } else { n }
        });
        Surface {
            id: self.id,
            p: p.as_vec3(),
            p_error: self.p_error,
            n_g,
            n_v,
            front,
            b: [b[0] as f32, b[1] as f32, b[2] as f32],
            material: self.mesh.material,
            spread,
            mesh: self.mesh,
            corners: self.corners,
            tint: self.tint,
        }
    }
}

/// The facets that were asked for lately: neighbouring rays meet the same few.
#[derive(Debug)]
pub(super) struct Facets<'s>(Vec<Option<Facet<'s>>>);

impl<'s> Facets<'s> {
    /// How many are kept; a power of two.
    const KEPT: usize = 64;

    pub fn new() -> Facets<'s> {
        Facets(Vec::new())
    }

    /// Triangle `id`, made anew only where it is not kept.
    pub fn of(&mut self, posed: &PosedScene<'s>, id: HitId) -> &Facet<'s> {
        // Where nothing is hit there is nothing to keep.
        if self.0.is_empty() {
            self.0.resize(Facets::KEPT, None);
        }
        // Neighbours in a file mostly are neighbours in space.
        let kept = &mut self.0[(id.triangle ^ id.instance.wrapping_mul(7)) as usize % Facets::KEPT];
        if kept.as_ref().is_some_and(|facet| facet.id != id) {
            *kept = None;
        }
        kept.get_or_insert_with(|| Facet::new(posed, id))
    }
}

/// All three barycentrics of a point, of which 1 and 2 are `u` and `v`; pulled onto the triangle where
/// rounding left it.
fn on_triangle([u, v]: [f64; 2]) -> [f64; 3] {
    if !(u.is_finite() && v.is_finite()) {
        return [1.0 / 3.0; 3];
    }
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let sum = u + v;
    if sum > 1.0 { [0.0, u / sum, v / sum] } else { [1.0 - sum, u, v] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Local, Material, Node, PoseSettings, Scene, pose};
    use glam::DAffine3;

    /// Cycles' two ways, under a scale that is not even.
    #[test]
    fn normals_are_blended_in_the_world_or_in_the_meshs_own_frame() {
        let normals = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, 0.6), Vec3::Z];
        let scale = DVec3::new(1.0, 0.25, 1.0);
        let expected = |own: bool| {
            let world = normals.map(|n| n.as_dvec3() / scale);
            let each = world.map(|n| if own { n } else { n.normalize() });
            (each[0] * 0.5 + each[1] * 0.25 + each[2] * 0.25).normalize()
        };
        assert!(expected(true).dot(expected(false)) < 0.99);
        for own in [false, true] {
            let mesh = Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                triangles: vec![[0, 1, 2]],
                normals: normals.into(),
                smooth_in_own_frame: own,
                ..Mesh::default()
            };
            let local = Local::Matrix(DAffine3::from_scale(scale));
            let scene = Scene {
                meshes: vec![mesh],
                nodes: vec![Node { local, visible: true, ..Node::default() }],
                instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
                materials: vec![Material::default()],
                ..Scene::default()
            };
            let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
            let posed = pose(&scene, &settings).unwrap();
            let ray = Ray { o: Vec3::new(0.25, 0.0625, 1.0), d: Vec3::NEG_Z };
            let n = Facet::new(&posed, HitId { instance: 0, triangle: 0 }).seen(ray, None).n_v;
            assert!(n.abs_diff_eq(expected(own), 1e-6), "{own}: {n}, not {}", expected(own));
        }
    }
}
