//! JSON lines: one camera a line, as computer vision writes it.
//!
//! ```json
//! {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "width": 640, "height": 480, "convention": "opencv",
//!  "world_to_camera": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 4], [0, 0, 0, 1]], "time": 0.5, "file": "a.png"}
//! ```

use std::io::{self, BufRead, BufReader};
use std::path::Path;

use serde::Deserialize;

use super::json;
use super::lens::Lens;
use super::lines::{Lines, read_record_line};
use super::listed_camera::ListedCamera;
use super::matrix::Matrix;
use super::names::picture_name;
use super::picture_size::picture_size;
use super::records::{RecordFile, RecordFormat};
use crate::error::LoadError;
use crate::files::read_file::open_scene_file;
use blinn_scene::{CameraAxes, LightRotation};

/// A line. Other keys are ignored.
#[derive(Deserialize)]
struct CameraLine {
    #[serde(rename = "K")]
    k: Option<Matrix>,
    camera_to_world: Option<Matrix>,
    world_to_camera: Option<Matrix>,
    width: Option<f64>,
    height: Option<f64>,
    convention: Option<String>,
    time: Option<f64>,
    file: Option<String>,
}

/// Opens a file and checks every line. Empty lines are skipped, and cameras without a pose, unless none has one.
pub(super) fn open(path: &Path, limit: u64) -> Result<RecordFile, LoadError> {
    let file = open_scene_file(path, limit)?.into_inner();
    let reader = file.try_clone().map_err(|e| LoadError::io(path, e))?;
    let mut records = RecordFile::new(path, Box::new(JsonLineFormat), file);
    let mut lines = Lines::new(BufReader::new(reader));
    let mut first = None;
    while let Some(line) = lines.next_line().map_err(|e| LoadError::io(path, e))? {
        if !line.text.trim().is_empty() {
            first.get_or_insert(line.number);
            records.add(line.offset, line.text.as_bytes(), &format!("line {}", line.number))?;
        }
    }
    match first {
        Some(number) if records.len() == 0 => Err(LoadError::parse(
            format!("{}, line {number}", path.display()),
            "has no camera_to_world or world_to_camera",
        )),
        _ => Ok(records),
    }
}

/// An object on a line.
#[derive(Debug)]
struct JsonLineFormat;

impl RecordFormat for JsonLineFormat {
    fn read(&self, reader: &mut dyn BufRead) -> io::Result<Vec<u8>> {
        read_record_line(reader)
    }

    fn parse(&self, bytes: &[u8]) -> Result<Option<ListedCamera>, String> {
        json::read_line::<CameraLine>(bytes)?.to_camera()
    }
}

impl CameraLine {
    /// The camera; `None` if its pose is not known.
    fn to_camera(&self) -> Result<Option<ListedCamera>, String> {
        let axes = match self.convention.as_deref() {
            Some("opengl") => CameraAxes::OpenGl,
            Some("opencv") | None => CameraAxes::OpenCv,
            Some(other) => {
                return Err(format!(
                    "convention '{other}' must be \"opengl\" (looks along −Z, y up) or \"opencv\" (looks along +Z, y down)"
                ));
            }
        };
        let named = |key: &'static str| move |defect: String| format!("{key} {defect}");
        let to_world = match (&self.camera_to_world, &self.world_to_camera) {
            (Some(matrix), None) => matrix.to_similarity().map_err(named("camera_to_world"))?,
            (None, Some(matrix)) => matrix.to_similarity().map_err(named("world_to_camera"))?.inverse(),
            (Some(_), Some(_)) => return Err("has camera_to_world and world_to_camera; keep one".into()),
            (None, None) => return Ok(None),
        };
        let k = self.k.as_ref().ok_or("has no K, the 3×3 matrix of focal lengths and principal point")?;
        let lens = Lens::from(k.to_intrinsics().map_err(named("K"))?);
        lens.check().map_err(|defect| format!("K: {defect}"))?;
        if self.time.is_some_and(|time| !time.is_finite()) {
            return Err("time must be a finite number of seconds".into());
        }
        let (view_point, basis) = to_world.camera_pose(axes);
        Ok(Some(ListedCamera {
            name: self.file.as_deref().and_then(picture_name),
            view_point,
            basis,
            lens,
            size: picture_size(self.width, self.height)?,
            time: self.time,
            depth_step: None,
            light: LightRotation::default(),
        }))
    }
}
