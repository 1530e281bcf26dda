//! A model of COLMAP as binary files, little-endian, after `reconstruction_io_binary.cc` of COLMAP.

use super::colmap_tables::ColmapTables;
use super::pinhole::Pinhole;

/// The number of the camera model `PINHOLE`.
const PINHOLE: i32 = 1;

/// `cameras.bin`, `images.bin` and `points3D.bin`.
pub(super) fn binary_files(model: &ColmapTables) -> [Vec<u8>; 3] {
    [cameras(model), images(model), points(model)]
}

fn cameras(model: &ColmapTables) -> Vec<u8> {
    let mut bytes = count(model.cameras.len());
    for (id, Pinhole { fx, fy, cx, cy, width, height }) in (model.first_id..).zip(&model.cameras) {
        bytes.extend(id.to_le_bytes());
        bytes.extend(PINHOLE.to_le_bytes());
        bytes.extend(u64::from(*width).to_le_bytes());
        bytes.extend(u64::from(*height).to_le_bytes());
        add_floats(&mut bytes, &[*fx, *fy, *cx, *cy]);
    }
    bytes
}

fn images(model: &ColmapTables) -> Vec<u8> {
    let mut bytes = count(model.images.len());
    for (id, image) in (model.first_id..).zip(&model.images) {
        bytes.extend(id.to_le_bytes());
        add_floats(&mut bytes, &image.quaternion);
        add_floats(&mut bytes, &image.translation);
        bytes.extend(image.camera_id.to_le_bytes());
        bytes.extend(image.name.as_bytes());
        bytes.push(0);
        bytes.extend(count(image.points.len()));
        for (pixel, id) in &image.points {
            add_floats(&mut bytes, &pixel.to_array());
            bytes.extend(id.to_le_bytes());
        }
    }
    bytes
}

fn points(model: &ColmapTables) -> Vec<u8> {
    let mut bytes = count(model.points.len());
    for (i, point) in model.points.iter().enumerate() {
        bytes.extend((i as u64 + 1).to_le_bytes());
        add_floats(&mut bytes, &point.position);
        bytes.extend(point.color);
        // The error.
        add_floats(&mut bytes, &[0.0]);
        bytes.extend(count(point.track.len()));
        for (image, index) in &point.track {
            bytes.extend(image.to_le_bytes());
            bytes.extend(index.to_le_bytes());
        }
    }
    bytes
}

/// The length of a list.
fn count(length: usize) -> Vec<u8> {
    (length as u64).to_le_bytes().to_vec()
}

fn add_floats(bytes: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
}
