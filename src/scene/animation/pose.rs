//! A scene at one moment: where every node is, how every mesh is bent, where the lights stand.
//!
//! Transforms are f64. One centre is subtracted from everything, so that f32 has its precision
//! where the scene is, however far from the origin a node placed it.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, Vec3, Vec4};

use crate::geometry::{Aabb, HitId, Transform};
use crate::scene::animation::clip::ClipBoundsCache;
use crate::scene::animation::node_transforms::{InstancePose, NodeTransforms};
use crate::scene::{
    Animation, ChannelTarget, DeformedMesh, FileCamera, Light, LightUnits, Material, Mesh, PosedLight, Scene,
};

/// Which animations play.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AnimationChoice {
    /// All where they drive different things (as Blender writes one for each object), else the
    /// first.
    #[default]
    Default,
    /// All; where two drive the same thing the later wins.
    All,
    /// One, by index.
    One(usize),
    /// None: the rest pose as the file stores it.
    Rest,
}

/// The moment, and which animations count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseSettings {
    /// Seconds.
    pub time: f64,
    /// Which animations play.
    pub animation: AnimationChoice,
    /// Subtracted from everything; `None` takes the middle of the posed bounds. A job of many
    /// frames takes the first frame's for all.
    pub centre: Option<DVec3>,
}

/// Why a scene cannot be posed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// There is no animation of that number.
    #[error("no animation {0}: the file has {1}")]
    NoAnimation(usize, usize),
}

/// An instance in its place.
#[derive(Clone, Debug)]
pub struct PosedInstance {
    /// LocalTransform (or deformed) to world, relative to the centre.
    pub transform: Transform,
    /// Index into [`PosedScene::deformed`].
    pub deformed: Option<u32>,
    /// False where it, or a node above it, is hidden.
    pub visible: bool,
}

/// A scene at one moment. Instances are parallel to the scene's.
#[derive(Clone, Debug)]
pub struct PosedScene<'s> {
    /// What is posed.
    pub scene: &'s Scene,
    /// The scene's materials at this moment.
    pub materials: Cow<'s, [Material]>,
    /// The scene's cameras at this moment.
    pub cameras: Cow<'s, [FileCamera]>,
    lights: Cow<'s, [Light]>,
    /// Subtracted from every world position.
    pub centre: DVec3,
    /// Where each instance is.
    pub instances: Vec<PosedInstance>,
    /// Bent meshes.
    pub deformed: Vec<DeformedMesh>,
    /// Node to world, not relative to the centre.
    node_to_world: Vec<DAffine3>,
    visible: Vec<bool>,
    animation: AnimationChoice,
    /// Of all that is visible, relative to the centre.
    pub(crate) bounds: Aabb,
    /// What the whole clip takes up, once it was asked for.
    pub(crate) clip_bounds_cache: ClipBoundsCache,
}

/// Poses `scene`.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn pose<'s>(scene: &'s Scene, at: &PoseSettings) -> Result<PosedScene<'s>, PoseError> {
    let moving = active_animations(scene, &at.animation)?;
    let stance = NodeTransforms::of(scene, &moving, at.time);
    let mut materials = Cow::Borrowed(&scene.materials[..]);
    let mut lights = Cow::Borrowed(&scene.lights[..]);
    let mut cameras = Cow::Borrowed(&scene.cameras[..]);
    for channel in moving.iter().flat_map(|a| &a.channels) {
        let keys = &channel.keyframes;
        match channel.target {
            ChannelTarget::Material(i, field) => {
                materials.to_mut()[i as usize].set_property(field, &keys.sample(at.time));
            }
            ChannelTarget::Light(i, field) => {
                lights.to_mut()[i as usize].set_property(field, &keys.sample(at.time))
            }
            ChannelTarget::Camera(i, field) => {
                cameras.to_mut()[i as usize].set_property(field, keys.sample(at.time)[0]);
            }
            _ => {}
        }
    }
    let mut deformed = Vec::new();
    let instances = scene.instances.iter().map(|instance| {
        let InstancePose { to_world, winding, bend } = stance.place(instance);
        let bent = bend.map(|bend| {
            deformed.push(bend.whole());
            deformed.len() as u32 - 1
        });
        PosedInstance {
            transform: Transform::new(to_world).with_winding_of(&winding),
            deformed: bent,
            visible: stance.visible[instance.node as usize],
        }
    });
    let instances = instances.collect();
    let mut posed = PosedScene {
        scene,
        materials,
        cameras,
        lights,
        centre: DVec3::ZERO,
        instances,
        deformed,
        node_to_world: stance.node_to_world,
        visible: stance.visible,
        animation: at.animation.clone(),
        bounds: Aabb::EMPTY,
        clip_bounds_cache: ClipBoundsCache::default(),
    };
    posed.bounds = posed.measure();
    let centre = at.centre.unwrap_or_else(|| posed.bounds.centre());
    if centre != DVec3::ZERO {
        posed.recentre(centre);
    }
    Ok(posed)
}

/// The animations of a scene that play.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn active_animations<'s>(
    scene: &'s Scene,
    choice: &AnimationChoice,
) -> Result<Vec<&'s Animation>, PoseError> {
    let all = &scene.animations;
    Ok(match *choice {
        AnimationChoice::Rest => Vec::new(),
        AnimationChoice::All => all.iter().collect(),
        AnimationChoice::One(i) => vec![all.get(i).ok_or(PoseError::NoAnimation(i, all.len()))?],
        AnimationChoice::Default => {
            let mut driven = std::collections::HashSet::new();
            let disjoint = all.iter().all(|a| {
                let own: std::collections::HashSet<_> = a.channels.iter().map(|c| c.target).collect();
                let new = own.is_disjoint(&driven);
                driven.extend(own);
                new
            });
            if disjoint { all.iter().collect() } else { all.iter().take(1).collect() }
        }
    })
}

impl<'s> PosedScene<'s> {
    /// The same scene at another moment: animation and centre are this one's, and what either
    /// finds out about the whole clip both know.
    pub fn at_time(&self, time: f64) -> PosedScene<'s> {
        let settings = PoseSettings { time, animation: self.animation.clone(), centre: Some(self.centre) };
        pose(self.scene, &settings)
            .unwrap_or_else(|_| self.clone())
            .with_clip_bounds_cache(&self.clip_bounds_cache)
    }

    /// Which animations play.
    pub fn animation(&self) -> &AnimationChoice {
        &self.animation
    }

    /// Node to world in f64, not relative to the centre.
    pub fn node_to_world(&self, node: u32) -> DAffine3 {
        self.node_to_world[node as usize]
    }

    /// The mesh that an instance draws.
    #[inline]
    pub fn mesh(&self, instance: u32) -> &'s Mesh {
        &self.scene.meshes[self.scene.instances[instance as usize].mesh as usize]
    }

    /// An instance's vertices as posed, in the frame that its transform takes to the world.
    #[inline]
    pub fn positions(&self, instance: u32) -> &[Vec3] {
        match self.deformed_of(instance) {
            Some(d) => &d.positions,
            None => &self.mesh(instance).positions,
        }
    }

    /// Likewise its normals; empty means flat.
    #[inline]
    pub fn normals(&self, instance: u32) -> &[Vec3] {
        match self.deformed_of(instance) {
            Some(d) => &d.normals,
            None => &self.mesh(instance).normals,
        }
    }

    /// Likewise its tangents; may be empty.
    pub fn tangents(&self, instance: u32) -> &[Vec4] {
        match self.deformed_of(instance) {
            Some(d) => &d.tangents,
            None => &self.mesh(instance).tangents,
        }
    }

    #[inline]
    fn deformed_of(&self, instance: u32) -> Option<&DeformedMesh> {
        self.instances[instance as usize].deformed.map(|d| &self.deformed[d as usize])
    }

    /// A triangle's corners in the frame that the instance's transform takes to the world.
    #[inline]
    pub fn local_triangle(&self, id: HitId) -> [Vec3; 3] {
        let positions = self.positions(id.instance);
        // Not by `map`, which is not always inlined: trees ask this of every triangle.
        let [a, b, c] = self.mesh(id.instance).triangles[id.triangle as usize];
        [positions[a as usize], positions[b as usize], positions[c as usize]]
    }

    /// A triangle's corners in the world, relative to the centre, each rounded once to f32. Trees
    /// over world triangles hold exactly these.
    #[inline]
    pub fn world_triangle(&self, id: HitId) -> [Vec3; 3] {
        let transform = &self.instances[id.instance as usize].transform;
        let [a, b, c] = self.local_triangle(id);
        [transform.point(a), transform.point(b), transform.point(c)]
    }

    /// The bounds of all that is visible, in world coordinates (the centre added back).
    pub fn bounds(&self) -> Aabb {
        let b = self.bounds;
        if b.is_empty() { b } else { Aabb { min: b.min + self.centre, max: b.max + self.centre } }
    }

    /// Nothing visible is farther than this from the centre.
    pub fn bounding_radius(&self) -> f64 {
        let b = self.bounds;
        if b.is_empty() { 0.0 } else { b.min.abs().max(b.max.abs()).length() }
    }

    /// The file's lights in the lecture's units, times `scale`.
    pub fn lights(&self, units: LightUnits, scale: f32) -> Vec<PosedLight> {
        let units = units.resolve(&self.scene.source);
        let visible = self.lights.iter().filter(|l| self.visible[l.node as usize]);
        visible
            .map(|light| {
                let to_world = self.node_to_world[light.node as usize];
                let position = (to_world.translation - self.centre).as_vec3();
                let kind = light.kind.pose(position, &to_world.matrix3, &self.scene.source);
                let intensity = light.color * (light.intensity * units.factor(light.kind) * scale);
                PosedLight { kind, intensity, range: light.range, radius: 0.0 }
            })
            .collect()
    }

    fn recentre(&mut self, centre: DVec3) {
        self.centre = centre;
        self.bounds = Aabb { min: self.bounds.min - centre, max: self.bounds.max - centre };
        for instance in &mut self.instances {
            instance.transform.affine.translation -= centre;
        }
    }
}
