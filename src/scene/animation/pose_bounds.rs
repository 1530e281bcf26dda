//! Bounds of a posed scene, exact to the corners of the triangles that can be seen.
//!
//! The extremes over all vertices are found first. Mostly, drawn triangles attain them, which is quickly checked.
//! Only if not, all triangles are visited.

use crate::animation::clip_alpha::ClipAlpha;
use crate::animation::drawn_triangles::{DrawnPoints, InstanceShape, Rank, add_drawn_triangles};
use crate::animation::extremes::{BoxExtremes, Extremes, FarthestVertex, VertexAt};
use crate::animation::playback::active_animations;
use crate::animation::posed_scene::PosedScene;
use crate::animation::vertex_clusters::{VertexClusters, add_points};
use blinn_core::geometry::{Aabb, Sphere};

impl PosedScene<'_> {
    /// Computes the bounds of the triangles that can be seen, relative to the centre.
    pub(super) fn compute_bounds(&self) -> Aabb {
        self.find_extremes(BoxExtremes::EMPTY).bounds
    }

    /// Computes a bounding sphere of the triangles that can be seen, in world coordinates: centred at the centre of
    /// the bounds, and as small as contains every corner. Radius 1 if nothing can be seen.
    pub fn bounding_sphere(&self) -> Sphere {
        let centre = self.bounds.centre();
        let r2 = self.find_extremes(FarthestVertex::from(centre)).distance_squared;
        let radius = if r2 > 0.0 { r2.sqrt() } else { 1.0 };
        Sphere { centre: centre + self.centre, radius }
    }

    /// Finds the extremes over the corners of all triangles that can be seen, relative to the centre.
    fn find_extremes<E: Extremes>(&self, start: E) -> E {
        let cache = self.clip_bounds_cache();
        let active = || active_animations(self.scene, self.animation()).unwrap_or_default();
        let alpha = cache.alpha(self.scene, active);
        if cache.drawn().is_none() {
            let found = self.extremes_of_vertices(start);
            if found.vertices().iter().all(|(part, at)| self.is_attained(&found, *part, at, alpha)) {
                return found;
            }
        }
        self.extremes_of_triangles(start, cache.drawn_or_init(self.scene), alpha)
    }

    /// Finds the extremes over all vertices of visible instances.
    fn extremes_of_vertices<E: Extremes>(&self, mut extremes: E) -> E {
        let counts = self.instance_counts();
        let mut clusters: Vec<Option<VertexClusters>> = counts.iter().map(|_| None).collect();
        for i in self.spread_instances() {
            let to_world = &self.instances[i as usize].transform.affine;
            let at = VertexAt { instance: i, ..VertexAt::default() };
            let mesh = self.scene.instances[i as usize].mesh as usize;
            // Clusters pay off for several instances.
            if self.instances[i as usize].deformed.is_none() && counts[mesh] > 1 {
                let positions = &self.scene.meshes[mesh].positions;
                clusters[mesh].get_or_insert_with(|| VertexClusters::new(positions, counts[mesh])).add_to(
                    to_world,
                    at,
                    &mut extremes,
                );
            } else {
                add_points(to_world, self.positions(i), at, &mut extremes, |v| v as u32);
            }
        }
        extremes
    }

    /// Finds the extremes over the triangles that can be seen.
    fn extremes_of_triangles<E: Extremes>(
        &self,
        mut extremes: E,
        drawn: &DrawnPoints,
        alpha: &ClipAlpha,
    ) -> E {
        let counts = self.instance_counts();
        let mut clusters: Vec<Option<VertexClusters>> = counts.iter().map(|_| None).collect();
        for i in self.spread_instances() {
            let to_world = &self.instances[i as usize].transform.affine;
            let mesh = self.scene.instances[i as usize].mesh;
            let is_deformed = self.instances[i as usize].deformed.is_some();
            if is_deformed || Rank::of(&to_world.matrix3) == Rank::Flat {
                let positions = self.positions(i);
                add_drawn_triangles(self.scene, self.mesh(i), positions, to_world, alpha, &mut extremes);
            } else {
                let count = counts[mesh as usize];
                clusters[mesh as usize]
                    .get_or_insert_with(|| VertexClusters::new(drawn.of(self.scene, mesh, alpha), count))
                    .add_to(to_world, VertexAt::default(), &mut extremes);
            }
        }
        extremes
    }

    /// Returns the visible instances whose transforms do not collapse them.
    fn spread_instances(&self) -> impl Iterator<Item = u32> {
        let is_spread = |i: &u32| {
            let instance = &self.instances[*i as usize];
            instance.visible && Rank::of(&instance.transform.affine.matrix3) != Rank::Line
        };
        (0..self.instances.len() as u32).filter(is_spread)
    }

    /// Returns the number of instances of each mesh.
    fn instance_counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.scene.meshes.len()];
        self.scene.instances.iter().for_each(|i| counts[i.mesh as usize] += 1);
        counts
    }

    /// Returns true if a triangle that can be seen attains a part of `extremes`, as a vertex does.
    fn is_attained<E: Extremes>(&self, extremes: &E, part: usize, at: &VertexAt, alpha: &ClipAlpha) -> bool {
        let positions = self.positions(at.instance);
        let mut shape = InstanceShape {
            scene: self.scene,
            mesh: self.mesh(at.instance),
            alpha,
            to_world: self.instances[at.instance as usize].transform.affine,
            position: |v: u32| positions[v as usize],
        };
        shape.attains(extremes, part, at.vertex)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, DVec3, Vec3};

    use super::*;
    use crate::animation::extremes::CountingBox;
    use crate::pose;
    use crate::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene};

    /// Triangles between each three neighbours of `count` vertices.
    fn strip(count: u32) -> Vec<[u32; 3]> {
        (0..count - 2).map(|i| [i, i + 1, i + 2]).collect()
    }

    /// Instances of a mesh: translated, rotated, mirrored and flattened by reproducible numbers.
    fn scene(copies: u32) -> Scene {
        let number = |i: u32| f64::from((i.wrapping_mul(2_654_435_761) >> 8) % 2001) / 1000.0 - 1.0;
        let vector = |i: u32| DVec3::new(number(i), number(i + 1), number(i + 2));
        let mut positions: Vec<Vec3> = (0..500).map(|i| vector(7 * i).as_vec3()).collect();
        positions.extend([Vec3::NAN, Vec3::INFINITY]);
        let mesh = Mesh { positions, triangles: strip(500), ..Mesh::default() };
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
        posed.extremes_of_vertices(CountingBox::default()).points
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
    fn of_copies_in_one_place_few_vertices_are_visited() {
        let copies = 400;
        let mut scene = scene(copies);
        let turn = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 8) * 1e-3;
        let of_sphere = |i: u32| DVec3::new(turn(i).cos(), turn(i).sin(), turn(7 * i).sin()).normalize();
        scene.meshes[0].positions = (0..6400).map(|i| of_sphere(i).as_vec3()).collect();
        scene.meshes[0].triangles = strip(6400);
        scene.nodes.iter_mut().for_each(|node| node.local = LocalTransform::default());
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let visited = visited_vertices(&posed);
        let all = 6400 * copies as usize;
        assert!(visited < all / 5, "{visited} of {all}");
    }
}
