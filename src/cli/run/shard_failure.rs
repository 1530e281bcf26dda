//! Archives that are not written.

use std::ops::ControlFlow;

use anyhow::Error;

use super::batch::{Batch, Scenes, fail};
use super::full_disk::is_disk_full;
use crate::usage::UsageError;

/// The reason why an archive was not written.
pub enum ShardFailure {
    /// The list of scenes cannot be read.
    Usage(UsageError),
    Archive(Error),
    /// The disk is full. The error was reported with its scene.
    DiskFull,
}

impl From<UsageError> for ShardFailure {
    fn from(error: UsageError) -> ShardFailure {
        ShardFailure::Usage(error)
    }
}

impl From<Error> for ShardFailure {
    fn from(error: Error) -> ShardFailure {
        ShardFailure::Archive(error)
    }
}

/// Ends the work on an archive that is not written, and reports why. Breaks if nothing more can be written.
pub fn give_up_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    failure: ShardFailure,
) -> Result<ControlFlow<()>, UsageError> {
    drop(scenes.cancel());
    batch.give_up_archive();
    let is_full = match failure {
        ShardFailure::Usage(error) => return Err(error),
        ShardFailure::DiskFull => true,
        ShardFailure::Archive(error) => {
            fail(batch.summary, batch.reporter, &error);
            is_disk_full(&error)
        }
    };
    Ok(if is_full { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
}
