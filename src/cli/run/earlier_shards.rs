//! The archives of an earlier run, whose images `--resume` takes into new ones.

use std::collections::VecDeque;
use std::ops::Range;
use std::rc::Rc;

use anyhow::Result;

use super::archived_scenes::ArchivedShard;
use crate::plan::{NumberedScene, RenderPlan, ShardPlan};

/// Archives that are open at once.
const OPEN_SHARDS: usize = 16;

/// Finds images in archives of an earlier run. Without --resume there are none.
pub struct EarlierShards<'a> {
    plan: &'a RenderPlan,
    shards: ShardPlan,
    /// Number of the next archive to open.
    next: usize,
    /// Archives with scenes that have not had their turn.
    open: VecDeque<Rc<ArchivedShard>>,
}

/// The images of a scene in an archive of an earlier run, made with the same settings.
pub struct ArchivedImages {
    pub shard: Rc<ArchivedShard>,
    /// Their bytes in it.
    pub members: Range<u64>,
    pub count: u64,
    /// True if the scene's files are the same as well.
    pub is_current: bool,
}

impl<'a> EarlierShards<'a> {
    pub fn new(plan: &'a RenderPlan, shards: &ShardPlan) -> EarlierShards<'a> {
        EarlierShards { plan, shards: shards.clone(), next: 0, open: VecDeque::new() }
    }

    /// Opens and returns the archive of a number from 0, which may be replaced from now on.
    ///
    /// # Errors
    /// As [`ArchivedShard::open`].
    pub fn open(&mut self, number: usize) -> Result<Option<Rc<ArchivedShard>>> {
        if !self.plan.outputs.resume {
            return Ok(None);
        }
        if !self.reads_ahead() {
            self.next = number;
        }
        while self.next <= number && self.open.len() < OPEN_SHARDS {
            self.open_next()?;
        }
        let file = self.shards.numbered(number);
        Ok(self.open.iter().find(|shard| shard.path == file).cloned())
    }

    /// Opens the archives up to the one that may have the scene of a number. Returns false if too many are open: it is looked
    /// for later.
    ///
    /// # Errors
    /// As [`ArchivedShard::open`].
    pub fn reach(&mut self, number: usize) -> Result<bool> {
        if !self.plan.outputs.resume || !self.reads_ahead() {
            return Ok(true);
        }
        while self.open.back().is_none_or(|shard| shard.last_number() < number)
            && let Some(next) = self.next_file()
        {
            if self.open.len() >= OPEN_SHARDS {
                return Ok(false);
            }
            self.next = next;
            self.open_next()?;
        }
        Ok(true)
    }

    /// Finds the images of a scene that were made with the same settings, rather those that are current.
    pub fn find(&self, scene: &NumberedScene) -> Option<ArchivedImages> {
        let mut found = None;
        for shard in &self.open {
            let of_number = shard.scenes.iter().find(|archived| archived.number == scene.number);
            let Some(archived) = of_number.filter(|archived| archived.has_settings(self.plan, scene)) else {
                continue;
            };
            let is_current = archived.is_current(self.plan, scene);
            if is_current || found.is_none() {
                found = Some(ArchivedImages {
                    shard: shard.clone(),
                    members: archived.members.clone(),
                    count: archived.images(),
                    is_current,
                });
            }
            if is_current {
                break;
            }
        }
        found
    }

    /// Closes archives all of whose scenes have had their turn, if that of a number has it now.
    pub fn release(&mut self, number: usize) {
        while self.open.front().is_some_and(|shard| shard.last_number() < number) {
            self.open.pop_front();
        }
    }

    /// True if the archive of a scene is not known before those before it are filled.
    fn reads_ahead(&self) -> bool {
        self.shards.max_bytes().is_some()
    }

    /// The number of the next archive that exists. A few may be missing.
    fn next_file(&self) -> Option<usize> {
        (self.next..self.next + OPEN_SHARDS).find(|number| self.shards.numbered(*number).is_file())
    }

    fn open_next(&mut self) -> Result<()> {
        self.open.extend(ArchivedShard::open(&self.shards.numbered(self.next))?.map(Rc::new));
        self.next += 1;
        Ok(())
    }
}
