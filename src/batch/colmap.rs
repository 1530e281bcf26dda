//! The sparse model of COLMAP as text: `cameras.txt`, `images.txt` and `points3D.txt`.

use std::fmt::Write;

use glam::{DQuat, DVec2, DVec3};

use super::pinhole::{Pinhole, RigidPose};

/// A model with the cameras of images, and points of the surface. Ids count from 1 in the order of the lists.
#[derive(Clone, Debug, Default)]
pub struct ColmapModel {
    /// All images.
    pub images: Vec<ColmapImage>,
    /// Points that at least two images see.
    pub points: Vec<ColmapPoint>,
}

/// An image of a model.
#[derive(Clone, Debug)]
pub struct ColmapImage {
    /// File name, without spaces.
    pub name: String,
    /// Intrinsics.
    pub pinhole: Pinhole,
    /// From the world to the camera's space after OpenCV.
    pub world_to_camera: RigidPose,
}

/// A point of a model.
#[derive(Clone, Debug)]
pub struct ColmapPoint {
    /// Position in the dataset's world in metres.
    pub position: DVec3,
    /// sRGB.
    pub color: [u8; 3],
    /// Index of each image that sees the point, and where, in pixels of the image.
    pub observations: Vec<(usize, DVec2)>,
}

/// The texts of a model's files.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapTexts {
    /// `cameras.txt`: one camera for each set of intrinsics.
    pub cameras: String,
    /// `images.txt`.
    pub images: String,
    /// `points3D.txt`.
    pub points: String,
}

impl ColmapModel {
    /// The texts of the model's files.
    pub fn texts(&self) -> ColmapTexts {
        let mut lenses: Vec<Pinhole> = Vec::new();
        let mut images = String::from(
            "# Image list with two lines of data per image:\n\
             #   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n\
             #   POINTS2D[] as (X, Y, POINT3D_ID)\n",
        );
        // For each image the points that it sees, in the order of points.
        let mut seen: Vec<Vec<(usize, DVec2)>> = vec![Vec::new(); self.images.len()];
        let mut points = String::from(
            "# 3D point list with one line of data per point:\n\
             #   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
        );
        for (i, point) in self.points.iter().enumerate() {
            let DVec3 { x, y, z } = point.position + DVec3::ZERO;
            let [r, g, b] = point.color;
            // Writing to a string cannot fail.
            let _ = write!(points, "{} {x} {y} {z} {r} {g} {b} 0", i + 1);
            for &(image, pixel) in &point.observations {
                if let Some(list) = seen.get_mut(image) {
                    let _ = write!(points, " {} {}", image + 1, list.len());
                    list.push((i + 1, pixel));
                }
            }
            points.push('\n');
        }
        for (i, (image, seen)) in self.images.iter().zip(&seen).enumerate() {
            let known = lenses.iter().position(|lens| *lens == image.pinhole);
            let camera = known.unwrap_or_else(|| {
                lenses.push(image.pinhole);
                lenses.len() - 1
            });
            let DQuat { x, y, z, w } = image.world_to_camera.quaternion();
            let [qx, qy, qz, qw] = [x, y, z, w].map(|v| v + 0.0);
            let t = image.world_to_camera.translation + DVec3::ZERO;
            let _ = writeln!(
                images,
                "{} {qw} {qx} {qy} {qz} {} {} {} {} {}",
                i + 1,
                t.x,
                t.y,
                t.z,
                camera + 1,
                image.name
            );
            let line: Vec<String> =
                seen.iter().map(|(id, pixel)| format!("{} {} {id}", pixel.x, pixel.y)).collect();
            let _ = writeln!(images, "{}", line.join(" "));
        }
        let mut cameras = String::from(
            "# Camera list with one line of data per camera:\n\
             #   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n",
        );
        for (i, Pinhole { fx, fy, cx, cy, width, height }) in lenses.iter().enumerate() {
            let _ = writeln!(cameras, "{} PINHOLE {width} {height} {fx} {fy} {cx} {cy}", i + 1);
        }
        ColmapTexts { cameras, images, points }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn texts_have_the_fields_of_the_specification() {
        let pinhole = Pinhole { fx: 10.0, fy: 11.0, cx: 4.0, cy: 3.5, width: 8, height: 7 };
        let pose = |angle: f64| RigidPose {
            rotation: DMat3::from_rotation_z(angle),
            translation: DVec3::new(0.0, -0.0, 2.5),
        };
        let image =
            |name: &str, angle: f64| ColmapImage { name: name.into(), pinhole, world_to_camera: pose(angle) };
        let point = |images: &[usize]| ColmapPoint {
            position: DVec3::new(1.0, 2.0, -3.0),
            color: [1, 2, 3],
            observations: images.iter().map(|&i| (i, DVec2::new(1.5, 2.5))).collect(),
        };
        let model = ColmapModel {
            images: vec![image("a.png", 0.0), image("b.png", std::f64::consts::PI)],
            points: vec![point(&[1]), point(&[0, 1])],
        };
        let data = |text: &str| {
            let lines = text.lines().filter(|line| !line.starts_with('#'));
            lines.map(str::to_string).collect::<Vec<_>>()
        };
        let texts = model.texts();
        assert_eq!(data(&texts.cameras), ["1 PINHOLE 8 7 10 11 4 3.5"]);
        assert_eq!(data(&texts.points), ["1 1 2 -3 1 2 3 0 2 0", "2 1 2 -3 1 2 3 0 1 0 2 1"]);
        let images = data(&texts.images);
        assert_eq!(images[0], "1 1 0 0 0 0 0 2.5 1 a.png");
        assert_eq!(images[1], "1.5 2.5 2");
        assert!(images[2].starts_with("2 ") && images[2].ends_with(" 1 0 0 2.5 1 b.png"), "{}", images[2]);
        assert_eq!(images[3], "1.5 2.5 1 1.5 2.5 2");
    }
}
