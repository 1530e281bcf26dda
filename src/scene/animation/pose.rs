//! Poses a scene: evaluates its animations at a time.

use std::borrow::Cow;

use glam::DVec3;

use crate::animation::bounds_cache::ClipBoundsCache;
use crate::animation::node_transforms::{InstancePose, NodeTransforms};
use crate::animation::playback::{AnimationChoice, PoseError, active_animations};
use crate::animation::posed_scene::{PosedInstance, PosedScene};
use crate::animation::turned_tangents::TurnedMap;
use crate::{
    Animation, AreaLight, ChannelTarget, DeformedMesh, Environment, FileCamera, Instance, Light, Material,
    Mesh, Scene, TangentAxes, UvTransform,
};
use blinn_core::geometry::{Aabb, Transform};

/// The time of a pose, and which animations play.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseSettings {
    /// Time in seconds.
    pub time: f64,
    /// The animations that play.
    pub animation: AnimationChoice,
    /// Subtracted from all positions. `None` takes the centre of the posed bounds. All frames of a job use
    /// the centre of the first.
    pub centre: Option<DVec3>,
}

/// Poses `scene`.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn pose<'s>(scene: &'s Scene, at: &PoseSettings) -> Result<PosedScene<'s>, PoseError> {
    pose_with_cache(scene, at, ClipBoundsCache::default())
}

/// Poses `scene` with what other times of the same clip know of its bounds.
fn pose_with_cache<'s>(
    scene: &'s Scene,
    at: &PoseSettings,
    clip_bounds_cache: ClipBoundsCache,
) -> Result<PosedScene<'s>, PoseError> {
    let active = active_animations(scene, &at.animation)?;
    let properties = AnimatedProperties::at(scene, &active, at.time);
    let nodes = NodeTransforms::at(scene, &active, at.time);
    let mut deformed = Vec::new();
    let instances = pose_instances(scene, &nodes, &properties.materials, &mut deformed);
    let mut posed = PosedScene {
        scene,
        has_reflecting_materials: properties.materials.iter().any(Material::reflects),
        materials: properties.materials,
        cameras: properties.cameras,
        environment: properties.environment,
        lights: properties.lights,
        area_lights: properties.area_lights,
        centre: DVec3::ZERO,
        instances,
        deformed,
        node_to_world: nodes.node_to_world,
        visible: nodes.visible,
        animation: at.animation.clone(),
        bounds: Aabb::EMPTY,
        clip_bounds_cache,
    };
    posed.bounds = posed.compute_bounds();
    let centre = at.centre.unwrap_or_else(|| posed.bounds.centre());
    if centre != DVec3::ZERO {
        posed.set_centre(centre);
    }
    Ok(posed)
}

/// Transforms the instances, and deforms their meshes.
fn pose_instances(
    scene: &Scene,
    nodes: &NodeTransforms,
    materials: &[Material],
    deformed: &mut Vec<DeformedMesh>,
) -> Vec<PosedInstance> {
    let pose = |instance: &Instance| {
        let InstancePose { to_world, winding, deformer } = nodes.pose_instance(instance);
        let mut shape = deformer.map(|deformer| deformer.deform());
        let mesh = &scene.meshes[instance.mesh as usize];
        if let Some(map) = turned_map(scene, mesh, materials, shape.as_ref()) {
            map.turn(mesh, shape.get_or_insert_with(|| mesh.rest_shape()));
        }
        let index = shape.map(|shape| {
            deformed.push(shape);
            deformed.len() as u32 - 1
        });
        PosedInstance {
            transform: Transform::new(to_world).with_winding_of(&winding),
            deformed: index,
            visible: nodes.visible[instance.node as usize],
        }
    };
    scene.instances.iter().map(pose).collect()
}

/// Returns the normal map of a mesh whose tangents an animation or the morph targets of `shape` turn. In Blender's files,
/// normal maps use the axes of the untransformed coordinates.
fn turned_map(
    scene: &Scene,
    mesh: &Mesh,
    materials: &[Material],
    shape: Option<&DeformedMesh>,
) -> Option<TurnedMap> {
    let material = mesh.material as usize;
    let (rest, now) = (scene.materials.get(material)?, materials.get(material)?);
    let displaces = shape.is_some_and(|shape| !shape.uvs.is_empty());
    let transforms = !std::ptr::eq(rest, now) && !scene.source.is_blender();
    if !displaces && !transforms {
        return None;
    }
    let [rest, now] = [rest, now].map(|material| {
        let axes = material.tangent_axes()?;
        let transform = if scene.source.is_blender() { UvTransform::IDENTITY } else { axes.transform };
        Some(TangentAxes { transform, ..axes })
    });
    TurnedMap::of(mesh, rest?, now?, displaces)
}

/// Materials, lights, cameras and the environment at one time; borrowed where nothing drives them.
struct AnimatedProperties<'s> {
    materials: Cow<'s, [Material]>,
    lights: Cow<'s, [Light]>,
    area_lights: Cow<'s, [AreaLight]>,
    cameras: Cow<'s, [FileCamera]>,
    environment: Option<Environment>,
}

impl<'s> AnimatedProperties<'s> {
    fn at(scene: &'s Scene, active: &[&Animation], time: f64) -> AnimatedProperties<'s> {
        let mut materials = Cow::Borrowed(&scene.materials[..]);
        let mut lights = Cow::Borrowed(&scene.lights[..]);
        let mut area_lights = Cow::Borrowed(&scene.area_lights[..]);
        let mut cameras = Cow::Borrowed(&scene.cameras[..]);
        let mut environment = scene.environment.clone();
        for channel in active.iter().flat_map(|a| &a.channels) {
            let keyframes = &channel.keyframes;
            match channel.target {
                ChannelTarget::Material(i, property) => {
                    materials.to_mut()[i as usize].set_property(property, &keyframes.sample(time));
                }
                ChannelTarget::Light(i, property) => {
                    lights.to_mut()[i as usize].set_property(property, &keyframes.sample(time));
                }
                ChannelTarget::AreaLight(i, property) => {
                    area_lights.to_mut()[i as usize].set_property(property, &keyframes.sample(time));
                }
                ChannelTarget::Camera(i, property) => {
                    cameras.to_mut()[i as usize].set_property(property, keyframes.sample(time)[0]);
                }
                ChannelTarget::Environment(property) => {
                    if let Some(environment) = &mut environment {
                        environment.set_property(property, keyframes, time);
                    }
                }
                _ => {}
            }
        }
        let environment = environment.map(|environment| environment.in_world());
        AnimatedProperties { materials, lights, area_lights, cameras, environment }
    }
}

impl<'s> PosedScene<'s> {
    /// Poses the same scene at another time, with the same animations and centre. Both share the clip
    /// bounds.
    pub fn at_time(&self, time: f64) -> PosedScene<'s> {
        let settings = PoseSettings { time, animation: self.animation().clone(), centre: Some(self.centre) };
        let cache = self.clip_bounds_cache().clone();
        pose_with_cache(self.scene, &settings, cache).unwrap_or_else(|_| self.clone())
    }
}
