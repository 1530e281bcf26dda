//! Bounds over an animation clip. Samples vertex positions at many times; clusters of vertices that are
//! already inside the bounds are skipped.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::{Aabb, Sphere};
use crate::scene::animation::node_transforms::{InstancePose, NodeTransforms};
use crate::scene::animation::playback::sample_times;
use crate::scene::animation::skinned_cluster_bounds::SkinnedClusters;
use crate::scene::animation::vertex_clusters::{
    CLUSTER_SIZE, VertexClusters, fold_points, transformed_bounds,
};
use crate::scene::{Animation, Instance, Mesh, Scene};

/// Most sample times.
const MAX_SAMPLES: usize = 257;
/// Fewest sample times, however large the scene.
const MIN_SAMPLES: usize = 9;
/// Vertices to process over all sample times, if that leaves enough of them.
const VERTEX_BUDGET: usize = 1 << 25;
/// Morph targets that cost as much as transforming a vertex.
const MORPH_TARGETS_PER_VERTEX: usize = 4;

/// Bounds over an animation clip, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClipBounds {
    pub bounds: Aabb,
    pub sphere: Sphere,
    /// Number of sampled times.
    pub samples: usize,
}

/// The bounds over an animation clip, once computed. Posed scenes of the same clip share it.
#[derive(Clone, Debug, Default)]
pub struct ClipBoundsCache(Arc<OnceLock<ClipBounds>>);

impl ClipBoundsCache {
    pub(super) fn get(&self) -> Option<&ClipBounds> {
        self.0.get()
    }

    pub(super) fn get_or_init(&self, compute: impl FnOnce() -> ClipBounds) -> &ClipBounds {
        self.0.get_or_init(compute)
    }
}

/// Samples the visible vertices of a clip. Positions are in world space, not relative to a centre, so that
/// rounding does not depend on the posed scene that requests the bounds.
pub(super) struct ClipSampler<'s> {
    scene: &'s Scene,
    active: Vec<&'s Animation>,
    /// Sample times. Empty if nothing moves.
    times: Vec<f64>,
    /// One flag for each instance.
    is_animated: Vec<bool>,
    /// Clusters of each mesh that is drawn undeformed.
    clusters: Vec<Option<VertexClusters<'s>>>,
    /// Clusters of each deformed mesh, with its skin.
    skinned_clusters: HashMap<(u32, Option<u32>), SkinnedClusters>,
}

impl<'s> ClipSampler<'s> {
    /// Chooses the sample times, and clusters the meshes.
    pub fn new(scene: &'s Scene, active: Vec<&'s Animation>) -> ClipSampler<'s> {
        let is_animated = scene.animated_instances(active.iter().copied());
        let mesh = |i: &Instance| &scene.meshes[i.mesh as usize];
        let animated = scene.instances.iter().zip(&is_animated).filter(|m| *m.1);
        let cost = animated.map(|m| sample_cost(mesh(m.0))).fold(0, usize::saturating_add);
        let max_samples = (VERTEX_BUDGET / cost.max(1)).clamp(MIN_SAMPLES, MAX_SAMPLES);
        let mut times = sample_times(&active, max_samples);
        if !is_animated.contains(&true) {
            times.clear();
        }
        let mut clusters: Vec<_> = scene.meshes.iter().map(|_| None).collect();
        let mut skinned_clusters = HashMap::new();
        for i in scene.instances.iter().filter(|_| !times.is_empty()) {
            let mesh = mesh(i);
            let skin = i.skin.filter(|_| mesh.influences.per_vertex > 0);
            if skin.is_none() {
                clusters[i.mesh as usize].get_or_insert_with(|| VertexClusters::in_order(&mesh.positions));
            }
            if skin.is_some() || !mesh.morph_targets.is_empty() {
                let new = || SkinnedClusters::new(mesh, skin.map(|skin| &scene.skins[skin as usize]));
                skinned_clusters.entry((i.mesh, i.skin)).or_insert_with(new);
            }
        }
        ClipSampler { scene, active, times, is_animated, clusters, skinned_clusters }
    }

    /// Computes the bounds over the clip; `None` if nothing moves.
    pub fn bounds(&self) -> Option<ClipBounds> {
        if self.times.is_empty() {
            return None;
        }
        let join = |mut a: Aabb, b: Aabb| {
            a.extend_box(&b);
            a
        };
        let bounds = self.fold(Aabb::EMPTY, |bounds, b| bounds.contains_box(&b), Aabb::extend, join);
        // Adding 0 turns −0 into 0: which zero came first depends on the threads.
        let bounds = Aabb { min: bounds.min + 0.0, max: bounds.max + 0.0 };
        let centre = bounds.centre();
        let covers = |r2: &f64, b: Aabb| b.max_distance_squared(centre) <= *r2;
        let add = |r2: &mut f64, p: DVec3| {
            if p.is_finite() {
                *r2 = r2.max(p.distance_squared(centre));
            }
        };
        let r2 = self.fold(0.0, covers, add, f64::max);
        let sphere = Sphere { centre, radius: if r2 > 0.0 { r2.sqrt() } else { 1.0 } };
        Some(ClipBounds { bounds, sphere, samples: self.times.len() })
    }

    /// Folds `add` over every visible vertex at all times. Skips clusters whose bounds cannot change the
    /// result, as `covers` says. `join` merges the results of threads.
    fn fold<T: Copy + Send + Sync>(
        &self,
        identity: T,
        covers: impl Fn(&T, Aabb) -> bool + Sync,
        add: impl Fn(&mut T, DVec3) + Sync,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> T {
        let Some((&first, others)) = self.times.split_first() else { return identity };
        let step = |time: f64, animated: bool, (mut result, mut scratch): (T, Vec<Vec3>)| {
            self.fold_at(time, animated, &mut result, &mut scratch, &covers, &add);
            (result, scratch)
        };
        // Static instances are folded once. All threads start from the result of the first time.
        let (start, _) = step(first, true, step(first, false, (identity, Vec::new())));
        let begin = || (start, Vec::with_capacity(CLUSTER_SIZE));
        let results = others.par_iter().fold(begin, |state, &time| step(time, true, state));
        results.map(|(result, _)| result).reduce(|| start, join)
    }

    /// Folds at one time, over either the animated or the static instances. `scratch` holds the positions of
    /// a cluster.
    fn fold_at<T>(
        &self,
        time: f64,
        animated: bool,
        result: &mut T,
        scratch: &mut Vec<Vec3>,
        covers: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) {
        let nodes = NodeTransforms::at(self.scene, &self.active, time);
        let instances = self.scene.instances.iter().zip(&self.is_animated);
        for (instance, _) in instances.filter(|(_, is_animated)| **is_animated == animated) {
            if !nodes.visible[instance.node as usize] {
                continue;
            }
            let InstancePose { to_world, deformer, .. } = nodes.pose_instance(instance);
            let Some(deformer) = deformer else {
                if let Some(clusters) = &self.clusters[instance.mesh as usize] {
                    clusters.fold(&to_world, result, &covers, &add);
                }
                continue;
            };
            let clusters = self.skinned_clusters.get(&(instance.mesh, instance.skin));
            let count = self.scene.meshes[instance.mesh as usize].positions.len();
            for (cluster, first) in (0..count).step_by(CLUSTER_SIZE).enumerate() {
                let bounds = clusters.and_then(|clusters| clusters.bounds(cluster, &deformer));
                if bounds.is_some_and(|b| covers(result, transformed_bounds(&to_world, &b))) {
                    continue;
                }
                deformer.deform_positions(first..(first + CLUSTER_SIZE).min(count), scratch);
                fold_points(&to_world, scratch, result, &add);
            }
        }
    }
}

/// Returns the cost of sampling a mesh once, in vertices.
fn sample_cost(mesh: &Mesh) -> usize {
    mesh.positions.len().saturating_mul(1 + mesh.morph_targets.len() / MORPH_TARGETS_PER_VERTEX)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::{DAffine3, DQuat};

    use super::*;
    use crate::scene::animation::playback::active_animations;
    use crate::scene::pose;
    use crate::scene::{
        AnimationChoice, Channel, ChannelTarget, Interpolation, Keyframes, LocalTransform, MorphTarget, Node,
        PoseSettings, Skin,
    };

    const RINGS: u16 = 300;
    const SIDES: u16 = 20;

    /// A tube as high as four joints.
    fn tube() -> Mesh {
        let point = |i: u16| {
            let angle = f32::from(i % SIDES) / f32::from(SIDES) * TAU;
            Vec3::new(0.3 * angle.cos(), 4.0 * f32::from(i / SIDES) / f32::from(RINGS), 0.3 * angle.sin())
        };
        let positions: Vec<Vec3> = (0..RINGS * SIDES).map(point).collect();
        Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }
    }

    fn skinned(mut mesh: Mesh) -> Mesh {
        mesh.influences.per_vertex = 2;
        for p in &mesh.positions {
            let below = p.y.clamp(0.0, 2.9) as u16;
            let above = (p.y - f32::from(below)).clamp(0.0, 1.0);
            mesh.influences.joints.extend([below, below + 1]);
            mesh.influences.weights.extend([1.0 - above, above]);
        }
        mesh
    }

    fn morphing(mut mesh: Mesh) -> Mesh {
        for k in 0..5 {
            let moved = |p: &Vec3| Vec3::new(p.y * 0.1 * k as f32, 0.0, (p.y * k as f32).sin());
            let positions = mesh.positions.iter().map(moved).collect();
            mesh.morph_targets.push(MorphTarget { positions, ..MorphTarget::default() });
        }
        mesh.morph_weights = vec![0.0; 5];
        mesh
    }

    /// A chain of four swinging joints, and instances of each mesh at a moving and at a static node.
    fn scene(meshes: Vec<Mesh>) -> Scene {
        let mut scene = Scene { meshes, ..Scene::default() };
        let times: Vec<f32> = (0..30).map(|i| i as f32 / 10.0).collect();
        // Not a coordinate axis, so that all bounds change.
        let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
        let mut channels = Vec::new();
        for j in 0..4u32 {
            let (translation, rotation) = (DVec3::Y * f64::from(j.min(1)), DQuat::IDENTITY);
            let local = LocalTransform::Trs { translation, rotation, scale: DVec3::ONE };
            scene.nodes.push(Node { parent: j.checked_sub(1), local, visible: true, ..Node::default() });
            let turned =
                |t: &f32| DQuat::from_axis_angle(axis, f64::from((t * (1.0 + j as f32)).sin())).as_quat();
            let values = times.iter().flat_map(|t| turned(t).to_array()).collect();
            let interpolation = Interpolation::Linear;
            let keys = Keyframes { times: times.clone(), values, width: 4, interpolation };
            channels.push(Channel { target: ChannelTarget::Rotation(j), keyframes: keys });
        }
        let inverse_bind = (0..4).map(|j| DAffine3::from_translation(DVec3::NEG_Y * f64::from(j))).collect();
        scene.skins = vec![Skin { name: String::new(), joints: vec![0, 1, 2, 3], inverse_bind }];
        for i in 0..scene.meshes.len() as u32 {
            // One moves with the last joint, one is static.
            for parent in [Some(3), None] {
                let node = scene.nodes.len() as u32;
                let local = LocalTransform::Matrix(DAffine3::from_translation(DVec3::X * f64::from(i)));
                scene.nodes.push(Node { parent, local, visible: true, ..Node::default() });
                let skin = (scene.meshes[i as usize].influences.per_vertex > 0).then_some(0);
                scene.instances.push(Instance { node, mesh: i, object: i + 1, skin, ..Instance::default() });
                let count = scene.meshes[i as usize].morph_targets.len();
                if count > 0 && parent.is_some() {
                    let weight = |t: &f32, k: usize| (t * 2.0 + k as f32).sin() * 1.5;
                    let values = times.iter().flat_map(|t| (0..count).map(move |k| weight(t, k))).collect();
                    let interpolation = Interpolation::Linear;
                    let keys = Keyframes { times: times.clone(), values, width: count, interpolation };
                    channels.push(Channel { target: ChannelTarget::Weights(node), keyframes: keys });
                }
            }
        }
        scene.animations = vec![Animation { name: String::new(), channels }];
        scene
    }

    fn sampler(scene: &Scene) -> ClipSampler<'_> {
        ClipSampler::new(scene, active_animations(scene, &AnimationChoice::Default).unwrap())
    }

    /// Returns the number of vertices that computing the bounds visits, and their number over all times.
    fn visited_vertices(scene: &Scene) -> (usize, usize) {
        let sampler = sampler(scene);
        let covers = |found: &(Aabb, usize), b: Aabb| found.0.contains_box(&b);
        let count = |found: &mut (Aabb, usize), p: DVec3| {
            found.0.extend(p);
            found.1 += 1;
        };
        let mut found = (Aabb::EMPTY, 0);
        for &time in &sampler.times {
            sampler.fold_at(time, true, &mut found, &mut Vec::new(), covers, count);
        }
        let moving = scene.instances.iter().zip(&sampler.is_animated).filter(|m| *m.1);
        let all: usize = moving.map(|m| scene.meshes[m.0.mesh as usize].positions.len()).sum();
        (found.1, all * sampler.times.len())
    }

    #[test]
    fn skipped_clusters_would_not_change_the_bounds() {
        let mut broken = morphing(skinned(tube()));
        broken.positions[7] = Vec3::NAN;
        broken.morph_targets[1].positions[700] = Vec3::INFINITY;
        broken.influences.weights[3000] = 2.0;
        broken.influences.joints[4000] = 9;
        broken.morph_targets[2].positions.clear();
        for meshes in [
            vec![tube()],
            vec![skinned(tube())],
            vec![morphing(tube())],
            vec![tube(), morphing(skinned(tube())), broken],
        ] {
            let scene = scene(meshes);
            let sampler = sampler(&scene);
            assert!(sampler.times.len() > 50);
            let all = || {
                sampler.times.iter().flat_map(|&time| {
                    let at = PoseSettings { time, centre: Some(DVec3::ZERO), ..PoseSettings::default() };
                    let posed = pose(&scene, &at).unwrap();
                    let of = |i: usize| {
                        let to_world = posed.instances[i].transform;
                        posed
                            .positions(i as u32)
                            .iter()
                            .map(move |&p| to_world.point_f64(p))
                            .collect::<Vec<_>>()
                    };
                    (0..posed.instances.len()).flat_map(of).collect::<Vec<_>>()
                })
            };
            let mut bounds = Aabb::EMPTY;
            all().for_each(|p| bounds.extend(p));
            let (middle, finite) = (bounds.centre(), all().filter(|p| p.is_finite()));
            let r2 = finite.map(|p| p.distance_squared(middle)).fold(0.0, f64::max);
            assert_eq!(
                sampler.bounds().map(|b| (b.bounds, b.sphere)),
                Some((bounds, Sphere { centre: middle, radius: r2.sqrt() }))
            );
        }
    }

    #[test]
    fn few_vertices_are_visited_vertices() {
        for meshes in [vec![tube()], vec![skinned(tube())], vec![morphing(tube())]] {
            let (visited, all) = visited_vertices(&scene(meshes));
            assert!(visited < all / 3, "{visited} of {all}");
        }
    }
}
