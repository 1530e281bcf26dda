//! The plan of one scene of a dataset, where it differs from that of all.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_128;

use super::dataset::first_orbit;
use super::frames::FrameSet;
use super::{FormatsPlan, RenderPlan, SceneNames};
use blinn_core::worded;
use blinn_scene::ViewSampling;
use blinn_session::DatasetPlan;

/// Parts of the plan that differ between scenes.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct ScenePlan {
    /// The seed of its random cameras and lights.
    seed: Option<u32>,
    /// The ids of its categories.
    categories: Vec<usize>,
}

impl RenderPlan {
    /// The plan with the random cameras and lights and the categories of a scene.
    pub fn of_scene(&self, scene: &Path) -> Cow<'_, RenderPlan> {
        let Some(ScenePlan { seed, categories }) = self.scene_plan(scene) else { return Cow::Borrowed(self) };
        let mut plan = match (seed, self.session.dataset) {
            (Some(seed), Some(dataset)) => self.with_seed(seed, dataset),
            _ => self.clone(),
        };
        plan.formats.scene_categories = categories;
        Cow::Owned(plan)
    }

    /// Returns the parts of the plan that are those of one scene, or `None` if it has the plan of all scenes. They follow from
    /// the names of scenes.
    pub fn scene_plan(&self, scene: &Path) -> Option<ScenePlan> {
        let dataset = self.session.dataset.filter(|_| self.random_per_scene);
        let name = || self.scenes.name(scene);
        let seed = dataset.map(|dataset| named_seed(dataset.sampling.seed, &name()));
        let FormatsPlan { categories, shared_categories, .. } = &self.formats;
        let has_categories = self.formats.has_categories_of_scenes();
        let names = has_categories.then(|| SceneNames::new(&self.scenes, scene));
        let categories =
            names.map(|names| shared_categories.of_scene(categories, &names)).unwrap_or_default();
        let plan = ScenePlan { seed, categories };
        (plan != ScenePlan::default()).then_some(plan)
    }

    /// A warning about categories that have other ids in each scene of the archives.
    pub fn category_warning(&self) -> Option<(PathBuf, String)> {
        let shards = self.outputs.shards.as_ref().filter(|_| self.formats.coco_masks().is_some())?;
        let text = worded!(
            "ids of categories differ between scenes, whose objects or materials are not known before they are read: \
             go by the names of categories, or use `category` NAME=GLOB, scene, or folder"
        );
        (self.scenes.len() > 1 && self.formats.has_categories_of_content())
            .then(|| (shards.numbered(0), text))
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
