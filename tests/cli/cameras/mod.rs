//! `--cameras`: each format against projections written here, names, sizes, and what is refused.

mod colmap;
mod formats;
mod lists;
mod own_datasets;

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
