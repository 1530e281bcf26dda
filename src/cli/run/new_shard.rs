//! An archive that is written only if it differs from the one of an earlier run.

use std::io;
use std::path::Path;
use std::rc::Rc;

use super::archived_scenes::ArchivedShard;
use super::earlier_shards::ArchivedImages;
use blinn_output::{Overwrite, ShardPart, ShardWriter};

/// An archive that is being made.
pub struct NewShard<'f> {
    file: &'f Path,
    /// The archive of an earlier run with its name.
    earlier: Option<Rc<ArchivedShard>>,
    /// Bytes at the start of that archive which this one has, too.
    same: u64,
    /// Set from the first difference on.
    writer: Option<ShardWriter>,
}

/// The outcome of an archive.
pub enum ShardEnd {
    Wrote,
    /// It would have been the same.
    Kept,
    /// It has no image, and is not written.
    Empty,
}

impl NewShard<'_> {
    pub fn new(file: &Path, earlier: Option<Rc<ArchivedShard>>) -> NewShard<'_> {
        NewShard { file, earlier, same: 0, writer: None }
    }

    /// Bytes of its files with their headers.
    pub fn length(&self) -> u64 {
        self.writer.as_ref().map_or(self.same, ShardWriter::length)
    }

    /// Appends the images of a scene that was rendered.
    pub fn add(&mut self, part: ShardPart) -> io::Result<()> {
        self.writer()?.append(part)
    }

    /// Appends images of an earlier run.
    pub fn keep(&mut self, images: &ArchivedImages) -> io::Result<()> {
        let is_own = self.earlier.as_ref().is_some_and(|earlier| Rc::ptr_eq(earlier, &images.shard));
        if is_own && self.writer.is_none() && images.members.start == self.same {
            self.same = images.members.end;
            return Ok(());
        }
        self.writer()?.append_members(&images.shard.file, images.members.clone())
    }

    /// Ends the archive, and names it if it is new.
    pub fn finish(mut self, overwrite: Overwrite) -> io::Result<ShardEnd> {
        if self.length() == 0 {
            return Ok(ShardEnd::Empty);
        }
        let is_same = self.earlier.as_ref().is_some_and(|earlier| earlier.length() == self.same);
        if self.writer.is_none() && is_same {
            return Ok(ShardEnd::Kept);
        }
        self.take_writer()?.finish(overwrite)?;
        Ok(ShardEnd::Wrote)
    }

    fn writer(&mut self) -> io::Result<&mut ShardWriter> {
        let writer = self.take_writer()?;
        Ok(self.writer.insert(writer))
    }

    /// The writer, or a new one with what is the same.
    fn take_writer(&mut self) -> io::Result<ShardWriter> {
        if let Some(writer) = self.writer.take() {
            return Ok(writer);
        }
        let mut writer = ShardWriter::new(self.file)?;
        if let Some(earlier) = &self.earlier {
            writer.append_members(&earlier.file, 0..self.same)?;
        }
        Ok(writer)
    }
}
