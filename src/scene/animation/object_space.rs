//! Object space: the rest shape of each object in a frame of its own.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::animation::node_transforms::NodeTransforms;
use crate::{Instance, Mesh, PackedTrs, Scene};
use blinn_core::geometry::Aabb;

/// The space of an object: metres, right-handed, with the axes and the origin of the object's node.
///
/// The scale of the node in the rest pose belongs to the shape, so that a rotation and a translation place the shape in
/// the world. A node that mirrors has its x axis turned around. The meshes of skinned objects are in their bind pose, in
/// which the node has no effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSpace {
    /// Bounds of the rest shape; empty without triangles, points and lines.
    pub bounds: Aabb,
    /// Factors from the vertex positions of the object's meshes to this space.
    pub scale: DVec3,
}

impl ObjectSpace {
    /// Transforms a vertex position of the object's meshes, in the rest pose, to this space.
    pub fn point(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() * self.scale
    }

    /// Returns normalised object coordinates (Wang et al., “Normalized Object Coordinate Space”, CVPR 2019): the centre
    /// of the bounds is at (½, ½, ½), and one scale for all axes makes their diagonal 1.
    pub fn normalized(&self, p: Vec3) -> DVec3 {
        let diagonal = self.bounds.extent().length();
        let offset = self.point(p) - self.bounds.centre();
        DVec3::splat(0.5) + if diagonal > 0.0 { offset / diagonal } else { DVec3::ZERO }
    }
}

/// The spaces of all objects of a scene.
#[derive(Clone, Debug)]
pub struct ObjectSpaces {
    objects: Vec<ObjectSpace>,
    /// For each instance, the number of triangles, points and lines of the instances before it in its object.
    first_primitive: Vec<u32>,
}

impl ObjectSpaces {
    /// Computes the spaces and bounds. All instances of an object are drawn at the same node.
    pub fn new(scene: &Scene) -> ObjectSpaces {
        let rest = NodeTransforms::at(scene, &[], 0.0);
        let bounds: Vec<Aabb> = scene.meshes.iter().map(rest_bounds).collect();
        let mut objects: Vec<Option<ObjectSpace>> = vec![None; scene.objects.len()];
        let mut counts = vec![0u32; scene.objects.len()];
        let mut first_primitive = Vec::with_capacity(scene.instances.len());
        for instance in &scene.instances {
            let object = object_index(instance);
            let mesh = &scene.meshes[instance.mesh as usize];
            let (Some(space), Some(count)) = (objects.get_mut(object), counts.get_mut(object)) else {
                first_primitive.push(0);
                continue;
            };
            let space = space.get_or_insert_with(|| start(instance, mesh, &rest));
            let mesh_bounds = bounds[instance.mesh as usize];
            if !mesh_bounds.is_empty() {
                space.bounds.extend(mesh_bounds.min * space.scale);
                space.bounds.extend(mesh_bounds.max * space.scale);
            }
            first_primitive.push(*count);
            *count = count.saturating_add(u32::try_from(mesh.primitive_count()).unwrap_or(u32::MAX));
        }
        let empty = ObjectSpace { bounds: Aabb::EMPTY, scale: DVec3::ONE };
        let objects = objects.into_iter().map(|space| space.unwrap_or(empty)).collect();
        ObjectSpaces { objects, first_primitive }
    }

    /// Returns the space of an object, which is counted from 1; `None` if there is no such object.
    pub fn object(&self, object: u32) -> Option<&ObjectSpace> {
        self.objects.get((object as usize).wrapping_sub(1))
    }

    /// Returns the number of a triangle, point or line of an instance in its object, from 0: those of all meshes of the
    /// object are counted in the order of the file.
    pub fn primitive_in_object(&self, instance: u32, primitive: u32) -> u32 {
        self.first_primitive.get(instance as usize).copied().unwrap_or(0).saturating_add(primitive)
    }
}

fn object_index(instance: &Instance) -> usize {
    (instance.object as usize).wrapping_sub(1)
}

/// The space of an object with `instance`, without bounds.
fn start(instance: &Instance, mesh: &Mesh, rest: &NodeTransforms) -> ObjectSpace {
    let is_skinned = instance.skin.is_some() && mesh.influences.per_vertex > 0;
    let scale = if is_skinned {
        DVec3::ONE
    } else {
        axis_scale(&placement(rest.node_to_world[instance.node as usize], instance.trs).matrix3)
    };
    ObjectSpace { bounds: Aabb::EMPTY, scale }
}

fn placement(node_to_world: DAffine3, trs: Option<PackedTrs>) -> DAffine3 {
    trs.map_or(node_to_world, |trs| node_to_world * trs.affine())
}

/// Lengths of the axes of a transform; the first is negative if it mirrors. An axis without length counts as 1.
fn axis_scale(m: &DMat3) -> DVec3 {
    let length = |axis: DVec3| {
        let length = axis.length();
        if length.is_finite() && length > 0.0 { length } else { 1.0 }
    };
    let mirror = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DVec3::new(mirror * length(m.x_axis), length(m.y_axis), length(m.z_axis))
}

/// Bounds of the vertices that triangles, points and lines use, in the rest pose.
fn rest_bounds(mesh: &Mesh) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    let corners = mesh.triangles.as_flattened().iter().chain(mesh.lines().as_flattened());
    for &corner in corners {
        bounds.extend(mesh.positions[corner as usize].as_dvec3());
    }
    // Each vertex is a point. Those that are not finite are not drawn.
    let points = mesh.positions.iter().take(mesh.point_count()).filter(|p| p.is_finite());
    points.for_each(|p| bounds.extend(p.as_dvec3()));
    bounds
}
