//! `--cameras`: each format against projections written here, names, sizes, and what is refused.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::common::program::*;

/// A pinhole camera in OpenCV's axes: x_camera = R x + t.
#[derive(Clone, Copy)]
struct Pinhole {
    /// f_x, f_y, c_x, c_y.
    k: [f64; 4],
    quaternion: DQuat,
    t: DVec3,
    size: (u32, u32),
}

impl Pinhole {
    fn r(&self) -> DMat3 {
        DMat3::from_quat(self.quaternion)
    }

    fn project(&self, p: DVec3) -> DVec2 {
        let c = self.r() * p + self.t;
        let [fx, fy, cx, cy] = self.k;
        DVec2::new(cx + fx * c.x / c.z, cy + fy * c.y / c.z)
    }

    /// Rows of the camera-to-world matrix in OpenGL's axes.
    fn opengl_rows(&self) -> Vec<[f64; 4]> {
        let to_world = self.r().transpose();
        let e = to_world * -self.t;
        let (x, y, z) = (to_world.x_axis, -to_world.y_axis, -to_world.z_axis);
        let row = |i: usize| [x[i], y[i], z[i], e[i]];
        vec![row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    fn opencv_rows(&self) -> Vec<[f64; 4]> {
        let (r, t) = (self.r(), self.t);
        let row = |i: usize| [r.x_axis[i], r.y_axis[i], r.z_axis[i], t[i]];
        vec![row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }
}

/// Numbers in 0…1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A camera with a principal point anywhere in the picture, about 4 m from the origin, which it sees.
    fn camera(&mut self) -> Pinhole {
        let size = (40 + (self.next() * 30.0) as u32, 30 + (self.next() * 30.0) as u32);
        let (w, h) = (f64::from(size.0), f64::from(size.1));
        let k = [
            self.between(50.0, 90.0),
            self.between(50.0, 90.0),
            w * self.between(0.3, 0.7),
            h * self.between(0.3, 0.7),
        ];
        let mut axis = || self.between(-1.0, 1.0);
        let quaternion = DQuat::from_xyzw(axis(), axis(), axis(), axis()).normalize();
        let t = DVec3::new(0.2 * axis(), 0.2 * axis(), 4.0 + axis());
        Pinhole { k, quaternion, t, size }
    }
}

fn cameras(count: usize) -> Vec<Pinhole> {
    let mut random = Random(7);
    (0..count).map(|_| random.camera()).collect()
}

fn write_scene(folder: &Path) {
    fs::copy(model("tests/cube.obj"), folder.join("cube.obj")).unwrap();
}

/// Checks that the points of the `position` layer project to their pixel centres.
#[track_caller]
fn check(file: &Path, camera: &Pinhole) {
    let image =
        exr::prelude::read_all_flat_layers_from_file(file).unwrap_or_else(|e| panic!("{file:?}: {e}"));
    let layer = &image.layer_data[0];
    assert_eq!(
        (layer.size.width() as u32, layer.size.height() as u32),
        camera.size,
        "{file:?} has the size of its camera"
    );
    let channels: BTreeMap<String, Vec<f32>> = layer
        .channel_data
        .list
        .iter()
        .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
        .collect();
    let mut hits = 0;
    let mut worst = 0.0f64;
    for (i, _) in channels["depth.Z"].iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let at = |name: &str| f64::from(channels[name][i]);
        let p = DVec3::new(at("position.X"), at("position.Y"), at("position.Z"));
        let width = camera.size.0 as usize;
        let centre = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        worst = worst.max(camera.project(p).distance(centre));
        hits += 1;
    }
    assert!(hits > 30, "{file:?}: {hits} pixels see the cube");
    assert!(worst < 1e-3, "{file:?}: {worst} pixels off");
}

const LAYERS: &str = "--aov position,depth -s 1 -q";

fn jsonl(cameras: &[Pinhole]) -> String {
    let mut text = String::from("\u{feff}\n");
    for (i, camera) in cameras.iter().enumerate() {
        let [fx, fy, cx, cy] = camera.k;
        let (width, height) = camera.size;
        let pose = match i % 3 {
            0 => format!("\"world_to_camera\": {:?}, \"convention\": \"opencv\"", camera.opencv_rows()),
            1 => format!("\"camera_to_world\": {:?}, \"convention\": \"opengl\"", camera.opengl_rows()),
            _ => format!("\"world_to_camera\": {:?}", camera.opencv_rows().concat()),
        };
        let _ = writeln!(
            text,
            "{{\"K\": [[{fx},0,{cx}],[0,{fy},{cy}],[0,0,1]], {pose}, \"width\": {width}, \"height\": {height}, \
             \"file\": \"v{i}.jpg\", \"note\": [1]}}\r"
        );
    }
    text
}

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

fn colmap_text(folder: &Path, cameras: &[Pinhole]) {
    let mut lenses = String::from("# Camera list\n");
    let mut images = String::from("# Image list with two lines of data per image:\n");
    for (i, camera) in cameras.iter().enumerate() {
        let [fx, fy, cx, cy] = camera.k;
        let (w, h) = camera.size;
        let lens = match i % 3 {
            0 => format!("PINHOLE {w} {h} {fx} {fy} {cx} {cy}"),
            1 => format!("OPENCV {w} {h} {fx} {fy} {cx} {cy} 0 0 0 0"),
            _ => format!("SIMPLE_PINHOLE {w} {h} {fx} {cx} {cy}"),
        };
        let _ = writeln!(lenses, "{} {lens}", i + 10);
        let (q, t) = (camera.quaternion, camera.t);
        let points = ["", "1.5 2.5 -1 3 4 7"][i % 2];
        let _ = writeln!(
            images,
            "{} {} {} {} {} {} {} {} {} cam {i}/img.png\n{points}",
            i + 1,
            q.w,
            q.x,
            q.y,
            q.z,
            t.x,
            t.y,
            t.z,
            i + 10
        );
    }
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("cameras.txt"), lenses).unwrap();
    fs::write(folder.join("images.txt"), images).unwrap();
}

fn colmap_binary(folder: &Path, cameras: &[Pinhole]) {
    let count = (cameras.len() as u64).to_le_bytes();
    let (mut lenses, mut images) = (count.to_vec(), count.to_vec());
    for (i, camera) in cameras.iter().enumerate() {
        let id = i as u32 + 10;
        lenses.extend(id.to_le_bytes());
        lenses.extend(1i32.to_le_bytes());
        lenses.extend(u64::from(camera.size.0).to_le_bytes());
        lenses.extend(u64::from(camera.size.1).to_le_bytes());
        camera.k.iter().for_each(|v| lenses.extend(v.to_le_bytes()));
        images.extend((i as u32).to_le_bytes());
        let (q, t) = (camera.quaternion, camera.t);
        [q.w, q.x, q.y, q.z, t.x, t.y, t.z].iter().for_each(|v| images.extend(v.to_le_bytes()));
        images.extend(id.to_le_bytes());
        images.extend(format!("img{i}.png\0").bytes());
        images.extend((i as u64).to_le_bytes());
        images.extend(vec![1; 24 * i]);
    }
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("cameras.bin"), lenses).unwrap();
    fs::write(folder.join("images.bin"), images).unwrap();
}

#[test]
fn colmap_models_project_to_pixel_centres() {
    let (_dir, at) = folder();
    write_scene(&at);
    let mut all = cameras(6);
    for camera in all.iter_mut().skip(2).step_by(3) {
        camera.k[1] = camera.k[0];
    }
    colmap_text(&at.join("text/sparse/0"), &all);
    colmap_binary(&at.join("binary"), &all);
    runs(&at, &format!("render cube.obj --cameras text {LAYERS} -o t/{{camera}}.exr"));
    runs(&at, &format!("render cube.obj --cameras binary/images.bin {LAYERS} -o b/{{camera}}.exr"));
    for (i, camera) in all.iter().enumerate() {
        check(&at.join(format!("t/cam {i}/img.exr")), camera);
        check(&at.join(format!("b/img{i}.exr")), camera);
    }
}

/// Some programs write a line for each image only. Names with blanks have as many words as points.
#[test]
fn colmap_models_without_lines_of_points_keep_all_images() {
    let (_dir, at) = folder();
    write_scene(&at);
    let mut all = cameras(4);
    all[2].k[1] = all[2].k[0];
    colmap_text(&at.join("m"), &all);
    let file = at.join("m/images.txt");
    let images = fs::read_to_string(&file).unwrap();
    let with_points = images.replacen("\n\n", "\n10.5 20 -1 3e2 4.25 17\n", 1);
    let long = images.replacen("\n\n", &format!("\n{}\n", "1.5 2.5 -1 ".repeat(200_000)), 1);
    let names = |images: &str| images.replace("cam ", "my cam ");
    for text in [images.replace("\n\n", "\n"), names(&images).replace("\n\n", "\n"), with_points, long] {
        fs::write(&file, &text).unwrap();
        let folder = if text.contains("my cam") { "my cam" } else { "cam" };
        let _ = fs::remove_dir_all(at.join("o"));
        runs(&at, &format!("render cube.obj --cameras m {LAYERS} -o o/{{camera}}.exr"));
        for (i, camera) in all.iter().enumerate() {
            check(&at.join(format!("o/{folder} {i}/img.exr")), camera);
        }
    }
}

/// What programs leave in lists: byte order marks, NaN, rounding, scale, keys of one axis, pictures without a pose.
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

/// Images keep their names and bytes in chunks, and --resume renders only what changed.
#[test]
fn lists_work_like_frames() {
    let (_dir, at) = folder();
    write_scene(&at);
    let all = cameras(5);
    fs::write(at.join("c.jsonl"), jsonl(&all)).unwrap();
    let line = "render cube.obj --cameras c.jsonl -s 1";
    runs(&at, &format!("{line} -q -o whole/"));
    let whole = files(&at.join("whole"));
    assert_eq!(
        whole.keys().collect::<Vec<_>>(),
        [0, 1, 2, 3, 4].map(|i| format!("cube_v{i}.png")).iter().collect::<Vec<_>>()
    );
    for part in ["1/2", "2/2"] {
        runs(&at, &format!("{line} -q -o parts/ --chunk {part}"));
    }
    assert!(files(&at.join("parts")) == whole);
    let mut changed = all.clone();
    changed[3].t.z += 0.5;
    fs::write(at.join("c.jsonl"), jsonl(&changed)).unwrap();
    let messages = runs(&at, &format!("{line} -o parts/ --resume"));
    assert!(
        messages.contains("kept 4 of cube.obj") && messages.contains("wrote parts/cube_v3.png"),
        "{messages}"
    );
    assert_eq!(messages.matches("wrote").count(), 1, "{messages}");
    let dry = blinn(&at, &format!("{line} -o x_##.png --dry-run")).stdout;
    assert_eq!(String::from_utf8(dry).unwrap(), "x_01.png\nx_02.png\nx_03.png\nx_04.png\nx_05.png\n");
    // An animation of pictures of one size.
    runs(&at, &format!("{line} --size 32x32 --fps 5 -q -o x.gif"));
    refused(&at, &format!("{line} -o x.gif"), "an animation needs --size");
    refused(&at, &format!("{line} --fps 5"), "--fps applies only to animations");
}

/// The time of a camera poses the scene.
#[test]
fn times_of_cameras_pose_the_scene() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    let line = |time: &str, file: &str| {
        format!(
            "{{\"K\": [80,0,32,0,80,32,0,0,1], \"width\": 64, \"height\": 64, \"convention\": \"opengl\", \
             \"camera_to_world\": [1,0,0,0, 0,1,0,1, 0,0,1,3, 0,0,0,1]{time}, \"file\": \"{file}\"}}\n"
        )
    };
    let text = line("", "start.png") + &line(", \"time\": 0.4", "later.png");
    fs::write(at.join("c.jsonl"), text).unwrap();
    let lit = "--lights three-point --exposure 0";
    for (flags, name) in [("", "a"), ("--time 0.4", "b")] {
        runs(
            &at,
            &format!("render {figure} --cameras c.jsonl {lit} {flags} -s 1 -q -o {name}/{{camera}}.png"),
        );
    }
    let (a, b) = (files(&at.join("a")), files(&at.join("b")));
    assert!(a["start.png"] != a["later.png"] && b["start.png"] != a["start.png"]);
    assert!(b["later.png"] == a["later.png"], "its own time takes precedence");
}

/// Names of images stay in the folder, and no two cameras share a file.
#[test]
fn names_of_cameras_are_safe_and_distinct() {
    let (_dir, at) = folder();
    write_scene(&at);
    let text = jsonl(&cameras(3));
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "../../v1.jpg").replace("v2.jpg", "/etc/v2.jpg"))
        .unwrap();
    let dry = blinn(&at, "render cube.obj --cameras c.jsonl --dry-run -o out/{camera}.png").stdout;
    assert_eq!(String::from_utf8(dry).unwrap(), "out/v0.png\nout/v1.png\nout/v2.png\n");
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "v0.png")).unwrap();
    refused(&at, "render cube.obj --cameras c.jsonl", "use {frame} in -o");
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "v0.depth.png")).unwrap();
    refused(&at, "render cube.obj --cameras c.jsonl --aov depth", "would both be written to");
}

#[test]
fn other_cameras_and_bad_lists_are_refused() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = cameras(1);
    let write = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
    write("ok.jsonl", &jsonl(&camera));
    for (flags, message) in [
        ("--cameras ok.jsonl --yfov 40", "--yfov"),
        ("--cameras ok.jsonl --orbit 1,2", "--orbit"),
        ("--cameras ok.jsonl --camera 0", "--camera"),
        ("--cameras ok.jsonl --frames 1-3", "--frames"),
        ("--cameras ok.jsonl --frame 3", "--frame"),
        ("--cameras ok.jsonl --intrinsics 1,1,1,1", "--intrinsics"),
        ("--cameras ok.jsonl --crop 0,0,500,5", "--crop reaches beyond"),
        ("--cameras ok.jsonl -o -", "standard output takes one image"),
        ("--cameras ok.jsonl -o ok.jsonl", "unknown format"),
        ("--cameras none.jsonl", "none.jsonl"),
        ("--chunk 1/2", "add --frames or --cameras, or name several scenes"),
        ("-o {camera}.png", "{camera} is the name of a camera of --cameras"),
    ] {
        refused(&at, &format!("render cube.obj {flags}"), message);
    }
    refused(&at, "turntable cube.obj --cameras ok.jsonl", "--cameras");
    let k = "\"K\": [[50,0,20],[0,50,20],[0,0,1]]";
    let pose = "\"camera_to_world\": [1,0,0,0, 0,1,0,0, 0,0,1,4, 0,0,0,1]";
    let size = "\"width\": 40, \"height\": 40";
    for (text, messages) in [
        ("", &["the file is empty"][..]),
        ("a b c", &["no list of cameras"]),
        ("{\"a\": 1}", &["no list of cameras", "transforms.json"]),
        ("[]", &["no list of cameras"]),
        (&format!("{{{k}, {size}}}"), &["line 1", "has no camera_to_world or world_to_camera"]),
        (&format!("{{{pose}, {size}}}"), &["line 1", "has no K"]),
        (
            &format!("{{{k}, {pose}, {size}}}\n{{{k}, {pose}, {size}, \"convention\": \"blender\"}}"),
            &["line 2", "convention 'blender'"],
        ),
        (&format!("{{{k}, {pose}, \"width\": 0, \"height\": 40}}"), &["line 1", "0 by 40 pixels"]),
        (&format!("{{{k}, {pose}, \"width\": 1e9, \"height\": 1e9}}"), &["line 1", "1 to 65536"]),
        (&format!("{{{k}, {pose}, \"width\": 40}}"), &["give both"]),
        (&format!("{{{k}, {pose}, {size}, \"time\": \"1\"}}"), &["line 1", "time", "invalid type"]),
        (&format!("{{{k}, {pose}, {size}, \"time\": NaN}}"), &["line 1", "time", "a finite number"]),
        (
            &format!("{{{}, {pose}, {size}}}", k.replace("[0,50,20]", "[0,-50,20]")),
            &["K", "greater than zero"],
        ),
        (&format!("{{{}, {pose}, {size}}}", k.replace("[50,0,", "[50,2,")), &["K has the skew 2"]),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[2,0,0,0,")),
            &["camera_to_world is not a rotation", "remove the scale"],
        ),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[-1,0,0,0,")),
            &["camera_to_world mirrors"],
        ),
        (&format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[0,0,0,0,")), &["is not a rotation"]),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("0,0,1,4", "0,0,1,1e300")),
            &["too far from the origin"],
        ),
        (&format!("{{\n{k}, {pose}, {size}}}"), &["must be on one line"]),
        ("{\"frames\": []}", &["has no cameras"]),
        ("{\"frames\": [{\"file_path\": \"a\"}]}", &["frames[0]", "has no transform_matrix"]),
        (
            "{\"frames\": [{\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]}",
            &["frames[0]", "has no focal length"],
        ),
        ("{\"fl_x\": 9, \"k1\": 0.1, \"frames\": []}", &["k1 = 0.1 is not supported", "undistort"]),
        ("{\"fl_x\": 9, \"camera_model\": \"OPENCV_FISHEYE\", \"frames\": []}", &["OPENCV_FISHEYE"]),
        ("{\"frames\": [{\"transform_matrix\": 3}]}", &["frames[0].transform_matrix", "a matrix"]),
        ("{\"0\": {\"cam_K\": [1,0,0,0,1,0,0,0,1]}}", &["image 0 has no cam_R_w2c"]),
        ("{\"0\": {}, \"x\": {}}", &["no list of cameras"]),
    ] {
        write("bad.json", text);
        for message in messages {
            refused(&at, "render cube.obj --size 40x40 --cameras bad.json", message);
        }
        refused(&at, "render cube.obj --size 40x40 --cameras bad.json", "bad.json");
    }
}

#[test]
fn bad_colmap_models_are_refused() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = cameras(2);
    let refused_with = |name: &str, message: &str| {
        refused(&at, &format!("render cube.obj --cameras {name}"), message);
    };
    fs::create_dir(at.join("empty")).unwrap();
    refused_with("empty", "the folder has no COLMAP model");
    colmap_text(&at.join("m"), &camera);
    let file = |name: &str| at.join("m").join(name);
    let (lenses, images) =
        (fs::read_to_string(file("cameras.txt")).unwrap(), fs::read_to_string(file("images.txt")).unwrap());
    for (from, to, message) in [
        ("OPENCV", "OPENCV_FISHEYE", "the model OPENCV_FISHEYE is not a pinhole"),
        ("0 0 0 0", "0 0 0.1 0", "the model OPENCV has distortion, which is not supported"),
        ("0 0 0 0", "0 0 0", "the model OPENCV has 8 parameters, not 7"),
        ("OPENCV", "FANCY", "the model FANCY is not supported"),
        ("11 OPENCV", "12 OPENCV", "camera 11 is not in the list of cameras"),
        ("11 OPENCV", "x OPENCV", "CAMERA_ID 'x'"),
    ] {
        fs::write(file("cameras.txt"), lenses.replace(from, to)).unwrap();
        refused_with("m", message);
    }
    fs::write(file("cameras.txt"), &lenses).unwrap();
    // A line that is neither points nor an image.
    fs::write(file("images.txt"), images.replacen("\n\n", "\n10 20 3 40\n", 1)).unwrap();
    refused_with("m", "images.txt, line 3: has no QZ");
    fs::write(file("images.txt"), images.replace("\n2 ", "\n2 nan ")).unwrap();
    refused_with("m", "images.txt, line 4");
    fs::write(file("images.txt"), "1 2 3").unwrap();
    refused_with("m", "has no QY");
    fs::write(at.join("m/transforms.json"), "{}").unwrap();
    refused_with("m", "the folder has images.txt and transforms.json; name one of them");

    colmap_binary(&at.join("b"), &camera);
    for name in ["cameras.bin", "images.bin"] {
        let file = at.join("b").join(name);
        let bytes = fs::read(&file).unwrap();
        for length in [0, 7, 8, 30, 80, bytes.len() - 1] {
            fs::write(&file, &bytes[..length]).unwrap();
            refused_with("b", name);
        }
        let many = [&u64::MAX.to_le_bytes(), &bytes[8..]].concat();
        fs::write(&file, many).unwrap();
        refused_with("b", "exceeds the limit");
        fs::write(&file, bytes).unwrap();
    }
    let file = at.join("b/cameras.bin");
    let mut bytes = fs::read(&file).unwrap();
    bytes[12] = 99;
    fs::write(&file, &bytes).unwrap();
    refused_with("b", "camera 10 has the unknown model 99");
}

/// A dataset's `transforms.json` read back: images, layers and fingerprints have the same bytes.
#[test]
fn own_datasets_are_rendered_again_to_the_byte() {
    let (_dir, at) = folder();
    write_scene(&at);
    let figure = model("figure/figure.glb");
    for (i, (scene, flags, lens, format)) in [
        ("cube.obj", "-s 4", "--size 40x30", "png"),
        (
            "cube.obj",
            "-s 4 --background transparent",
            "--world-up y --size 40x30 --yfov 50 --proj-distance 3",
            "png",
        ),
        ("cube.obj", "-s 5 --ks 0.3,0.3,0.3", "--size 60x44 --crop 9,5,31,22 --clip 0.5,50", "png"),
        ("cube.obj", "-s 1", "--size 40x30 --intrinsics 50,51,17.3,16.1", "exr"),
        (figure.as_str(), "-s 2 --ao 2", "--size 40x30 --time 0.3", "webp"),
        (
            "cube.obj",
            "-s 2 --seed 7",
            "--size 40x30 --on random --roll 20 --look-at-jitter .2 --random-lights",
            "png",
        ),
        (
            figure.as_str(),
            "-s 1 --hdri sky --background hdri --lights three-point",
            "--size 40x30 --random-lights --random-hdri --normalize unit-cube --distance-range 2,4",
            "png",
        ),
        (
            "cube.obj",
            "-s 1 --lights headlight --hdri studio --depth 32",
            "--size 40x30 --random-hdri --normalize unit-sphere --on stereo --world-up y --crop 9,5,21,20",
            "exr",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let (a, b) = (format!("a{i}"), format!("b{i}"));
        runs(&at, &format!("turntable {scene} --views 4 {flags} {lens} -q -o {a}/#.{format}"));
        let list = format!("render {scene} --cameras {a}/transforms.json {flags} --aov depth,normal,mask");
        runs(&at, &format!("{list} -q -o {b}/{{camera}}.{format}"));
        let mut dataset = files(&at.join(&a));
        assert!(dataset.remove("transforms.json").is_some());
        let again = files(&at.join(&b));
        assert_eq!(again.keys().collect::<Vec<_>>(), dataset.keys().collect::<Vec<_>>(), "{flags} {lens}");
        for (name, bytes) in &again {
            assert!(*bytes == dataset[name], "{name} differs: {flags} {lens}");
        }
        // So --resume keeps the images of either.
        let messages = runs(&at, &format!("{list} -o {a}/{{camera}}.{format} --resume"));
        assert!(messages.contains("kept 4"), "{messages}");
    }
}

/// A lens that somebody changed is the one that counts.
#[test]
fn changed_datasets_are_rendered_as_they_are() {
    let (_dir, at) = folder();
    write_scene(&at);
    runs(&at, "turntable cube.obj --views 2 --size 40x30 -s 1 -q -o a/#.png");
    let text = fs::read_to_string(at.join("a/transforms.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let focal = json["fl_x"].as_f64().unwrap();
    let changed = text.replace(&format!("\"fl_x\": {focal}"), &format!("\"fl_x\": {}", 0.5 * focal));
    assert!(changed != text);
    fs::write(at.join("a/changed.json"), changed).unwrap();
    runs(&at, "render cube.obj --cameras a/changed.json -s 1 -q -o b/{camera}.png");
    let (a, b) = (files(&at.join("a")), files(&at.join("b")));
    assert!(a["1.png"] != b["1.png"]);
    fs::write(at.join("a/bad.json"), text.replace("\"up\": \"z\"", "\"up\": \"w\"")).unwrap();
    refused(&at, "render cube.obj --cameras a/bad.json", "up 'w' must be \"y\" or \"z\"");
}

/// Positions that somebody changed count, in the units of the file; keys of blinn in files of others do not.
#[test]
fn normalized_datasets_are_rendered_in_their_units() {
    let (_dir, at) = folder();
    write_scene(&at);
    let aov = "--aov position --size 40x30 -s 1";
    runs(&at, &format!("turntable cube.obj --views 2 --normalize unit-cube {aov} -q -o a/#.exr"));
    let text = fs::read_to_string(at.join("a/transforms.json")).unwrap();
    let dataset: serde_json::Value = serde_json::from_str(&text).unwrap();
    let write = |name: &str, change: &dyn Fn(&mut serde_json::Value)| {
        let mut changed = dataset.clone();
        change(&mut changed);
        fs::write(at.join("a").join(name), changed.to_string()).unwrap();
        runs(&at, &format!("render cube.obj --cameras a/{name} {aov} -q -o {name}-out/{{camera}}.exr"));
        files(&at.join(format!("{name}-out")))
    };
    let same = write("same.json", &|_| {});
    let without_position = write("rounded.json", &|json| {
        let frames = json["frames"].as_array_mut().unwrap();
        frames.iter_mut().for_each(|frame| frame["scene_view_point"] = serde_json::Value::Null);
    });
    let moved = write("moved.json", &|json| {
        let x = json["frames"][0]["transform_matrix"][0][3].as_f64().unwrap();
        json["frames"][0]["transform_matrix"][0][3] = (x + 0.1).into();
    });
    assert!(moved["1.exr"] != same["1.exr"] && moved["2.exr"] == same["2.exr"]);
    let pixels = |bytes: &[u8]| image::load_from_memory_with_format(bytes, image::ImageFormat::OpenExr);
    let difference = |a: &[u8], b: &[u8]| {
        let (a, b) = (pixels(a).unwrap().into_rgba32f(), pixels(b).unwrap().into_rgba32f());
        a.iter().zip(b.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(difference(&same["1.exr"], &without_position["1.exr"]) < 1e-3);
    // In another program's file, the units are metres and the lights are those of the scene.
    let foreign = |light: f64| {
        write(&format!("foreign{light}.json"), &|json| {
            json.as_object_mut().unwrap().remove("blinn");
            json["frames"][0]["light_rotation"] = light.into();
        })
    };
    assert!(foreign(0.0) == foreign(70.0));
    let scaled = text.replace("\"scale\": ", "\"scale\": -");
    assert!(scaled != text);
    fs::write(at.join("a/bad.json"), scaled).unwrap();
    refused(&at, "render cube.obj --cameras a/bad.json", "normalization.scale must be greater than zero");
}
