//! A scene at one time: transforms, deformed meshes, animated materials, lights and cameras.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use crate::animation::bounds_cache::ClipBoundsCache;
use crate::animation::playback::AnimationChoice;
use crate::{
    AreaLight, DeformedMesh, Environment, FileCamera, Light, LightUnits, Material, Mesh, PosedAreaLight,
    PosedLight, Scene,
};
use blinn_core::geometry::{Aabb, HitId, Transform};

/// An instance of a posed scene.
#[derive(Clone, Debug)]
pub struct PosedInstance {
    /// Transforms local (or deformed) vertices to world space, relative to the centre.
    pub transform: Transform,
    /// Index into [`PosedScene::deformed`].
    pub deformed: Option<u32>,
    /// False if its node or an ancestor is hidden.
    pub visible: bool,
}

/// A scene at one time.
///
/// Transforms are f64. A common centre is subtracted from everything, so that f32 has its precision where
/// the scene is, however far from the origin its nodes are.
#[derive(Clone, Debug)]
pub struct PosedScene<'s> {
    /// The scene.
    pub scene: &'s Scene,
    /// Materials at this time.
    pub materials: Cow<'s, [Material]>,
    /// True if any material reflects its surroundings.
    pub has_reflecting_materials: bool,
    /// Cameras at this time.
    pub cameras: Cow<'s, [FileCamera]>,
    /// The file's environment at this time.
    pub environment: Option<Environment>,
    /// Lights at this time.
    pub(super) lights: Cow<'s, [Light]>,
    /// Area lights at this time.
    pub(super) area_lights: Cow<'s, [AreaLight]>,
    /// Subtracted from every world position.
    pub centre: DVec3,
    /// Instances, parallel to the scene's.
    pub instances: Vec<PosedInstance>,
    /// Deformed meshes.
    pub deformed: Vec<DeformedMesh>,
    /// Node to world, not relative to the centre.
    pub(super) node_to_world: Vec<DAffine3>,
    /// Visibility of the nodes.
    pub(super) visible: Vec<bool>,
    pub(super) animation: AnimationChoice,
    /// Bounds of the triangles that can be seen, relative to the centre.
    pub(crate) bounds: Aabb,
    pub(super) clip_bounds_cache: ClipBoundsCache,
}

impl<'s> PosedScene<'s> {
    /// Returns which animations play.
    pub fn animation(&self) -> &AnimationChoice {
        &self.animation
    }

    /// Returns a node's transform to world space in f64, not relative to the centre.
    pub fn node_to_world(&self, node: u32) -> DAffine3 {
        self.node_to_world[node as usize]
    }

    /// Returns the mesh of an instance.
    #[inline]
    pub fn mesh(&self, instance: u32) -> &'s Mesh {
        &self.scene.meshes[self.scene.instances[instance as usize].mesh as usize]
    }

    /// Returns an instance's vertex positions at this time, in the space that its transform maps from.
    #[inline]
    pub fn positions(&self, instance: u32) -> &[Vec3] {
        match self.deformed_mesh(instance) {
            Some(d) => &d.positions,
            None => &self.mesh(instance).positions,
        }
    }

    /// Returns an instance's vertex normals at this time. Empty means flat shading.
    #[inline]
    pub fn normals(&self, instance: u32) -> &[Vec3] {
        match self.deformed_mesh(instance) {
            Some(d) => &d.normals,
            None => &self.mesh(instance).normals,
        }
    }

    /// Returns an instance's tangents at this time. May be empty.
    #[inline]
    pub fn tangents(&self, instance: u32) -> &[Vec4] {
        match self.deformed_mesh(instance) {
            Some(d) => &d.tangents,
            None => &self.mesh(instance).tangents,
        }
    }

    /// Returns the sets of an instance's texture coordinates at this time.
    #[inline]
    pub fn uvs(&self, instance: u32) -> &[Vec<Vec2>] {
        match self.deformed_mesh(instance) {
            Some(d) if !d.uvs.is_empty() => &d.uvs,
            _ => &self.mesh(instance).uvs,
        }
    }

    /// Returns an instance's vertex colours at this time. May be empty.
    #[inline]
    pub fn colors(&self, instance: u32) -> &[Vec4] {
        match self.deformed_mesh(instance) {
            Some(d) if !d.colors.is_empty() => &d.colors,
            _ => &self.mesh(instance).colors,
        }
    }

    #[inline]
    fn deformed_mesh(&self, instance: u32) -> Option<&DeformedMesh> {
        self.instances[instance as usize].deformed.map(|d| &self.deformed[d as usize])
    }

    /// Returns a triangle's corners in the space that the instance's transform maps from.
    #[inline]
    pub fn local_triangle(&self, id: HitId) -> [Vec3; 3] {
        let positions = self.positions(id.instance);
        // Not `map`, which is not always inlined: BVH builds call this for every triangle.
        let [a, b, c] = self.mesh(id.instance).corners(id.triangle);
        [positions[a as usize], positions[b as usize], positions[c as usize]]
    }

    /// Returns a triangle's corners in world space, relative to the centre, each rounded once to f32. BVHs
    /// over world-space triangles store exactly these.
    #[inline]
    pub fn world_triangle(&self, id: HitId) -> [Vec3; 3] {
        let transform = &self.instances[id.instance as usize].transform;
        let [a, b, c] = self.local_triangle(id);
        [transform.point(a), transform.point(b), transform.point(c)]
    }

    /// Returns the bounds of the triangles that can be seen, relative to the centre, as rays are.
    pub fn centred_bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Returns the bounds of the triangles that can be seen, in world coordinates (with the centre added).
    ///
    /// They hold the corners of all triangles with area at this time, except those whose alpha hides them at every
    /// time of the animations that play. They are empty if there are none.
    pub fn bounds(&self) -> Aabb {
        let b = self.bounds;
        if b.is_empty() { b } else { Aabb { min: b.min + self.centre, max: b.max + self.centre } }
    }

    /// Returns the radius of a sphere around the centre that contains all triangles that can be seen.
    pub fn bounding_radius(&self) -> f64 {
        let b = self.bounds;
        if b.is_empty() { 0.0 } else { b.min.abs().max(b.max.abs()).length() }
    }

    /// Returns the file's lights in the lecture's units, with intensities times `scale`.
    pub fn lights(&self, units: LightUnits, scale: f32) -> Vec<PosedLight> {
        let units = units.resolve(&self.scene.source);
        let visible = self.lights.iter().filter(|l| self.visible[l.node as usize]);
        visible
            .map(|light| {
                let to_world = self.node_to_world[light.node as usize];
                let position = (to_world.translation - self.centre).as_vec3();
                let kind = light.kind.pose(
                    position,
                    &to_world.matrix3,
                    &self.scene.source,
                    &self.scene.light_profiles,
                );
                let peak = self.scene.peak_intensity(light);
                let intensity = light.color * (peak * units.factor(light.kind) * scale);
                PosedLight { kind, intensity, range: light.range, radius: light.radius }
            })
            .collect()
    }

    /// Returns the file's area lights, with radiances in the scene's unit times `scale`.
    pub fn area_lights(&self, units: LightUnits, scale: f32) -> Vec<PosedAreaLight> {
        let units = units.resolve(&self.scene.source);
        let visible = self.area_lights.iter().filter(|light| self.visible[light.node as usize]);
        visible
            .filter_map(|light| {
                let mut node = self.node_to_world[light.node as usize];
                node.translation -= self.centre;
                let radiance = light.color * (light.intensity * units.radiance_factor() * scale);
                PosedAreaLight::new(light.shape, light.size, &node, radiance)
            })
            .collect()
    }

    /// Moves the centre from the world's origin.
    pub(super) fn set_centre(&mut self, centre: DVec3) {
        self.centre = centre;
        self.bounds = Aabb { min: self.bounds.min - centre, max: self.bounds.max - centre };
        for instance in &mut self.instances {
            instance.transform.affine.translation -= centre;
        }
    }
}
