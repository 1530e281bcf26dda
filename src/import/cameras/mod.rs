//! Lists of cameras: `transforms.json` of NeRF tools and nerfstudio, COLMAP models, BOP's `scene_camera.json`, and
//! JSON lines.
//!
//! All formats describe pinhole cameras in pixels, whose centres are at half-integers: the first is (0.5, 0.5). Worlds
//! are taken as they are, in metres; none is rotated, except that blinn's own `transforms.json` names its up axis. The
//! world axes of a scene that was converted from Z up to Y up differ from those of its cameras; [`CameraFile::with_up`] rotates the cameras likewise.
//!
//! Files are untrusted. JSON lines and COLMAP's images are read one at a time, once to check them and then again when
//! they are used, so memory holds only their positions in the file.

mod bop;
mod colmap;
mod format;
mod json;
mod json_lines;
mod json_numbers;
mod lens;
mod lens_keys;
mod lines;
mod listed_camera;
mod matrix;
mod names;
mod picture_size;
mod recorded_view;
mod records;
mod transforms;

use std::path::{Path, PathBuf};

use super::error::LoadError;
use super::files::limits::Limits;
use blinn_scene::Normalization;
use blinn_scene::UpAxis;
use format::CameraFormat;
pub use lens::Lens;
pub use listed_camera::{ListedCamera, MAX_CAMERAS};
pub use recorded_view::RecordedView;
use records::RecordFile;

/// A list of cameras in a file.
#[derive(Debug)]
pub struct CameraFile {
    path: PathBuf,
    cameras: Cameras,
    recorded: Option<RecordedView>,
    up: UpAxis,
    without_pose: usize,
    has_several_files: bool,
}

/// The cameras, in the order of the file.
#[derive(Debug)]
enum Cameras {
    /// In memory, for formats that are one JSON document.
    List(Vec<ListedCamera>),
    /// In the file.
    Records(RecordFile),
}

impl CameraFile {
    /// Opens a list and checks every camera. The format is detected from the contents. A folder is searched for a
    /// COLMAP model, `transforms.json` or `scene_camera.json`.
    ///
    /// # Errors
    /// The file cannot be read, follows no known format, or has a camera that is not a pinhole camera at a finite
    /// position. The error has the line or the key.
    pub fn open(path: &Path, limits: &Limits) -> Result<CameraFile, LoadError> {
        let limit = limits.file_bytes;
        let format = CameraFormat::detect(path, limit)?;
        let mut recorded = None;
        let of_records = |records: RecordFile| (records.without_pose(), Cameras::Records(records));
        let (without_pose, cameras) = match &format {
            CameraFormat::Transforms(file) => {
                let document = transforms::load(file, limit)?;
                recorded = document.recorded;
                (document.without_pose, Cameras::List(document.cameras))
            }
            CameraFormat::Bop(file) => {
                let (list, without_pose) = bop::load(file, limit)?;
                (without_pose, Cameras::List(list))
            }
            CameraFormat::JsonLines(file) => of_records(json_lines::open(file, limit)?),
            CameraFormat::Colmap(model) => of_records(colmap::open(model, limit)?),
        };
        let up = recorded.map_or(UpAxis::Y, |view| view.up);
        let has_several_files = matches!(format, CameraFormat::Colmap(_));
        let path = format.file().to_path_buf();
        let opened = CameraFile { path, cameras, recorded, up, without_pose, has_several_files };
        if opened.is_empty() {
            return Err(LoadError::parse(opened.path.display(), "the list has no cameras"));
        }
        Ok(opened)
    }

    /// Sets the up axis of the world that the file describes. With +Z, (x, y, z) becomes (x, z, −y).
    pub fn with_up(self, up: UpAxis) -> CameraFile {
        CameraFile { up, ..self }
    }

    /// The file with the cameras.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns true if the cameras are in several files of one folder.
    pub fn has_several_files(&self) -> bool {
        self.has_several_files
    }

    /// The up axis of the world that the file describes.
    pub fn up(&self) -> UpAxis {
        self.up
    }

    /// The lens that blinn recorded in its own `transforms.json`. `None` for other files, and if a lens was changed.
    pub fn recorded(&self) -> Option<&RecordedView> {
        self.recorded.as_ref().filter(|view| view.is_exact)
    }

    /// From the scene's world to the units of blinn's own `transforms.json`, which are those of its layers. `None` for
    /// metres. Cameras are in metres.
    pub fn normalization(&self) -> Option<Normalization> {
        self.recorded.and_then(|view| view.normalization)
    }

    /// The number of pictures that are left out, as the list has no pose for them.
    pub fn without_pose(&self) -> usize {
        self.without_pose
    }

    /// The number of cameras.
    pub fn len(&self) -> usize {
        match &self.cameras {
            Cameras::List(list) => list.len(),
            Cameras::Records(records) => records.len(),
        }
    }

    /// Returns true if there are no cameras. A list that was opened has some.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The time of a camera in seconds, if it has one.
    pub fn time(&self, index: usize) -> Option<f64> {
        match &self.cameras {
            Cameras::List(list) => list.get(index)?.time,
            Cameras::Records(records) => records.time(index),
        }
    }

    /// Returns the camera at `index`, from 0, in the scene's world.
    ///
    /// # Errors
    /// There is no such camera, or the file changed since it was opened.
    pub fn camera(&self, index: usize) -> Result<ListedCamera, LoadError> {
        let camera = match &self.cameras {
            Cameras::List(list) => list.get(index).cloned(),
            Cameras::Records(records) => records.read(index)?,
        };
        let camera = camera.ok_or_else(|| {
            LoadError::parse(self.path.display(), format!("there is no camera {}", index + 1))
        })?;
        Ok(camera.in_world(self.up))
    }
}
