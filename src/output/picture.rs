//! A rendered image with its AOV layers and cryptomattes, ready to be encoded.

use std::sync::Arc;

use blinn_render::display::Display;
use blinn_render::integrator::Aov;
use blinn_render::{AovLayer, Matte, PixelRect, Pixels};

/// The key under which formats with named metadata store [`Picture::fingerprint`].
pub(super) const FINGERPRINT_KEY: &str = "blinn";

/// A rendered image with its layers and the transform to display values.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Premultiplied linear colour.
    pub pixels: Pixels,
    /// AOV layers of the same size.
    pub layers: Vec<AovLayer>,
    /// Cryptomattes of the same size.
    pub mattes: Vec<Matte>,
    /// Exposure, view transform and background. Formats with linear colour ignore the view transform.
    pub display: Display,
    /// The rectangle of a larger image that was rendered; `None` for the full image.
    pub crop_window: Option<CropWindow>,
    /// Metres per step of the 16-bit depth layer, in which 0 means no hit. `None`: the depth layer is a preview.
    pub depth_step: Option<f64>,
    /// Names of the ids in layers.
    pub id_names: Arc<IdNames>,
    /// A line of ASCII that is stored in the file; [`read_fingerprint`](super::read_fingerprint) reads it back.
    pub fingerprint: Option<String>,
}

/// Names of objects and materials as in the scene: index 0 is id 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdNames {
    /// Names of objects. They may be empty, and may not be unique.
    pub objects: Vec<String>,
    /// Names of materials.
    pub materials: Vec<String>,
}

impl IdNames {
    /// The names of the ids in a layer; `None` for layers without names.
    pub(super) fn of(&self, aov: Aov) -> Option<&[String]> {
        match aov {
            Aov::ObjectId => Some(&self.objects),
            Aov::MaterialId => Some(&self.materials),
            _ => None,
        }
    }
}

/// A rendered rectangle of a larger image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropWindow {
    /// The rendered rectangle.
    pub crop: PixelRect,
    /// Width of the full image in pixels.
    pub full_width: u32,
    /// Height of the full image in pixels.
    pub full_height: u32,
}

impl Picture {
    /// A full image without layers.
    pub fn new(pixels: Pixels, display: Display) -> Picture {
        Picture {
            pixels,
            layers: Vec::new(),
            mattes: Vec::new(),
            display,
            crop_window: None,
            depth_step: None,
            id_names: Arc::default(),
            fingerprint: None,
        }
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> (u32, u32) {
        (self.pixels.width, self.pixels.height)
    }
}
