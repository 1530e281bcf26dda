//! A list of cameras: names, sizes and cameras of images.

use std::path::Path;

use blinn_import::{CameraFile, Limits, ListedCamera, LoadError, RecordedView};
use blinn_output::datasets::WorldUp;
use blinn_render::PixelRect;
use blinn_scene::{Camera, ClipPlanes, LightRotation, Normalization, UpAxis};

/// The cameras of a list, each for an image.
#[derive(Debug)]
pub struct CameraList {
    file: CameraFile,
    replaced: ReplacedCameraFields,
}

/// Fields that options replace in every camera of a list.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReplacedCameraFields {
    /// Width and height in pixels.
    pub size: Option<(u32, u32)>,
    /// The rendered region.
    pub crop: Option<PixelRect>,
    /// Near and far plane.
    pub clip: Option<ClipPlanes>,
}

/// The camera of an image, with what else a list or a dataset sets for it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ImageCamera {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the image without crop.
    pub size: (u32, u32),
    /// The rendered region.
    pub crop: Option<PixelRect>,
    /// Metres, or units of the normalization, per step of 16-bit depth.
    pub depth_step: Option<f64>,
    /// Rotation of the light.
    pub light: LightRotation,
    /// From the scene's world to the units of layers. `None` for metres.
    pub normalization: Option<Normalization>,
}

impl CameraList {
    /// Opens a list of cameras: a file, or a folder of COLMAP's. `up` replaces the up axis that the list has.
    ///
    /// # Errors
    /// The file cannot be read, or is no list of cameras.
    pub fn open(
        path: &Path,
        up: Option<UpAxis>,
        replaced: ReplacedCameraFields,
        limits: &Limits,
    ) -> Result<CameraList, LoadError> {
        let file = CameraFile::open(path, limits)?;
        let up = up.unwrap_or_else(|| file.up());
        Ok(CameraList { file: file.with_up(up), replaced })
    }

    /// The file of the list.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Path that finds the list again: a file, or true and the folder of a list of several files.
    pub fn input(&self) -> (&Path, bool) {
        let file = self.file.path();
        match file.parent().filter(|_| self.file.has_several_files()) {
            Some(folder) => (folder, true),
            None => (file, false),
        }
    }

    /// The up axis of the world that the list describes.
    pub fn world_up(&self) -> WorldUp {
        match self.file.up() {
            UpAxis::Y => WorldUp::Y,
            UpAxis::Z => WorldUp::Z,
        }
    }

    /// Number of cameras, at least one.
    #[allow(clippy::len_without_is_empty, reason = "no list is empty")]
    pub fn len(&self) -> usize {
        self.file.len()
    }

    /// Number of pictures that are left out, as the list has no pose for them.
    pub fn without_pose(&self) -> usize {
        self.file.without_pose()
    }

    /// A camera as the list has it.
    ///
    /// # Errors
    /// The file changed.
    pub fn listed(&self, index: usize) -> Result<ListedCamera, LoadError> {
        self.file.camera(index)
    }

    /// The time of a camera in seconds, if it has one.
    pub fn time(&self, index: usize) -> Option<f64> {
        self.file.time(index)
    }

    /// The name of a camera for output files: that of its picture, else its number.
    pub fn name(&self, index: usize) -> String {
        let name = self.file.camera(index).ok().and_then(|camera| camera.name);
        name.unwrap_or_else(|| format!("{:04}", index + 1))
    }

    /// The camera of an image. It does not depend on the scene.
    ///
    /// # Errors
    /// The file changed.
    pub fn camera(&self, index: usize) -> Result<ImageCamera, LoadError> {
        self.file.camera(index).map(|listed| self.image_camera(&listed))
    }

    /// The camera of an image, from what the list has.
    pub(crate) fn image_camera(&self, listed: &ListedCamera) -> ImageCamera {
        // All cameras were checked to have a size.
        let (size, crop) = self.size_of(listed).unwrap_or(((1, 1), None));
        let camera = listed.camera(size);
        let recorded = self.recorded();
        let camera =
            recorded.map_or(Camera { clip: ClipPlanes::OFF, ..camera }, |view| view.lens_of(&camera));
        let camera = Camera { clip: self.replaced.clip.unwrap_or(camera.clip), ..camera };
        let normalization = self.file.normalization();
        ImageCamera { camera, size, crop, depth_step: listed.depth_step, light: listed.light, normalization }
    }

    /// The recorded lens of blinn's own list, if no option changes the size of images.
    fn recorded(&self) -> Option<&RecordedView> {
        self.file.recorded().filter(|_| self.replaced.size.is_none() && self.replaced.crop.is_none())
    }

    /// Width and height of an image, and the rendered region.
    pub fn size_of(&self, listed: &ListedCamera) -> Option<((u32, u32), Option<PixelRect>)> {
        if let Some(view) = self.recorded() {
            let crop = view.crop.map(|[x, y, width, height]| PixelRect { x, y, width, height });
            return Some((view.size, crop));
        }
        Some((self.replaced.size.or(listed.size)?, self.replaced.crop))
    }
}
