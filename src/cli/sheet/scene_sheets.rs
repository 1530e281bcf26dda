//! Scenes that are rendered for sheets, several at once, and finished in their order.

use std::sync::Arc;

use anyhow::Result;

use crate::console::{scene_error, single_line};
use crate::plan::{NumberedScene, RenderPlan};
use crate::run::batch::is_queue_full;
use crate::run::panics;
use crate::run::progress::{Reporter, SceneLog};
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_session::{Claim, Finished, Job, Permit, run_scheduled};

/// A scene while it is rendered.
pub struct SheetScene<'a> {
    pub plan: &'a RenderPlan,
    pub scene: NumberedScene,
    pub log: SceneLog<'a>,
    pub cancel: CancelToken,
}

/// Renders the part of a sheet that belongs to a scene.
pub trait RenderScene: Sync {
    type Output: Send;

    /// Views of each scene, which its work is estimated from.
    fn view_count(&self) -> usize;

    fn render(&self, scene: &SheetScene, permit: &Arc<Permit>) -> Result<Self::Output>;
}

/// The job of a scene.
struct SceneJob<'a, R> {
    scene: SheetScene<'a>,
    renderer: &'a R,
}

impl<R: RenderScene> Job for SceneJob<'_, R> {
    type Output = Result<R::Output>;

    fn claim(&self) -> Claim {
        let SheetScene { plan, scene, .. } = &self.scene;
        plan.session.scene_claim(&scene.path, Some(self.renderer.view_count()))
    }

    fn run(&self, permit: &Arc<Permit>) -> Self::Output {
        panics::catch(|| self.renderer.render(&self.scene, permit))
    }

    fn begin_again(&self) {
        self.scene.log.clear();
    }

    fn begin_turn(&self) {
        self.scene.log.begin_turn();
    }

    fn cancel(&self) {
        self.scene.cancel.cancel();
    }
}

/// Renders all scenes of a plan, reports those that fail, and calls `finish` with each in the order of the list: with its output,
/// and the line that says why it failed.
///
/// # Errors
/// The list of scenes cannot be read to its end.
pub fn render_scenes<R: RenderScene>(
    plan: &RenderPlan,
    renderer: &R,
    reporter: &Reporter,
    summary: &mut Summary,
    mut finish: impl FnMut(&NumberedScene, Result<R::Output>, Option<&str>, &mut Summary),
) -> Result<(), UsageError> {
    let mut list = plan.numbered_scenes().peekable();
    run_scheduled(plan.session.capacity(), |jobs| {
        loop {
            while !is_queue_full(jobs)
                && let Some(Ok(scene)) = list.next_if(Result::is_ok)
            {
                let log = SceneLog::of_batch(reporter, scene.number, &scene.path, plan.strict);
                let scene = SheetScene { plan, scene, log, cancel: CancelToken::new() };
                jobs.push(SceneJob { scene, renderer });
            }
            let Some(Finished { job, output, .. }) = jobs.next_finished() else {
                // The list cannot be read to its end.
                return list.next().transpose().map(drop);
            };
            let SheetScene { scene, log, .. } = &job.scene;
            log.scene_done();
            let failure = output.as_ref().err().map(|error| single_line(&scene_error(&scene.path, error)));
            log.finish();
            if let Some(line) = &failure {
                reporter.fail(Some(&scene.path), line);
            }
            summary.add_scene(failure.clone());
            finish(scene, output, failure.as_deref(), summary);
        }
    })
}
