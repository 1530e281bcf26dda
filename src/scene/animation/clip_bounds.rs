//! A look at the vertices of a scene at many moments of its animations: only their positions are found, a crowd
//! at a time, and only of crowds that could change what is known by then.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::{Aabb, Sphere};
use crate::scene::animation::clip::moments;
use crate::scene::animation::node_transforms::{InstancePose, NodeTransforms};
use crate::scene::animation::pose_bounds::{CROWD, VertexClusters, add_all, box_about};
use crate::scene::animation::skinned_cluster_bounds::SkinnedClusters;
use crate::scene::{Animation, Instance, Mesh, Scene};

/// Moments that are looked at, at most.
const MOST: usize = 257;
/// And at least, however large the scene.
const LEAST: usize = 9;
/// Vertices that are looked at, in all moments together, where that leaves moments enough.
const BUDGET: usize = 1 << 25;
/// Morph targets that take as long to blend in as a vertex to place.
const TARGETS: usize = 4;

/// A walk through the moments of a clip, past the vertices of all that is visible: in the world, not relative
/// to any centre, so that not even rounding depends on whose moment asks.
pub(crate) struct ClipSampler<'s> {
    scene: &'s Scene,
    playing: Vec<&'s Animation>,
    /// Empty where nothing moves.
    pub moments: Vec<f64>,
    /// Of each instance.
    moving: Vec<bool>,
    /// Of each mesh that is drawn as the file has it.
    crowds: Vec<Option<VertexClusters<'s>>>,
    /// Of each mesh that bends, with each of its skins.
    bent: HashMap<(u32, Option<u32>), SkinnedClusters>,
}

impl<'s> ClipSampler<'s> {
    pub fn new(scene: &'s Scene, playing: Vec<&'s Animation>) -> ClipSampler<'s> {
        let moving = scene.animated_instances(playing.iter().copied());
        let mesh = |i: &Instance| &scene.meshes[i.mesh as usize];
        let moved = scene.instances.iter().zip(&moving).filter(|m| *m.1);
        let looks = moved.map(|m| looks(mesh(m.0))).fold(0, usize::saturating_add);
        let most = (BUDGET / looks.max(1)).clamp(LEAST, MOST);
        let mut moments = moments(&playing, most);
        if !moving.contains(&true) {
            moments.clear();
        }
        let mut crowds: Vec<_> = scene.meshes.iter().map(|_| None).collect();
        let mut bent = HashMap::new();
        for i in scene.instances.iter().filter(|_| !moments.is_empty()) {
            let mesh = mesh(i);
            let skin = i.skin.filter(|_| mesh.influences.per_vertex > 0);
            if skin.is_none() {
                crowds[i.mesh as usize].get_or_insert_with(|| VertexClusters::in_order(&mesh.positions));
            }
            if skin.is_some() || !mesh.morph_targets.is_empty() {
                let new = || SkinnedClusters::new(mesh, skin.map(|skin| &scene.skins[skin as usize]));
                bent.entry((i.mesh, i.skin)).or_insert_with(new);
            }
        }
        ClipSampler { scene, playing, moments, moving, crowds, bent }
    }

    /// Bounds of all, and a sphere about their middle.
    pub fn measure(&self) -> (Aabb, Sphere) {
        let within = |bounds: &Aabb, b: Aabb| bounds.min.cmple(b.min).all() && bounds.max.cmpge(b.max).all();
        let join = |mut a: Aabb, b: Aabb| {
            a.extend_box(&b);
            a
        };
        let bounds = self.over_vertices(Aabb::EMPTY, within, Aabb::extend, join);
        // One zero and not the other, whichever came first.
        let bounds = Aabb { min: bounds.min + 0.0, max: bounds.max + 0.0 };
        let middle = bounds.centre();
        let within = |r2: &f64, b: Aabb| b.max_distance_squared(middle) <= *r2;
        let add = |r2: &mut f64, p: DVec3| {
            if p.is_finite() {
                *r2 = r2.max(p.distance_squared(middle));
            }
        };
        let r2 = self.over_vertices(0.0, within, add, f64::max);
        (bounds, Sphere { centre: middle, radius: if r2 > 0.0 { r2.sqrt() } else { 1.0 } })
    }

    /// Has `add` count every vertex in at every moment, but for those in boxes of which `within` says that they
    /// change nothing. What threads found is `join`ed.
    fn over_vertices<T: Copy + Send + Sync>(
        &self,
        none: T,
        within: impl Fn(&T, Aabb) -> bool + Sync,
        add: impl Fn(&mut T, DVec3) + Sync,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> T {
        let Some((&first, others)) = self.moments.split_first() else { return none };
        let look = |time: f64, moving: bool, (mut found, mut room): (T, Vec<Vec3>)| {
            self.at(time, moving, &mut found, &mut room, &within, &add);
            (found, room)
        };
        // What stands still counts once, the rest at every moment: all begin with what the first one shows.
        let (start, _) = look(first, true, look(first, false, (none, Vec::new())));
        let begin = || (start, Vec::with_capacity(CROWD));
        let shares = others.par_iter().fold(begin, |known, &time| look(time, true, known));
        shares.map(|(found, _)| found).reduce(|| start, join)
    }

    /// The same at one moment, for what moves or for what stands still; `room` is for a crowd.
    fn at<T>(
        &self,
        time: f64,
        moving: bool,
        found: &mut T,
        room: &mut Vec<Vec3>,
        within: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) {
        let stance = NodeTransforms::of(self.scene, &self.playing, time);
        for (instance, _) in self.scene.instances.iter().zip(&self.moving).filter(|m| *m.1 == moving) {
            if !stance.visible[instance.node as usize] {
                continue;
            }
            let InstancePose { to_world, bend, .. } = stance.place(instance);
            let Some(bend) = bend else {
                if let Some(crowds) = &self.crowds[instance.mesh as usize] {
                    crowds.over_vertices(&to_world, found, &within, &add);
                }
                continue;
            };
            let crowds = self.bent.get(&(instance.mesh, instance.skin));
            let count = self.scene.meshes[instance.mesh as usize].positions.len();
            for (crowd, first) in (0..count).step_by(CROWD).enumerate() {
                let around = crowds.and_then(|crowds| crowds.around(crowd, &bend));
                if around.is_some_and(|b| within(found, box_about(&to_world, &b))) {
                    continue;
                }
                bend.positions(first..(first + CROWD).min(count), room);
                add_all(&to_world, room, found, &add);
            }
        }
    }
}

/// What it takes to look at a mesh once, in vertices.
fn looks(mesh: &Mesh) -> usize {
    mesh.positions.len().saturating_mul(1 + mesh.morph_targets.len() / TARGETS)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::{DAffine3, DQuat};

    use super::*;
    use crate::scene::animation::pose::active_animations;
    use crate::scene::pose;
    use crate::scene::{
        AnimationChoice, Channel, ChannelTarget, Interpolation, Keyframes, LocalTransform, MorphTarget, Node,
        PoseSettings, Skin,
    };

    const RINGS: u16 = 300;
    const SIDES: u16 = 20;

    /// A tube of four joints' height.
    fn tube() -> Mesh {
        let place = |i: u16| {
            let angle = f32::from(i % SIDES) / f32::from(SIDES) * TAU;
            Vec3::new(0.3 * angle.cos(), 4.0 * f32::from(i / SIDES) / f32::from(RINGS), 0.3 * angle.sin())
        };
        let positions: Vec<Vec3> = (0..RINGS * SIDES).map(place).collect();
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

    /// Four joints, one above the other, that swing about as those below them do; below them and beside them
    /// what is drawn at nodes that move or stand still.
    fn scene(meshes: Vec<Mesh>) -> Scene {
        let mut scene = Scene { meshes, ..Scene::default() };
        let times: Vec<f32> = (0..30).map(|i| i as f32 / 10.0).collect();
        // About no axis of the world: nothing keeps the same bounds.
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
            // One moves with the last joint, another stands still.
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

    fn walk(scene: &Scene) -> ClipSampler<'_> {
        ClipSampler::new(scene, active_animations(scene, &AnimationChoice::Default).unwrap())
    }

    /// How many vertices it takes to know the bounds, and how many there are at all moments.
    fn looked_at(scene: &Scene) -> (usize, usize) {
        let walk = walk(scene);
        let within =
            |found: &(Aabb, usize), b: Aabb| found.0.min.cmple(b.min).all() && found.0.max.cmpge(b.max).all();
        let count = |found: &mut (Aabb, usize), p: DVec3| {
            found.0.extend(p);
            found.1 += 1;
        };
        let mut found = (Aabb::EMPTY, 0);
        for &time in &walk.moments {
            walk.at(time, true, &mut found, &mut Vec::new(), within, count);
        }
        let moving = scene.instances.iter().zip(&walk.moving).filter(|m| *m.1);
        let all: usize = moving.map(|m| scene.meshes[m.0.mesh as usize].positions.len()).sum();
        (found.1, all * walk.moments.len())
    }

    #[test]
    fn what_is_passed_over_would_have_changed_nothing() {
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
            let walk = walk(&scene);
            assert!(walk.moments.len() > 50);
            let all = || {
                walk.moments.iter().flat_map(|&time| {
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
            assert_eq!(walk.measure(), (bounds, Sphere { centre: middle, radius: r2.sqrt() }));
        }
    }

    #[test]
    fn few_vertices_are_looked_at() {
        for meshes in [vec![tube()], vec![skinned(tube())], vec![morphing(tube())]] {
            let (looked, all) = looked_at(&scene(meshes));
            println!("{looked} of {all}");
            assert!(looked < all / 3, "{looked} of {all}");
        }
    }
}
