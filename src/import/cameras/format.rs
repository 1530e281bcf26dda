//! Detects the format of a list of cameras.

use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, Visitor};

use super::colmap::ColmapModel;
use super::json;
use super::json_numbers::replace_non_finite;
use super::lines::MAX_LINE;
use crate::error::LoadError;
use crate::files::read_file::open_scene_file;

/// The format of a list, and its files.
#[derive(Debug)]
pub(super) enum CameraFormat {
    Transforms(PathBuf),
    Bop(PathBuf),
    JsonLines(PathBuf),
    Colmap(ColmapModel),
}

/// The supported formats, for errors.
const EXPECTED: &str = "expected transforms.json (with frames), BOP's scene_camera.json (with cam_K for each image \
                        id), JSON lines (with K and camera_to_world or world_to_camera), or the folder of a COLMAP model";

impl CameraFormat {
    /// Detects the format of a file from its contents, and of a folder from the files in it.
    pub fn detect(path: &Path, limit: u64) -> Result<CameraFormat, LoadError> {
        if path.is_dir() {
            return CameraFormat::in_folder(path, limit);
        }
        if let Some(model) = ColmapModel::of_file(path) {
            return Ok(CameraFormat::Colmap(model));
        }
        let mut reader = BufReader::new(open_scene_file(path, limit)?);
        let io_error = |e| LoadError::io(path, e);
        let mut first = Vec::new();
        // The first line that is not empty.
        while without_mark(&first).is_empty() {
            first.clear();
            if (&mut reader).take(MAX_LINE as u64).read_until(b'\n', &mut first).map_err(io_error)? == 0 {
                return Err(LoadError::parse(path.display(), format!("the file is empty; {EXPECTED}")));
            }
        }
        if first.starts_with(b"\xff\xfe") || first.starts_with(b"\xfe\xff") {
            return Err(LoadError::parse(path.display(), "the text is UTF-16; save it as UTF-8"));
        }
        let line = without_mark(&first);
        if !line.starts_with(b"{") {
            return Err(LoadError::parse(path.display(), format!("no list of cameras; {EXPECTED}")));
        }
        let kind = match serde_json::from_slice::<Keys>(&replace_non_finite(line)) {
            Ok(keys) => keys.kind,
            Err(error) if error.is_eof() => match json::read_document::<Keys>(path, limit)?.kind {
                Some(Kind::Line) => {
                    let text =
                        "a camera of JSON lines must be on one line; write {\"K\": …} without line breaks";
                    return Err(LoadError::parse(path.display(), text));
                }
                kind => kind,
            },
            // Its line and column are those of the file, except for blank lines before.
            Err(error) => return Err(LoadError::parse(path.display(), error)),
        };
        let file = path.to_path_buf();
        match kind {
            Some(Kind::Transforms) => Ok(CameraFormat::Transforms(file)),
            Some(Kind::Bop) => Ok(CameraFormat::Bop(file)),
            Some(Kind::Line) => Ok(CameraFormat::JsonLines(file)),
            None => Err(LoadError::parse(path.display(), format!("no list of cameras; {EXPECTED}"))),
        }
    }

    /// The one list in a folder.
    fn in_folder(folder: &Path, limit: u64) -> Result<CameraFormat, LoadError> {
        let models = ["", "sparse/0", "sparse"].map(|inside| folder.join(inside));
        let model = models.iter().find_map(|inside| ColmapModel::in_folder(inside));
        let files = ["transforms.json", "scene_camera.json"].map(|name| folder.join(name));
        let files: Vec<&PathBuf> = files.iter().filter(|file| file.is_file()).collect();
        match (model, &files[..]) {
            (Some(model), []) => Ok(CameraFormat::Colmap(model)),
            (None, [file]) => CameraFormat::detect(file, limit),
            (None, []) => Err(LoadError::parse(
                folder.display(),
                "the folder has no COLMAP model (cameras.txt and images.txt, or .bin), transforms.json or \
                 scene_camera.json",
            )),
            (Some(model), [file, ..]) => Err(several(folder, &model.images, file)),
            (None, [first, second, ..]) => Err(several(folder, first, second)),
        }
    }

    /// The file with the poses.
    pub fn file(&self) -> &Path {
        match self {
            CameraFormat::Transforms(file) | CameraFormat::Bop(file) | CameraFormat::JsonLines(file) => file,
            CameraFormat::Colmap(model) => &model.images,
        }
    }
}

/// A line without byte order mark and blanks around it.
fn without_mark(line: &[u8]) -> &[u8] {
    line.strip_prefix(json::BYTE_ORDER_MARK).unwrap_or(line).trim_ascii()
}

fn several(folder: &Path, a: &Path, b: &Path) -> LoadError {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    LoadError::parse(
        folder.display(),
        format!("the folder has {} and {}; name one of them", name(a), name(b)),
    )
}

/// The format that the keys of a JSON object show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Transforms,
    Bop,
    Line,
}

/// The keys of a JSON object.
struct Keys {
    kind: Option<Kind>,
}

impl<'de> Deserialize<'de> for Keys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Keys, D::Error> {
        struct KeysVisitor;
        impl<'de> Visitor<'de> for KeysVisitor {
            type Value = Keys;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Keys, A::Error> {
                let mut found = None;
                let mut are_ids = true;
                while let Some(key) = map.next_key::<String>()? {
                    are_ids &= key.bytes().all(|b| b.is_ascii_digit()) && !key.is_empty();
                    found = found.or(match key.as_str() {
                        "frames" | "camera_angle_x" | "fl_x" => Some(Kind::Transforms),
                        "K" | "camera_to_world" | "world_to_camera" => Some(Kind::Line),
                        _ => None,
                    });
                    map.next_value::<IgnoredAny>()?;
                }
                Ok(Keys { kind: found.or(are_ids.then_some(Kind::Bop)) })
            }
        }
        deserializer.deserialize_map(KeysVisitor)
    }
}
