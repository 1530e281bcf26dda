//! Bounds of a posed scene, exact to the vertex. Clusters of vertices inside the bounds so far are skipped.

use glam::DVec3;

use crate::geometry::{Aabb, Sphere};
use crate::scene::animation::posed_scene::PosedScene;
use crate::scene::animation::vertex_clusters::{VertexClusters, fold_points};

impl PosedScene<'_> {
    /// Computes the bounds of everything visible, relative to the centre.
    pub(super) fn compute_bounds(&self) -> Aabb {
        self.fold_vertices(Aabb::EMPTY, |bounds, b| bounds.contains_box(&b), Aabb::extend)
    }

    /// Computes a bounding sphere of everything visible, in world coordinates: centred at the centre of the
    /// bounds, and as small as contains every vertex. Radius 1 if nothing is visible.
    pub fn bounding_sphere(&self) -> Sphere {
        let centre = self.bounds.centre();
        let covers = |r2: &f64, b: Aabb| b.max_distance_squared(centre) <= *r2;
        let r2 = self.fold_vertices(0.0, covers, |r2, p| {
            if p.is_finite() {
                *r2 = f64::max(*r2, p.distance_squared(centre));
            }
        });
        let radius = if r2 > 0.0 { r2.sqrt() } else { 1.0 };
        Sphere { centre: centre + self.centre, radius }
    }

    /// Folds `add` over every visible vertex, relative to the centre. Skips clusters whose bounds cannot
    /// change the result, as `covers` says.
    fn fold_vertices<T>(
        &self,
        mut result: T,
        covers: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) -> T {
        let clusters = self.vertex_clusters();
        for (i, instance) in self.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            let to_world = &instance.transform.affine;
            let own = clusters[self.scene.instances[i].mesh as usize].as_ref();
            match own.filter(|_| instance.deformed.is_none()) {
                Some(own) => own.fold(to_world, &mut result, &covers, &add),
                None => fold_points(to_world, self.positions(i as u32), &mut result, &add),
            }
        }
        result
    }

    /// Clusters the vertices of each mesh with several instances.
    fn vertex_clusters(&self) -> Vec<Option<VertexClusters<'_>>> {
        let mut instances = vec![0usize; self.scene.meshes.len()];
        self.scene.instances.iter().for_each(|i| instances[i.mesh as usize] += 1);
        let meshes = self.scene.meshes.iter().zip(instances);
        meshes.map(|(mesh, n)| (n > 1).then(|| VertexClusters::new(&mesh.positions, n))).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, Vec3};

    use super::*;
    use crate::scene::pose;
    use crate::scene::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene};

    /// Instances of a mesh: translated, rotated, mirrored and flattened by reproducible numbers.
    fn scene(copies: u32) -> Scene {
        let number = |i: u32| f64::from((i.wrapping_mul(2_654_435_761) >> 8) % 2001) / 1000.0 - 1.0;
        let vector = |i: u32| DVec3::new(number(i), number(i + 1), number(i + 2));
        let mut positions: Vec<Vec3> = (0..500).map(|i| vector(7 * i).as_vec3()).collect();
        positions.extend([Vec3::NAN, Vec3::INFINITY]);
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let mut scene =
            Scene { materials: vec![Material::default()], meshes: vec![mesh], ..Scene::default() };
        for i in 0..copies {
            let k = 1000 * i;
            let matrix3 = DMat3::from_cols(vector(k), vector(k + 3), vector(k + 6));
            let local = LocalTransform::Matrix(DAffine3 { matrix3, translation: 5.0 * vector(k + 9) });
            scene.nodes.push(Node { local, visible: true, ..Node::default() });
            scene.instances.push(Instance { node: i, mesh: 0, object: i + 1, ..Instance::default() });
        }
        scene
    }

    /// Returns the number of vertices that computing the bounds visits.
    fn visited_vertices(posed: &PosedScene) -> usize {
        let covers = |found: &(Aabb, usize), b: Aabb| found.0.contains_box(&b);
        let count = |found: &mut (Aabb, usize), p: DVec3| {
            found.0.extend(p);
            found.1 += 1;
        };
        posed.fold_vertices((Aabb::EMPTY, 0), covers, count).1
    }

    #[test]
    fn skipped_clusters_would_not_change_the_bounds() {
        let scene = scene(300);
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let all = || {
            let instances = posed.instances.iter().enumerate();
            instances.flat_map(|(i, at)| posed.positions(i as u32).iter().map(|&p| at.transform.point_f64(p)))
        };
        let mut bounds = Aabb::EMPTY;
        all().for_each(|p| bounds.extend(p));
        assert_eq!(posed.compute_bounds(), bounds);
        let sphere = posed.bounding_sphere();
        let middle = posed.bounds.centre();
        let far = all().filter(|p| p.is_finite()).map(|p| p.distance_squared(middle)).fold(0.0, f64::max);
        assert_eq!(sphere, Sphere { centre: middle + posed.centre, radius: far.sqrt() });
        // Most vertices are skipped.
        let visited = visited_vertices(&posed);
        assert!(visited < all().count() / 6, "{visited} of {}", all().count());
    }

    /// All instances have the same bounds, except for rounding.
    #[test]
    fn of_copies_in_one_place_few_vertices_are_visited_vertices() {
        let copies = 400;
        let mut scene = scene(copies);
        let turn = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 8) * 1e-3;
        let of_sphere = |i: u32| DVec3::new(turn(i).cos(), turn(i).sin(), turn(7 * i).sin()).normalize();
        scene.meshes[0].positions = (0..6400).map(|i| of_sphere(i).as_vec3()).collect();
        scene.nodes.iter_mut().for_each(|node| node.local = LocalTransform::default());
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let visited = visited_vertices(&posed);
        let all = 6400 * copies as usize;
        assert!(visited < all / 5, "{visited} of {all}");
    }
}
