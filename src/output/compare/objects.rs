//! Differences of two posed scenes, object by object.

#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};

use glam::{Vec2, Vec3, Vec4};

use super::canonical_material::MaterialDescriber;
use super::faces::{Face, FaceParts, match_faces};
use super::surface_distance::Surface;
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
    /// Other triangles, in whichever order.
    Rebuilt {
        /// Number of triangles in the old and in the new scene.
        triangles: [u64; 2],
        /// Triangles of each scene that the other one lacks.
        differing: [u64; 2],
        /// Distance of the surfaces in scene units: the largest distance of a corner, middle of an edge or centre of a
        /// differing triangle from the other surface. Infinite if there is no other surface.
        surface_distance: f64,
        /// True if normals, tangents, texture coordinates or colours of triangles that both have differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
    /// The same triangles with other properties.
    Changed {
        /// Number of triangles with a corner elsewhere.
        moved_triangles: u64,
        /// Largest distance of a corner, in scene units.
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

    /// The materials of an object.
    fn material_set(&self, object: usize) -> BTreeSet<&str> {
        self.instances[object].iter().map(|&instance| self.material(instance)).collect()
    }

    /// The triangles, points and lines of an object. `materials` numbers the materials of all objects that are compared.
    fn faces<'m>(&'m self, object: usize, materials: &mut HashMap<&'m str, u32>) -> Vec<Face> {
        let mut faces = Vec::new();
        let mut scratch = Vec::new();
        for &instance in &self.instances[object] {
            let next = materials.len() as u32;
            let material = *materials.entry(self.material(instance)).or_insert(next);
            let attributes = Attributes::new(self.posed, instance);
            for triangle in 0..self.mesh_size(instance) {
                let vertices = attributes.mesh.corners(triangle as u32);
                let parts = FaceParts {
                    instance,
                    triangle: triangle as u32,
                    corners: self.corners(instance, triangle),
                    material,
                    attributes: &|corner, out| attributes.append(vertices[corner], out),
                };
                faces.push(Face::new(&parts, &mut scratch));
            }
        }
        faces
    }

    fn corners_of(&self, faces: &[Face]) -> Vec<[Vec3; 3]> {
        faces.iter().map(|face| self.corners(face.instance, face.triangle as usize)).collect()
    }

    /// All triangles of an object.
    fn surface(&self, object: usize) -> Surface {
        let instances = self.instances[object].iter();
        let triangles = instances.flat_map(|&i| (0..self.mesh_size(i)).map(move |t| self.corners(i, t)));
        Surface::new(triangles)
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
    let in_order = compare_in_order(old, old_object, new, new_object);
    if let Some(InOrder { moved_triangles: 0, attributes, material, .. }) = in_order {
        let change = ObjectChange::Changed { moved_triangles: 0, max_distance: 0.0, attributes, material };
        return (attributes || material).then(|| (change, old.extent(old_object).1));
    }
    // Exporters order triangles as they like.
    let mut numbers = HashMap::new();
    let old_faces = old.faces(old_object, &mut numbers);
    let new_faces = new.faces(new_object, &mut numbers);
    let triangles = [&old_faces, &new_faces].map(|faces| faces.len() as u64);
    let difference = match_faces(old_faces, new_faces);
    let material = difference.material || old.material_set(old_object) != new.material_set(new_object);
    let attributes = difference.attributes;
    let differing = difference.unmatched.each_ref().map(|faces| faces.len() as u64);
    match in_order {
        // As many moved as have no equal: the order is the same.
        Some(in_order) if differing == [in_order.moved_triangles; 2] => {
            let InOrder { moved_triangles, max_distance, attributes, material, bounds } = in_order;
            let change = ObjectChange::Changed { moved_triangles, max_distance, attributes, material };
            Some((change, bounds))
        }
        _ if differing == [0, 0] => {
            let change =
                ObjectChange::Changed { moved_triangles: 0, max_distance: 0.0, attributes, material };
            (attributes || material).then(|| (change, old.extent(old_object).1))
        }
        _ => {
            let [before, after] = &difference.unmatched;
            let [before, after] = [old.corners_of(before), new.corners_of(after)];
            let to_new = new.surface(new_object).max_distance(&before);
            let to_old = old.surface(old_object).max_distance(&after);
            let mut bounds = Aabb::EMPTY;
            before.iter().chain(&after).flatten().for_each(|corner| bounds.extend(corner.as_dvec3()));
            let surface_distance = to_new.max(to_old);
            let change =
                ObjectChange::Rebuilt { triangles, differing, surface_distance, attributes, material };
            Some((change, old.to_world(bounds)))
        }
    }
}

/// Differences of triangles at the same places of two files.
struct InOrder {
    moved_triangles: u64,
    max_distance: f64,
    attributes: bool,
    material: bool,
    bounds: Aabb,
}

/// Compares two objects triangle by triangle; `None` if their parts have other sizes.
fn compare_in_order(old: &Objects, old_object: usize, new: &Objects, new_object: usize) -> Option<InOrder> {
    let (parts, others) = (&old.instances[old_object], &new.instances[new_object]);
    let sizes = |objects: &Objects, parts: &[u32]| -> Vec<usize> {
        parts.iter().map(|&part| objects.mesh_size(part)).collect()
    };
    if sizes(old, parts) != sizes(new, others) {
        return None;
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
    Some(InOrder { moved_triangles, max_distance, attributes, material, bounds: old.to_world(bounds) })
}

/// The values at an instance's vertices.
struct Attributes<'a> {
    mesh: &'a Mesh,
    normals: &'a [Vec3],
    tangents: &'a [Vec4],
    colors: &'a [Vec4],
    uvs: &'a [Vec<Vec2>],
    color: Option<Vec3>,
}

impl<'a> Attributes<'a> {
    fn new(posed: &'a PosedScene, instance: u32) -> Attributes<'a> {
        Attributes {
            mesh: posed.mesh(instance),
            normals: posed.normals(instance),
            tangents: posed.tangents(instance),
            colors: posed.colors(instance),
            uvs: posed.uvs(instance),
            color: posed.scene.instances[instance as usize].color,
        }
    }

    /// Appends the values at a vertex. What is absent differs from what is zero.
    fn append(&self, vertex: u32, out: &mut Vec<u32>) {
        let vertex = vertex as usize;
        let mut values = |values: Option<&[f32]>| match values {
            Some(values) => out.extend(values.iter().map(|value| value.to_bits())),
            None => out.push(u32::MAX),
        };
        values(self.normals.get(vertex).map(|v| &v.as_ref()[..]));
        values(self.tangents.get(vertex).map(|v| &v.as_ref()[..]));
        values(self.colors.get(vertex).map(|v| &v.as_ref()[..]));
        for uvs in self.uvs {
            values(uvs.get(vertex).map(|v| &v.as_ref()[..]));
        }
        values(self.color.as_ref().map(|v| &v.as_ref()[..]));
    }
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
        let (uvs, others) = (old.uvs(a), new.uvs(b));
        let pairs = uvs.iter().zip(others);
        let flat = |uv: &Vec2| uv.extend(0.0).extend(0.0);
        uvs.len() == others.len() && pairs.into_iter().all(|(x, y)| same_at_corners(mesh, x, other, y, flat))
    };
    let wide = |v: &Vec3| v.extend(0.0);
    let whole = |v: &Vec4| *v;
    color(old, a) == color(new, b)
        && same_uvs()
        && same_at_corners(mesh, old.normals(a), other, new.normals(b), wide)
        && same_at_corners(mesh, old.tangents(a), other, new.tangents(b), whole)
        && same_at_corners(mesh, old.colors(a), other, new.colors(b), whole)
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
