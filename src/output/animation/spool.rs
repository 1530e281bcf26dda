//! The body of a moving picture while it grows: a nameless file, so that memory does not grow with
//! frames, and a process that is killed leaves nothing behind.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use crate::output::Overwrite;
use crate::output::atomic::{check_overwrite, unnamed_temp_file, write_atomically_with};

/// Bytes that wait for their head, which often can be written only when all is known.
pub(crate) struct Spool {
    file: BufWriter<File>,
    length: u64,
}

impl Spool {
    /// For a file that will appear at `path`; says at once where it cannot.
    pub fn beside(path: &Path, replace: Overwrite) -> io::Result<Spool> {
        check_overwrite(path, replace)?;
        Ok(Spool { file: BufWriter::new(unnamed_temp_file(path)?), length: 0 })
    }

    /// Bytes so far.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Writes `head` and the body to `path`, whole or not at all.
    pub fn publish(self, head: &[u8], path: &Path, replace: Overwrite) -> io::Result<()> {
        let mut body = self.file.into_inner().map_err(|e| e.into_error())?;
        body.rewind()?;
        write_atomically_with(path, replace, |file| {
            file.write_all(head)?;
            io::copy(&mut body, file).map(drop)
        })
    }
}

impl Write for Spool {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.length += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
