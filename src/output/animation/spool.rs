//! A spool file: an unnamed temporary file for the body of an animation. Memory does not grow with the number of
//! frames, and a killed process leaves no file behind.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use crate::atomic::{Overwrite, check_overwrite, unnamed_temp_file, write_atomically_with};

/// The body of a file whose head is known only at the end.
pub(super) struct Spool {
    file: BufWriter<File>,
    length: u64,
}

impl Spool {
    /// Creates a spool for a file at `path`. Fails if that file cannot be created.
    pub fn create(path: &Path, overwrite: Overwrite) -> io::Result<Spool> {
        check_overwrite(path, overwrite)?;
        Ok(Spool { file: BufWriter::new(unnamed_temp_file(path)?), length: 0 })
    }

    /// Bytes written so far.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Writes the head and the body atomically to `path`.
    pub fn publish(self, head: &[u8], path: &Path, overwrite: Overwrite) -> io::Result<()> {
        let mut body = self.file.into_inner().map_err(|e| e.into_error())?;
        body.rewind()?;
        write_atomically_with(path, overwrite, |file| {
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
