//! A triangle as shading sees it: what all points on it share.

use glam::{DVec3, Vec2, Vec3};

use crate::accel::Accel;
use crate::geometry::{HitId, Ray, RayDifferential, offset_ray_origin, point_error};
use crate::integrator::material::coefficients::widens;
use crate::integrator::surface::points::{Columns, Found, Group, Met, Rays, TOGETHER};
use crate::integrator::surface::ray_differentials::Spread;
use crate::integrator::surface::shadow_terminator::{Lift, start};
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_eval::OnMesh;
use crate::integrator::surface::triangle_plane::{Flat, OnFlat};
use crate::scene::{Mesh, PosedScene};
use crate::simd::AutovecKernel;

/// A triangle in the world, relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet<'s> {
    /// Which triangle.
    pub id: HitId,
    mesh: &'s Mesh,
    corners: [u32; 3],
    flat: Flat,
    /// Points on it are right to within ± this.
    p_error: Vec3,
    /// Normals at the corners, as they are blended; 0 where the mesh has none.
    n: [DVec3; 3],
    lift: Lift,
    /// The instance's own colour.
    tint: Option<Vec3>,
    /// Index of the material.
    pub material: u32,
    /// True where nothing but the material says what is seen: no texture, no colour.
    pub plain: bool,
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
        let normals = posed.normals(id.instance);
        let normal = |c: u32| {
            let n = transform.normal(normals[c as usize]);
            if mesh.interpolate_normals_locally { n } else { n.normalize_or_zero() }
        };
        let n = if normals.is_empty() { [DVec3::ZERO; 3] } else { corners.map(normal) };
        let p_error = point_error(world, local, &transform.affine);
        let flat = Flat::new(world, transform.flips_winding);
        let lift = Lift::new(&flat.v, &n, !mesh.interpolate_normals_locally);
        let material = &posed.materials[mesh.material as usize];
        let even = !widens(material) && material.normal.is_none() && !material.is_textured();
        let tint = posed.scene.instances[id.instance as usize].color;
        let colored = tint.is_some() || !mesh.colors.is_empty();
        let plain = !(colored || material.normal.is_some() || material.is_textured());
        let material = mesh.material;
        Facet { id, mesh, corners, flat, p_error, n, lift, tint, material, plain, even }
    }

    /// The point where `ray` meets it, which it is known to do; seen by an eye ray that stands for
    /// those up to `differential` away, if there is one.
    pub fn seen(&self, ray: Ray, differential: Option<&RayDifferential>) -> SurfacePoint<'s> {
        self.surface(&self.met(self.flat.front_to(ray), ray, differential.filter(|_| !self.even)))
    }

    /// The same for the first `count` of `rays`, whose points are added to `columns`: all that meet one
    /// triangle have so much in common that they go by the column.
    pub fn meet(
        &self,
        accel: &Accel,
        rays: &Rays,
        count: usize,
        differential: Option<RayDifferential>,
        columns: &mut Columns,
    ) {
        let differential = differential.filter(|_| !self.even);
        let (group, at) = columns.more(count);
        match self.flat.front {
            Some(front) if count > 1 => {
                accel.run_autovec(Meet { facet: *self, front, rays, differential, group, at });
            }
            _ => {
                for i in 0..count {
                    let ray = rays.get(i);
                    let met = self.met(self.flat.front_to(ray), ray, differential.as_ref());
                    group.put_one(at + i, ray.d, &met);
                }
            }
        }
    }

    #[inline(always)]
    fn met(&self, front: DVec3, ray: Ray, differential: Option<&RayDifferential>) -> Met {
        let OnFlat { t, facing, per_facing, b } = self.flat.meet(front, ray);
        let [v0, v1, v2] = self.flat.v;
        let p = v0 * b[0] + v1 * b[1] + v2 * b[2];
        let n_g = if facing <= 0.0 { front } else { -front };
        let mut spread = Spread::POINT;
        if let Some(by) = differential {
            let way = (t, ray.d.as_dvec3());
            spread = Spread::over(by, way, &self.flat.steps, (front, per_facing));
        }
        // Flat triangles have none, and no sum of them that fits.
        let n = self.n;
        let sum = n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
        let per_length = sum.length_recip();
        let middle = sum * per_length;
        let fits = (per_length < f64::INFINITY) & (per_length > 0.0);
        if differential.is_some() {
            spread.bend(n, middle, per_length, fits);
        }
        // Files whose normals point against their winding are lit all the same.
        let against = middle.dot(n_g) < 0.0;
        let n_v = if against { -middle } else { middle };
        let n_v = if fits { n_v } else { n_g };
        let p = p.as_vec3();
        let (clear, up) = (self.above(p, n_g), self.lift.up(b, against));
        Met { p, clear, up, n_g, n_v, b: [b[0] as f32, b[1] as f32, b[2] as f32], spread }
    }

    /// A place on it, moved off by its error to `n_g`'s side.
    #[inline(always)]
    fn above(&self, p: Vec3, n_g: DVec3) -> Vec3 {
        let n_g = n_g.as_vec3();
        offset_ray_origin(p, self.p_error, n_g, n_g)
    }

    /// Where a shadow ray from a point towards `l` starts ([`Surface::shadow_origin`]); the point by its
    /// place and barycentrics, its geometric and its vertex normal.
    pub fn shadow_origin(&self, (p, b): (Vec3, [f32; 3]), (n_g, n_v): (DVec3, DVec3), l: DVec3) -> Vec3 {
        let b = b.map(f64::from);
        let against = (self.n[0] * b[0] + self.n[1] * b[1] + self.n[2] * b[2]).dot(n_v) < 0.0;
        start(self.above(p, n_g), self.lift.up(b, against), n_g.dot(l))
    }

    /// What is where a ray has met it.
    pub fn surface(&self, met: &Met) -> SurfacePoint<'s> {
        SurfacePoint {
            id: self.id,
            p: met.p,
            p_error: self.p_error,
            n_g: met.n_g,
            n_v: met.n_v,
            // Without area it faces whoever looks.
            front: self.flat.front.is_none_or(|front| front.dot(met.n_g) > 0.0),
            material: self.material,
            on: self.on_mesh(met.b, met.spread),
        }
    }

    /// Where that is on its mesh.
    #[inline(always)]
    pub fn on_mesh(&self, b: [f32; 3], spread: Spread) -> OnMesh<'s> {
        OnMesh { mesh: self.mesh, corners: self.corners, b, spread, tint: self.tint, fetched: None }
    }

    /// Texture coordinates of a set at its corners.
    pub fn uvs(&self, set: u32) -> [Vec2; 3] {
        self.mesh.uvs_at(self.corners, set)
    }
}

/// [`Facet::meet`]. A job so small that the compiler sees through its loops.
struct Meet<'a, 's> {
    facet: Facet<'s>,
    front: DVec3,
    rays: &'a Rays,
    differential: Option<RayDifferential>,
    group: &'a mut Group,
    at: usize,
}

impl AutovecKernel for Meet<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Meet { facet, front, rays, differential, group, at } = self;
        // By value: what the loops read is then nothing that they write.
        let rays = *rays;
        let mut found = Found::NONE;
        match differential {
            None => {
                for i in 0..TOGETHER {
                    found.set(i, &facet.met(front, rays.get(i), None));
                }
            }
            Some(by) => {
                for i in 0..TOGETHER {
                    found.set(i, &facet.met(front, rays.get(i), Some(&by)));
                }
            }
        }
        group.put(at, &rays, &found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{BuildSettings, SimdLevel};
    use crate::scene::pose;
    use crate::scene::{Instance, LocalTransform, Material, Node, PoseSettings, Scene};
    use glam::DAffine3;

    /// One mesh under a transform.
    fn placed(mesh: Mesh, transform: DAffine3) -> Scene {
        Scene {
            meshes: vec![mesh],
            nodes: vec![Node { local: LocalTransform::Matrix(transform), visible: true, ..Node::default() }],
            instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn about_origin() -> PoseSettings {
        PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }
    }

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
                interpolate_normals_locally: own,
                ..Mesh::default()
            };
            let scene = placed(mesh, DAffine3::from_scale(scale));
            let posed = pose(&scene, &about_origin()).unwrap();
            let ray = Ray { o: Vec3::new(0.25, 0.0625, 1.0), d: Vec3::NEG_Z };
            let n = Facet::new(&posed, HitId { instance: 0, triangle: 0 }).seen(ray, None).n_v;
            assert!(n.abs_diff_eq(expected(own), 1e-6), "{own}: {n}, not {}", expected(own));
        }
    }

    /// Smooth, flat, without area, from both sides, edge on and past the edges; any number of rays, with
    /// and without neighbours, on every tier.
    #[test]
    fn rays_together_find_what_each_finds_alone() {
        let corners =
            [Vec3::ZERO, Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.2, 1.0, 0.3), Vec3::new(2.0, 0.2, 0.0)];
        let normals = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.8, 0.6), -Vec3::Z];
        let step = |x, y, z| DVec3::new(x, y, z) * 0.01;
        let by = RayDifferential { o: [DVec3::ZERO; 2], d: [step(1.0, 0.2, 0.0), step(0.0, 1.0, -0.3)] };
        let ray = |i: usize| {
            let [x, y] = [i % 5, i / 5 % 7].map(|k| k as f32 * 0.3 - 0.4);
            let o = if i % 3 == 2 { Vec3::new(0.3, 0.4, -2.0) } else { Vec3::new(0.1, -0.2, 3.0) };
            let d = Vec3::new(x, y, 0.0) - o;
            Ray { o, d: if i % 11 == 10 { Vec3::new(1.0, 0.1, 0.0) } else { d } }
        };
        for smooth in [false, true] {
            let mesh = Mesh {
                positions: corners.into(),
                triangles: vec![[0, 1, 2], [2, 3, 1], [0, 1, 3], [1, 1, 2]],
                normals: if smooth { normals.into() } else { Vec::new() },
                ..Mesh::default()
            };
            let turn = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.2);
            let scene = placed(mesh, turn);
            let posed = pose(&scene, &about_origin()).unwrap();
            for tier in SimdLevel::ALL.into_iter().filter(|tier| tier.is_supported()) {
                let accel = Accel::build(&posed, &BuildSettings { simd: tier, ..BuildSettings::default() }).0;
                let (mut columns, mut next) = (Columns::default(), 0);
                for (triangle, differential) in (0..4).flat_map(|t| [(t, None), (t, Some(by))]) {
                    let facet = Facet::new(&posed, HitId { instance: 0, triangle });
                    for count in (1..=TOGETHER).cycle().take(40) {
                        let count = count.min(columns.room());
                        let mut rays = Rays::NONE;
                        (0..count).for_each(|i| rays.set(i, ray(next + i)));
                        facet.meet(&accel, &rays, count, differential, &mut columns);
                        for i in next..next + count {
                            let (group, at) = columns.of(i);
                            // NaN is one number here.
                            let together = format!("{:?}", facet.surface(&group.met(at)));
                            let alone = format!("{:?}", facet.seen(ray(i), differential.as_ref()));
                            assert_eq!(together, alone, "{tier:?} {smooth} {triangle} {count}");
                        }
                        next += count;
                    }
                }
            }
        }
    }
}
