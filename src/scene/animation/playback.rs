//! Selection of the animations that play, the nodes they move, and the times at which bounds sample them.

use std::collections::HashSet;

use crate::{Animation, ChannelTarget, Instance, Scene};

/// Most intervals that the time between two keyframes is divided into.
const MAX_INTERVALS: usize = 4;
/// Number of sample times from which on keyframes alone are dense enough.
const DENSE: usize = 64;

/// The animations that play.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AnimationChoice {
    /// All if they drive different targets (Blender writes one animation for each object), else the
    /// first.
    #[default]
    Default,
    /// All. Where two drive the same target, the later one wins.
    All,
    /// One, by index.
    One(usize),
    /// None: the rest pose as the file stores it.
    Rest,
}

/// An error in posing a scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// The file has no animation with that index.
    #[error("the file has no animation {0}; it has {1}")]
    NoAnimation(usize, usize),
}

/// Returns the animations that play.
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
            let mut driven = HashSet::new();
            let disjoint = all.iter().all(|a| {
                let own: HashSet<_> = a.channels.iter().map(|c| c.target).collect();
                let is_new = own.is_disjoint(&driven);
                driven.extend(own);
                is_new
            });
            if disjoint { all.iter().collect() } else { all.iter().take(1).collect() }
        }
    })
}

/// Returns the end of the animations that play, in seconds; 0 if none do.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn clip_duration(scene: &Scene, animation: &AnimationChoice) -> Result<f64, PoseError> {
    let active = active_animations(scene, animation)?;
    Ok(active.iter().map(|a| f64::from(a.duration())).fold(0.0, f64::max))
}

impl Scene {
    /// Returns a flag for each instance: true if the animations move, deform, show or hide it.
    pub fn animated_instances<'a>(&self, active: impl IntoIterator<Item = &'a Animation>) -> Vec<bool> {
        let mut moved = vec![false; self.nodes.len()];
        let mut morphed = vec![false; self.nodes.len()];
        for channel in active.into_iter().flat_map(|a| &a.channels) {
            match channel.target {
                ChannelTarget::Translation(n)
                | ChannelTarget::Rotation(n)
                | ChannelTarget::Scale(n)
                | ChannelTarget::Visibility(n) => moved[n as usize] = true,
                ChannelTarget::Weights(n) | ChannelTarget::Weight(n, _) => morphed[n as usize] = true,
                ChannelTarget::Material(..)
                | ChannelTarget::Light(..)
                | ChannelTarget::AreaLight(..)
                | ChannelTarget::Camera(..)
                | ChannelTarget::Environment(..) => {}
            }
        }
        for (i, node) in self.nodes.iter().enumerate() {
            moved[i] |= node.parent.is_some_and(|p| moved[p as usize]);
        }
        let skin_moves = |s: u32| self.skins[s as usize].joints.iter().any(|&j| moved[j as usize]);
        let skins: Vec<bool> = (0..self.skins.len() as u32).map(skin_moves).collect();
        let is_animated = |i: &Instance| {
            moved[i.node as usize] || morphed[i.node as usize] || i.skin.is_some_and(|s| skins[s as usize])
        };
        self.instances.iter().map(is_animated).collect()
    }
}

/// Returns at most `max` times at which to sample the animations: the keyframes that move something, and
/// times between them.
pub(super) fn sample_times(active: &[&Animation], max: usize) -> Vec<f64> {
    let moves = |t: &ChannelTarget| {
        !matches!(
            t,
            ChannelTarget::Material(..)
                | ChannelTarget::Light(..)
                | ChannelTarget::AreaLight(..)
                | ChannelTarget::Camera(..)
                | ChannelTarget::Environment(..)
        )
    };
    let channels = active.iter().flat_map(|a| &a.channels).filter(|c| moves(&c.target));
    let mut keys: Vec<f32> = channels.flat_map(|c| c.keyframes.times.iter().copied()).collect();
    keys.retain(|t| t.is_finite());
    keys.sort_by(f32::total_cmp);
    keys.dedup();
    let Some(last) = keys.len().checked_sub(1) else { return Vec::new() };
    let key = |i: usize| f64::from(keys[i]);
    if last >= max {
        // Evenly distributed keyframes, including the first and the last.
        return (0..max).map(|i| key(i * last / (max - 1))).collect();
    }
    let steps = (DENSE.min(max - 1) / last.max(1)).clamp(1, MAX_INTERVALS);
    let times = (0..last)
        .flat_map(|i| (0..steps).map(move |s| key(i) + (key(i + 1) - key(i)) * s as f64 / steps as f64));
    times.chain([key(last)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Interpolation, Keyframes};

    #[test]
    fn sample_times_are_keyframes_and_times_between_within_the_limit() {
        let clip = |times: &[f32]| {
            let keyframes = Keyframes {
                times: times.to_vec(),
                values: vec![0.0; times.len() * 3],
                width: 3,
                interpolation: Interpolation::Linear,
            };
            let channels = vec![Channel { target: ChannelTarget::Translation(0), keyframes }];
            Animation { name: String::new(), channels }
        };
        assert_eq!(sample_times(&[&clip(&[1.0, 2.0])], 9), [1.0, 1.25, 1.5, 1.75, 2.0]);
        assert_eq!(sample_times(&[&clip(&[1.0])], 9), [1.0]);
        let long: Vec<f32> = (0..1001).map(|i| i as f32).collect();
        let few = sample_times(&[&clip(&long)], 9);
        assert_eq!((few.len(), few[0], few[4], few[8]), (9, 0.0, 500.0, 1000.0));
        assert!(sample_times(&[], 9).is_empty());
    }
}
