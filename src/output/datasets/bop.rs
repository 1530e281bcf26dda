//! The format of BOP, the benchmark for 6D object pose estimation: cameras and poses of objects in millimetres, models and
//! their extents.

use glam::DVec3;
use serde_json::{Map, Value, json};

use super::pinhole::{Pinhole, RigidPose};
use blinn_core::geometry::Aabb;
use blinn_render::{MaskRect, PixelMask};

/// The file with the extents of models, beside them.
pub const MODELS_INFO: &str = "models_info.json";
/// Millimetres per metre.
const MILLIMETRES: f64 = 1000.0;

/// The files of a scene: `scene_camera.json`, `scene_gt.json` and `scene_gt_info.json`.
#[derive(Clone, Debug, Default)]
pub struct BopScene {
    cameras: Map<String, Value>,
    poses: Map<String, Value>,
    info: Map<String, Value>,
}

/// An object in an image.
#[derive(Clone, Copy, Debug)]
pub struct BopObject {
    /// Number of the object, from 1.
    pub object: u32,
    /// From the model to the camera's space after OpenCV.
    pub model_to_camera: RigidPose,
    /// Pixels that the object covers alone, also outside the image.
    pub all_pixels: u64,
    /// Those of them that have a depth: pixels of the image.
    pub valid_pixels: u64,
    /// Visible pixels.
    pub visible_pixels: u64,
    /// The bounds of all pixels.
    pub bounds: Option<MaskRect>,
    /// The bounds of the visible pixels.
    pub visible_bounds: Option<MaskRect>,
}

/// The camera of an image and the poses of its objects.
#[derive(Clone, Debug)]
pub struct BopImage {
    camera: Value,
    poses: Value,
    info: Value,
}

impl BopImage {
    /// Describes an image. `depth_step` is the size in metres of a step of its depth image.
    pub fn new(
        pinhole: &Pinhole,
        world_to_camera: &RigidPose,
        depth_step: f64,
        objects: &[BopObject],
    ) -> BopImage {
        let Pinhole { fx, fy, cx, cy, .. } = *pinhole;
        let camera = json!({
            "cam_K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            "cam_R_w2c": world_to_camera.rows(),
            "cam_t_w2c": millimetres(world_to_camera.translation),
            "depth_scale": depth_step * MILLIMETRES,
        });
        let pose = |object: &BopObject| {
            json!({
                "cam_R_m2c": object.model_to_camera.rows(),
                "cam_t_m2c": millimetres(object.model_to_camera.translation),
                "obj_id": object.object,
            })
        };
        let info = |object: &BopObject| {
            json!({
                "bbox_obj": bbox(object.bounds),
                "bbox_visib": bbox(object.visible_bounds),
                "px_count_all": object.all_pixels,
                "px_count_valid": object.valid_pixels,
                "px_count_visib": object.visible_pixels,
                "visib_fract": object.visible_pixels as f64 / object.all_pixels.max(1) as f64,
            })
        };
        BopImage {
            camera,
            poses: objects.iter().map(pose).collect(),
            info: objects.iter().map(info).collect(),
        }
    }

    /// Extensions and texts of the files that describe the image alone, as a sample of an archive has them.
    pub fn sample_files(&self) -> [(&'static str, String); 3] {
        [
            ("camera.json", format!("{}\n", self.camera)),
            ("gt.json", format!("{}\n", self.poses)),
            ("gt_info.json", format!("{}\n", self.info)),
        ]
    }
}

/// Returns the masks of an image's objects as one text, as a sample of an archive has them: the run lengths of each by its
/// index in `gt.json`. They are lists of numbers, as BOP's toolkit writes them and reads them without pycocotools.
pub fn bop_sample_masks<'m>(
    (width, height): (u32, u32),
    masks: impl IntoIterator<Item = &'m PixelMask>,
) -> String {
    let entry = |(i, mask): (usize, &PixelMask)| {
        let runs = json!({"counts": mask.column_runs(width, height), "size": [height, width]});
        format!("\"{i}\": {runs}")
    };
    let entries: Vec<String> = masks.into_iter().enumerate().map(entry).collect();
    format!("{{{}}}\n", entries.join(",\n"))
}

impl BopScene {
    /// Adds an image.
    pub fn add_image(&mut self, id: i64, image: BopImage) {
        let key = id.to_string();
        self.cameras.insert(key.clone(), image.camera);
        self.poses.insert(key.clone(), image.poses);
        self.info.insert(key, image.info);
    }

    /// Names and texts of the files.
    pub fn files(&self) -> [(&'static str, String); 3] {
        [
            ("scene_camera.json", lines(&self.cameras)),
            ("scene_gt.json", lines(&self.poses)),
            ("scene_gt_info.json", lines(&self.info)),
        ]
    }
}

/// A JSON object with a line for each image, in the order of ids.
fn lines(images: &Map<String, Value>) -> String {
    let mut sorted: Vec<(i64, &Value)> =
        images.iter().map(|(key, value)| (key.parse().unwrap_or(0), value)).collect();
    sorted.sort_by_key(|(id, _)| *id);
    let lines: Vec<String> = sorted.iter().map(|(id, value)| format!("  \"{id}\": {value}")).collect();
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

fn millimetres(v: DVec3) -> [f64; 3] {
    v.to_array().map(|x| x * MILLIMETRES + 0.0)
}

/// The bounds as the BOP toolkit writes them: left, top, and the distances from there to the last column and the last row,
/// which are one less than the numbers of columns and rows; −1 without pixels.
fn bbox(bounds: Option<MaskRect>) -> Value {
    match bounds {
        Some(MaskRect { x, y, width, height }) => json!([x, y, width.max(1) - 1, height.max(1) - 1]),
        None => json!([-1, -1, -1, -1]),
    }
}

/// The mesh of an object in its own space.
#[derive(Clone, Debug, Default)]
pub struct BopModel {
    /// Positions in metres.
    pub vertices: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl BopModel {
    /// The model as a binary PLY file in millimetres.
    pub fn to_ply(&self) -> Vec<u8> {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.vertices.len(),
            self.triangles.len()
        );
        let mut bytes = header.into_bytes();
        for vertex in &self.vertices {
            bytes.extend(millimetres(*vertex).iter().flat_map(|x| (*x as f32).to_le_bytes()));
        }
        for triangle in &self.triangles {
            bytes.push(3);
            bytes.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
        }
        bytes
    }

    /// Its entry in [`MODELS_INFO`], in millimetres.
    pub fn info(&self) -> Value {
        let mut bounds = Aabb::EMPTY;
        self.vertices.iter().for_each(|&vertex| bounds.extend(vertex));
        let (low, size) = match bounds.is_empty() {
            true => ([0.0; 3], [0.0; 3]),
            false => (millimetres(bounds.min), millimetres(bounds.extent())),
        };
        json!({
            "diameter": diameter(&self.vertices) * MILLIMETRES,
            "min_x": low[0], "min_y": low[1], "min_z": low[2],
            "size_x": size[0], "size_y": size[1], "size_z": size[2],
        })
    }
}

/// Points up to which all pairs are compared.
const ALL_PAIRS: usize = 2048;

/// The largest distance between two points. Of many points, only those that lie farthest along some direction are
/// compared, which may miss up to 0.3 %.
fn diameter(points: &[DVec3]) -> f64 {
    let extreme: Vec<DVec3> = if points.len() <= ALL_PAIRS {
        points.to_vec()
    } else {
        directions().map(|d| farthest_along(points, d)).collect()
    };
    let mut largest: f64 = 0.0;
    for (i, a) in extreme.iter().enumerate() {
        for b in &extreme[..i] {
            largest = largest.max(a.distance_squared(*b));
        }
    }
    largest.sqrt()
}

/// Directions to the points of a grid on the surface of a cube.
fn directions() -> impl Iterator<Item = DVec3> {
    const SIDE: i32 = 8;
    let range = || -SIDE..=SIDE;
    let all = range().flat_map(move |x| range().flat_map(move |y| range().map(move |z| (x, y, z))));
    all.filter(|(x, y, z)| [x, y, z].iter().any(|v| v.abs() == SIDE))
        .map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()))
}

fn farthest_along(points: &[DVec3], d: DVec3) -> DVec3 {
    let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
    for &p in points {
        let along = p.dot(d);
        if along > best.0 {
            best = (along, p);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_have_their_extent_in_millimetres() {
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64 * 2.0, (i >> 2) as f64 * 2.0);
        let model = BopModel { vertices: (0..8).map(corner).collect(), triangles: vec![[0, 1, 2]] };
        let info = model.info();
        assert_eq!(info["diameter"], json!(3000.0));
        assert_eq!((info["size_z"].clone(), info["min_x"].clone()), (json!(2000.0), json!(0.0)));
        let ply = model.to_ply();
        assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\nelement vertex 8\n"));
        assert_eq!(ply[ply.len() - 13..], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }

    /// The decoder of BOP's toolkit: runs outside and inside of the mask in turn, down the columns.
    #[test]
    fn masks_of_samples_are_run_lengths_by_index() {
        let mut mask = PixelMask::default();
        [(0, 0), (2, 0), (2, 1)].into_iter().for_each(|(x, y)| mask.add(x, y));
        let text = bop_sample_masks((3, 2), [&PixelMask::default(), &mask]);
        let masks: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(masks["0"], json!({"counts": [6], "size": [2, 3]}));
        assert_eq!(masks["1"], json!({"counts": [0, 1, 3, 2], "size": [2, 3]}));
        assert_eq!(bop_sample_masks((3, 2), []), "{}\n");
    }

    #[test]
    fn boxes_are_those_of_the_toolkit() {
        let pixels = MaskRect { x: -3, y: 5, width: 4, height: 1 };
        assert_eq!(bbox(Some(pixels)), json!([-3, 5, 3, 0]));
        assert_eq!(bbox(None), json!([-1, -1, -1, -1]));
    }

    #[test]
    fn the_diameter_of_many_points_is_nearly_exact() {
        let turn = |i: usize| 2.399_963_229_728_653 * i as f64;
        let count = 20_000;
        let point = |i: usize| {
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * libm::cos(turn(i)), r * libm::sin(turn(i)), z)
        };
        let points: Vec<DVec3> = (0..count).map(point).collect();
        assert!((diameter(&points) / 2.0 - 1.0).abs() < 0.003, "{}", diameter(&points));
        assert_eq!(BopModel::default().info()["diameter"], json!(0.0));
    }
}
