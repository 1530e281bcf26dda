//! Annotations in the format of COCO: boxes, areas and masks of objects, visible and amodal.

use serde_json::{Value, json};

use blinn_render::{MaskRect, PixelMask};

/// The form of masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CocoMasks {
    /// Compressed run lengths.
    #[default]
    RunLengths,
    /// Polygons along the edges of pixels, which pycocotools decodes to the same pixels.
    Polygons,
}

/// The annotations of a dataset.
#[derive(Clone, Debug, Default)]
pub struct CocoDataset {
    /// Width and height of all images in pixels.
    pub size: (u32, u32),
    /// All categories.
    pub categories: Vec<CocoCategory>,
    /// The form of masks.
    pub masks: CocoMasks,
    /// Metres per step of integer depth layers, if there are any. Images name it as `transforms.json` does.
    pub depth_step: Option<f64>,
    /// The lines of the file, which take less memory than values.
    images: Vec<String>,
    annotations: Vec<String>,
}

/// A category.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CocoCategory {
    /// Its id, from 1.
    pub id: usize,
    /// Its name.
    pub name: String,
}

/// An object in an image.
#[derive(Clone, Copy, Debug)]
pub struct CocoObject<'m> {
    /// Number of the object, from 1.
    pub object: u32,
    /// Name of the object.
    pub name: &'m str,
    /// Index of the category.
    pub category: usize,
    /// Visible pixels of the image; not empty.
    pub visible: &'m PixelMask,
    /// Pixels that the object covers alone.
    pub amodal: &'m PixelMask,
}

impl CocoDataset {
    /// A dataset without images.
    pub fn new(size: (u32, u32), categories: Vec<CocoCategory>, masks: CocoMasks) -> CocoDataset {
        CocoDataset { size, categories, masks, ..CocoDataset::default() }
    }

    /// Adds an image and the objects that it shows. Masks count from its upper left corner.
    pub fn add_image<'m>(&mut self, id: i64, file: &str, objects: impl IntoIterator<Item = CocoObject<'m>>) {
        let (width, height) = self.size;
        let mut image = json!({"id": id, "file_name": file, "width": width, "height": height});
        if let Some(step) = self.depth_step {
            image["integer_depth_scale"] = json!(step);
        }
        self.images.push(image.to_string());
        for object in objects {
            let Some(bounds) = object.visible.bounds() else { continue };
            let (visible, amodal) = (object.visible.area(), object.amodal.area());
            let annotation = json!({
                "id": self.annotations.len() + 1,
                "image_id": id,
                "category_id": self.categories[object.category].id,
                "object_id": object.object,
                "name": object.name,
                "iscrowd": 0,
                "bbox": bbox(bounds),
                "area": visible,
                "segmentation": self.segmentation(object.visible),
                "amodal_bbox": object.amodal.bounds().map(bbox),
                "amodal_area": amodal,
                "amodal_segmentation": self.segmentation(object.amodal),
                "visible_fraction": visible as f64 / amodal.max(1) as f64,
            });
            self.annotations.push(annotation.to_string());
        }
    }

    /// The text of the file.
    pub fn to_json(&self) -> String {
        let head = CocoDataset::head(&self.categories, &self.images);
        format!("{{\n{head},\n\"annotations\": {}\n}}\n", json_lines(&self.annotations))
    }

    /// The entries of a file before its annotations, from categories and lines of images.
    pub(super) fn head(categories: &[CocoCategory], images: &[String]) -> String {
        let category = |CocoCategory { id, name }: &CocoCategory| {
            json!({"id": id, "name": name, "supercategory": ""}).to_string()
        };
        let categories: Vec<String> = categories.iter().map(category).collect();
        let description = concat!("rendered by blinn ", env!("CARGO_PKG_VERSION"));
        format!(
            "\"info\": {},\n\"licenses\": [],\n\"categories\": {},\n\"images\": {}",
            json!({"description": description}),
            json_lines(&categories),
            json_lines(images)
        )
    }

    fn segmentation(&self, mask: &PixelMask) -> Value {
        let (width, height) = self.size;
        match self.masks {
            CocoMasks::RunLengths => {
                json!({"size": [height, width], "counts": compress_runs(&mask.column_runs(width, height))})
            }
            CocoMasks::Polygons => json!(mask.outlines()),
        }
    }
}

/// A list with a line for each value.
fn json_lines(lines: &[String]) -> String {
    match lines {
        [] => "[]".into(),
        _ => format!("[\n  {}\n]", lines.join(",\n  ")),
    }
}

fn bbox(bounds: MaskRect) -> Value {
    json!([bounds.x, bounds.y, bounds.width, bounds.height])
}

/// COCO's text for run lengths: each length from the third on as the difference to the one before the last, in groups of
/// five bits, lowest first, as characters from `0` on; bit 6 announces another group.
fn compress_runs(runs: &[u64]) -> String {
    let mut text = String::new();
    for (i, &run) in runs.iter().enumerate() {
        let before = if i > 2 { runs[i - 2] } else { 0 };
        let mut rest = run as i64 - before as i64;
        loop {
            let bits = (rest & 0x1f) as u8;
            rest >>= 5;
            let is_last = if bits & 0x10 != 0 { rest == -1 } else { rest == 0 };
            text.push(char::from(bits + if is_last { 48 } else { 48 + 32 }));
            if is_last {
                break;
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The inverse of `compress_runs`, after the C code of pycocotools.
    fn decompress(text: &str) -> Vec<u64> {
        let mut runs: Vec<i64> = Vec::new();
        let mut bytes = text.bytes();
        while bytes.len() > 0 {
            let (mut x, mut k) = (0i64, 0);
            loop {
                let c = i64::from(bytes.next().unwrap()) - 48;
                x |= (c & 0x1f) << (5 * k);
                k += 1;
                if c & 0x20 == 0 {
                    if c & 0x10 != 0 {
                        x |= -1 << (5 * k);
                    }
                    break;
                }
            }
            if runs.len() > 2 {
                x += runs[runs.len() - 2];
            }
            runs.push(x);
        }
        runs.into_iter().map(|x| x as u64).collect()
    }

    #[test]
    fn run_lengths_survive_compression() {
        let lists: [&[u64]; 5] = [
            &[0],
            &[12, 3, 5],
            &[0, 1, 2, 3, 100_000, 1, 1],
            &[15, 16, 17, 31, 32, 33],
            &[7, 1 << 29, 5, 2, 9],
        ];
        for runs in lists {
            let text = compress_runs(runs);
            assert_eq!(decompress(&text), runs, "{text}");
            assert!(text.bytes().all(|b| (48..112).contains(&b)));
        }
        // The example of pycocotools' documentation of the form: a 4 × 4 image with two set columns.
        assert_eq!(compress_runs(&[4, 8, 4]), "484");
    }

    #[test]
    fn hidden_objects_have_no_annotation() {
        let mut mask = PixelMask::default();
        [(1, 0), (2, 0), (1, 1)].into_iter().for_each(|(x, y)| mask.add(x, y));
        let categories =
            [(1, "a"), (5, "b")].map(|(id, name)| CocoCategory { id, name: name.into() }).to_vec();
        let mut data = CocoDataset::new((4, 3), categories, CocoMasks::Polygons);
        let object = |visible| CocoObject { object: 7, name: "n", category: 1, visible, amodal: &mask };
        data.depth_step = Some(0.002);
        data.add_image(3, "x.png", [object(&mask), object(&PixelMask::default())]);
        let value: Value = serde_json::from_str(&data.to_json()).unwrap();
        let annotations = value["annotations"].as_array().unwrap();
        assert_eq!(annotations.len(), 1);
        assert_eq!(annotations[0]["bbox"], json!([1, 0, 2, 2]));
        assert_eq!(
            (annotations[0]["area"].clone(), annotations[0]["category_id"].clone()),
            (json!(3), json!(5))
        );
        assert_eq!(value["images"][0]["id"], json!(3));
        assert_eq!(value["images"][0]["integer_depth_scale"], json!(0.002));
        assert_eq!(annotations[0]["segmentation"], json!([[1, 0, 3, 0, 3, 1, 2, 1, 2, 2, 1, 2]]));
    }
}
