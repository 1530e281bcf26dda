//! A picture on a sheet, and the positions of the model in it.

use glam::DVec3;
use serde_json::{Value, json};

use blinn_scene::{Camera, LightRotation, Projection};
use blinn_session::ImageCamera;

/// A picture on a sheet.
#[derive(Clone, Debug)]
pub struct SheetCell {
    /// The name of its view, which no other cell of the sheet has.
    pub name: String,
    /// Position of the upper left corner on the sheet in pixels.
    pub origin: [u32; 2],
    /// Its camera and size in pixels.
    pub view: ImageCamera,
    /// Time of the scene in seconds.
    pub time: f64,
}

/// The camera of a picture of `size` pixels that no list describes.
pub fn image_camera(camera: Camera, size: (u32, u32)) -> ImageCamera {
    ImageCamera {
        camera,
        size,
        crop: None,
        depth_step: None,
        light: LightRotation::default(),
        normalization: None,
    }
}

impl SheetCell {
    /// The rows of the matrix that maps (x, y, z, 1) of the model, in metres, to the sheet, in pixels: two rows for the position,
    /// and a third for a perspective camera, by which these are divided.
    pub fn model_to_pixel(&self) -> Vec<[f64; 4]> {
        let Camera { view_point, basis, view_width, view_height, view_centre, proj_distance, .. } =
            self.view.camera;
        let [left, top] = self.origin.map(f64::from);
        let (width, height) = (f64::from(self.view.size.0), f64::from(self.view.size.1));
        // Position = first + scale · (axis · (p − e)), of the lengths of the view rectangle.
        let (scale_x, scale_y) = (width / view_width, height / view_height);
        let first_x = left + 0.5 * width - view_centre.x * scale_x;
        let first_y = top + 0.5 * height + view_centre.y * scale_y;
        let row = |axis: DVec3, first: f64| {
            let DVec3 { x, y, z } = axis;
            [x, y, z, first - axis.dot(view_point)]
        };
        match self.view.camera.projection {
            Projection::Orthographic => {
                vec![row(basis.u * scale_x, first_x), row(-basis.v * scale_y, first_y)]
            }
            Projection::Perspective => {
                let d = proj_distance;
                vec![
                    row(basis.u * (scale_x * d) - basis.w * first_x, 0.0),
                    row(-basis.v * (scale_y * d) - basis.w * first_y, 0.0),
                    row(-basis.w, 0.0),
                ]
            }
        }
    }

    /// Its description in the output of --json.
    pub fn describe(&self) -> Value {
        let ImageCamera { ref camera, size: (width, height), .. } = self.view;
        let [left, top] = self.origin;
        let mut description = json!({
            "view": self.name,
            "rect": {"x": left, "y": top, "width": width, "height": height},
            "camera": {
                "projection": match camera.projection {
                    Projection::Orthographic => "orthographic",
                    Projection::Perspective => "perspective",
                },
                "view_point": camera.view_point.to_array(),
                "u": camera.basis.u.to_array(),
                "v": camera.basis.v.to_array(),
                "w": camera.basis.w.to_array(),
                "view_width": camera.view_width,
                "view_height": camera.view_height,
            },
            "model_to_pixel": self.model_to_pixel(),
        });
        if camera.projection == Projection::Perspective {
            description["camera"]["view_centre"] = json!(camera.view_centre.to_array());
            description["camera"]["proj_distance"] = json!(camera.proj_distance);
        }
        description
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Basis;
    use blinn_scene::ClipPlanes;
    use glam::DVec2;

    /// The matrix maps points to where the camera projects them, also off-centre.
    #[test]
    fn matrices_agree_with_the_projection_of_cameras() {
        let basis = Basis {
            u: DVec3::new(0.6, 0.0, -0.8),
            v: DVec3::new(0.0, 1.0, 0.0),
            w: DVec3::new(0.8, 0.0, 0.6),
        };
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let camera = Camera {
                view_point: DVec3::new(5.0, 1.0, 7.0),
                basis,
                view_width: 2.0,
                view_height: 1.5,
                view_centre: DVec2::new(0.3, -0.2),
                proj_distance: 1.7,
                projection,
                clip: ClipPlanes::OFF,
                lens: None,
            };
            let view = image_camera(camera, (200, 150));
            let cell = SheetCell { name: "a".into(), origin: [30, 40], view, time: 0.0 };
            for p in [DVec3::ZERO, DVec3::new(1.0, -2.0, 0.5), DVec3::new(-3.0, 0.1, 2.0)] {
                let rows = cell.model_to_pixel();
                let values: Vec<f64> = rows.iter().map(|row| p.extend(1.0).dot((*row).into())).collect();
                let divisor = values.get(2).copied().unwrap_or(1.0);
                let pixel = DVec2::new(values[0], values[1]) / divisor;
                let film = camera.project(p).unwrap();
                let expected = DVec2::new(30.0 + 200.0 * film.x, 40.0 + 150.0 * (1.0 - film.y));
                assert!((pixel - expected).length() < 1e-9, "{projection:?}: {pixel} {expected}");
            }
        }
    }
}
