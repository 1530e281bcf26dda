//! What a posed scene takes up, to the vertex: but of a mesh that is drawn often, most copies lie within
//! what is known already, and their vertices are not looked at.

use glam::DVec3;

use super::PosedScene;
use crate::geometry::{Aabb, Sphere};

impl PosedScene<'_> {
    /// The bounds of all that is visible, relative to the centre.
    pub(super) fn measure(&self) -> Aabb {
        let shared = self.boxes_of_shared();
        let mut bounds = Aabb::EMPTY;
        for (i, instance) in self.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            let about = self.box_about(i, &shared);
            if about.is_some_and(|b| bounds.min.cmple(b.min).all() && bounds.max.cmpge(b.max).all()) {
                continue;
            }
            for &p in self.positions(i as u32) {
                bounds.add(instance.transform.point_f64(p));
            }
        }
        bounds
    }

    /// A sphere around all that is visible, in world coordinates: about the middle of the bounds,
    /// as small as holds every vertex. Radius 1 where there is nothing.
    pub fn bounding_sphere(&self) -> Sphere {
        let shared = self.boxes_of_shared();
        let middle = self.bounds.centre();
        let mut r2 = 0f64;
        for (i, instance) in self.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            if self.box_about(i, &shared).is_some_and(|b| b.farthest_squared(middle) <= r2) {
                continue;
            }
            for &p in self.positions(i as u32) {
                let p = instance.transform.point_f64(p);
                if p.is_finite() {
                    r2 = r2.max(p.distance_squared(middle));
                }
            }
        }
        let radius = if r2 > 0.0 { r2.sqrt() } else { 1.0 };
        Sphere { centre: middle + self.centre, radius }
    }

    /// The boxes of meshes that are drawn more than once, in their own coordinates.
    fn boxes_of_shared(&self) -> Vec<Option<Aabb>> {
        let mut drawn = vec![0usize; self.scene.meshes.len()];
        self.scene.instances.iter().for_each(|i| drawn[i.mesh as usize] += 1);
        let around = |positions: &[glam::Vec3]| {
            let mut bounds = Aabb::EMPTY;
            positions.iter().for_each(|p| bounds.add(p.as_dvec3()));
            bounds
        };
        let meshes = self.scene.meshes.iter().zip(drawn);
        meshes.map(|(mesh, drawn)| (drawn > 1).then(|| around(&mesh.positions))).collect()
    }

    /// A box that holds an instance whatever is rounded; `None` where only its vertices tell.
    fn box_about(&self, instance: usize, shared: &[Option<Aabb>]) -> Option<Aabb> {
        let own = shared[self.scene.instances[instance].mesh as usize]?;
        if self.instances[instance].deformed.is_some() || own.is_empty() {
            return None;
        }
        let to_world = &self.instances[instance].transform.affine;
        let columns = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
        let (middle, half) = (own.centre(), 0.5 * own.extent());
        let spread = |by: DVec3| {
            columns[0].abs() * by.x.abs() + columns[1].abs() * by.y.abs() + columns[2].abs() * by.z.abs()
        };
        let rounding = 1e-12 * (spread(middle) + spread(half) + to_world.translation.abs());
        let (at, reach) = (to_world.transform_point3(middle), spread(half) + rounding);
        Some(Aabb { min: at - reach, max: at + reach })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, Vec3};

    use super::*;
    use crate::scene::{Instance, Local, Material, Mesh, Node, PoseSettings, Scene, pose};

    /// Copies of a mesh, moved, turned, mirrored and flattened by numbers that are the same each time.
    fn scene(copies: u32) -> Scene {
        let number = |i: u32| f64::from((i.wrapping_mul(2_654_435_761) >> 8) % 2001) / 1000.0 - 1.0;
        let vector = |i: u32| DVec3::new(number(i), number(i + 1), number(i + 2));
        let mut positions: Vec<Vec3> = (0..50).map(|i| vector(7 * i).as_vec3()).collect();
        positions.extend([Vec3::NAN, Vec3::INFINITY]);
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let mut scene =
            Scene { materials: vec![Material::default()], meshes: vec![mesh], ..Scene::default() };
        for i in 0..copies {
            let k = 1000 * i;
            let matrix3 = DMat3::from_cols(vector(k), vector(k + 3), vector(k + 6));
            let local = Local::Matrix(DAffine3 { matrix3, translation: 5.0 * vector(k + 9) });
            scene.nodes.push(Node { local, visible: true, ..Node::default() });
            scene.instances.push(Instance { node: i, mesh: 0, object: i + 1, placement: None, skin: None });
        }
        scene
    }

    #[test]
    fn what_is_passed_over_would_have_changed_nothing() {
        let scene = scene(300);
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let all = || {
            let instances = posed.instances.iter().enumerate();
            instances.flat_map(|(i, at)| posed.positions(i as u32).iter().map(|&p| at.transform.point_f64(p)))
        };
        let mut bounds = Aabb::EMPTY;
        all().for_each(|p| bounds.add(p));
        assert_eq!(posed.measure(), bounds);
        let sphere = posed.bounding_sphere();
        let middle = posed.bounds.centre();
        let far = all().filter(|p| p.is_finite()).map(|p| p.distance_squared(middle)).fold(0.0, f64::max);
        assert_eq!(sphere, Sphere { centre: middle + posed.centre, radius: far.sqrt() });
        // And nearly all are passed over.
        let shared = posed.boxes_of_shared();
        let bounds = posed.measure();
        let within = |b: Aabb| bounds.min.cmple(b.min).all() && bounds.max.cmpge(b.max).all();
        let passed = (0..300).filter(|&i| posed.box_about(i, &shared).is_some_and(within)).count();
        assert!(passed > 250, "{passed}");
    }
}
