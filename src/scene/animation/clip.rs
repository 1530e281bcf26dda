//! What a scene takes up over the whole of its animation: what must not change from frame to frame, a
//! framed view or a ground, is taken from here.

use std::sync::{Arc, OnceLock};

use crate::geometry::{Aabb, Sphere};
use crate::scene::animation::clip_bounds::ClipSampler;
use crate::scene::animation::pose::active_animations;
use crate::scene::{Animation, AnimationChoice, ChannelTarget, PoseError, PosedScene, Scene};

/// Moments from one key to the next, at most.
const BETWEEN: usize = 4;
/// Moments from which on keys are close enough by themselves.
const CLOSE: usize = 64;

/// What a scene takes up while its animations play: known to all moments of a clip once one of them was asked.
#[derive(Clone, Debug, Default)]
pub struct ClipBoundsCache(Arc<OnceLock<Extent>>);

/// The same in world coordinates.
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Aabb,
    sphere: Sphere,
    /// How many were looked at.
    moments: usize,
}

/// When the animations that play end, in seconds; 0 where nothing moves.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn clip_duration(scene: &Scene, animation: &AnimationChoice) -> Result<f64, PoseError> {
    Ok(active_animations(scene, animation)?.iter().map(|a| f64::from(a.duration())).fold(0.0, f64::max))
}

impl PosedScene<'_> {
    /// The bounds of all that is visible at any time of the animations that play, in world coordinates:
    /// the same ones whatever moment this is. Without animations they are [`PosedScene::bounds`].
    ///
    /// Keyframes and times between them are looked at; as many as a large scene can bear.
    pub fn clip_bounds(&self) -> Aabb {
        self.extent().bounds
    }

    /// A sphere around all that is visible at any time of the animations that play, in world
    /// coordinates: the same one whatever moment this is. Without animations it is
    /// [`PosedScene::bounding_sphere`]. As wide as [`PosedScene::clip_bounds`], and as small as holds every
    /// vertex that was looked at.
    pub fn clip_sphere(&self) -> Sphere {
        self.extent().sphere
    }

    /// How many moments of the animations were looked at, if [`PosedScene::clip_bounds`] or
    /// [`PosedScene::clip_sphere`] was asked for at this moment or another of the same clip; 0 where nothing
    /// moves.
    pub fn clip_sample_count(&self) -> Option<usize> {
        self.clip_bounds_cache.0.get().map(|extent| extent.moments)
    }

    /// What this moment shares with others of its clip.
    pub(crate) fn clip_bounds_cache(&self) -> &ClipBoundsCache {
        &self.clip_bounds_cache
    }

    /// This moment, which shares that with others: of the same scene and the same animations.
    pub(crate) fn with_clip_bounds_cache(mut self, clip_bounds_cache: &ClipBoundsCache) -> Self {
        self.clip_bounds_cache = clip_bounds_cache.clone();
        self
    }

    fn extent(&self) -> &Extent {
        self.clip_bounds_cache.0.get_or_init(|| self.look_through_clip())
    }

    fn look_through_clip(&self) -> Extent {
        let playing = active_animations(self.scene, self.animation()).unwrap_or_default();
        let walk = ClipSampler::new(self.scene, playing);
        if walk.moments.is_empty() {
            return Extent { bounds: self.bounds(), sphere: self.bounding_sphere(), moments: 0 };
        }
        let (bounds, sphere) = walk.measure();
        Extent { bounds, sphere, moments: walk.moments.len() }
    }
}

impl Scene {
    /// Which instances move, bend, come or go while animations play.
    pub fn animated_instances<'a>(&self, playing: impl IntoIterator<Item = &'a Animation>) -> Vec<bool> {
        let mut moved = vec![false; self.nodes.len()];
        let mut bent = vec![false; self.nodes.len()];
        for channel in playing.into_iter().flat_map(|a| &a.channels) {
            match channel.target {
                ChannelTarget::Translation(n)
                | ChannelTarget::Rotation(n)
                | ChannelTarget::Scale(n)
                | ChannelTarget::Visibility(n) => {
                    moved[n as usize] = true;
                }
                ChannelTarget::Weights(n) | ChannelTarget::Weight(n, _) => bent[n as usize] = true,
                ChannelTarget::Material(..) | ChannelTarget::Light(..) | ChannelTarget::Camera(..) => {}
            }
        }
        for (i, node) in self.nodes.iter().enumerate() {
            moved[i] |= node.parent.is_some_and(|p| moved[p as usize]);
        }
        let skin_moves = |s: u32| self.skins[s as usize].joints.iter().any(|&j| moved[j as usize]);
        let skins: Vec<bool> = (0..self.skins.len() as u32).map(skin_moves).collect();
        let of = |i: &crate::scene::Instance| {
            moved[i.node as usize] || bent[i.node as usize] || i.skin.is_some_and(|s| skins[s as usize])
        };
        self.instances.iter().map(of).collect()
    }
}

/// The times of all keys that move something and times between them, `most` at most.
pub(crate) fn moments(playing: &[&Animation], most: usize) -> Vec<f64> {
    let moves = |t: &ChannelTarget| {
        !matches!(t, ChannelTarget::Material(..) | ChannelTarget::Light(..) | ChannelTarget::Camera(..))
    };
    let channels = playing.iter().flat_map(|a| &a.channels).filter(|c| moves(&c.target));
    let mut keys: Vec<f32> = channels.flat_map(|c| c.keyframes.times.iter().copied()).collect();
    keys.retain(|t| t.is_finite());
    keys.sort_by(f32::total_cmp);
    keys.dedup();
    let Some(last) = keys.len().checked_sub(1) else { return Vec::new() };
    let key = |i: usize| f64::from(keys[i]);
    if last >= most {
        // Evenly through the keys, the first and the last among them.
        return (0..most).map(|i| key(i * last / (most - 1))).collect();
    }
    let steps = (CLOSE.min(most - 1) / last.max(1)).clamp(1, BETWEEN);
    let between = (0..last)
        .flat_map(|i| (0..steps).map(move |s| key(i) + (key(i + 1) - key(i)) * s as f64 / steps as f64));
    between.chain([key(last)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::pose;
    use crate::scene::{
        Channel, Instance, Interpolation, Keyframes, LocalTransform, Mesh, Node, PoseSettings,
    };
    use glam::{DQuat, DVec3, Vec3};

    fn keys(times: &[f32], values: &[f32], width: usize) -> Keyframes {
        Keyframes {
            times: times.to_vec(),
            values: values.to_vec(),
            width,
            interpolation: Interpolation::Linear,
        }
    }

    /// A small triangle three metres from the origin, on an arm that swings half around, beside one
    /// that stands still.
    fn scene() -> Scene {
        let mut scene = Scene::default();
        let mesh = |x: f32| Mesh {
            positions: vec![Vec3::new(x, 0.0, 0.0), Vec3::new(x + 0.1, 0.0, 0.0), Vec3::new(x, 0.1, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        scene.meshes = vec![mesh(3.0), mesh(0.0)];
        for i in 0..2 {
            scene.nodes.push(Node { visible: true, ..Node::default() });
            scene.instances.push(Instance { node: i, mesh: i, object: i + 1, ..Instance::default() });
        }
        let turn = |angle: f64| {
            let q = DQuat::from_rotation_y(angle).as_quat();
            [q.x, q.y, q.z, q.w]
        };
        let values = [turn(0.0), turn(std::f64::consts::PI)].concat();
        let target = ChannelTarget::Rotation(0);
        let channels = vec![Channel { target, keyframes: keys(&[0.0, 2.0], &values, 4) }];
        scene.animations.push(Animation { name: "swing".into(), channels });
        scene
    }

    fn sphere(scene: &Scene, time: f64, animation: AnimationChoice) -> Sphere {
        pose(scene, &PoseSettings { time, animation, centre: None }).unwrap().clip_sphere()
    }

    #[test]
    fn the_sphere_is_the_same_at_every_moment_and_holds_them_all() {
        let scene = scene();
        let whole = sphere(&scene, 0.0, AnimationChoice::Default);
        for time in [0.0, 0.3, 1.0, 1.7, 2.0, 9.0] {
            let at = sphere(&scene, time, AnimationChoice::Default);
            assert_eq!(at, whole, "to the bit");
            let settings = PoseSettings { time, ..Default::default() };
            let own = pose(&scene, &settings).unwrap().bounding_sphere();
            assert!(own.centre.distance(whole.centre) + own.radius < whole.radius * 1.1, "{time}");
        }
        // A half circle of radius 3.1 about the origin, seen from above.
        assert!((whole.radius - 3.1).abs() < 0.5 && whole.radius < 3.5, "{whole:?}");
        assert!((whole.centre.z + 1.55).abs() < 0.01, "half way out: {whole:?}");
    }

    #[test]
    fn moments_that_share_it_find_it_once() {
        let scene = scene();
        let posed = || pose(&scene, &PoseSettings::default()).unwrap();
        let first = posed();
        let second = posed().with_clip_bounds_cache(first.clip_bounds_cache());
        assert_eq!(first.clip_sample_count(), None);
        let sphere = second.clip_sphere();
        assert_eq!((first.clip_sample_count(), first.clip_sphere()), (Some(5), sphere));
    }

    #[test]
    fn without_animation_it_is_the_bounding_sphere() {
        let scene = scene();
        let posed = pose(&scene, &PoseSettings { animation: AnimationChoice::Rest, ..Default::default() });
        let posed = posed.unwrap();
        assert_eq!(posed.clip_sphere(), posed.bounding_sphere());
    }

    #[test]
    fn moments_are_keys_and_between_within_a_limit() {
        let clip = |times: &[f32]| {
            let values = vec![0.0; times.len() * 3];
            Animation {
                name: String::new(),
                channels: vec![Channel {
                    target: ChannelTarget::Translation(0),
                    keyframes: keys(times, &values, 3),
                }],
            }
        };
        assert_eq!(moments(&[&clip(&[1.0, 2.0])], 9), [1.0, 1.25, 1.5, 1.75, 2.0]);
        assert_eq!(moments(&[&clip(&[1.0])], 9), [1.0]);
        let long: Vec<f32> = (0..1001).map(|i| i as f32).collect();
        let few = moments(&[&clip(&long)], 9);
        assert_eq!((few.len(), few[0], few[4], few[8]), (9, 0.0, 500.0, 1000.0));
        assert!(moments(&[], 9).is_empty());
    }

    #[test]
    fn a_ball_that_falls_has_its_ground_where_it_lands() {
        let local =
            LocalTransform::Trs { translation: DVec3::Y * 7.0, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        let mesh = Mesh { positions: vec![Vec3::NEG_ONE, Vec3::ONE], ..Mesh::default() };
        let keys = Keyframes {
            times: vec![0.0, 1.0, 2.0],
            values: vec![0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 0.0],
            width: 3,
            interpolation: Interpolation::Linear,
        };
        let channel = Channel { target: ChannelTarget::Translation(0), keyframes: keys };
        let scene = Scene {
            nodes: vec![Node { local, visible: true, ..Node::default() }],
            meshes: vec![mesh],
            instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
            animations: vec![Animation { name: String::new(), channels: vec![channel] }],
            ..Scene::default()
        };
        let bounds = |time: f64, animation: AnimationChoice| {
            pose(&scene, &PoseSettings { time, animation, centre: None }).unwrap().clip_bounds()
        };
        for time in [0.0, 0.5, 1.9] {
            let over = bounds(time, AnimationChoice::Default);
            assert_eq!((over.min, over.max), (DVec3::new(-1.0, -1.0, -1.0), DVec3::new(4.0, 6.0, 1.0)));
        }
        let rest = bounds(0.0, AnimationChoice::Rest);
        assert_eq!((rest.min.y, rest.max.y), (6.0, 8.0));
    }
}
