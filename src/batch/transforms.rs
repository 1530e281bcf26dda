//! `transforms.json`: where the camera stood for each picture of a dataset, as the tools for radiance
//! fields read it.

use glam::{DMat3, DMat4, DVec3};
use serde_json::{Map, Value, json};

use crate::geometry::Aabb;
use crate::render::PixelRect;
use crate::scene::Camera;

/// Which way is up in a dataset's world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldUp {
    /// (x, y, z) as it is here, and in glTF.
    Y,
    /// (x, −z, y), as in Blender, and as the tools expect.
    Z,
}

impl WorldUp {
    /// The turn from the world here to a dataset's.
    pub fn turn(self) -> DMat3 {
        match self {
            WorldUp::Y => DMat3::IDENTITY,
            WorldUp::Z => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        }
    }
}

/// A picture of a dataset.
#[derive(Clone, Debug)]
pub struct DatasetView {
    /// Its file, as seen from the folder of `transforms.json`.
    pub file: String,
    /// Files of its layers beside it: the key that the tools look for, and the name.
    pub layers: Vec<(&'static str, String)>,
    /// What it was taken with. Perspective.
    pub camera: Camera,
}

/// What all pictures of a dataset share.
#[derive(Clone, Copy, Debug)]
pub struct Dataset {
    /// Pixels of a whole picture.
    pub size: (u32, u32),
    /// What was rendered of it.
    pub window: PixelRect,
    /// The world's up.
    pub up: WorldUp,
    /// What holds the scene, in the world that is rendered.
    pub bounds: Aabb,
    /// Metres that a step of an integer depth stands for, where there are such.
    pub depth_step: Option<f64>,
}

impl Dataset {
    /// The text of `transforms.json`. Pinhole cameras in pixels, rows downward, pixel (i, j) centred at
    /// (i + ½, j + ½); matrices take camera coordinates (x right, y up, z backward: OpenGL's) to the
    /// world, in metres.
    pub fn to_json(&self, views: &[DatasetView]) -> String {
        let mut all = Map::new();
        if let Some(view) = views.first() {
            let Camera { view_width, view_height, proj_distance, .. } = view.camera;
            let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
            let PixelRect { x, y, width: w, height: h } = self.window;
            // The lens is the same everywhere.
            let (fl_x, fl_y) = (width * proj_distance / view_width, height * proj_distance / view_height);
            let angle = |pixels: u32, focal: f64| 2.0 * libm::atan(0.5 * f64::from(pixels) / focal);
            let numbers = [
                ("camera_angle_x", angle(w, fl_x)),
                ("camera_angle_y", angle(h, fl_y)),
                ("fl_x", fl_x),
                ("fl_y", fl_y),
                ("cx", 0.5 * width - f64::from(x)),
                ("cy", 0.5 * height - f64::from(y)),
            ];
            all.extend(numbers.map(|(key, value)| (key.to_string(), json!(value))));
            all.insert("w".into(), json!(w));
            all.insert("h".into(), json!(h));
        }
        // instant-ngp looks for the scene here, and else near the origin alone.
        if !self.bounds.is_empty() {
            all.insert("aabb".into(), self.aabb());
        }
        all.extend(self.depth_step.map(|step| ("integer_depth_scale".into(), json!(step))));
        all.insert("frames".into(), views.iter().map(|view| self.frame(view)).collect());
        format!("{:#}\n", Value::Object(all))
    }

    fn frame(&self, view: &DatasetView) -> Value {
        let mut frame = Map::new();
        frame.insert("file_path".into(), json!(view.file));
        frame.extend(view.layers.iter().map(|(key, name)| (key.to_string(), json!(name))));
        frame.insert("transform_matrix".into(), self.matrix(&view.camera));
        Value::Object(frame)
    }

    /// The lowest and the highest corner.
    fn aabb(&self) -> Value {
        let mut turned = Aabb::EMPTY;
        turned.extend(self.up.turn() * self.bounds.min);
        turned.extend(self.up.turn() * self.bounds.max);
        // No zero has a sign.
        let corner = |p: DVec3| p.to_array().map(|x| x + 0.0);
        json!([corner(turned.min), corner(turned.max)])
    }

    /// Camera to world, row by row.
    fn matrix(&self, camera: &Camera) -> Value {
        let turn = self.up.turn();
        let [u, v, w] = [camera.basis.u, camera.basis.v, camera.basis.w].map(|axis| turn * axis);
        let e = turn * camera.view_point;
        let to_world = DMat4::from_cols(u.extend(0.0), v.extend(0.0), w.extend(0.0), e.extend(1.0));
        // No zero has a sign.
        (0..4).map(|i| json!(to_world.row(i).to_array().map(|x| x + 0.0))).collect()
    }
}
