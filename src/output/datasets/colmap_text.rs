//! A model of COLMAP as text.

use std::fmt::Write;

use super::colmap_tables::ColmapTables;
use super::pinhole::Pinhole;

/// `cameras.txt`, `images.txt` and `points3D.txt`.
pub(super) fn text_files(model: &ColmapTables) -> [String; 3] {
    [cameras(model), images(model), points(model)]
}

fn cameras(model: &ColmapTables) -> String {
    let mut text = String::from(
        "# Camera list with one line of data per camera:\n\
         #   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n",
    );
    for (id, Pinhole { fx, fy, cx, cy, width, height }) in (model.first_id..).zip(&model.cameras) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{id} PINHOLE {width} {height} {fx} {fy} {cx} {cy}");
    }
    text
}

fn images(model: &ColmapTables) -> String {
    let mut text = String::from(
        "# Image list with two lines of data per image:\n\
         #   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n\
         #   POINTS2D[] as (X, Y, POINT3D_ID)\n",
    );
    for (id, image) in (model.first_id..).zip(&model.images) {
        let ([qw, qx, qy, qz], [tx, ty, tz]) = (image.quaternion, image.translation);
        let _ = writeln!(text, "{id} {qw} {qx} {qy} {qz} {tx} {ty} {tz} {} {}", image.camera_id, image.name);
        let points: Vec<String> =
            image.points.iter().map(|(pixel, id)| format!("{} {} {id}", pixel.x, pixel.y)).collect();
        let _ = writeln!(text, "{}", points.join(" "));
    }
    text
}

fn points(model: &ColmapTables) -> String {
    let mut text = String::from(
        "# 3D point list with one line of data per point:\n\
         #   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
    );
    for (i, point) in model.points.iter().enumerate() {
        let ([x, y, z], [r, g, b]) = (point.position, point.color);
        let _ = write!(text, "{} {x} {y} {z} {r} {g} {b} 0", i + 1);
        for (image, index) in &point.track {
            let _ = write!(text, " {image} {index}");
        }
        text.push('\n');
    }
    text
}
