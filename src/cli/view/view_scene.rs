//! A scene with its poses and their acceleration structures, which all pictures of it share.

use std::path::Path;

use anyhow::{Context, Result};

use super::loaded_scene::LoadedScene;
use crate::plan::RenderPlan;
use crate::run::progress::{SceneLog, quiet_reporter};
use blinn_core::cancellation::CancelToken;
use blinn_scene::{AnimationChoice, PoseSettings, Scene, Selection, pose};
use blinn_session::{
    BackFaceCulling, PosedFrame, ResolvedExposure, SceneRenderer, SceneSetup, SettingsHash, check_memory,
};

self_cell::self_cell!(
    /// A scene that owns its poses.
    struct PosedScenes {
        owner: LoadedScene,
        #[covariant]
        dependent: Poses,
    }
);

/// The poses of a scene that pictures need.
pub struct Poses<'s> {
    /// The start of the clip.
    pub start: PosedFrame<'s>,
    /// The last time that was shown, if it is not the start.
    current: Option<PosedFrame<'s>>,
}

impl<'s> Poses<'s> {
    fn new(scene: &'s LoadedScene, animation: &AnimationChoice) -> Result<Poses<'s>> {
        let settings = PoseSettings { time: 0.0, animation: animation.clone(), centre: None };
        let posed = pose(&scene.scene, &settings)?;
        Ok(Poses { start: PosedFrame { time: 0.0, posed, accel: None }, current: None })
    }

    /// The scene at a time in seconds, with its acceleration structure, which is refitted.
    pub fn at(&mut self, setup: &SceneSetup, time: f64) -> Result<&PosedFrame<'s>> {
        if setup.is_at(&self.start, time) {
            setup.build(&mut self.start)?;
            return Ok(&self.start);
        }
        let frame = match self.current.take() {
            Some(frame) if setup.is_at(&frame, time) && frame.accel.is_some() => frame,
            other => setup.pose_at(time, &self.start, other.and_then(|frame| frame.accel))?,
        };
        Ok(self.current.insert(frame))
    }
}

/// A scene with the parts and the animation that are shown, and its poses.
pub struct ViewScene {
    /// The options that it was loaded with.
    key: SettingsHash,
    selection: Selection,
    animation: AnimationChoice,
    content: Option<Content>,
}

enum Content {
    Posed(Box<PosedScenes>),
    /// The scene after an error.
    Unposed(Box<LoadedScene>),
}

/// Hash of the options of a plan that take effect when a scene is loaded.
fn load_key(plan: &RenderPlan) -> SettingsHash {
    let options = &plan.session.options;
    SettingsHash::of(&(&options.load, options.cull == BackFaceCulling::All))
}

impl ViewScene {
    /// Loads the scene of a plan.
    ///
    /// # Errors
    /// The file cannot be read, or needs more memory than there is.
    pub fn load(plan: &RenderPlan, path: &Path, cancel: &CancelToken) -> Result<ViewScene> {
        let mut loaded = LoadedScene::load(plan, path, cancel)?;
        loaded.show(&plan.session.options.selection)?;
        check_memory(&plan.session, &loaded.scene, 1)?;
        let mut view_scene = ViewScene {
            key: load_key(plan),
            selection: plan.session.options.selection.clone(),
            animation: plan.session.options.animation(&loaded.scene)?,
            content: None,
        };
        view_scene.pose(loaded)?;
        Ok(view_scene)
    }

    /// True if the scene of `plan` is this one, perhaps with other parts shown.
    pub fn suits(&self, plan: &RenderPlan) -> bool {
        self.key == load_key(plan)
    }

    /// Shows the parts and the animation of a plan.
    ///
    /// # Errors
    /// A pattern matches nothing, or there is no such animation.
    pub fn show(&mut self, plan: &RenderPlan) -> Result<()> {
        let animation = plan.session.options.animation(self.scene()?)?;
        let selection = &plan.session.options.selection;
        let is_posed = matches!(self.content, Some(Content::Posed(_)));
        if is_posed && self.selection == *selection && self.animation == animation {
            return Ok(());
        }
        let mut loaded = match self.content.take().context("the scene is lost")? {
            Content::Posed(cell) => cell.into_owner(),
            Content::Unposed(loaded) => *loaded,
        };
        if self.selection != *selection {
            if let Err(error) = loaded.show(selection) {
                self.selection = Selection::default();
                self.content = Some(Content::Unposed(loaded.into()));
                return Err(error);
            }
            self.selection.clone_from(selection);
        }
        self.animation = animation;
        self.pose(loaded)
    }

    fn pose(&mut self, loaded: LoadedScene) -> Result<()> {
        let posed = PosedScenes::try_new_or_recover(loaded, |loaded| Poses::new(loaded, &self.animation));
        match posed {
            Ok(cell) => {
                self.content = Some(Content::Posed(cell.into()));
                Ok(())
            }
            Err((loaded, error)) => {
                self.content = Some(Content::Unposed(loaded.into()));
                Err(error)
            }
        }
    }

    fn loaded(&self) -> Result<&LoadedScene> {
        match self.content.as_ref().context("the scene is lost")? {
            Content::Posed(cell) => Ok(cell.borrow_owner()),
            Content::Unposed(loaded) => Ok(loaded),
        }
    }

    /// The scene.
    pub fn scene(&self) -> Result<&Scene> {
        Ok(&self.loaded()?.scene)
    }

    /// Warnings of the import.
    pub fn warnings(&self) -> Result<&[String]> {
        Ok(&self.loaded()?.warnings)
    }

    /// Calls a function with the scene and its poses.
    ///
    /// # Errors
    /// Those of the function; the scene could not be posed.
    pub fn with_poses<T>(
        &mut self,
        function: impl for<'s> FnOnce(&'s Scene, &mut Poses<'s>) -> Result<T>,
    ) -> Result<T> {
        match self.content.as_mut() {
            Some(Content::Posed(cell)) => {
                cell.with_dependent_mut(|loaded, poses| function(&loaded.scene, poses))
            }
            _ => anyhow::bail!("the scene has no pose"),
        }
    }

    /// The exposure of the pictures of a plan, metered if it does not give one.
    ///
    /// # Errors
    /// The lights or the camera do not suit the scene, or the work is cancelled.
    pub fn exposure(
        &mut self,
        plan: &RenderPlan,
        path: &Path,
        cancel: &CancelToken,
    ) -> Result<ResolvedExposure> {
        let reporter = quiet_reporter();
        let log = SceneLog::new(&reporter, path, false);
        self.with_poses(|scene, poses| {
            Ok(SceneRenderer::from_start(&plan.session, scene, &log, &mut poses.start, cancel)?.exposure)
        })
    }
}
