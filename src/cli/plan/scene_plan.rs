//! The plan of one scene of a dataset, where it differs from that of all.

use std::borrow::Cow;
use std::path::Path;

use twox_hash::XxHash3_128;

use super::RenderPlan;
use super::dataset::first_orbit;
use super::frames::FrameSet;
use blinn_scene::ViewSampling;
use blinn_session::DatasetPlan;

impl RenderPlan {
    /// The plan with the random cameras and lights of a scene.
    pub fn of_scene(&self, scene: &Path) -> Cow<'_, RenderPlan> {
        match (self.scene_seed(scene), self.session.dataset) {
            (Some(seed), Some(dataset)) => Cow::Owned(self.with_seed(seed, dataset)),
            _ => Cow::Borrowed(self),
        }
    }

    /// The seed of the random cameras and lights of a scene, where each has its own. It follows from the name of the scene.
    pub fn scene_seed(&self, scene: &Path) -> Option<u32> {
        let dataset = self.session.dataset.filter(|_| self.random_per_scene)?;
        Some(named_seed(dataset.sampling.seed, &self.scenes.name(scene)))
    }

    fn with_seed(&self, seed: u32, dataset: DatasetPlan) -> RenderPlan {
        let mut plan = self.clone();
        let dataset = DatasetPlan { sampling: ViewSampling { seed, ..dataset.sampling }, ..dataset };
        plan.session.options.view.orbit = first_orbit(&dataset);
        if let FrameSet::List(frames) = &self.frames {
            let numbers = frames.iter().map(|frame| frame.number);
            plan.frames = FrameSet::List(dataset.views(numbers).collect());
        }
        plan.session.dataset = Some(dataset);
        plan
    }
}

/// A seed that follows from another one and a name.
fn named_seed(seed: u32, name: &str) -> u32 {
    let bytes: Vec<u8> = seed.to_le_bytes().into_iter().chain(name.bytes()).collect();
    XxHash3_128::oneshot(&bytes) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Datasets must not change with the version.
    #[test]
    fn seeds_follow_from_names() {
        // The lower 32 bits of XXH3-128 of the Python package xxhash.
        for (seed, name, expected) in
            [(0, "a.glb", 500_222_877), (0, "a/m.glb", 3_373_605_470), (1, "a.glb", 2_041_370_255)]
        {
            assert_eq!(named_seed(seed, name), expected, "{seed} {name}");
        }
    }
}
