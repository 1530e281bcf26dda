//! Points and lines with options of pictures: clipping planes, ground, transparent backgrounds, Cryptomatte.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use image::RgbaImage;
use serde_json::Value;

use crate::common::program::*;
use crate::edges::coverage;
use crate::image_output::{ranks, read_exr, text};

/// A camera that sees 4 m × 4 m about the origin, in 64 × 64 pixels.
const FRONT: &str =
    "--view-point 0,0,9 --look-at 0,0,0 --projection orthographic --view-rect -2,2,-2,2 --size 64x64";
/// Pixels per metre of [`FRONT`].
const SCALE: f64 = 16.0;

/// Writes red points, and a line between the first two.
fn write(folder: &Path, points: &[[f64; 3]], has_line: bool) {
    let mut content: String = points.iter().map(|[x, y, z]| format!("v {x} {y} {z} 1 0 0\n")).collect();
    content += if has_line { "o line\nl 1 2\n" } else { "" };
    content += "o points\np";
    (1..=points.len()).for_each(|i| content += &format!(" {i}"));
    fs::write(folder.join("a.obj"), content + "\n").unwrap();
}

fn render(folder: &Path, options: &str) -> RgbaImage {
    runs(folder, &format!("render a.obj -o a.png {options}"));
    image::open(folder.join("a.png")).unwrap().into_rgba8()
}

#[test]
fn clipping_planes_cut_points_and_lines() {
    let (_dir, at) = folder();
    // At depths of 9, 7 and 5; the line runs from 9 to 7.
    write(&at, &[[-1.0, 0.5, 0.0], [0.0, 0.5, 2.0], [1.0, 0.5, 4.0]], true);
    let options = format!("{FRONT} -s 16 --background transparent --line-width .1");
    let covered = |clip: &str, left: u32| {
        let picture = render(&at, &format!("{options} --point-size .5 {clip}"));
        coverage(&image::imageops::crop_imm(&picture, left, 0, 12, 64).to_image())
    };
    // The columns about each point.
    let columns = [10, 26, 42];
    let disc = PI * (0.25 * SCALE).powi(2);
    for (clip, seen) in [
        ("--clip off", [true, true, true]),
        ("--clip 6,8", [false, true, false]),
        ("--clip 4,6", [false, false, true]),
        ("--clip 8,10", [true, false, false]),
    ] {
        for (left, is_seen) in columns.into_iter().zip(seen) {
            let area = covered(clip, left);
            // Beside it lies a part of the line, 1.6 pixels wide.
            assert_eq!(area > 0.9 * disc, is_seen, "{clip} {left}: {area}");
        }
    }
    // Half of the line between the discs is nearer than 8.
    let between = |clip: &str| {
        let picture = render(&at, &format!("{options} --point-size off {clip}"));
        coverage(&picture)
    };
    let ratio = between("--clip 1,8") / between("--clip off");
    assert!((ratio - 0.5).abs() < 0.05, "{ratio}");
}

#[test]
fn transparent_pictures_have_the_colour_of_points_at_their_rims() {
    let (_dir, at) = folder();
    write(&at, &[[0.03, 0.52, 0.0], [-1.0, -1.0, 0.0]], false);
    for (options, expected) in [("--point-size .5", 2.0 * PI * 16.0), ("--point-size 8px", 2.0 * PI * 16.0)] {
        let picture = render(&at, &format!("{FRONT} -s 64 --filter box --background transparent {options}"));
        let area = coverage(&picture);
        assert!((area / expected - 1.0).abs() < 0.02, "{options}: {area}, not {expected}");
        let rim = picture.pixels().filter(|pixel| (1..255).contains(&pixel[3])).count();
        assert!(rim > 20, "{rim}");
        for pixel in picture.pixels().filter(|pixel| pixel[3] > 0) {
            assert_eq!(pixel.0[..3], [255, 0, 0], "{pixel:?}");
        }
    }
}

/// Points above a ground look as without one, and those of a size in metres throw shadows on it.
#[test]
fn points_stand_above_a_ground() {
    let (_dir, at) = folder();
    write(&at, &[[0.0, -1.0, 0.0], [0.0, 0.5, 0.0], [0.7, 0.5, 0.4]], true);
    let options =
        "--view-point 0,3,9 --look-at 0,0,0 --yfov 30 --size 64x64 -s 16 --lights none --sun 0,-1,-.3,3";
    let is_red = |pixel: &image::Rgba<u8>| pixel.0 == [255, 0, 0, 255];
    let upper = |picture: &RgbaImage| {
        let (width, height) = picture.dimensions();
        let half = image::imageops::crop_imm(picture, 0, 0, width, height / 2).to_image();
        half.pixels().filter(|pixel| is_red(pixel)).count()
    };
    let shadows =
        |picture: &RgbaImage| picture.pixels().filter(|pixel| pixel[3] > 40 && pixel[0] < 100).count();
    let mut counts = Vec::new();
    for size in [".4", "6px"] {
        let sizes = format!("--point-size {size} --line-width off");
        let alone = render(&at, &format!("{options} {sizes} --background transparent"));
        let on_plane = render(&at, &format!("{options} {sizes} --ground plane"));
        let on_catcher = render(&at, &format!("{options} {sizes} --ground shadow --background transparent"));
        assert!(upper(&alone) > 20);
        assert_eq!([upper(&on_plane), upper(&on_catcher)], [upper(&alone); 2], "{size}");
        counts.push(shadows(&on_catcher));
    }
    assert!(counts[0] > 10 && counts[1] == 0, "{counts:?}");
}

#[test]
fn mattes_of_points_know_clipping_planes_and_grounds() {
    let (_dir, at) = folder();
    write(&at, &[[0.0, 0.5, 0.0], [1.0, -1.0, 4.0]], true);
    let disc = PI * (0.25 * SCALE).powi(2);
    for (options, points, has_line) in [
        ("--line-width off", 2.0 * disc, false),
        ("--line-width off --clip 7,12", disc, false),
        ("--line-width off --ground plane", 2.0 * disc, false),
        ("--line-width .02", 2.0 * disc, true),
    ] {
        let flags = format!("{FRONT} -s 64 --filter box --point-size .5 --aov cryptomatte {options}");
        runs(&at, &format!("render a.obj -o a.exr {flags}"));
        let image = read_exr(&at.join("a.exr"));
        let manifest: Value = serde_json::from_str(&text(&image, "cryptomatte/f834d0a/manifest")).unwrap();
        let ranked = ranks(&image, "crypto_object", 64 * 64);
        let area = |name: &str| -> f64 {
            let Some(id) = manifest[name].as_str() else { return 0.0 };
            let id = u32::from_str_radix(id, 16).unwrap();
            ranked.iter().flatten().filter(|(rank, _)| *rank == id).map(|(_, part)| f64::from(*part)).sum()
        };
        assert!((area("points") / points - 1.0).abs() < 0.05, "{options}: {}", area("points"));
        assert_eq!(area("line") > 1.0, has_line, "{options}");
    }
}

/// The masks of COCO and BOP are those of the layer of objects: points and lines have some, and hide what is behind them.
#[test]
fn datasets_have_masks_of_points_and_lines() {
    let (_dir, at) = folder();
    // Points and a line in front of a triangle, seen from both sides.
    let content = "o triangle\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n\
                   o points\nv 0 0 .4\nv 0 0 -.4\np 4 5\n\
                   o line\nv -.5 -.5 .4\nv .5 -.5 .4\nl 6 7\n";
    fs::write(at.join("a.obj"), content).unwrap();
    for sizes in ["", "--point-size .2 --line-width 3px"] {
        let line =
            format!("turntable a.obj --views 3 --size 48x36 -s 1 --aov object-id --dataset bop,coco {sizes}");
        runs(&at, &format!("{line} -o data/"));
        let scene = at.join("data/train/000001");
        let json = |file: &str| -> Value {
            serde_json::from_str(&fs::read_to_string(scene.join(file)).unwrap()).unwrap()
        };
        let coco = json("rgb/annotations.json");
        let poses = json("scene_gt.json");
        let mut found = [0; 3];
        for view in 1..=3u64 {
            let ids = png_indices(&scene.join(format!("layers/{view:06}.object-id.png")));
            for object in 1..=3u8 {
                let pixels = ids.iter().filter(|id| **id == object).count();
                found[usize::from(object) - 1] += pixels;
                let area: u64 = coco["annotations"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .filter(|row| row["image_id"] == view && row["object_id"] == object)
                    .map(|row| row["area"].as_u64().unwrap())
                    .sum();
                assert_eq!(area, pixels as u64, "{sizes} view {view} object {object}");
            }
            // Only the triangle has a model, so only it has a pose and masks.
            let posed = poses[view.to_string()].as_array().unwrap();
            assert!(posed.iter().all(|row| row["obj_id"] == 1), "{posed:?}");
            assert!(!scene.join(format!("mask/{view:06}_{:06}.png", posed.len())).exists());
        }
        assert!(found.iter().all(|pixels| *pixels > 4), "{found:?}");
        fs::remove_dir_all(at.join("data")).unwrap();
    }
}

/// The pixels of a palette image.
fn png_indices(path: &Path) -> Vec<u8> {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}
