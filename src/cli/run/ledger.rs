//! `--ledger FILE`: a line of JSON about each scene, appended when the scene is finished. With `--resume`, scenes that
//! a ledger names as done are skipped without reading them.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use serde_json::{Value, json};

use super::files_version::{FilesVersion, time_of_epoch};
use super::image_sink::WrittenFiles;
use crate::console::single_line;
use crate::files::create_parent_folder;
use crate::plan::{ClipFrames, RenderPlan, Target};
use blinn_import::file_version;
use blinn_output::{Overwrite, check_overwrite};
use blinn_session::{PlannedFrame, SettingsHash};

/// The status of a scene whose images were written or kept.
const DONE: &str = "done";
/// The status of a scene that failed.
const FAILED_STATUS: &str = "failed";
/// The start of every line.
const LINE_START: &[u8] = b"{\"scene\":";
/// Bytes that tell a ledger from other files.
const HEAD_BYTES: u64 = 256;
/// Warnings of a scene whose texts are stored.
const LISTED_WARNINGS: usize = 10;
/// Longest text of a warning or an error, in bytes.
const MAX_TEXT: usize = 500;
/// Longest line that is read, in bytes. Longer ones are none of ours.
const MAX_LINE: u64 = 1 << 20;

/// The outcome of a scene in an earlier run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PastOutcome {
    /// All of its images were written or kept.
    Done {
        /// Number of images.
        images: u64,
        /// The frames, if they depend on the scene.
        clip: ClipFrames,
        /// The version of their files, if the line has it.
        files: Option<FilesVersion>,
    },
    Failed,
}

/// The stored facts about a scene.
#[derive(Debug)]
pub struct LedgerEntry<'a> {
    pub key: SceneKey,
    pub scene: &'a Path,
    /// The scene's number, from 1.
    pub index: usize,
    /// The error line of a scene that failed.
    pub failure: Option<&'a str>,
    pub warnings: &'a [String],
    pub time: Duration,
    pub images: ImageCounts,
    /// The frames, if they depend on the scene.
    pub clip: Option<ClipFrames>,
    /// The version of the files of a scene that is done, unless they are in an archive.
    pub files: Option<FilesVersion>,
}

/// Images of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageCounts {
    /// Written images.
    pub rendered: u64,
    /// Images that `--resume` kept.
    pub kept: u64,
    /// Written images that show nothing.
    pub empty: u64,
    /// Written files.
    pub files: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl ImageCounts {
    /// Counts files.
    pub fn add(&mut self, written: WrittenFiles) {
        self.files += written.files;
        self.bytes += written.bytes;
    }

    /// Counts the images of another scene.
    pub fn add_images(&mut self, ImageCounts { rendered, kept, empty, files, bytes }: ImageCounts) {
        self.rendered += rendered;
        self.kept += kept;
        self.empty += empty;
        self.files += files;
        self.bytes += bytes;
    }
}

/// Identifies a scene, its version and its settings: equal for two runs that would write the same images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneKey(u128);

impl SceneKey {
    /// The key of the `index`-th scene. `settings` is the hash of the plan. A scene that was changed, by its size and
    /// time of modification, has another key, and so has one whose images go elsewhere; files that it refers to are not
    /// looked at.
    pub fn new(plan: &RenderPlan, settings: SettingsHash, path: &Path, index: usize) -> SceneKey {
        let version =
            file_version(path).map(|(bytes, modified, offset)| (bytes, modified.map(time_of_epoch), offset));
        let output = plan.outputs.target(path, index, &PlannedFrame::at(1, 0.0));
        let output = match &output {
            Target::Stdout => None,
            Target::File(file) => Some(file.as_os_str().as_encoded_bytes()),
        };
        let path = path.as_os_str().as_encoded_bytes();
        // The name of an image in an archive does not say which archive.
        let shard = plan.outputs.shards.as_ref().map(|shards| {
            let file = shards.file(index).into_os_string().into_encoded_bytes();
            (file, shards.neighbours(index, plan.scenes.len()))
        });
        SceneKey(SettingsHash::of(&(settings, path, version, output, shard)).hash())
    }
}

/// A ledger that is open for appending.
pub struct Ledger {
    path: PathBuf,
    file: File,
    /// True if the last line has no end: an earlier run was killed while it wrote.
    is_torn: bool,
    past: PastScenes,
}

/// The outcomes of earlier runs, in 24 bytes a scene.
#[derive(Debug, Default)]
struct PastScenes {
    /// In the order of keys.
    scenes: Vec<PastScene>,
    /// Frames of scenes on which they depend, by the same halves of keys.
    clips: HashMap<u64, ClipFrames>,
}

#[derive(Debug)]
struct PastScene {
    /// Half of the key.
    key: u64,
    /// Number of images, or [`FAILED`].
    images: u64,
    files: Option<FilesVersion>,
}

/// Stands for a failed scene in place of a number of images.
const FAILED: u64 = u64::MAX;

/// The parts of a line that are read.
#[derive(Deserialize)]
struct Line {
    key: String,
    status: String,
    #[serde(default)]
    images: u64,
    #[serde(default)]
    kept: u64,
    files_version: Option<String>,
    first_frame: Option<i64>,
    frame_step: Option<i64>,
}

impl Ledger {
    /// Opens a ledger. With `resume`, its lines are kept and read; otherwise it begins anew.
    ///
    /// # Errors
    /// The file cannot be read or written, is not a ledger, or exists and must not be overwritten.
    pub fn open(path: &Path, resume: bool, replace: Overwrite) -> Result<Ledger> {
        create_parent_folder(path)?;
        check_overwrite(path, replace)?;
        let open =
            || -> io::Result<File> { OpenOptions::new().read(true).append(true).create(true).open(path) };
        let context = || format!("{} cannot be opened", path.display());
        let mut file = open().with_context(context)?;
        if !file.metadata().with_context(context)?.is_file() {
            bail!("{} is not a regular file; name another file", path.display());
        }
        if !is_ledger(&mut file).with_context(context)? {
            bail!("{} is not a ledger; name another file", path.display());
        }
        let mut past = PastScenes::default();
        if resume {
            file.rewind().with_context(context)?;
            past = PastScenes::read(BufReader::new(&file)).with_context(context)?;
        } else {
            file.set_len(0).with_context(context)?;
        }
        let is_torn = !ends_with_line_break(&mut file).with_context(context)?;
        Ok(Ledger { path: path.to_path_buf(), file, is_torn, past })
    }

    /// The outcome of a scene in an earlier run.
    pub fn past(&self, key: SceneKey) -> Option<PastOutcome> {
        self.past.get(key)
    }

    /// Appends the lines of scenes in a single write, so that several processes can share a ledger.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, lines: &str) -> Result<()> {
        if lines.is_empty() {
            return Ok(());
        }
        let line_break = if self.is_torn { "\n" } else { "" };
        let written = self.file.write_all(format!("{line_break}{lines}").as_bytes());
        self.is_torn = written.is_err();
        written.with_context(|| format!("{} cannot be written", self.path.display()))
    }
}

/// A line about a scene.
pub struct LedgerLine(Value);

impl LedgerLine {
    /// Sets the version of the files of a scene that is done.
    pub fn set_files(&mut self, files: FilesVersion) {
        if self.0["status"] == DONE {
            self.0["files_version"] = json!(files.to_string());
        }
    }

    /// The text of the line, with its line break.
    pub fn to_text(&self) -> String {
        format!("{}\n", self.0)
    }
}

impl LedgerEntry<'_> {
    /// The line of the scene.
    pub fn to_line(&self) -> LedgerLine {
        let mut line = json!({
            "scene": self.scene.to_string_lossy(), "index": self.index,
            "status": if self.failure.is_some() { FAILED_STATUS } else { DONE },
        });
        if let Some(failure) = self.failure {
            line["error"] = json!(shortened(failure));
        }
        let ImageCounts { rendered, kept, empty, files, bytes } = self.images;
        line["seconds"] = json!((self.time.as_secs_f64() * 1e3).round() / 1e3);
        for (name, count) in
            [("images", rendered), ("kept", kept), ("empty", empty), ("files", files), ("bytes", bytes)]
        {
            line[name] = json!(count);
        }
        if let Some(ClipFrames { first, step }) = self.clip {
            line["first_frame"] = json!(first);
            line["frame_step"] = json!(step);
        }
        line["warnings"] = json!(self.warnings.len());
        if !self.warnings.is_empty() {
            let texts = self.warnings.iter().take(LISTED_WARNINGS).map(|text| json!(shortened(text)));
            line["warning_texts"] = texts.collect();
        }
        line["key"] = json!(format!("{:032x}", self.key.0));
        let mut line = LedgerLine(line);
        if let Some(files) = self.files {
            line.set_files(files);
        }
        line
    }
}

/// The beginning of a text, on one line.
fn shortened(text: &str) -> String {
    single_line(&text[..text.floor_char_boundary(MAX_TEXT)])
}

/// Returns true for an empty file and for one that begins as a ledger does.
fn is_ledger(file: &mut File) -> io::Result<bool> {
    file.rewind()?;
    let mut head = Vec::new();
    file.take(HEAD_BYTES).read_to_end(&mut head)?;
    // Runs that were killed may have torn the first lines.
    let may_start = |line: &[u8]| LINE_START.starts_with(line) || line.starts_with(LINE_START);
    Ok(head.split(|&byte| byte == b'\n').all(may_start))
}

fn ends_with_line_break(file: &mut File) -> io::Result<bool> {
    if file.seek(SeekFrom::End(0))? == 0 {
        return Ok(true);
    }
    file.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    file.read_exact(&mut last)?;
    Ok(last == *b"\n")
}

impl PastScenes {
    /// Reads the lines of a ledger. Of several lines about a scene, the last counts. Lines that cannot be read, such as
    /// a torn one, are skipped.
    fn read(mut input: impl BufRead) -> io::Result<PastScenes> {
        let (mut scenes, mut clips): (Vec<PastScene>, _) = (Vec::new(), HashMap::new());
        let mut line = Vec::new();
        loop {
            line.clear();
            if input.by_ref().take(MAX_LINE).read_until(b'\n', &mut line)? == 0 {
                break;
            }
            let Ok(line) = serde_json::from_slice(&line) else { continue };
            let Line { key, status, images, kept, files_version, first_frame, frame_step } = line;
            let Ok(key) = u128::from_str_radix(&key, 16) else { continue };
            let images = match status.as_str() {
                DONE => images.saturating_add(kept).min(FAILED - 1),
                FAILED_STATUS => FAILED,
                _ => continue,
            };
            let files = files_version.as_deref().and_then(FilesVersion::from_digits);
            if let (Some(first), Some(step)) = (first_frame, frame_step) {
                clips.insert(key as u64, ClipFrames { first, step });
            }
            scenes.push(PastScene { key: key as u64, images, files });
        }
        // A stable sort keeps the order of lines with the same key.
        scenes.sort_by_key(|scene| scene.key);
        scenes.dedup_by(|later, earlier| {
            let is_same = later.key == earlier.key;
            if is_same {
                std::mem::swap(earlier, later);
            }
            is_same
        });
        scenes.shrink_to_fit();
        Ok(PastScenes { scenes, clips })
    }

    fn get(&self, key: SceneKey) -> Option<PastOutcome> {
        let found = self.scenes.binary_search_by_key(&(key.0 as u64), |scene| scene.key).ok()?;
        Some(match self.scenes[found] {
            PastScene { images: FAILED, .. } => PastOutcome::Failed,
            PastScene { key, images, files } => {
                let clip = self.clips.get(&key).copied().unwrap_or(ClipFrames::FROM_ONE);
                PastOutcome::Done { images, clip, files }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(key: u128, failure: Option<&str>) -> LedgerEntry<'_> {
        let images = ImageCounts { rendered: 3, kept: 1, ..ImageCounts::default() };
        let scene = Path::new("a.glb");
        LedgerEntry {
            key: SceneKey(key),
            scene,
            index: 1,
            failure,
            warnings: &[],
            time: Duration::ZERO,
            images,
            clip: Some(ClipFrames { first: 5, step: 2 }),
            files: FilesVersion::from_digits("1f"),
        }
    }

    #[test]
    fn the_last_line_of_a_scene_counts() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/ledger.jsonl");
        let mut ledger = Ledger::open(&path, true, Overwrite::Yes).unwrap();
        for (key, failure) in [(1, None), (2, Some("no")), (3, Some("no")), (2, None), (1, Some("gone"))] {
            ledger.append(&entry(key, failure).to_line().to_text()).unwrap();
        }
        let past = Ledger::open(&path, true, Overwrite::Yes).unwrap();
        let outcomes = [1, 2, 3, 4].map(|key| past.past(SceneKey(key)));
        let clip = ClipFrames { first: 5, step: 2 };
        let files = FilesVersion::from_digits("1f");
        let (failed, done) = (Some(PastOutcome::Failed), Some(PastOutcome::Done { images: 4, clip, files }));
        assert_eq!(outcomes, [failed, done, failed, None]);
        // Lines of earlier versions of the program have neither the version of the files nor the frames.
        let text = std::fs::read_to_string(&path).unwrap();
        let text = text.replace("files_version", "other").replace("first_frame", "another");
        std::fs::write(&path, text).unwrap();
        let past = Ledger::open(&path, true, Overwrite::Yes).unwrap();
        assert_eq!(
            past.past(SceneKey(2)),
            Some(PastOutcome::Done { images: 4, clip: ClipFrames::FROM_ONE, files: None })
        );
        let new = Ledger::open(&path, false, Overwrite::Yes).unwrap();
        assert_eq!(new.past(SceneKey(2)), None);
        assert_eq!(std::fs::read(&path).unwrap(), b"", "without --resume, a ledger begins anew");
        assert!(Ledger::open(&path, false, Overwrite::No).is_err());
    }

    /// A kill may tear the last line anywhere.
    #[test]
    fn a_torn_line_is_skipped_and_does_not_spoil_the_next() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("ledger");
        let mut ledger = Ledger::open(&path, false, Overwrite::Yes).unwrap();
        ledger.append(&entry(7, None).to_line().to_text()).unwrap();
        ledger.append(&entry(8, None).to_line().to_text()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let first = whole.iter().position(|&b| b == b'\n').unwrap() + 1;
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let mut ledger = Ledger::open(&path, true, Overwrite::Yes).unwrap();
            // A line without its line break may be complete.
            assert_eq!(ledger.past(SceneKey(7)).is_some(), length + 1 >= first, "{length}");
            ledger.append(&entry(9, Some("a\nb")).to_line().to_text()).unwrap();
            let ledger = Ledger::open(&path, true, Overwrite::Yes).unwrap();
            assert_eq!(ledger.past(SceneKey(9)), Some(PastOutcome::Failed), "{length}");
            assert_eq!(ledger.past(SceneKey(8)).is_some(), length + 1 == whole.len(), "{length}");
        }
    }

    #[test]
    fn other_files_are_never_touched() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scenes.txt");
        for content in ["a.glb\n", "[1]", "{\"scenes\": 1}", "\0"] {
            std::fs::write(&path, content).unwrap();
            for resume in [true, false] {
                let error = Ledger::open(&path, resume, Overwrite::Yes).err().unwrap().to_string();
                assert!(error.contains("is not a ledger"), "{error}");
            }
            assert_eq!(std::fs::read_to_string(&path).unwrap(), content);
        }
        assert!(Ledger::open(dir.path(), true, Overwrite::Yes).is_err());
    }
}
