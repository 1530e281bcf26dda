//! The scenes of archives in their order, with their images: those of an earlier run, or rendered ones.

use std::collections::VecDeque;
use std::iter::Peekable;
use std::path::{Path, PathBuf};

use super::batch::{Batch, Scenes, is_queue_full};
use super::earlier_shards::{ArchivedImages, EarlierShards};
use super::ledger::PastOutcome;
use super::scene_task::SceneTask;
use super::shard_failure::ShardFailure;
use crate::files::create_parent_folder;
use crate::plan::{NumberedScene, RenderPlan, ShardPlan};
use crate::usage::UsageError;
use blinn_output::{ShardPart, check_writable};
use blinn_session::Finished;

/// Scenes one after the other.
pub type SceneIter<'l> = Box<dyn Iterator<Item = Result<NumberedScene, UsageError>> + 'l>;

/// Scenes that are looked at before their turn.
const SCENES_AHEAD: usize = 1024;

/// Scenes and their images.
pub struct ShardScenes<'l, 'a> {
    list: Peekable<SceneIter<'l>>,
    pub earlier: EarlierShards<'a>,
    /// Scenes that were looked at. Those that are rendered are in the scheduler, too.
    waiting: VecDeque<WaitingScene>,
    /// The scene that did not fit into the archive before.
    carried: Option<SceneTurn<'a>>,
    /// The last archive that can be written.
    checked: Option<PathBuf>,
}

struct WaitingScene {
    scene: NumberedScene,
    past: Option<PastOutcome>,
    archived: Option<ArchivedImages>,
    is_rendered: bool,
}

/// A scene that has its turn.
pub struct SceneTurn<'a> {
    pub scene: NumberedScene,
    /// Its outcome in the ledger.
    pub past: Option<PastOutcome>,
    /// Its images of an earlier run.
    pub archived: Option<ArchivedImages>,
    /// Set if it was rendered: its images are not up to date.
    pub rendered: Option<Finished<SceneTask<'a>>>,
}

impl SceneTurn<'_> {
    /// Bytes of its images in an archive.
    pub fn bytes(&self) -> u64 {
        match self.rendered.as_ref().map(|finished| &finished.output) {
            Some(output) if output.outcome.is_ok() => output.part.as_ref().map_or(0, ShardPart::length),
            _ => self.archived.as_ref().map_or(0, |images| images.members.end - images.members.start),
        }
    }
}

impl<'l, 'a> ShardScenes<'l, 'a> {
    pub fn new(plan: &'a RenderPlan, shards: &ShardPlan, list: SceneIter<'l>) -> ShardScenes<'l, 'a> {
        ShardScenes {
            list: list.peekable(),
            earlier: EarlierShards::new(plan, shards),
            waiting: VecDeque::new(),
            carried: None,
            checked: None,
        }
    }

    /// True if all scenes had their turn.
    pub fn is_empty(&mut self) -> bool {
        self.carried.is_none() && self.waiting.is_empty() && self.list.peek().is_none()
    }

    /// Waits for the next scene. Meanwhile, later ones are rendered for the archive `file`.
    pub fn next_turn<'scope>(
        &mut self,
        batch: &Batch<'a>,
        scenes: &mut Scenes<'_, 'scope, 'a>,
        file: &Path,
    ) -> Result<Option<SceneTurn<'a>>, ShardFailure>
    where
        'a: 'scope,
    {
        if let Some(turn) = self.carried.take() {
            return Ok(Some(turn));
        }
        self.look_ahead(batch, scenes, file)?;
        let Some(waiting) = self.waiting.pop_front() else { return Ok(None) };
        let WaitingScene { scene, past, archived, is_rendered } = waiting;
        self.earlier.release(scene.number);
        let rendered = if is_rendered { scenes.next_finished() } else { None };
        Ok(Some(SceneTurn { scene, past, archived, rendered }))
    }

    /// Gives the scene whose turn it was its turn again, as the first of the next archive.
    pub fn carry(&mut self, turn: SceneTurn<'a>) {
        self.carried = Some(turn);
    }

    /// Starts scenes until there are enough.
    fn look_ahead<'scope>(
        &mut self,
        batch: &Batch<'a>,
        scenes: &mut Scenes<'_, 'scope, 'a>,
        file: &Path,
    ) -> Result<(), ShardFailure>
    where
        'a: 'scope,
    {
        while self.waiting.len() < SCENES_AHEAD
            && !is_queue_full(scenes)
            && let Some(next) = self.list.peek()
        {
            if let Ok(scene) = next
                && !self.earlier.reach(scene.number)?
                && !self.waiting.is_empty()
            {
                break;
            }
            let Some(scene) = self.list.next().transpose()? else { break };
            let past = batch.past_outcome(&scene);
            let archived = self.earlier.find(&scene);
            let is_current = archived.as_ref().is_some_and(|images| images.is_current);
            // A scene that failed is not tried again if the ledger says so.
            let is_rendered = !is_current && past != Some(PastOutcome::Failed);
            if is_rendered {
                self.check(batch.plan, file)?;
                batch.start(scenes, scene.clone(), Some(file));
            }
            self.waiting.push_back(WaitingScene { scene, past, archived, is_rendered });
        }
        Ok(())
    }

    /// Checks that an archive can be written before anything is rendered for it.
    fn check(&mut self, plan: &RenderPlan, file: &Path) -> Result<(), ShardFailure> {
        if self.checked.as_deref() != Some(file) {
            create_parent_folder(file)?;
            check_writable(file, plan.outputs.replace).map_err(anyhow::Error::new)?;
            self.checked = Some(file.to_path_buf());
        }
        Ok(())
    }
}
