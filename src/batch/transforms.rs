//! `transforms.json`: the cameras of a dataset, in the format of NeRF tools (instant-ngp, nerfstudio).

use std::collections::BTreeSet;

use glam::DMat4;
use serde_json::{Map, Value, json};

use super::pinhole::Pinhole;
use super::world_up::WorldUp;
use crate::geometry::Aabb;
use crate::render::PixelRect;
use crate::scene::{Camera, ClipPlanes};

/// An image of a dataset.
#[derive(Clone, Debug)]
pub struct DatasetView {
    /// The image file, relative to the folder of `transforms.json`.
    pub file: String,
    /// The files of its layers, each with its key in `transforms.json`.
    pub layers: Vec<(&'static str, String)>,
    /// The camera of the image. Perspective.
    pub camera: Camera,
    /// True if the image is known to show nothing.
    pub is_empty: bool,
}

/// The properties that all images of a dataset share.
#[derive(Clone, Copy, Debug)]
pub struct Dataset {
    /// Width and height of the full image in pixels.
    pub size: (u32, u32),
    /// The rendered part of it.
    pub window: PixelRect,
    /// The up axis.
    pub up: WorldUp,
    /// Time of the scene in seconds.
    pub time: f64,
    /// Bounds of the scene in blinn's world, in metres.
    pub bounds: Aabb,
    /// Metres per step of integer depth layers, if there are any.
    pub depth_step: Option<f64>,
}

impl Dataset {
    /// The text of `transforms.json`. Cameras are pinhole cameras in pixels, rows downward, with the centre of pixel
    /// (i, j) at (i + ½, j + ½). Matrices transform from OpenGL camera space (x right, y up, z backward) to the world,
    /// in metres.
    pub fn to_json(&self, views: &[DatasetView]) -> String {
        let mut root = Map::new();
        if let Some(view) = views.first() {
            // All cameras have the same intrinsics.
            root.extend(self.intrinsics(&view.camera));
        }
        // Without it, instant-ngp looks for the scene near the origin only.
        if !self.bounds.is_empty() {
            root.insert("aabb".into(), self.aabb());
        }
        root.extend(self.depth_step.map(|step| ("integer_depth_scale".into(), json!(step))));
        if let Some(recorded) = self.recorded(views) {
            root.insert("blinn".into(), recorded);
        }
        root.insert("frames".into(), views.iter().map(|view| self.frame(view)).collect());
        format!("{:#}\n", Value::Object(root))
    }

    /// Angles of view in radians; focal lengths, principal point and size in pixels.
    fn intrinsics(&self, camera: &Camera) -> Vec<(String, Value)> {
        let Pinhole { fx, fy, cx, cy, width: w, height: h } = Pinhole::new(camera, self.size, self.window);
        let angle = |pixels: u32, focal: f64| 2.0 * libm::atan(0.5 * f64::from(pixels) / focal);
        [
            ("camera_angle_x", json!(angle(w, fx))),
            ("camera_angle_y", json!(angle(h, fy))),
            ("fl_x", json!(fx)),
            ("fl_y", json!(fy)),
            ("cx", json!(cx)),
            ("cy", json!(cy)),
            ("w", json!(w)),
            ("h", json!(h)),
        ]
        .map(|(key, value)| (key.to_string(), value))
        .into()
    }

    /// What `render --cameras` needs to render the same images to the byte, which the lens in pixels does not tell to the
    /// last digit. `None` if the lenses differ.
    fn recorded(&self, views: &[DatasetView]) -> Option<Value> {
        let camera = &views.first()?.camera;
        let Camera { view_width, view_height, view_centre, proj_distance, clip, .. } = *camera;
        let same_lens = |other: &Camera| {
            (other.view_width, other.view_height, other.view_centre) == (view_width, view_height, view_centre)
                && (other.proj_distance, other.clip) == (proj_distance, clip)
        };
        if !views.iter().all(|view| same_lens(&view.camera)) {
            return None;
        }
        let mut recorded = Map::new();
        let mut insert = |key: &str, value: Value| drop(recorded.insert(key.into(), value));
        insert("up", json!(if self.up == WorldUp::Y { "y" } else { "z" }));
        insert("time", json!(self.time));
        insert("size", json!([self.size.0, self.size.1]));
        let PixelRect { x, y, width, height } = self.window;
        if (x, y, width, height) != (0, 0, self.size.0, self.size.1) {
            insert("crop", json!([x, y, width, height]));
        }
        insert("view_width", json!(view_width));
        insert("view_height", json!(view_height));
        insert("view_centre", json!(positive_zeros(view_centre.to_array())));
        insert("proj_distance", json!(proj_distance));
        if clip != ClipPlanes::OFF {
            // JSON has no infinity: null.
            insert("clip", json!([clip.near, clip.far]));
        }
        Some(Value::Object(recorded))
    }

    fn frame(&self, view: &DatasetView) -> Value {
        let mut frame = Map::new();
        frame.insert("file_path".into(), json!(view.file));
        frame.extend(view.layers.iter().map(|(key, name)| (key.to_string(), json!(name))));
        if view.is_empty {
            frame.insert("empty".into(), json!(true));
        }
        frame.insert("transform_matrix".into(), self.camera_to_world(&view.camera));
        Value::Object(frame)
    }

    /// Returns the images that a text of `transforms.json` marks as empty.
    pub fn empty_images(text: &str) -> BTreeSet<String> {
        let root: Value = serde_json::from_str(text).unwrap_or_default();
        let frames = root["frames"].as_array().map(Vec::as_slice).unwrap_or_default();
        let is_marked = |frame: &&Value| frame["empty"] == json!(true);
        let name = |frame: &Value| Some(frame["file_path"].as_str()?.to_string());
        frames.iter().filter(is_marked).filter_map(name).collect()
    }

    /// The lowest and the highest corner in the dataset's world.
    fn aabb(&self) -> Value {
        let mut rotated = Aabb::EMPTY;
        rotated.extend(self.up.rotation() * self.bounds.min);
        rotated.extend(self.up.rotation() * self.bounds.max);
        json!([positive_zeros(rotated.min.to_array()), positive_zeros(rotated.max.to_array())])
    }

    /// The camera-to-world matrix, row by row.
    fn camera_to_world(&self, camera: &Camera) -> Value {
        let rotation = self.up.rotation();
        let [u, v, w] = [camera.basis.u, camera.basis.v, camera.basis.w].map(|axis| rotation * axis);
        let e = rotation * camera.view_point;
        let matrix = DMat4::from_cols(u.extend(0.0), v.extend(0.0), w.extend(0.0), e.extend(1.0));
        (0..4).map(|i| json!(positive_zeros(matrix.row(i).to_array()))).collect()
    }
}

/// Replaces −0 by 0.
fn positive_zeros<const N: usize>(numbers: [f64; N]) -> [f64; N] {
    numbers.map(|x| x + 0.0)
}
