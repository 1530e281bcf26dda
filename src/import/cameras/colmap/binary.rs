//! `cameras.bin` and `images.bin`, little-endian.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use glam::DVec3;

use super::camera_models::{camera_lens, model_name, parameter_count};
use super::image_pose::{ImagePose, LensesById};
use crate::cameras::listed_camera::{ListedCamera, MAX_CAMERAS};
use crate::cameras::records::{RecordFile, RecordFormat};
use crate::error::LoadError;
use crate::files::read_file::open_scene_file;

/// Bytes of an image before its name: id, quaternion, translation and camera id.
const POSE_BYTES: usize = 4 + 7 * 8 + 4;
/// Longest name in bytes, with its end.
const MAX_NAME: u64 = 4096;
/// Bytes of a point of an image.
const POINT_BYTES: u64 = 24;

/// Loads the lenses.
pub(super) fn load_lenses(path: &Path, limit: u64) -> Result<LensesById, LoadError> {
    let mut reader = BufReader::new(open_scene_file(path, limit)?);
    let io_error = |e| truncated(path, e);
    let count = u64::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
    LoadError::check_limit("number of cameras", count, MAX_CAMERAS as u64)?;
    let mut lenses = LensesById::new();
    for index in 0..count {
        let id = u32::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
        let model = i32::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
        let width = u64::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
        let height = u64::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
        // Without the number of parameters, the next camera cannot be found.
        let (Some(parameter_count), Some(name)) = (parameter_count(model), model_name(model)) else {
            return Err(LoadError::parse(
                format!("{}, camera {} of {count}", path.display(), index + 1),
                format!(
                    "camera {id} has the unknown model {model}; undistort the images with colmap image_undistorter"
                ),
            ));
        };
        let mut parameters = Vec::with_capacity(parameter_count);
        for _ in 0..parameter_count {
            parameters.push(f64::from_le_bytes(read_array(&mut reader).map_err(io_error)?));
        }
        lenses.insert(id, camera_lens(id, name, width as f64, height as f64, &parameters));
    }
    Ok(lenses)
}

/// Opens the images.
pub(super) fn open_images(path: &Path, lenses: LensesById, limit: u64) -> Result<RecordFile, LoadError> {
    let file = open_scene_file(path, limit)?.into_inner();
    let io_error = |e| truncated(path, e);
    let reader = file.try_clone().map_err(io_error)?;
    let size = reader.metadata().map_err(io_error)?.len();
    let mut reader = BufReader::new(reader);
    let mut records = RecordFile::new(path, Box::new(ImageRecord(lenses)), file);
    let count = u64::from_le_bytes(read_array(&mut reader).map_err(io_error)?);
    LoadError::check_limit("number of images", count, MAX_CAMERAS as u64)?;
    let mut offset = 8;
    for index in 0..count {
        let place = format!("image {} of {count}", index + 1);
        let located = |text: String| LoadError::parse(format!("{}, {place}", path.display()), text);
        let bytes = read_image(&mut reader).map_err(|e| located(truncation(&e)))?;
        records.add(offset, &bytes, &place)?;
        let points: [u8; 8] = read_array(&mut reader).map_err(|e| located(truncation(&e)))?;
        let points = u64::from_le_bytes(points);
        let after = points.checked_mul(POINT_BYTES).and_then(|skipped| {
            let after = (offset + bytes.len() as u64 + 8).checked_add(skipped)?;
            (after <= size).then_some((skipped, after))
        });
        let Some((skipped, after)) = after else {
            return Err(located(format!("the file ends before the {points} points of the image")));
        };
        reader.seek_relative(skipped as i64).map_err(io_error)?;
        offset = after;
    }
    Ok(records)
}

/// An image up to the end of its name.
#[derive(Debug)]
struct ImageRecord(LensesById);

impl RecordFormat for ImageRecord {
    fn read(&self, reader: &mut dyn BufRead) -> io::Result<Vec<u8>> {
        read_image(reader)
    }

    fn parse(&self, bytes: &[u8]) -> Result<Option<ListedCamera>, String> {
        parse_image(bytes, &self.0).map(Some)
    }
}

/// Reads the bytes of an image up to the end of its name.
fn read_image(reader: &mut dyn BufRead) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; POSE_BYTES];
    reader.read_exact(&mut bytes)?;
    reader.take(MAX_NAME).read_until(0, &mut bytes)?;
    if bytes.last() != Some(&0) || bytes.len() == POSE_BYTES {
        let text = format!("the name of the image does not end within {MAX_NAME} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
    Ok(bytes)
}

/// Parses what [`read_image`] reads.
fn parse_image(bytes: &[u8], lenses: &LensesById) -> Result<ListedCamera, String> {
    let (_, name) = bytes.split_at_checked(POSE_BYTES).ok_or("the image is truncated")?;
    let field = |at: usize| -> [u8; 8] { std::array::from_fn(|i| bytes[at + i]) };
    let float = |i: usize| f64::from_le_bytes(field(4 + 8 * i));
    let camera_id = u32::from_le_bytes(std::array::from_fn(|i| bytes[POSE_BYTES - 4 + i]));
    let name = String::from_utf8_lossy(name.strip_suffix(&[0]).unwrap_or(name));
    let pose = ImagePose {
        quaternion: [float(0), float(1), float(2), float(3)],
        translation: DVec3::new(float(4), float(5), float(6)),
        camera_id,
        name: &name,
    };
    pose.to_camera(lenses)
}

fn read_array<const N: usize>(reader: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn truncation(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "the file is truncated".into(),
        _ => error.to_string(),
    }
}

fn truncated(path: &Path, error: io::Error) -> LoadError {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => LoadError::parse(path.display(), "the file is truncated"),
        _ => LoadError::io(path, error),
    }
}
