//! Formats of lists of cameras against projections written here.

use std::fmt::Write as _;
use std::fs;

use glam::{DMat3, DQuat, DVec3};

use super::{LAYERS, Pinhole, cameras, check, jsonl, write_scene};
use crate::common::program::*;

#[test]
fn json_lines_of_both_conventions_project_to_pixel_centres() {
    let (_dir, at) = folder();
    write_scene(&at);
    let all = cameras(6);
    fs::write(at.join("c.jsonl"), jsonl(&all)).unwrap();
    runs(&at, &format!("render cube.obj --cameras c.jsonl {LAYERS} -o {{camera}}.exr"));
    all.iter().enumerate().for_each(|(i, camera)| check(&at.join(format!("v{i}.exr")), camera));
    // --size scales the picture: the view stays.
    runs(&at, &format!("render cube.obj --cameras c.jsonl {LAYERS} --size 32x48 --chunk 1/6 -o s/#.exr"));
    let (w, h) = (32.0 / f64::from(all[0].size.0), 48.0 / f64::from(all[0].size.1));
    let [fx, fy, cx, cy] = all[0].k;
    check(&at.join("s/1.exr"), &Pinhole { k: [fx * w, fy * h, cx * w, cy * h], size: (32, 48), ..all[0] });
}

#[test]
fn transforms_of_nerf_and_nerfstudio_project_to_pixel_centres() {
    let (_dir, at) = folder();
    write_scene(&at);
    let all = cameras(4);
    let mut frames = String::new();
    for (i, camera) in all.iter().enumerate() {
        let [fx, fy, cx, cy] = camera.k;
        let (w, h) = camera.size;
        let comma = if i > 0 { "," } else { "" };
        let _ = write!(
            frames,
            "{comma}{{\"file_path\": \"./images/v_{i}.png\", \"fl_x\": {fx}, \"fl_y\": {fy}, \"cx\": {cx}, \
             \"cy\": {cy}, \"w\": {w}, \"h\": {h}, \"k1\": 0, \"transform_matrix\": {:?}}}",
            camera.opengl_rows()
        );
    }
    // The root, which each frame overrides, follows the frames.
    let root = "\"camera_model\": \"OPENCV\", \"fl_x\": 1, \"p1\": 0.0, \"aabb_scale\": 16";
    fs::write(at.join("transforms.json"), format!("{{\"frames\": [\n{frames}],\n{root}}}")).unwrap();
    runs(&at, &format!("render cube.obj --cameras . {LAYERS} -o out/{{camera}}.exr"));
    for (i, camera) in all.iter().enumerate() {
        check(&at.join(format!("out/images/v_{i}.exr")), camera);
    }
    // The original NeRF: an angle, square pixels, and the size from elsewhere.
    let camera = Pinhole { k: [70.0, 70.0, 24.0, 20.0], size: (48, 40), ..all[0] };
    let angle = 2.0 * (24.0f64 / 70.0).atan();
    let frame =
        format!("{{\"file_path\": \"./train/r_0\", \"transform_matrix\": {:?}}}", camera.opengl_rows());
    let text = format!("{{\"camera_angle_x\": {angle}, \"frames\": [{frame}]}}");
    fs::write(at.join("nerf.json"), text).unwrap();
    runs(&at, &format!("render cube.obj --cameras nerf.json --size 48x40 {LAYERS} -o n/x_{{camera}}.exr"));
    check(&at.join("n/x_train_r_0.exr"), &camera);
    fails(&at, &["render", "cube.obj", "--cameras", "nerf.json"], 2, "has no size; add --size WxH");
}

/// Blender's worlds have Z up; the scene was converted to Y up.
#[test]
fn cameras_of_a_world_with_z_up_are_rotated_on_request_only() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = cameras(1)[0];
    // (x, y, z) with Y up is (x, −z, y) with Z up.
    let rows = camera.opengl_rows();
    let rows = [rows[0], rows[2].map(|v| -v), rows[1], rows[3]];
    let [fx, fy, cx, cy] = camera.k;
    let (w, h) = camera.size;
    let text = format!(
        "{{\"fl_x\": {fx}, \"fl_y\": {fy}, \"cx\": {cx}, \"cy\": {cy}, \"w\": {w}, \"h\": {h}, \"frames\": \
         [{{\"transform_matrix\": {rows:?}}}]}}"
    );
    fs::write(at.join("t.json"), text).unwrap();
    runs(&at, &format!("render cube.obj --cameras t.json --world-up z {LAYERS} -o z.exr"));
    // Layers are in the world of the list.
    let to_list = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    let quaternion = DQuat::from_mat3(&(camera.r() * to_list.transpose()));
    check(&at.join("z_0001.exr"), &Pinhole { quaternion, ..camera });
    refused(&at, "render cube.obj --world-up z", "--cameras");
}

/// Leftovers of programs in lists: byte order marks, NaN, rounding, scale, keys of one axis, pictures without a pose.
#[test]
fn lists_of_other_programs_are_read() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = Pinhole { k: [70.0, 70.0, 24.0, 20.0], size: (48, 40), ..cameras(1)[0] };
    let pose = camera.opengl_rows();
    let mut rounded = pose.clone();
    rounded[3] = [1e-17, -2e-16, 0.0, 0.999_999_999_999_999_8];
    let scaled = |scale: f64| {
        let mut scaled = pose.clone();
        scaled[..3].iter_mut().for_each(|row| row[..3].iter_mut().for_each(|v| *v *= scale));
        scaled
    };
    let frame = |pose: &[[f64; 4]], keys: &str| {
        format!("{{\"transform_matrix\": {pose:?}, \"file_path\": \"a\"{keys}}}")
    };
    let file = |keys: &str, frames: &str| format!("{{\"w\": 48, \"h\": 40, {keys}, \"frames\": [{frames}]}}");
    let of_pose = |pose: &[[f64; 4]]| file("\"fl_x\": 70", &frame(pose, ""));
    let (angle_x, angle_y) = (2.0 * (24.0f64 / 70.0).atan(), 2.0 * (20.0f64 / 70.0).atan());
    let without_pose = "{\"file_path\": \"b\", \"transform_matrix\": null}, {\"file_path\": \"c\"}";
    let k = "[[70, 3e-14, 24], [0, 70, 20], [1e-20, 0, 0.9999999999999999]]";
    let mut to_camera = camera.opencv_rows();
    to_camera[3] = [0.0, 1e-18, 0.0, 1.0000000000000002];
    let line = |more: &str| {
        format!(
            "{{\"K\": {k}, \"width\": 48, \"height\": 40, \"file\": \"a\", \"world_to_camera\": {to_camera:?}{more}}}\n"
        )
    };
    for (name, text, left_out) in [
        ("mark", format!("\u{feff}{}", of_pose(&pose)), 0),
        ("row", of_pose(&rounded), 0),
        ("small", of_pose(&scaled(0.1)), 0),
        ("large", of_pose(&scaled(250.0)), 0),
        ("fl-y", file("\"fl_y\": 70", &frame(&pose, "")), 0),
        ("angle-y", file(&format!("\"camera_angle_y\": {angle_y}"), &frame(&pose, "")), 0),
        (
            "zoom",
            file("\"fl_x\": 90, \"fl_y\": 90", &frame(&pose, &format!(", \"camera_angle_x\": {angle_x}"))),
            0,
        ),
        (
            "nan",
            file(
                "\"totp\": [NaN, -Infinity], \"fl_x\": 70, \"k1\": 1e-15",
                &frame(&pose, ", \"sharpness\": NaN"),
            ),
            0,
        ),
        ("null", file("\"fl_x\": 70", &format!("{without_pose}, {}", frame(&pose, ""))), 2),
        ("line", line(", \"score\": NaN"), 0),
        (
            "lines",
            format!("{}{}", line(""), "{\"K\": [1, 0, 0, 0, 1, 0, 0, 0, 1], \"camera_to_world\": null}"),
            1,
        ),
    ] {
        fs::write(at.join("list.json"), text).unwrap();
        runs(&at, &format!("render cube.obj --cameras list.json {LAYERS} -o {name}/{{camera}}.exr"));
        check(&at.join(name).join("a.exr"), &camera);
        let messages = runs(&at, "render cube.obj --cameras list.json -s 1 -o x/{camera}.png");
        let warning = format!("left out {left_out} picture");
        assert_eq!(messages.contains(&warning), left_out > 0, "{name}: {messages}");
    }
    for (text, message) in [
        (file("\"fl_x\": NaN", &frame(&pose, "")), "expected a finite number"),
        (file("\"fl_x\": 70", without_pose), "has no transform_matrix"),
        (format!("\u{feff}{}", file("\"fl_x\": -70", &frame(&pose, ""))), "greater than zero"),
    ] {
        fs::write(at.join("list.json"), text).unwrap();
        refused(&at, "render cube.obj --cameras list.json", message);
    }
}

#[test]
fn bop_cameras_project_to_pixel_centres() {
    let (_dir, at) = folder();
    write_scene(&at);
    let all = cameras(3).into_iter().map(|camera| Pinhole { size: (50, 40), ..camera });
    let all: Vec<Pinhole> = all.collect();
    let mut text = String::from("{");
    for (i, camera) in all.iter().enumerate() {
        let [fx, fy, cx, cy] = camera.k;
        let r: Vec<f64> = camera.opencv_rows()[..3].iter().flat_map(|row| row[..3].to_vec()).collect();
        let t = (camera.t * 1000.0).to_array();
        let comma = if i > 0 { "," } else { "" };
        let _ = write!(
            text,
            "{comma}\n\"{}\": {{\"cam_K\": [{fx},0.0,{cx},0.0,{fy},{cy},0.0,0.0,1.0], \"depth_scale\": 0.1, \
             \"cam_R_w2c\": {r:?}, \"cam_t_w2c\": {t:?}}}",
            i * 9
        );
    }
    fs::write(at.join("scene_camera.json"), text + "}").unwrap();
    runs(
        &at,
        &format!("render cube.obj --cameras scene_camera.json --size 50x40 {LAYERS} -o {{camera}}.exr"),
    );
    all.iter().enumerate().for_each(|(i, camera)| check(&at.join(format!("{:06}.exr", i * 9)), camera));
    // Depth images have the scale of the file: 0.1 mm.
    runs(
        &at,
        "render cube.obj --cameras scene_camera.json --size 50x40 --aov depth -s 1 -q -o d/{camera}.png",
    );
    let depths = match image::open(at.join("d/000009.depth.png")).unwrap() {
        image::DynamicImage::ImageLuma16(depths) => depths,
        other => panic!("{:?} is not 16-bit grey", other.color()),
    };
    let nearest = depths.pixels().map(|p| p.0[0]).filter(|d| *d > 0).min().unwrap();
    assert!((20_000..45_000).contains(&nearest), "{nearest} steps of 0.1 mm");
}
