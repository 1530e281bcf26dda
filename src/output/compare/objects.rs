//! Differences of two posed scenes, object by object.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::canonical_material::MaterialDescriber;
use blinn_core::geometry::{Aabb, HitId};
use blinn_scene::{Mesh, PosedScene};

/// An object that differs between two scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDifference {
    /// Name of the object.
    pub name: String,
    /// The kind of difference.
    pub change: ObjectChange,
    /// Bounds of the triangles that differ, in both scenes, in world coordinates.
    pub bounds: Aabb,
}

/// Kinds of differences of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectChange {
    /// Only the new scene has the object.
    Added {
        /// Number of its triangles.
        triangles: u64,
    },
    /// Only the old scene has the object.
    Removed {
        /// Number of its triangles.
        triangles: u64,
    },
    /// Another number of triangles or other parts.
    Rebuilt {
        /// Number of triangles in the old and in the new scene.
        triangles: [u64; 2],
    },
    /// The same triangles with other properties.
    Changed {
        /// Number of triangles with a corner elsewhere.
        moved_triangles: u64,
        /// Largest distance of a corner, in metres.
        max_distance: f64,
        /// True if normals, tangents, texture coordinates or colours differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
}

/// Compares the objects of two scenes that are posed around the same centre. Objects are matched by name, those of one
/// name in their order. Objects that are equal are left out.
pub fn compare_objects(old: &PosedScene, new: &PosedScene) -> Vec<ObjectDifference> {
    let [old, new] = [old, new].map(Objects::new);
    let mut of_new: HashMap<&str, Vec<usize>> = HashMap::new();
    for object in (0..new.instances.len()).rev() {
        of_new.entry(new.name(object)).or_default().push(object);
    }
    let mut differences = Vec::new();
    for object in 0..old.instances.len() {
        let name = old.name(object);
        let difference = match of_new.get_mut(name).and_then(Vec::pop) {
            Some(other) => compare_object(&old, object, &new, other),
            None => {
                let (triangles, bounds) = old.extent(object);
                Some((ObjectChange::Removed { triangles }, bounds))
            }
        };
        differences.extend(difference.map(|(change, bounds)| ObjectDifference {
            name: name.into(),
            change,
            bounds,
        }));
    }
    let mut added: Vec<usize> = of_new.into_values().flatten().collect();
    added.sort_unstable();
    differences.extend(added.into_iter().map(|object| {
        let (triangles, bounds) = new.extent(object);
        let name = new.name(object).to_string();
        ObjectDifference { name, change: ObjectChange::Added { triangles }, bounds }
    }));
    differences
}

/// The visible objects of a posed scene.
struct Objects<'a> {
    posed: &'a PosedScene<'a>,
    /// The instances of each object. The last entry is for instances without object.
    instances: Vec<Vec<u32>>,
    materials: Vec<String>,
}

impl<'a> Objects<'a> {
    fn new(posed: &'a PosedScene<'a>) -> Objects<'a> {
        let scene = posed.scene;
        let mut instances = vec![Vec::new(); scene.objects.len() + 1];
        for (i, instance) in scene.instances.iter().enumerate().filter(|(i, _)| posed.instances[*i].visible) {
            let object = (instance.object as usize).wrapping_sub(1).min(scene.objects.len());
            instances[object].push(i as u32);
        }
        let describer = MaterialDescriber::new(scene);
        let materials = posed.materials.iter().map(|material| describer.describe(material)).collect();
        let mut objects = Objects { posed, instances, materials };
        // Parts of an object are matched in an order that does not depend on the file's.
        for object in 0..objects.instances.len() {
            let mut parts = std::mem::take(&mut objects.instances[object]);
            parts.sort_by_cached_key(|&i| (objects.mesh_size(i), objects.material(i).to_string()));
            objects.instances[object] = parts;
        }
        objects
    }

    fn name(&self, object: usize) -> &str {
        self.posed.scene.objects.get(object).map_or("", String::as_str)
    }

    fn mesh_size(&self, instance: u32) -> usize {
        primitive_count(self.posed.mesh(instance))
    }

    fn material(&self, instance: u32) -> &str {
        self.materials.get(self.posed.mesh(instance).material as usize).map_or("", String::as_str)
    }

    /// The corners of a triangle, point or line, relative to the centre.
    fn corners(&self, instance: u32, triangle: usize) -> [Vec3; 3] {
        self.posed.world_triangle(HitId { instance, triangle: triangle as u32 })
    }

    /// Number of triangles of an object, and their bounds.
    fn extent(&self, object: usize) -> (u64, Aabb) {
        let mut bounds = Aabb::EMPTY;
        let mut count = 0;
        for &instance in &self.instances[object] {
            for triangle in 0..self.mesh_size(instance) {
                self.corners(instance, triangle).iter().for_each(|c| bounds.extend(c.as_dvec3()));
                count += 1;
            }
        }
        (count, self.to_world(bounds))
    }

    fn to_world(&self, bounds: Aabb) -> Aabb {
        let centre = self.posed.centre;
        if bounds.is_empty() { bounds } else { Aabb { min: bounds.min + centre, max: bounds.max + centre } }
    }
}

/// Number of triangles, points and lines of a mesh.
fn primitive_count(mesh: &Mesh) -> usize {
    mesh.triangles.len() + mesh.point_count() + mesh.lines().len()
}

fn compare_object(
    old: &Objects,
    old_object: usize,
    new: &Objects,
    new_object: usize,
) -> Option<(ObjectChange, Aabb)> {
    let (parts, others) = (&old.instances[old_object], &new.instances[new_object]);
    let sizes = |objects: &Objects, parts: &[u32]| -> Vec<usize> {
        parts.iter().map(|&part| objects.mesh_size(part)).collect()
    };
    if sizes(old, parts) != sizes(new, others) {
        let (before, mut bounds) = old.extent(old_object);
        let (after, other) = new.extent(new_object);
        bounds.extend_box(&other);
        return Some((ObjectChange::Rebuilt { triangles: [before, after] }, bounds));
    }
    let mut moved_triangles = 0;
    let mut max_distance = 0f64;
    let (mut attributes, mut material) = (false, false);
    let mut bounds = Aabb::EMPTY;
    for (&a, &b) in parts.iter().zip(others) {
        for triangle in 0..old.mesh_size(a) {
            let (before, after) = (old.corners(a, triangle), new.corners(b, triangle));
            if is_same(&before, &after) {
                continue;
            }
            moved_triangles += 1;
            for (p, q) in before.into_iter().zip(after) {
                // Infinite if a corner became invalid.
                let distance = f64::from(p.distance(q));
                max_distance = max_distance.max(if distance.is_nan() { f64::INFINITY } else { distance });
                bounds.extend(p.as_dvec3());
                bounds.extend(q.as_dvec3());
            }
        }
        attributes |= !has_same_attributes(old.posed, a, new.posed, b);
        material |= old.material(a) != new.material(b);
    }
    if moved_triangles == 0 && !attributes && !material {
        return None;
    }
    let bounds = if bounds.is_empty() { old.extent(old_object).1 } else { old.to_world(bounds) };
    Some((ObjectChange::Changed { moved_triangles, max_distance, attributes, material }, bounds))
}

fn is_same(a: &[Vec3; 3], b: &[Vec3; 3]) -> bool {
    a.map(|p| p.to_array().map(f32::to_bits)) == b.map(|p| p.to_array().map(f32::to_bits)) || a == b
}

/// Compares normals, tangents, texture coordinates and colours at the corners of triangles, so that the order of the
/// vertices does not count.
fn has_same_attributes(old: &PosedScene, a: u32, new: &PosedScene, b: u32) -> bool {
    let (mesh, other) = (old.mesh(a), new.mesh(b));
    let color = |posed: &PosedScene, i: u32| posed.scene.instances[i as usize].color;
    let same_uvs = || {
        let pairs = mesh.uvs.iter().zip(&other.uvs);
        let flat = |uv: &Vec2| uv.extend(0.0).extend(0.0);
        mesh.uvs.len() == other.uvs.len()
            && pairs.into_iter().all(|(x, y)| same_at_corners(mesh, x, other, y, flat))
    };
    let wide = |v: &Vec3| v.extend(0.0);
    let whole = |v: &Vec4| *v;
    color(old, a) == color(new, b)
        && same_uvs()
        && same_at_corners(mesh, old.normals(a), other, new.normals(b), wide)
        && same_at_corners(mesh, old.tangents(a), other, new.tangents(b), whole)
        && same_at_corners(mesh, &mesh.colors, other, &other.colors, whole)
}

fn same_at_corners<T>(
    mesh: &Mesh,
    values: &[T],
    other: &Mesh,
    others: &[T],
    to_vec4: impl Fn(&T) -> Vec4,
) -> bool {
    if values.is_empty() || others.is_empty() {
        return values.is_empty() == others.is_empty();
    }
    let at = |values: &[T], i: u32| values.get(i as usize).map(|v| to_vec4(v).to_array().map(f32::to_bits));
    let count = primitive_count(mesh).min(primitive_count(other)) as u32;
    let mut corners = (0..count).flat_map(|k| mesh.corners(k).into_iter().zip(other.corners(k)));
    corners.all(|(i, j)| at(values, i) == at(others, j))
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use blinn_core::geometry::Rgb;
    use blinn_scene::{
        ColorInput, Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene, pose,
    };

    /// Objects of one triangle each, at these places.
    fn scene(objects: &[(&str, f64)]) -> Scene {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        for (i, (name, x)) in objects.iter().enumerate() {
            let i = i as u32;
            let local = LocalTransform::Matrix(DAffine3::from_translation(DVec3::new(*x, 0.0, 0.0)));
            scene.nodes.push(Node { local, visible: true, ..Node::default() });
            let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
            scene.meshes.push(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() });
            scene.instances.push(Instance { node: i, mesh: i, object: i + 1, ..Instance::default() });
            scene.objects.push(name.to_string());
        }
        scene
    }

    fn compare(old: &Scene, new: &Scene) -> Vec<ObjectDifference> {
        let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
        compare_objects(&pose(old, &settings).unwrap(), &pose(new, &settings).unwrap())
    }

    #[test]
    fn reordered_objects_are_equal() {
        let old = scene(&[("a", 0.0), ("b", 1.0), ("b", 2.0)]);
        assert!(compare(&old, &scene(&[("b", 1.0), ("b", 2.0), ("a", 0.0)])).is_empty());
    }

    #[test]
    fn one_moved_corner_is_found_with_its_distance_and_bounds() {
        let old = scene(&[("a", 0.0), ("b", 5.0)]);
        let mut new = old.clone();
        new.meshes[1].positions[2].z = 0.001;
        let found = compare(&old, &new);
        let [ObjectDifference { name, change, bounds }] = &found[..] else { panic!("{found:?}") };
        let ObjectChange::Changed { moved_triangles: 1, max_distance, attributes: false, material: false } =
            change
        else {
            panic!("{change:?}")
        };
        assert_eq!(name, "b");
        assert!((max_distance - 0.001).abs() < 1e-9);
        assert_eq!((bounds.min.x, bounds.max.x, bounds.max.z), (5.0, 6.0, f64::from(0.001f32)));
    }

    #[test]
    fn added_removed_rebuilt_and_repainted_objects_are_told_apart() {
        let old = scene(&[("a", 0.0), ("b", 1.0), ("c", 2.0)]);
        let mut new = scene(&[("a", 0.0), ("c", 2.0), ("d", 3.0)]);
        new.meshes[1].triangles.push([2, 1, 0]);
        new.materials[0].base_color = ColorInput::new(Rgb::splat(0.5));
        let found = compare(&old, &new);
        let changes: Vec<_> = found.iter().map(|d| (d.name.as_str(), &d.change)).collect();
        let material = ObjectChange::Changed {
            moved_triangles: 0,
            max_distance: 0.0,
            attributes: false,
            material: true,
        };
        assert_eq!(
            changes,
            [
                ("a", &material),
                ("b", &ObjectChange::Removed { triangles: 1 }),
                ("c", &ObjectChange::Rebuilt { triangles: [1, 2] }),
                ("d", &ObjectChange::Added { triangles: 1 }),
            ]
        );
    }
}
