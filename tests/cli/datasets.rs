//! `turntable --views`: the guarantees for readers of datasets.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use glam::{DMat4, DVec3, DVec4};
use serde_json::Value;

use crate::common::program::*;

/// An asymmetric box.
const LOW: DVec3 = DVec3::new(-1.0, 0.0, -3.0);
const HIGH: DVec3 = DVec3::new(2.0, 1.0, 0.5);
const SMALL: &str = "--size 48x36 -s 1";

fn write_box(folder: &Path) {
    let mut text = String::new();
    for i in 0..8 {
        let pick = |bit: usize, low: f64, high: f64| if i & bit > 0 { high } else { low };
        let (x, y, z) = (pick(1, LOW.x, HIGH.x), pick(2, LOW.y, HIGH.y), pick(4, LOW.z, HIGH.z));
        text += &format!("v {x} {y} {z}\n");
    }
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(folder.join("box.obj"), text).unwrap();
}

fn transforms(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("transforms.json")).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn matrix(frame: &Value) -> DMat4 {
    let rows = frame["transform_matrix"].as_array().unwrap().iter();
    let rows: Vec<Vec<f64>> = rows.map(|row| row.as_array().unwrap().iter().map(number).collect()).collect();
    assert!(rows.len() == 4 && rows.iter().all(|row| row.len() == 4));
    DMat4::from_cols_array(&std::array::from_fn(|i| rows[i % 4][i / 4]))
}

/// From the dataset's world frame to the file's.
fn from_z_up(p: DVec3) -> DVec3 {
    DVec3::new(p.x, p.z, -p.y)
}

/// The point of a depth value in the dataset's world frame: a pinhole camera with OpenGL's axes.
fn point(all: &Value, to_world: &DMat4, i: u32, j: u32, depth: f64) -> DVec3 {
    let x = (f64::from(i) + 0.5 - number(&all["cx"])) / number(&all["fl_x"]);
    let y = (f64::from(j) + 0.5 - number(&all["cy"])) / number(&all["fl_y"]);
    (*to_world * DVec4::new(x * depth, -y * depth, -depth, 1.0)).truncate()
}

/// The signed distance from the box's surface, and the normal of the nearest side.
fn side(p: DVec3) -> (f64, DVec3) {
    let sides = [
        (p.x - HIGH.x, DVec3::X),
        (LOW.x - p.x, DVec3::NEG_X),
        (p.y - HIGH.y, DVec3::Y),
        (LOW.y - p.y, DVec3::NEG_Y),
        (p.z - HIGH.z, DVec3::Z),
        (LOW.z - p.z, DVec3::NEG_Z),
    ];
    // Outside the nearest side's plane by this distance, inside all others.
    sides.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

fn beside(folder: &Path, frame: &Value, key: &str) -> image::DynamicImage {
    let name = frame[key].as_str().unwrap_or_else(|| panic!("{frame} has no {key}"));
    image::open(folder.join(name)).unwrap()
}

/// Every depth lies on the mesh, computed from `transforms.json` alone.
#[test]
fn depths_lie_on_the_mesh() {
    let (_dir, at) = folder();
    write_box(&at);
    for (flags, z_up) in [
        ("", true),
        ("--world-up y", false),
        ("--world-up z --crop 9,5,31,22 --yfov 50 --look-at .2,.3,-1", true),
        ("--view-width 1.2 --view-height .7", true),
    ] {
        let to_file = |p: DVec3| if z_up { from_z_up(p) } else { p };
        runs(&at, &format!("turntable box.obj --views 7 {SMALL} {flags} -q -o ds/v_##.png"));
        let (folder, all) = (at.join("ds"), transforms(&at.join("ds")));
        let (w, h) = (number(&all["w"]), number(&all["h"]));
        let expected = 2.0 * (0.5 * w / number(&all["fl_x"])).atan();
        assert!((number(&all["camera_angle_x"]) - expected).abs() < 1e-12);
        let corner = |i: usize| DVec3::from_array(std::array::from_fn(|k| number(&all["aabb"][i][k])));
        let (low, high) = (to_file(corner(0)), to_file(corner(1)));
        assert!(low.min(high) == LOW && low.max(high) == HIGH && corner(0).cmple(corner(1)).all());
        let step = number(&all["integer_depth_scale"]);
        let frames = all["frames"].as_array().unwrap();
        assert_eq!(frames.len(), 7);
        let mut seen = BTreeSet::new();
        for (i, frame) in frames.iter().enumerate() {
            assert_eq!(frame["file_path"], format!("v_0{}.png", i + 1));
            let picture = beside(&folder, frame, "file_path");
            assert_eq!((f64::from(picture.width()), f64::from(picture.height())), (w, h));
            let depths = match beside(&folder, frame, "depth_path") {
                image::DynamicImage::ImageLuma16(depths) => depths,
                other => panic!("{:?} is not 16-bit grey", other.color()),
            };
            assert_eq!(frame["depth_file_path"], frame["depth_path"]);
            let normals = beside(&folder, frame, "normal_file_path").into_rgb8();
            // nerfstudio rejects masks with several channels.
            let mask = match beside(&folder, frame, "mask_path") {
                image::DynamicImage::ImageLuma8(mask) => mask,
                other => panic!("{:?} is not 8-bit grey", other.color()),
            };
            let to_world = matrix(frame);
            let mut hits = 0;
            for (i, j, depth) in depths.enumerate_pixels() {
                assert_eq!(mask.get_pixel(i, j).0[0] > 0, depth.0[0] > 0);
                if depth.0[0] == 0 {
                    continue;
                }
                hits += 1;
                let p = point(&all, &to_world, i, j, f64::from(depth.0[0]) * step);
                let (off, side) = side(to_file(p));
                assert!(off.abs() < step, "{flags}: {p} is off by {off}, {step} a step");
                // The normal is in the same frame; near an edge it may be the other side's.
                let n = DVec3::from_array(normals.get_pixel(i, j).0.map(|v| f64::from(v) / 127.5 - 1.0));
                let inside = side_distance(to_file(p));
                assert!(to_file(n).dot(side) > 0.98 || inside < 2.0 * step, "{flags}: {n} at {p}");
                seen.insert(side.to_array().map(|v| v as i32));
            }
            assert!(hits > 50, "{flags}: {hits} pixels see it");
        }
        assert_eq!(seen.len(), 6, "{flags}: from all around, all sides are seen");
    }
}

/// Depths of points of a pixel are half a pixel from their centres.
#[test]
fn depths_of_a_cloud_agree_with_its_points() {
    let (_dir, at) = folder();
    // The golden angle spreads points evenly over a sphere.
    let cloud: Vec<DVec3> = (0..400)
        .map(|i| {
            let (y, angle) = (1.0 - (2.0 * f64::from(i) + 1.0) / 400.0, 2.399_963 * f64::from(i));
            let r = (1.0 - y * y).sqrt();
            DVec3::new(r * angle.cos(), y, 0.5 * r * angle.sin())
        })
        .collect();
    let lines: String = cloud.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    let indices: String = (1..=cloud.len()).map(|i| format!("p {i}\n")).collect();
    fs::write(at.join("cloud.obj"), lines + &indices).unwrap();
    for (size, pixels) in [("1px", 1.0), ("3px", 3.0)] {
        let flags = format!("--size 96x72 -s 1 --aov depth --point-size {size}");
        runs(&at, &format!("turntable cloud.obj --views 3 {flags} -q -o ds/#.exr"));
        let all = transforms(&at.join("ds"));
        let mut hits = 0;
        for frame in all["frames"].as_array().unwrap() {
            let image =
                crate::image_output::read_exr(&at.join("ds").join(frame["file_path"].as_str().unwrap()));
            let depths = crate::image_output::channel(&image, "depth.Z");
            let to_world = matrix(frame);
            for (k, depth) in (0..).zip(depths).filter(|(_, depth)| depth.is_finite()) {
                let depth = f64::from(depth);
                let p = from_z_up(point(&all, &to_world, k % 96, k / 96, depth));
                let off = cloud.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
                // The radius is that at the centre, which is a little farther away than the surface.
                let radius = 0.5 * pixels * depth / number(&all["fl_x"]);
                assert!(off < 1.05 * radius, "{size}: {off} {radius}");
                hits += 1;
            }
        }
        assert!(hits > 200, "{size}: {hits}");
    }
}

/// The distance of a point on the box from its nearest edge.
fn side_distance(p: DVec3) -> f64 {
    let mut to_sides = [p - LOW, HIGH - p].map(|d| d.abs().to_array()).concat();
    to_sides.sort_by(f64::total_cmp);
    to_sides[1]
}

#[test]
fn an_exr_contains_its_aovs() {
    let (_dir, at) = folder();
    write_box(&at);
    runs(&at, &format!("turntable box.obj --views 2 {SMALL} -q -o ds/#.exr"));
    assert_eq!(names(&at.join("ds")), ["1.exr", "2.exr", "transforms.json"]);
    let all = transforms(&at.join("ds"));
    assert!(all.get("integer_depth_scale").is_none());
    for frame in all["frames"].as_array().unwrap() {
        assert!(frame.get("depth_path").is_none());
        let file = at.join("ds").join(frame["file_path"].as_str().unwrap());
        let image = exr::prelude::read_all_flat_layers_from_file(file).unwrap();
        let channels: BTreeMap<String, Vec<f32>> = image.layer_data[0]
            .channel_data
            .list
            .iter()
            .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
            .collect();
        let to_world = matrix(frame);
        let mut hits = 0;
        for (at, &depth) in channels["depth.Z"].iter().enumerate().filter(|(_, z)| z.is_finite()) {
            let p = point(&all, &to_world, at as u32 % 48, at as u32 / 48, f64::from(depth));
            assert!(side(from_z_up(p)).0.abs() < 1e-5, "{p}");
            hits += 1;
        }
        assert!(hits > 50);
    }
}

/// Lights are fixed to the model, those of a camera included: a matte side has the same colour in all views.
#[test]
fn all_views_are_lit_alike() {
    let (_dir, at) = folder();
    write_box(&at);
    runs(&at, &format!("turntable box.obj --views 9 {SMALL} --ks 0,0,0 -q -o #.png"));
    let all = transforms(&at);
    let mut colors: BTreeMap<[i32; 3], BTreeSet<[u8; 3]>> = BTreeMap::new();
    for frame in all["frames"].as_array().unwrap() {
        let (picture, depths) = (beside(&at, frame, "file_path"), beside(&at, frame, "depth_path"));
        let (picture, depths) = (picture.into_rgb8(), depths.into_luma16());
        let to_world = matrix(frame);
        for (i, j, depth) in depths.enumerate_pixels().filter(|(_, _, depth)| depth.0[0] > 0) {
            let step = number(&all["integer_depth_scale"]);
            let p = from_z_up(point(&all, &to_world, i, j, f64::from(depth.0[0]) * step));
            if side_distance(p) > 0.01 {
                colors.entry(side(p).1.to_array().map(|v| v as i32)).or_default().insert(picture[(i, j)].0);
            }
        }
    }
    assert_eq!(colors.len(), 6);
    assert!(colors.values().all(|c| c.len() == 1), "{colors:?}");
    assert!(colors.values().collect::<BTreeSet<_>>().len() > 3, "{colors:?}");
}

#[test]
fn chunks_of_a_dataset_equal_the_complete_dataset() {
    let (_dir, at) = folder();
    write_box(&at);
    let line = format!("turntable box.obj --views 4 {SMALL}");
    runs(&at, &format!("{line} -q -o whole/#.png"));
    let whole = files(&at.join("whole"));
    assert_eq!(whole.len(), 4 * 4 + 1, "{:?}", whole.keys());
    for share in ["--only 2-4", "--chunk 1/4"] {
        runs(&at, &format!("{line} -q -o parts/#.png {share}"));
        assert!(files(&at.join("parts"))["transforms.json"] == whole["transforms.json"]);
    }
    assert!(files(&at.join("parts")) == whole);
    // Existing pictures are kept; `transforms.json` describes the current request.
    fs::remove_file(at.join("parts/transforms.json")).unwrap();
    let messages = runs(&at, &format!("{line} -o parts/#.png --resume"));
    assert_eq!(messages, "kept 4 of box.obj\nwrote parts/transforms.json\n");
    assert!(files(&at.join("parts")) == whole);
    let messages = runs(&at, &format!("{line} -o parts/#.png --resume --world-up y"));
    assert_eq!(messages.matches("wrote ").count(), 17, "normals are in that frame: {messages}");
    let dry = blinn(&at, "turntable box.obj --views 1 -o x/ --dry-run").stdout;
    let expected = ["_0001.png", "_0001.depth.png", "_0001.normal.png", "_0001.mask.png"];
    let expected = expected.map(|name| format!("x/box{name}\n")).concat() + "x/transforms.json\n";
    assert_eq!(String::from_utf8(dry).unwrap(), expected);
    // Partial runs with `--no-overwrite` share one `transforms.json`, which must belong to the same dataset.
    for share in ["--chunk 1/2", "--chunk 2/2"] {
        runs(&at, &format!("{line} -q -o new/#.png --no-overwrite {share}"));
    }
    assert!(files(&at.join("new")) == whole);
    let kept = blinn(&at, &format!("{line} -o parts/a#.png --no-overwrite"));
    assert_eq!(kept.status.code(), Some(1));
    assert!(!at.join("parts/a1.png").exists(), "found before anything is rendered");
}

#[test]
fn invalid_datasets_are_refused() {
    let (_dir, at) = folder();
    write_box(&at);
    for (flags, message) in [
        ("--views 0", "0"),
        ("--views 4 --count 4", "--count"),
        ("--views 4 --frames 4", "--count"),
        ("--views 4 --turn camera", "--turn"),
        ("--views 4 --axis z", "--axis"),
        ("--views 4 --orbit 1,2", "--orbit"),
        ("--views 4 --view-point 1,2,3", "--view-point"),
        ("--views 4 --projection orthographic", "only perspective cameras"),
        ("--views 4 --camera-orthographic", "only perspective cameras"),
        ("--views 4 --only 5", "the frames are 1 to 4"),
        ("--views 4 -o a.gif", "a dataset consists of images"),
        ("--views 4 -o #/a.png", "in one folder"),
        ("--views 4 -o -", "several frames"),
        (
            "--views 4 box.obj -o ds/{index}_#.png",
            "would both write their dataset to ds; let their folders differ, as in -o '{index:05}/####.png'",
        ),
        ("--world-up y", "--views"),
    ] {
        refused(&at, &format!("turntable box.obj {flags}"), message);
    }
    refused(&at, "render box.obj --views 4", "--views");
}

/// Whatever the cameras, the depths lie on the mesh once `normalized_to_scene` is applied.
#[test]
fn sampled_and_normalized_views_describe_the_mesh() {
    let (_dir, at) = folder();
    write_box(&at);
    for (flags, ext) in [
        ("--on random --distance-range .9x,1.6x --roll 180 --look-at-jitter .2", "png"),
        ("--on hemisphere --normalize unit-cube --world-up y", "exr"),
        (
            "--on random --normalize unit-sphere --distance-range 2,3 --roll 20 --seed 9 --elevation-range -20,70",
            "exr",
        ),
        ("--on stereo=.1 --normalize unit-sphere --distance-range 3", "png"),
        ("--on icosphere --look-at 1,.5,-1", "png"),
        ("--on ring --elevation-range 30 --random-lights --random-hdri --hdri sky", "png"),
    ] {
        let out = at.join("ds");
        runs(&at, &format!("turntable box.obj --views 12 {SMALL} {flags} -q -o ds/##.{ext}"));
        let all = transforms(&out);
        let to_scene = match all.get("normalized_to_scene") {
            Some(rows) => matrix(&serde_json::json!({"transform_matrix": rows})),
            None => DMat4::from_cols_array_2d(&[
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, -1.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0],
            ]),
        };
        assert_eq!(all.get("normalized_to_scene").is_some(), flags.contains("--normalize"));
        let scale = 1.0 / to_scene.x_axis.truncate().length();
        let frames = all["frames"].as_array().unwrap();
        assert_eq!(frames.len(), 12);
        let mut hits = 0;
        for frame in frames {
            let to_world = matrix(frame);
            let u = to_world.x_axis.truncate();
            assert!((u.length() - 1.0).abs() < 1e-12, "{flags}: the matrix is rigid");
            let mut check = |i: u32, j: u32, depth: f64, step: f64| {
                let p = point(&all, &to_world, i, j, depth);
                let off = side(to_scene.transform_point3(p)).0.abs() * scale;
                assert!(off <= step, "{flags}: {p} is off by {off}, {step} a step");
                hits += 1;
            };
            if ext == "exr" {
                let file = out.join(frame["file_path"].as_str().unwrap());
                let image = exr::prelude::read_all_flat_layers_from_file(file).unwrap();
                let depths =
                    image.layer_data[0].channel_data.list.iter().find(|c| c.name.eq("depth.Z")).unwrap();
                let depths: Vec<f32> = depths.sample_data.values_as_f32().collect();
                for (k, &depth) in depths.iter().enumerate().filter(|(_, z)| z.is_finite()) {
                    check(k as u32 % 48, k as u32 / 48, f64::from(depth), 1e-5);
                }
            } else {
                let step = number(&all["integer_depth_scale"]);
                let depths = beside(&out, frame, "depth_path").into_luma16();
                for (i, j, depth) in depths.enumerate_pixels().filter(|(_, _, depth)| depth.0[0] > 0) {
                    check(i, j, f64::from(depth.0[0]) * step, step);
                }
            }
        }
        assert!(hits > 600, "{flags}: {hits} pixels see it");
        if flags.contains("stereo") {
            for pair in frames.chunks(2) {
                let (left, right) = (matrix(&pair[0]), matrix(&pair[1]));
                let between = (right.w_axis - left.w_axis).truncate();
                assert!((between - left.x_axis.truncate() * 0.1).length() < 1e-9, "{between}");
                assert_eq!(left.z_axis, right.z_axis);
            }
        }
        if flags.contains("random-lights") {
            assert!(frames.iter().all(|frame| frame["light_rotation"].is_number()), "{flags}");
            assert!(frames.iter().all(|frame| frame["environment_rotation"].is_number()), "{flags}");
        }
        let bounds = |k: usize| DVec3::from_array(std::array::from_fn(|c| number(&all["aabb"][k][c])));
        if flags.contains("unit-cube") {
            assert!(((bounds(1) - bounds(0)).max_element() - 1.0).abs() < 1e-6);
            assert!((bounds(1) + bounds(0)).length() < 1e-6);
        }
        fs::remove_dir_all(out).unwrap();
    }
}

/// Every view can be rendered by itself, and random views do not depend on how many there are.
#[test]
fn sampled_views_do_not_depend_on_shares() {
    let (_dir, at) = folder();
    write_box(&at);
    let flags = "--on random --roll 30 --look-at-jitter .3 --distance-range 1x,2x --random-lights --seed 5";
    let line = |views: u32| format!("turntable box.obj --views {views} {SMALL} {flags} -q");
    runs(&at, &format!("{} -o whole/#.png", line(6)));
    for share in ["--chunk 2/3", "--only 5-6,1", "--chunk 1/3"] {
        runs(&at, &format!("{} -o parts/#.png {share}", line(6)));
    }
    let whole = files(&at.join("whole"));
    assert!(files(&at.join("parts")) == whole);
    runs(&at, &format!("{} -o few/#.png", line(3)));
    let (few, many) = (transforms(&at.join("few")), transforms(&at.join("whole")));
    for k in 0..3 {
        assert_eq!(few["frames"][k]["transform_matrix"], many["frames"][k]["transform_matrix"]);
        assert_eq!(few["frames"][k]["light_rotation"], many["frames"][k]["light_rotation"]);
    }
    for (flags, message) in [
        ("--views 5 --on stereo", "--on: stereo views are pairs, but 5 is odd"),
        ("--views 5 --on icosphere", "an icosphere has 12, 42"),
        ("--views 12 --on icosphere --elevation-range 0,9", "fixed elevations"),
        ("--views 5 --on cube", "expected sphere, hemisphere"),
        ("--views 5 --distance-range 2,1", "the range is empty"),
        ("--on ring", "--views"),
        ("--normalize unit-cube", "--views"),
    ] {
        refused(&at, &format!("turntable box.obj {flags}"), message);
    }
}
