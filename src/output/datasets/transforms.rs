//! `transforms.json`: the cameras of a dataset, in the format of NeRF tools (instant-ngp, nerfstudio).

use std::collections::BTreeSet;

use glam::{DMat4, DVec3};
use serde_json::{Map, Value, json};

use super::pinhole::Pinhole;
use super::world_up::WorldUp;
use blinn_core::geometry::Aabb;
use blinn_render::PixelRect;
use blinn_scene::{
    Camera, ClipPlanes, DistanceRange, LightRotation, Normalization, ViewLayout, ViewSampling,
};

/// An image of a dataset.
#[derive(Clone, Debug)]
pub struct DatasetView {
    /// The image file, relative to the folder of `transforms.json`.
    pub file: String,
    /// The files of its layers, each with its key in `transforms.json`.
    pub layers: Vec<(&'static str, String)>,
    /// The camera of the image. Perspective.
    pub camera: Camera,
    /// Rotation of the light.
    pub light: LightRotation,
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
    /// Metres, or units of the normalization, per step of integer depth layers, if there are any.
    pub depth_step: Option<f64>,
    /// From blinn's world to the units of the file, before the rotation to its up axis. `None` for metres.
    pub normalization: Option<Normalization>,
    /// How the views were chosen.
    pub sampling: ViewSampling,
}

impl Dataset {
    /// The text of `transforms.json`. Cameras are pinhole cameras in pixels, rows downward, with the centre of pixel
    /// (i, j) at (i + ½, j + ½). Matrices transform from OpenGL camera space (x right, y up, z backward) to the world,
    /// in metres. `scene` is the name of the scene's file.
    pub fn to_json(&self, scene: &str, views: &[DatasetView]) -> String {
        let mut root = self.shared_members(views);
        root.insert("scene".into(), json!(scene));
        root.insert("frames".into(), views.iter().map(|view| Value::Object(self.frame(view))).collect());
        format!("{:#}\n", Value::Object(root))
    }

    /// All members of `transforms.json` but the frames.
    fn shared_members(&self, views: &[DatasetView]) -> Map<String, Value> {
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
        if let Some(normalization) = &self.normalization {
            let inverse = normalization.inverse() * DMat4::from_mat3(self.up.rotation().transpose());
            root.insert("normalized_to_scene".into(), matrix_rows(&inverse));
        }
        if self.sampling != (ViewSampling { seed: self.sampling.seed, ..ViewSampling::default() }) {
            root.insert("view_sampling".into(), self.sampling());
        }
        if let Some(recorded) = self.recorded(views) {
            root.insert("blinn".into(), recorded);
        }
        root
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

    /// The exact view, with which `render --cameras` renders the same images to the byte. The lens in pixels is rounded.
    /// `None` if the lenses differ.
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
        if let Some(Normalization { centre, scale }) = self.normalization {
            insert("normalization", json!({"centre": positive_zeros(centre.to_array()), "scale": scale}));
        }
        Some(Value::Object(recorded))
    }

    /// Adds what `transforms.json` would hold of one image to the description of a sample.
    pub fn describe_sample(&self, view: &DatasetView, description: &mut Value) {
        for (key, value) in
            self.shared_members(std::slice::from_ref(view)).into_iter().chain(self.frame(view))
        {
            description[key] = value;
        }
    }

    fn frame(&self, view: &DatasetView) -> Map<String, Value> {
        let mut frame = Map::new();
        frame.insert("file_path".into(), json!(view.file));
        frame.extend(view.layers.iter().map(|(key, name)| (key.to_string(), json!(name))));
        let LightRotation { sources, environment } = view.light;
        for (key, degrees) in [("light_rotation", sources), ("environment_rotation", environment)] {
            if degrees != 0.0 {
                frame.insert(key.into(), json!(degrees));
            }
        }
        if self.normalization.is_some() {
            // The matrix has the rounded position in other units.
            let view_point = positive_zeros(view.camera.view_point.to_array());
            frame.insert("scene_view_point".into(), json!(view_point));
        }
        if view.is_empty {
            frame.insert("empty".into(), json!(true));
        }
        frame.insert("transform_matrix".into(), self.camera_to_world(&view.camera));
        frame
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
        rotated.extend(self.point(self.bounds.min));
        rotated.extend(self.point(self.bounds.max));
        json!([positive_zeros(rotated.min.to_array()), positive_zeros(rotated.max.to_array())])
    }

    /// The camera-to-world matrix, row by row.
    fn camera_to_world(&self, camera: &Camera) -> Value {
        let rotation = self.up.rotation();
        let [u, v, w] = [camera.basis.u, camera.basis.v, camera.basis.w].map(|axis| rotation * axis);
        let e = self.point(camera.view_point);
        matrix_rows(&DMat4::from_cols(u.extend(0.0), v.extend(0.0), w.extend(0.0), e.extend(1.0)))
    }

    /// A point of blinn's world in that of the file.
    fn point(&self, p: DVec3) -> DVec3 {
        self.up.rotation() * self.normalization.map_or(p, |normalization| normalization.point(p))
    }

    /// The settings that the views follow from, by the names of the flags.
    fn sampling(&self) -> Value {
        let ViewSampling { layout, elevation, distance, roll, look_at_jitter, .. } = self.sampling;
        let mut root = Map::new();
        let on = match layout {
            ViewLayout::Sphere => "sphere",
            ViewLayout::Hemisphere => "hemisphere",
            ViewLayout::Ring => "ring",
            ViewLayout::Icosphere => "icosphere",
            ViewLayout::Random => "random",
            ViewLayout::Stereo { .. } => "stereo",
        };
        root.insert("on".into(), json!(on));
        if let ViewLayout::Stereo { baseline: Some(baseline) } = layout {
            root.insert("baseline".into(), json!(baseline));
        }
        if let Some((low, high)) = elevation {
            root.insert("elevation_range".into(), json!([low.to_degrees(), high.to_degrees()]));
        }
        match distance {
            Some(DistanceRange::Metres(low, high)) => {
                root.insert("distance_range".into(), json!([low, high]))
            }
            Some(DistanceRange::Framed(low, high)) => {
                root.insert("distance_range_framed".into(), json!([low, high]))
            }
            None => None,
        };
        for (key, value) in [("roll", roll.to_degrees()), ("look_at_jitter", look_at_jitter)] {
            if value != 0.0 {
                root.insert(key.into(), json!(value));
            }
        }
        root.insert("seed".into(), json!(self.sampling.seed));
        Value::Object(root)
    }
}

/// The rows of a matrix.
fn matrix_rows(matrix: &DMat4) -> Value {
    (0..4).map(|i| json!(positive_zeros(matrix.row(i).to_array()))).collect()
}

/// Replaces −0 by 0.
fn positive_zeros<const N: usize>(numbers: [f64; N]) -> [f64; N] {
    numbers.map(|x| x + 0.0)
}
