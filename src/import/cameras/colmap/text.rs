//! `cameras.txt` and `images.txt`.

use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::str::SplitAsciiWhitespace;

use glam::DVec3;

use super::camera_models::{MAX_PARAMETERS, camera_lens};
use super::image_pose::{ImagePose, LensesById};
use crate::cameras::lines::{Line, Lines, read_record_line};
use crate::cameras::listed_camera::{ListedCamera, MAX_CAMERAS};
use crate::cameras::records::{RecordFile, RecordFormat};
use crate::error::LoadError;
use crate::files::read_file::open_scene_file;

/// Loads the lenses: lines of CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS.
pub(super) fn load_lenses(path: &Path, limit: u64) -> Result<LensesById, LoadError> {
    let mut lines = Lines::new(BufReader::new(open_scene_file(path, limit)?));
    let mut lenses = LensesById::new();
    while let Some(line) = lines.next_line().map_err(|e| LoadError::io(path, e))? {
        if is_comment(&line.text) {
            continue;
        }
        let located =
            |text: String| LoadError::parse(format!("{}, line {}", path.display(), line.number), text);
        let mut words = line.text.split_ascii_whitespace();
        let id = number::<u32>(&mut words, "CAMERA_ID").map_err(located)?;
        let model = words.next().ok_or_else(|| located("has no MODEL".into()))?;
        let width = number(&mut words, "WIDTH").map_err(located)?;
        let height = number(&mut words, "HEIGHT").map_err(located)?;
        let mut parameters = Vec::new();
        for word in words {
            let parameter = word.parse().map_err(|_| located(format!("'{word}' is not a number")))?;
            if parameters.len() == MAX_PARAMETERS {
                return Err(located(format!("has more than {MAX_PARAMETERS} parameters")));
            }
            parameters.push(parameter);
        }
        LoadError::check_limit("number of cameras", lenses.len() as u64 + 1, MAX_CAMERAS as u64)?;
        lenses.insert(id, camera_lens(id, model, width, height, &parameters));
    }
    Ok(lenses)
}

/// Opens the images: a line with the pose for each, and a line with points, which some programs leave out.
pub(super) fn open_images(path: &Path, lenses: LensesById, limit: u64) -> Result<RecordFile, LoadError> {
    let file = open_scene_file(path, limit)?.into_inner();
    let io_error = |e| LoadError::io(path, e);
    let reader = file.try_clone().map_err(io_error)?;
    let mut records = RecordFile::new(path, Box::new(ImageLine(lenses)), file);
    let mut lines = Lines::new(BufReader::new(reader));
    let mut follows_image = false;
    while let Some(line) = lines.next_line_or_start().map_err(io_error)? {
        let is_points = follows_image && is_points(&line);
        follows_image = false;
        if is_points || is_comment(&line.text) {
            continue;
        }
        let place = format!("line {}", line.number);
        if !line.is_whole {
            let text = "expected an image, IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
            return Err(LoadError::parse(format!("{}, {place}", path.display()), text));
        }
        records.add(line.offset, line.text.as_bytes(), &place)?;
        follows_image = true;
    }
    Ok(records)
}

/// Returns true for a line of points, X Y POINT3D_ID each, perhaps of none. Names of images are no numbers, and numbers
/// of images no whole triples.
fn is_points(line: &Line) -> bool {
    let mut words: Vec<&str> = line.text.split_ascii_whitespace().collect();
    if !line.is_whole {
        // The last word may be cut, and the last triple incomplete.
        words.pop();
        words.truncate(words.len() / 3 * 3);
    }
    words.len().is_multiple_of(3)
        && words.chunks_exact(3).all(|point| {
            let is_number = |word: &str| word.parse::<f64>().is_ok();
            is_number(point[0]) && is_number(point[1]) && point[2].parse::<i64>().is_ok()
        })
}

/// The line of an image with its pose.
#[derive(Debug)]
struct ImageLine(LensesById);

impl RecordFormat for ImageLine {
    fn read(&self, reader: &mut dyn BufRead) -> io::Result<Vec<u8>> {
        read_record_line(reader)
    }

    fn parse(&self, bytes: &[u8]) -> Result<Option<ListedCamera>, String> {
        parse_line(&String::from_utf8_lossy(bytes), &self.0).map(Some)
    }
}

/// Parses a line of IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME.
fn parse_line(text: &str, lenses: &LensesById) -> Result<ListedCamera, String> {
    let mut words = text.split_ascii_whitespace();
    number::<u64>(&mut words, "IMAGE_ID")?;
    let [w, x, y, z] = numbers(&mut words, ["QW", "QX", "QY", "QZ"])?;
    let translation = numbers(&mut words, ["TX", "TY", "TZ"])?;
    let camera_id = number(&mut words, "CAMERA_ID")?;
    // Names may have blanks.
    let name = text_after(text, 9);
    let pose =
        ImagePose { quaternion: [w, x, y, z], translation: DVec3::from_array(translation), camera_id, name };
    pose.to_camera(lenses)
}

fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    line.is_empty() || line.starts_with('#')
}

fn number<T: std::str::FromStr>(words: &mut SplitAsciiWhitespace, name: &str) -> Result<T, String> {
    let word = words.next().ok_or_else(|| format!("has no {name}"))?;
    word.parse().map_err(|_| format!("{name} '{word}' is not a number of its kind"))
}

fn numbers<const N: usize>(words: &mut SplitAsciiWhitespace, names: [&str; N]) -> Result<[f64; N], String> {
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        *value = number(words, name)?;
    }
    Ok(values)
}

/// The text after a number of words, without blanks around it.
fn text_after(text: &str, words: usize) -> &str {
    let mut rest = text.trim_ascii();
    for _ in 0..words {
        rest = rest.find(|c: char| c.is_ascii_whitespace()).map_or("", |end| rest[end..].trim_ascii_start());
    }
    rest
}
