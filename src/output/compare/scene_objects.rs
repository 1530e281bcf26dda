//! The objects of a posed scene, their triangles and what is at their corners.

use std::collections::{BTreeSet, HashMap};

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::canonical_material::MaterialDescriber;
use super::element_kind::ElementKind;
use super::faces::{Face, FaceParts};
use super::surface_distance::Surface;
use blinn_core::geometry::{Aabb, HitId};
use blinn_scene::{Mesh, PosedScene, Rounds};

/// Rounding errors of coordinates, as a multiple of the distance of neighbouring numbers at the largest one.
const ROUNDING_ERRORS: f64 = 4.0;

/// The visible objects of a posed scene.
pub struct Objects<'a> {
    pub posed: &'a PosedScene<'a>,
    /// The instances of each object. The last entry is for instances without object.
    pub instances: Vec<Vec<u32>>,
    materials: Vec<String>,
}

impl<'a> Objects<'a> {
    pub fn new(posed: &'a PosedScene<'a>) -> Objects<'a> {
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

    pub fn name(&self, object: usize) -> &str {
        self.posed.scene.objects.get(object).map_or("", String::as_str)
    }

    pub fn mesh_size(&self, instance: u32) -> usize {
        self.posed.mesh(instance).primitive_count()
    }

    pub fn material(&self, instance: u32) -> &str {
        self.materials.get(self.posed.mesh(instance).material as usize).map_or("", String::as_str)
    }

    /// The corners of a triangle, point or line, relative to the centre.
    pub fn corners(&self, instance: u32, triangle: usize) -> [Vec3; 3] {
        self.posed.world_triangle(HitId { instance, triangle: triangle as u32 })
    }

    /// The kind of an object's triangles, points and lines.
    pub fn element_kind(&self, object: usize) -> ElementKind {
        let of_instance = |&instance: &u32| match self.posed.mesh(instance).rounds {
            Rounds::None => ElementKind::Triangles,
            Rounds::Points => ElementKind::Points,
            Rounds::Lines(_) => ElementKind::Lines,
        };
        let kinds = self.instances[object].iter().map(of_instance);
        kinds.reduce(ElementKind::join).unwrap_or(ElementKind::Triangles)
    }

    /// Number of triangles, points and lines of an object, and their bounds.
    pub fn extent(&self, object: usize) -> (u64, Aabb) {
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
    pub fn material_set(&self, object: usize) -> BTreeSet<&str> {
        self.instances[object].iter().map(|&instance| self.material(instance)).collect()
    }

    /// The triangles, points and lines of an object. `materials` numbers the materials of all objects that are compared.
    pub fn faces<'m>(&'m self, object: usize, materials: &mut HashMap<&'m str, u32>) -> Vec<Face> {
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

    /// A digest of an object's triangles, points and lines, in whichever order.
    pub fn geometry_digest(&self, object: usize) -> u128 {
        let faces = self.faces(object, &mut HashMap::new());
        faces.iter().fold(0, |sum: u128, face| sum.wrapping_add(face.position))
    }

    pub fn corners_of(&self, faces: &[Face]) -> Vec<[Vec3; 3]> {
        faces.iter().map(|face| self.corners(face.instance, face.triangle as usize)).collect()
    }

    /// All triangles of an object.
    pub fn surface(&self, object: usize) -> Surface {
        let instances = self.instances[object].iter();
        let triangles = instances.flat_map(|&i| (0..self.mesh_size(i)).map(move |t| self.corners(i, t)));
        Surface::new(triangles)
    }

    pub fn to_world(&self, bounds: Aabb) -> Aabb {
        let centre = self.posed.centre;
        if bounds.is_empty() { bounds } else { Aabb { min: bounds.min + centre, max: bounds.max + centre } }
    }

    /// The precision of an object's coordinates: a few times the distance of neighbouring f32 numbers at the largest of
    /// them, in the file or relative to the centre.
    pub fn precision(&self, object: usize) -> f64 {
        let of_instance = |&instance: &u32| {
            let affine = self.posed.instances[instance as usize].transform.affine;
            let finite = self.posed.positions(instance).iter().filter(|point| point.is_finite());
            let in_file = finite.fold(Vec3::ZERO, |largest, point| largest.max(point.abs())).as_dvec3();
            let [x, y, z] = affine.matrix3.to_cols_array_2d().map(DVec3::from);
            let in_world = x.abs() * in_file.x + y.abs() * in_file.y + z.abs() * in_file.z;
            in_world.max(affine.translation.abs()).max_element()
        };
        let largest = self.instances[object].iter().map(of_instance);
        let largest = largest.filter(|largest| largest.is_finite()).fold(0.0, f64::max);
        ROUNDING_ERRORS * f64::from(f32::EPSILON) * largest
    }
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
