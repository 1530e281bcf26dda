//! Lists whose cameras are records in a file, read one at a time.

use std::fmt::Debug;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use twox_hash::XxHash3_128;

use super::listed_camera::{ListedCamera, MAX_CAMERAS};
use crate::error::LoadError;

/// Bytes that are read of a record at first.
const RECORD_BYTES: usize = 1024;

/// The form of the records of a file.
pub(super) trait RecordFormat: Debug + Send + Sync {
    /// Reads the bytes of a record from its beginning.
    fn read(&self, reader: &mut dyn BufRead) -> io::Result<Vec<u8>>;

    /// Parses a record; `None` if it has no pose.
    fn parse(&self, bytes: &[u8]) -> Result<Option<ListedCamera>, String>;
}

/// A camera in the file.
#[derive(Clone, Copy, Debug)]
struct Record {
    /// Byte offset.
    offset: u64,
    /// Hash of its bytes.
    hash: u64,
    /// NaN without a time.
    time: f64,
}

/// A file of records, and their positions.
#[derive(Debug)]
pub(super) struct RecordFile {
    path: PathBuf,
    format: Box<dyn RecordFormat>,
    records: Vec<Record>,
    /// Number of records without a pose.
    without_pose: usize,
    /// Opened once, so that a file that replaces this one has no effect.
    file: Mutex<File>,
}

impl RecordFile {
    pub fn new(path: &Path, format: Box<dyn RecordFormat>, file: File) -> RecordFile {
        let path = path.to_path_buf();
        RecordFile { path, format, records: Vec::new(), without_pose: 0, file: Mutex::new(file) }
    }

    /// Adds the camera of a record at `offset` with these bytes. `place` stands in errors.
    pub fn add(&mut self, offset: u64, bytes: &[u8], place: &str) -> Result<(), LoadError> {
        let path = self.path.display();
        let camera =
            self.format.parse(bytes).map_err(|text| LoadError::parse(format!("{path}, {place}"), text))?;
        let Some(camera) = camera else {
            self.without_pose += 1;
            return Ok(());
        };
        LoadError::check_limit("number of cameras", self.records.len() as u64 + 1, MAX_CAMERAS as u64)?;
        self.records.push(Record { offset, hash: hash(bytes), time: camera.time.unwrap_or(f64::NAN) });
        Ok(())
    }

    pub fn len(&self) -> usize {
        self.records.len()
    }

    pub fn without_pose(&self) -> usize {
        self.without_pose
    }

    pub fn time(&self, index: usize) -> Option<f64> {
        self.records.get(index).map(|record| record.time).filter(|time| !time.is_nan())
    }

    /// Reads a camera again; `None` if there is none.
    pub fn read(&self, index: usize) -> Result<Option<ListedCamera>, LoadError> {
        let Some(record) = self.records.get(index) else { return Ok(None) };
        let bytes = self.bytes_at(record.offset).map_err(|e| LoadError::io(&self.path, e))?;
        if hash(&bytes) != record.hash {
            let cause = io::Error::new(io::ErrorKind::InvalidData, "the file changed while it was read");
            return Err(LoadError::io(&self.path, cause));
        }
        let camera = self.format.parse(&bytes);
        camera.map_err(|text| LoadError::parse(self.path.display(), text))
    }

    /// The bytes of the record at `offset`.
    fn bytes_at(&self, offset: u64) -> io::Result<Vec<u8>> {
        let mut file = self.file.lock().unwrap_or_else(|e| e.into_inner());
        file.seek(SeekFrom::Start(offset))?;
        self.format.read(&mut BufReader::with_capacity(RECORD_BYTES, &mut *file))
    }
}

fn hash(bytes: &[u8]) -> u64 {
    XxHash3_128::oneshot(bytes) as u64
}
