//! What a posed scene takes up, to the vertex: but of a mesh that is drawn often, most copies lie within
//! what is known already, and their vertices are not looked at.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, UVec3, Vec3};

use crate::geometry::{Aabb, Sphere, morton3};
use crate::scene::PosedScene;

impl PosedScene<'_> {
    /// The bounds of all that is visible, relative to the centre.
    pub(crate) fn measure(&self) -> Aabb {
        let within = |bounds: &Aabb, b: Aabb| bounds.min.cmple(b.min).all() && bounds.max.cmpge(b.max).all();
        self.over_vertices(Aabb::EMPTY, within, Aabb::extend)
    }

    /// A sphere around all that is visible, in world coordinates: about the middle of the bounds,
    /// as small as holds every vertex. Radius 1 where there is nothing.
    pub fn bounding_sphere(&self) -> Sphere {
        let middle = self.bounds.centre();
        let within = |r2: &f64, b: Aabb| b.max_distance_squared(middle) <= *r2;
        let r2 = self.over_vertices(0.0, within, |r2, p| {
            if p.is_finite() {
                *r2 = f64::max(*r2, p.distance_squared(middle));
            }
        });
        let radius = if r2 > 0.0 { r2.sqrt() } else { 1.0 };
        Sphere { centre: middle + self.centre, radius }
    }

    /// Has `add` count every visible vertex in, relative to the centre, but for those in boxes of which
    /// `within` says that they change nothing.
    fn over_vertices<T>(
        &self,
        mut found: T,
        within: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) -> T {
        let crowds = self.crowds();
        for (i, instance) in self.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            let to_world = &instance.transform.affine;
            let own = crowds[self.scene.instances[i].mesh as usize].as_ref();
            match own.filter(|_| instance.deformed.is_none()) {
                Some(own) => own.over_vertices(to_world, &mut found, &within, &add),
                None => add_all(to_world, self.positions(i as u32), &mut found, &add),
            }
        }
        found
    }

    /// Of meshes that are drawn more than once.
    fn crowds(&self) -> Vec<Option<VertexClusters<'_>>> {
        let mut drawn = vec![0usize; self.scene.meshes.len()];
        self.scene.instances.iter().for_each(|i| drawn[i.mesh as usize] += 1);
        let meshes = self.scene.meshes.iter().zip(drawn);
        meshes.map(|(mesh, drawn)| (drawn > 1).then(|| VertexClusters::new(&mesh.positions, drawn))).collect()
    }
}

/// The vertices of a mesh, in its own coordinates, in crowds of such as lie together: of many copies side
/// by side each may widen the bounds a little, but only few of its vertices do.
pub(crate) struct VertexClusters<'m> {
    points: Cow<'m, [Vec3]>,
    /// Points of a crowd, but for the last.
    size: usize,
    boxes: Vec<Aabb>,
    around: Aabb,
}

/// Meshes that are drawn more rarely are one crowd: to sort them would take longer.
const MANY: usize = 16;
/// Points of a crowd of those that are sorted.
pub(crate) const CROWD: usize = 64;

impl<'m> VertexClusters<'m> {
    fn new(positions: &'m [Vec3], drawn: usize) -> VertexClusters<'m> {
        let around = box_of(positions);
        let (mut points, mut size) = (Cow::Borrowed(positions), positions.len().max(1));
        if drawn >= MANY && size > CROWD {
            size = CROWD;
            points.to_mut().sort_by_cached_key(|p| morton(p.as_dvec3(), &around));
        }
        VertexClusters::of(points, size, around)
    }

    /// Of vertices that stay in their order: files mostly have neighbours one after another.
    pub fn in_order(positions: &'m [Vec3]) -> VertexClusters<'m> {
        VertexClusters::of(Cow::Borrowed(positions), CROWD, box_of(positions))
    }

    fn of(points: Cow<'m, [Vec3]>, size: usize, around: Aabb) -> VertexClusters<'m> {
        let boxes = points.chunks(size).map(box_of).collect();
        VertexClusters { points, size, boxes, around }
    }

    /// Has `add` count the vertices in where `to_world` takes them, but for those in boxes of which `within`
    /// says that they change nothing.
    pub fn over_vertices<T>(
        &self,
        to_world: &DAffine3,
        found: &mut T,
        within: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) {
        let passed = |found: &T, b: &Aabb| !b.is_empty() && within(found, box_about(to_world, b));
        if passed(found, &self.around) {
            return;
        }
        for (points, b) in self.points.chunks(self.size).zip(&self.boxes) {
            if !passed(found, b) {
                add_all(to_world, points, found, &add);
            }
        }
    }
}

/// Has `add` count every one of `points` in.
pub(crate) fn add_all<T>(to_world: &DAffine3, points: &[Vec3], found: &mut T, add: impl Fn(&mut T, DVec3)) {
    points.iter().for_each(|&p| add(found, to_world.transform_point3(p.as_dvec3())));
}

pub(crate) fn box_of(points: &[Vec3]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    points.iter().for_each(|p| bounds.extend(p.as_dvec3()));
    bounds
}

/// The Morton code of a point's cell in a grid of 1024³ over a box: points with neighbouring codes lie close together.
fn morton(p: DVec3, bounds: &Aabb) -> u64 {
    let cell = ((p - bounds.min) / bounds.extent() * 1024.0).to_array();
    // NaN, along an axis without extent, is the same cell for all.
    morton3(UVec3::from(cell.map(|x| x.min(1023.0) as u32)))
}

/// A box that holds all of `own` once it is placed, whatever is rounded.
pub(crate) fn box_about(to_world: &DAffine3, own: &Aabb) -> Aabb {
    let columns = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
    let (middle, half) = (own.centre(), 0.5 * own.extent());
    let spread = |by: DVec3| {
        columns[0].abs() * by.x.abs() + columns[1].abs() * by.y.abs() + columns[2].abs() * by.z.abs()
    };
    let rounding = 1e-12 * (spread(middle) + spread(half) + to_world.translation.abs());
    let (at, reach) = (to_world.transform_point3(middle), spread(half) + rounding);
    Aabb { min: at - reach, max: at + reach }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::scene::pose;
    use crate::scene::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene};

    /// Copies of a mesh, moved, turned, mirrored and flattened by numbers that are the same each time.
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

    /// How many vertices it takes to know the bounds.
    fn looked_at(posed: &PosedScene) -> usize {
        let within =
            |found: &(Aabb, usize), b: Aabb| found.0.min.cmple(b.min).all() && found.0.max.cmpge(b.max).all();
        let count = |found: &mut (Aabb, usize), p: DVec3| {
            found.0.extend(p);
            found.1 += 1;
        };
        posed.over_vertices((Aabb::EMPTY, 0), within, count).1
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
        all().for_each(|p| bounds.extend(p));
        assert_eq!(posed.measure(), bounds);
        let sphere = posed.bounding_sphere();
        let middle = posed.bounds.centre();
        let far = all().filter(|p| p.is_finite()).map(|p| p.distance_squared(middle)).fold(0.0, f64::max);
        assert_eq!(sphere, Sphere { centre: middle + posed.centre, radius: far.sqrt() });
        // And nearly all are passed over.
        let looked = looked_at(&posed);
        assert!(looked < all().count() / 6, "{looked} of {}", all().count());
    }

    /// Of copies in one place, each but for roundings as wide as all, few vertices are looked at.
    #[test]
    fn of_copies_in_one_place_few_vertices_are_looked_at() {
        let copies = 400;
        let mut scene = scene(copies);
        let turn = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 8) * 1e-3;
        let of_sphere = |i: u32| DVec3::new(turn(i).cos(), turn(i).sin(), turn(7 * i).sin()).normalize();
        scene.meshes[0].positions = (0..6400).map(|i| of_sphere(i).as_vec3()).collect();
        scene.nodes.iter_mut().for_each(|node| node.local = LocalTransform::default());
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let looked = looked_at(&posed);
        let all = 6400 * copies as usize;
        assert!(looked < all / 5, "{looked} of {all}");
    }
}
