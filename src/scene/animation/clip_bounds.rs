//! Bounds over an animation clip. Samples vertex positions at many times; clusters of vertices that are
//! already inside the bounds are skipped.
//!
//! As for a single pose, all triangles are visited only if vertices that no triangle draws attain the bounds.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::animation::bounds_cache::{ClipBounds, ClipBoundsCache};
use crate::animation::clip_alpha::ClipAlpha;
use crate::animation::drawn_triangles::{InstanceShape, Rank, add_drawn_triangles};
use crate::animation::extremes::{BoxExtremes, Extremes, FarthestVertex, VertexAt};
use crate::animation::node_transforms::{InstancePose, NodeTransforms};
use crate::animation::playback::sample_times;
use crate::animation::skinned_cluster_bounds::SkinnedClusters;
use crate::animation::vertex_clusters::{CLUSTER_SIZE, VertexClusters, add_points, transformed_bounds};
use crate::{Animation, Instance, Mesh, Scene};
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Aabb, Sphere};

/// Most sample times.
const MAX_SAMPLES: usize = 257;
/// Fewest sample times, however large the scene.
const MIN_SAMPLES: usize = 9;
/// Vertices to process over all sample times, if that leaves enough of them.
const VERTEX_BUDGET: usize = 1 << 25;
/// Morph targets that cost as much as transforming a vertex.
const MORPH_TARGETS_PER_VERTEX: usize = 4;

/// Samples the visible vertices of a clip. Positions are in world space, not relative to a centre, so that
/// rounding does not depend on the posed scene that requests the bounds.
pub(super) struct ClipSampler<'s> {
    scene: &'s Scene,
    active: Vec<&'s Animation>,
    cache: &'s ClipBoundsCache,
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
    pub fn new(scene: &'s Scene, active: Vec<&'s Animation>, cache: &'s ClipBoundsCache) -> ClipSampler<'s> {
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
        ClipSampler { scene, active, cache, times, is_animated, clusters, skinned_clusters }
    }

    /// Computes the bounds over the clip; `None` if nothing moves.
    ///
    /// # Errors
    /// [`Cancelled`] by the token of the cache.
    pub fn bounds(&self) -> Result<Option<ClipBounds>, Cancelled> {
        if self.times.is_empty() {
            return Ok(None);
        }
        let bounds = self.find_extremes(BoxExtremes::EMPTY)?.bounds;
        // Adding 0 turns −0 into 0: which zero came first depends on the threads.
        let bounds = Aabb { min: bounds.min + 0.0, max: bounds.max + 0.0 };
        let centre = bounds.centre();
        let r2 = self.find_extremes(FarthestVertex::from(centre))?.distance_squared;
        let sphere = Sphere { centre, radius: if r2 > 0.0 { r2.sqrt() } else { 1.0 } };
        Ok(Some(ClipBounds { bounds, sphere, samples: self.times.len() }))
    }

    /// Finds the extremes over the corners of all triangles that can be seen at some time.
    fn find_extremes<E: Extremes>(&self, start: E) -> Result<E, Cancelled> {
        let alpha = self.cache.alpha(self.scene, || self.active.clone());
        if self.cache.drawn().is_none() {
            let found = self.over_all_times(start, |time, which, e: &mut E, scratch| {
                self.add_vertices(time, which, e, scratch);
            })?;
            if found.vertices().iter().all(|(part, at)| self.is_attained(&found, *part, at, alpha)) {
                return Ok(found);
            }
        }
        let drawn = self.cache.drawn_or_init(self.scene);
        let clusters: Vec<_> = (0..self.scene.meshes.len())
            .map(|mesh| self.clusters[mesh].as_ref().map(|_| drawn.of(self.scene, mesh as u32, alpha)))
            .map(|points| points.map(VertexClusters::in_order))
            .collect();
        self.over_all_times(start, |time, which, e: &mut E, scratch| {
            self.add_triangles(time, which, &clusters, alpha, e, scratch);
        })
    }

    /// Adds the instances at all times, on all threads. `add` includes the animated or the static instances at one
    /// time; its last argument is memory to reuse.
    fn over_all_times<E: Extremes>(
        &self,
        start: E,
        add: impl Fn(usize, Moving, &mut E, &mut Vec<Vec3>) + Sync,
    ) -> Result<E, Cancelled> {
        let step = |time: usize, (mut extremes, mut scratch): (E, Vec<Vec3>)| {
            add(time, Moving::Animated, &mut extremes, &mut scratch);
            (extremes, scratch)
        };
        // Static instances are added once. All threads start from the result of the first time.
        let mut first = start;
        add(0, Moving::Static, &mut first, &mut Vec::new());
        let (first, _) = step(0, (first, Vec::new()));
        let begin = || (first, Vec::with_capacity(CLUSTER_SIZE));
        let results = (1..self.times.len()).into_par_iter().fold(begin, |state, time| step(time, state));
        let joined = results.map(|(extremes, _)| extremes).reduce(|| first, E::join);
        // Bounds of a cancelled computation lack what it skipped.
        self.cache.check().map(|()| joined)
    }

    /// Includes the vertices of visible instances at one time.
    fn add_vertices<E: Extremes>(
        &self,
        time: usize,
        which: Moving,
        extremes: &mut E,
        scratch: &mut Vec<Vec3>,
    ) {
        let nodes = NodeTransforms::at(self.scene, &self.active, self.times[time]);
        for (at, instance) in self.visible_instances(time, which, &nodes) {
            let InstancePose { to_world, deformer, .. } = nodes.pose_instance(instance);
            if Rank::of(&to_world.matrix3) == Rank::Line {
                continue;
            }
            let Some(deformer) = deformer else {
                if let Some(clusters) = &self.clusters[instance.mesh as usize] {
                    clusters.add_to(&to_world, at, extremes);
                }
                continue;
            };
            let clusters = self.skinned_clusters.get(&(instance.mesh, instance.skin));
            let count = self.scene.meshes[instance.mesh as usize].positions.len();
            for (cluster, first) in (0..count).step_by(CLUSTER_SIZE).enumerate() {
                let bounds = clusters.and_then(|clusters| clusters.bounds(cluster, &deformer));
                if bounds.is_some_and(|b| extremes.covers(&transformed_bounds(&to_world, &b))) {
                    continue;
                }
                if self.cache.cancel().is_cancelled() {
                    return;
                }
                deformer.deform_positions(first..(first + CLUSTER_SIZE).min(count), scratch);
                add_points(&to_world, scratch, at, extremes, |i| (first + i) as u32);
            }
        }
    }

    /// Includes the triangles that can be seen at one time. `clusters` are those of the drawn vertices.
    fn add_triangles<E: Extremes>(
        &self,
        time: usize,
        which: Moving,
        clusters: &[Option<VertexClusters>],
        alpha: &ClipAlpha,
        extremes: &mut E,
        scratch: &mut Vec<Vec3>,
    ) {
        let nodes = NodeTransforms::at(self.scene, &self.active, self.times[time]);
        for (at, instance) in self.visible_instances(time, which, &nodes) {
            let InstancePose { to_world, deformer, .. } = nodes.pose_instance(instance);
            let mesh = &self.scene.meshes[instance.mesh as usize];
            match (Rank::of(&to_world.matrix3), &deformer, &clusters[instance.mesh as usize]) {
                (Rank::Line, ..) => {}
                (Rank::Full, None, Some(clusters)) => clusters.add_to(&to_world, at, extremes),
                (_, Some(deformer), _) => {
                    deformer.deform_positions(0..mesh.positions.len(), scratch);
                    add_drawn_triangles(self.scene, mesh, scratch, &to_world, alpha, extremes);
                }
                _ => add_drawn_triangles(self.scene, mesh, &mesh.positions, &to_world, alpha, extremes),
            }
        }
    }

    /// Returns the animated or the static instances that are visible at one time, up to the cancellation.
    fn visible_instances<'n>(
        &'n self,
        time: usize,
        which: Moving,
        nodes: &'n NodeTransforms,
    ) -> impl Iterator<Item = (VertexAt, &'n Instance)> {
        let instances = self.scene.instances.iter().zip(&self.is_animated).enumerate();
        let instances = instances.take_while(|_| !self.cache.cancel().is_cancelled());
        let chosen = instances.filter(move |(_, (instance, is_animated))| {
            **is_animated == (which == Moving::Animated) && nodes.visible[instance.node as usize]
        });
        chosen.map(move |(i, (instance, _))| {
            (VertexAt { time: time as u32, instance: i as u32, vertex: 0 }, instance)
        })
    }

    /// Returns true if a triangle that can be seen attains a part of `extremes`, as a vertex does.
    fn is_attained<E: Extremes>(&self, extremes: &E, part: usize, at: &VertexAt, alpha: &ClipAlpha) -> bool {
        let nodes = NodeTransforms::at(self.scene, &self.active, self.times[at.time as usize]);
        let instance = &self.scene.instances[at.instance as usize];
        let mesh = &self.scene.meshes[instance.mesh as usize];
        let InstancePose { to_world, deformer, .. } = nodes.pose_instance(instance);
        let mut deformed = Vec::new();
        let position = |v: u32| match &deformer {
            Some(deformer) => {
                deformer.deform_positions(v as usize..v as usize + 1, &mut deformed);
                deformed[0]
            }
            None => mesh.positions[v as usize],
        };
        InstanceShape { scene: self.scene, mesh, alpha, to_world, position }
            .attains(extremes, part, at.vertex)
    }
}

/// The instances that animations move, or the others.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Moving {
    Animated,
    Static,
}

/// Returns the cost of sampling a mesh once, in vertices.
fn sample_cost(mesh: &Mesh) -> usize {
    mesh.positions.len().saturating_mul(1 + mesh.morph_targets.len() / MORPH_TARGETS_PER_VERTEX)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::{DAffine3, DQuat, DVec3};

    use super::*;
    use crate::animation::extremes::CountingBox;
    use crate::animation::playback::active_animations;
    use crate::pose;
    use crate::{
        AnimationChoice, Channel, ChannelTarget, Interpolation, Keyframes, LocalTransform, MorphTarget, Node,
        PoseSettings, Skin,
    };
    use blinn_core::cancellation::CancelToken;

    const RINGS: u16 = 300;
    const SIDES: u16 = 20;

    /// A tube as high as four joints.
    fn tube() -> Mesh {
        let point = |i: u16| {
            let angle = f32::from(i % SIDES) / f32::from(SIDES) * TAU;
            Vec3::new(0.3 * angle.cos(), 4.0 * f32::from(i / SIDES) / f32::from(RINGS), 0.3 * angle.sin())
        };
        let positions: Vec<Vec3> = (0..RINGS * SIDES).map(point).collect();
        let triangles = (0..positions.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
        Mesh { positions, triangles, ..Mesh::default() }
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

    fn sampler<'s>(scene: &'s Scene, cache: &'s ClipBoundsCache) -> ClipSampler<'s> {
        ClipSampler::new(scene, active_animations(scene, &AnimationChoice::Default).unwrap(), cache)
    }

    /// Returns the number of vertices that computing the bounds visits, and their number over all times.
    fn visited_vertices(scene: &Scene) -> (usize, usize) {
        let cache = ClipBoundsCache::default();
        let sampler = sampler(scene, &cache);
        let mut found = CountingBox::default();
        for time in 0..sampler.times.len() {
            sampler.add_vertices(time, Moving::Animated, &mut found, &mut Vec::new());
        }
        let moving = scene.instances.iter().zip(&sampler.is_animated).filter(|m| *m.1);
        let all: usize = moving.map(|m| scene.meshes[m.0.mesh as usize].positions.len()).sum();
        (found.points, all * sampler.times.len())
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
            let cache = ClipBoundsCache::default();
            let sampler = sampler(&scene, &cache);
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
                sampler.bounds().map(|found| found.map(|b| (b.bounds, b.sphere))),
                Ok(Some((bounds, Sphere { centre: middle, radius: r2.sqrt() })))
            );
        }
    }

    /// A token that is cancelled meanwhile ends the search, whatever was found.
    #[test]
    fn a_cancelled_search_has_no_result() {
        let scene = scene(vec![tube(), morphing(skinned(tube()))]);
        let token = CancelToken::new();
        let cache = ClipBoundsCache::cancelled_by(&token);
        let sampler = sampler(&scene, &cache);
        assert!(sampler.bounds().is_ok_and(|found| found.is_some()));
        token.cancel();
        assert_eq!(sampler.bounds().map(|_| ()), Err(Cancelled));
        let mut found = CountingBox::default();
        sampler.add_vertices(3, Moving::Animated, &mut found, &mut Vec::new());
        assert_eq!(found.points, 0);
        let posed = pose(&scene, &PoseSettings::default()).unwrap().with_clip_bounds_cache(&cache);
        assert!(posed.clip_bounds().is_empty() && cache.check().is_err());
    }

    #[test]
    fn few_vertices_are_visited() {
        for meshes in [vec![tube()], vec![skinned(tube())], vec![morphing(tube())]] {
            let (visited, all) = visited_vertices(&scene(meshes));
            assert!(visited < all / 3, "{visited} of {all}");
        }
    }
}
