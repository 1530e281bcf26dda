//! Bounds of a posed scene over its animation clip, for views and grounds that must be the same in all
//! frames.

use glam::DVec3;

use crate::PosedScene;
use crate::animation::bounds_cache::{ClipBounds, ClipBoundsCache};
use crate::animation::clip_bounds::ClipSampler;
use crate::animation::playback::active_animations;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Aabb, Sphere};

impl PosedScene<'_> {
    /// Returns the bounds of all triangles that can be seen at any time of the animations that play, in world
    /// coordinates. They are the same for all times. Without animations they are
    /// [`PosedScene::bounds`].
    ///
    /// Samples the keyframes and times between them, fewer for large scenes.
    pub fn clip_bounds(&self) -> Aabb {
        self.cached_clip_bounds().bounds
    }

    /// Returns a bounding sphere of all triangles that can be seen at any time of the animations that play, in world
    /// coordinates. It is the same for all times. Without animations it is
    /// [`PosedScene::bounding_sphere`].
    ///
    /// Its centre is that of [`PosedScene::clip_bounds`], and it is as small as contains every sampled
    /// vertex.
    pub fn clip_sphere(&self) -> Sphere {
        self.cached_clip_bounds().sphere
    }

    /// Returns the number of sampled times if the clip bounds were computed, at this time or at another
    /// that shares the cache; 0 if nothing moves.
    pub fn clip_sample_count(&self) -> Option<usize> {
        self.clip_bounds_cache.clip().map(|bounds| bounds.samples)
    }

    /// Returns the cache that times of the same clip share.
    pub fn clip_bounds_cache(&self) -> &ClipBoundsCache {
        &self.clip_bounds_cache
    }

    /// Shares a cache with other times of the same scene and animations.
    pub fn with_clip_bounds_cache(mut self, cache: &ClipBoundsCache) -> Self {
        self.clip_bounds_cache = cache.clone();
        self
    }

    fn cached_clip_bounds(&self) -> &ClipBounds {
        self.clip_bounds_cache.clip_or_init(|| {
            let active = active_animations(self.scene, self.animation()).unwrap_or_default();
            let sampler = ClipSampler::new(self.scene, active, &self.clip_bounds_cache);
            match sampler.bounds() {
                Ok(Some(bounds)) => bounds,
                Ok(None) => ClipBounds { bounds: self.bounds(), sphere: self.bounding_sphere(), samples: 0 },
                Err(Cancelled) => {
                    let sphere = Sphere { centre: DVec3::ZERO, radius: 1.0 };
                    ClipBounds { bounds: Aabb::EMPTY, sphere, samples: 0 }
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};

    use super::*;
    use crate::{
        Animation, AnimationChoice, Channel, ChannelTarget, Instance, Interpolation, Keyframes,
        LocalTransform, Mesh, Node, PoseSettings, Scene, pose,
    };

    fn keys(times: &[f32], values: &[f32], width: usize) -> Keyframes {
        Keyframes {
            times: times.to_vec(),
            values: values.to_vec(),
            width,
            interpolation: Interpolation::Linear,
        }
    }

    /// A small triangle that swings half around the origin at a distance of 3 m, and a static one.
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
    fn the_clip_sphere_is_the_same_at_all_times_and_contains_the_scene() {
        let scene = scene();
        let clip = sphere(&scene, 0.0, AnimationChoice::Default);
        for time in [0.0, 0.3, 1.0, 1.7, 2.0, 9.0] {
            let at = sphere(&scene, time, AnimationChoice::Default);
            assert_eq!(at, clip, "to the bit");
            let settings = PoseSettings { time, ..Default::default() };
            let sphere_now = pose(&scene, &settings).unwrap().bounding_sphere();
            assert!(
                sphere_now.centre.distance(clip.centre) + sphere_now.radius < clip.radius * 1.1,
                "{time}"
            );
        }
        // A half circle of radius 3.1 around the origin, seen from above.
        assert!((clip.radius - 3.1).abs() < 0.5 && clip.radius < 3.5, "{clip:?}");
        assert!((clip.centre.z + 1.55).abs() < 0.01, "half way out: {clip:?}");
    }

    #[test]
    fn times_that_share_a_cache_compute_the_bounds_once() {
        let scene = scene();
        let posed = || pose(&scene, &PoseSettings::default()).unwrap();
        let first = posed();
        let second = posed().with_clip_bounds_cache(first.clip_bounds_cache());
        assert_eq!(first.clip_sample_count(), None);
        let sphere = second.clip_sphere();
        assert_eq!((first.clip_sample_count(), first.clip_sphere()), (Some(5), sphere));
    }

    #[test]
    fn without_animations_the_clip_sphere_is_the_bounding_sphere() {
        let scene = scene();
        let posed = pose(&scene, &PoseSettings { animation: AnimationChoice::Rest, ..Default::default() });
        let posed = posed.unwrap();
        assert_eq!(posed.clip_sphere(), posed.bounding_sphere());
    }

    #[test]
    fn clip_bounds_contain_a_falling_ball_where_it_lands() {
        let local =
            LocalTransform::Trs { translation: DVec3::Y * 7.0, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        let mesh = Mesh {
            positions: vec![Vec3::NEG_ONE, Vec3::ONE, Vec3::new(1.0, -1.0, 1.0)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
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
