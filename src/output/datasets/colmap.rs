//! The sparse model of COLMAP: cameras, images and points, as text or binary files.

use glam::{DQuat, DVec2, DVec3};

use super::colmap_binary::binary_files;
use super::colmap_tables::{ColmapTables, ImageRow, PointRow};
use super::colmap_text::text_files;

use super::pinhole::{Pinhole, RigidPose};

/// A model with the cameras of images, and points of the surface. Ids count from 1 in the order of the lists, those of images
/// and cameras behind the images of other models.
#[derive(Clone, Debug, Default)]
pub struct ColmapModel {
    /// All images.
    pub images: Vec<ColmapImage>,
    /// Points that at least two images see.
    pub points: Vec<ColmapPoint>,
    /// Number of images of the models before.
    pub first_image: u32,
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

/// The form of a model's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColmapForm {
    /// `cameras.txt`, `images.txt` and `points3D.txt`.
    Text,
    /// `cameras.bin`, `images.bin` and `points3D.bin`, little-endian: what COLMAP writes itself.
    Binary,
}

impl ColmapForm {
    /// The names of a model's files.
    pub fn names(self) -> [&'static str; 3] {
        match self {
            ColmapForm::Text => ["cameras.txt", "images.txt", "points3D.txt"],
            ColmapForm::Binary => ["cameras.bin", "images.bin", "points3D.bin"],
        }
    }
}

impl ColmapModel {
    /// The contents of the files, in the order of [`ColmapForm::names`].
    pub fn files(&self, form: ColmapForm) -> [Vec<u8>; 3] {
        let tables = self.tables();
        match form {
            ColmapForm::Text => text_files(&tables).map(String::into_bytes),
            ColmapForm::Binary => binary_files(&tables),
        }
    }

    fn tables(&self) -> ColmapTables<'_> {
        let mut cameras: Vec<Pinhole> = Vec::new();
        let mut images: Vec<ImageRow> = Vec::with_capacity(self.images.len());
        for ColmapImage { name, pinhole, world_to_camera } in &self.images {
            let known = cameras.iter().position(|lens| lens == pinhole);
            let camera = known.unwrap_or_else(|| {
                cameras.push(*pinhole);
                cameras.len() - 1
            });
            let DQuat { x, y, z, w } = world_to_camera.quaternion();
            images.push(ImageRow {
                name,
                camera_id: self.first_image + camera as u32 + 1,
                quaternion: [w, x, y, z].map(|v| v + 0.0),
                translation: (world_to_camera.translation + DVec3::ZERO).to_array(),
                points: Vec::new(),
            });
        }
        let mut points = Vec::with_capacity(self.points.len());
        for (i, point) in self.points.iter().enumerate() {
            let mut track = Vec::with_capacity(point.observations.len());
            for &(image, pixel) in &point.observations {
                if let Some(row) = images.get_mut(image) {
                    track.push((self.first_image + image as u32 + 1, row.points.len() as u32));
                    row.points.push((pixel, i as u64 + 1));
                }
            }
            let position = (point.position + DVec3::ZERO).to_array();
            points.push(PointRow { position, color: point.color, track });
        }
        ColmapTables { cameras, images, points, first_id: self.first_image + 1 }
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
            first_image: 0,
        };
        let data = |text: &str| {
            let lines = text.lines().filter(|line| !line.starts_with('#'));
            lines.map(str::to_string).collect::<Vec<_>>()
        };
        let [cameras, images, points] = text_files(&model.tables());
        assert_eq!(data(&cameras), ["1 PINHOLE 8 7 10 11 4 3.5"]);
        assert_eq!(data(&points), ["1 1 2 -3 1 2 3 0 2 0", "2 1 2 -3 1 2 3 0 1 0 2 1"]);
        let images = data(&images);
        assert_eq!(images[0], "1 1 0 0 0 0 0 2.5 1 a.png");
        assert_eq!(images[1], "1.5 2.5 2");
        assert!(images[2].starts_with("2 ") && images[2].ends_with(" 1 0 0 2.5 1 b.png"), "{}", images[2]);
        assert_eq!(images[3], "1.5 2.5 1 1.5 2.5 2");
    }

    #[test]
    fn ids_count_on_behind_other_models() {
        let pinhole = Pinhole { fx: 10.0, fy: 11.0, cx: 4.0, cy: 3.5, width: 8, height: 7 };
        let world_to_camera = RigidPose { rotation: DMat3::IDENTITY, translation: DVec3::ZERO };
        let model = ColmapModel {
            images: vec![ColmapImage { name: "b/a.png".into(), pinhole, world_to_camera }],
            points: vec![ColmapPoint {
                position: DVec3::ONE,
                color: [1, 2, 3],
                observations: vec![(0, DVec2::new(1.5, 2.5))],
            }],
            first_image: 12,
        };
        let [cameras, images, points] = text_files(&model.tables());
        assert!(cameras.contains("\n13 PINHOLE 8"), "{cameras}");
        assert!(images.contains("\n13 1 0 0 0 0 0 0 13 b/a.png\n1.5 2.5 1\n"), "{images}");
        assert!(points.ends_with("\n1 1 1 1 1 2 3 0 13 0\n"), "{points}");
        let [cameras, images, points] = model.files(ColmapForm::Binary);
        assert_eq!((cameras[8], images[8]), (13, 13));
        assert_eq!(points[points.len() - 8..], [13, 0, 0, 0, 0, 0, 0, 0]);
    }

    /// Binary files hold the numbers of the text files, in the layout of COLMAP's `reconstruction_io.cc`.
    #[test]
    fn binary_files_have_the_layout_of_the_specification() {
        let pinhole = Pinhole { fx: 10.0, fy: 11.0, cx: 4.0, cy: 3.5, width: 8, height: 7 };
        let pose = RigidPose { rotation: DMat3::IDENTITY, translation: DVec3::new(0.5, 0.0, 2.5) };
        let model = ColmapModel {
            images: vec![ColmapImage { name: "a.png".into(), pinhole, world_to_camera: pose }],
            points: vec![ColmapPoint {
                position: DVec3::new(1.0, 2.0, -3.0),
                color: [1, 2, 3],
                observations: vec![(0, DVec2::new(1.5, 2.5))],
            }],
            first_image: 0,
        };
        let bytes = |parts: &[&[u8]]| parts.concat();
        let floats = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let [cameras, images, points] = model.files(ColmapForm::Binary);
        let count = 1u64.to_le_bytes();
        let (id, pinhole_model) = (1u32.to_le_bytes(), 1i32.to_le_bytes());
        let size = [8u64.to_le_bytes(), 7u64.to_le_bytes()].concat();
        assert_eq!(cameras, bytes(&[&count, &id, &pinhole_model, &size, &floats(&[10.0, 11.0, 4.0, 3.5])]));
        let pose = floats(&[1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 2.5]);
        let seen = [&count[..], &floats(&[1.5, 2.5]), &count].concat();
        assert_eq!(images, bytes(&[&count, &id, &pose, &id, b"a.png\0", &seen]));
        let track = [&count[..], &id, &0u32.to_le_bytes()].concat();
        let point = floats(&[1.0, 2.0, -3.0]);
        assert_eq!(points, bytes(&[&count, &count, &point, &[1, 2, 3], &floats(&[0.0]), &track]));
    }
}
