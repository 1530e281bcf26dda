//! Options of images: everything that decides the pixels of an image except its scene and frame.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::edge_options::EdgeOptions;
use crate::error::SessionError;
use crate::image_size::{DEFAULT_SIZE, natural_size, scaled_to};
use crate::planned_frame::PlannedFrame;
use crate::round_sizes::RoundWidth;
use blinn_core::closest_name::did_you_mean;
use blinn_core::geometry::Rgb;
use blinn_import::LoadOptions;
use blinn_render::display::{Background, Look, ViewTransform};
use blinn_render::integrator::{Aov, DEFAULT_BOUNCES, MaterialOverrides, MatteKind, Stage};
use blinn_render::{AdaptiveSampling, Denoise, PixelFilter, PixelRect, RenderSettings};
use blinn_scene::{
    AnimationChoice, Camera, GroundKind, Lighting, Normalization, PosedScene, Scene, Selection, UnitShape,
    View, ViewError,
};

/// Everything that decides the pixels of an image except its scene and frame. The default is that of `blinn render`.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Options {
    /// How the file is read. With default limits: limits depend on the machine and decide no pixels.
    pub load: LoadOptions,
    /// Blender, or a Python with its module `bpy`, for .blend files; found if `None`.
    #[serde(serialize_with = "crate::settings_hash::optional_path")]
    pub blender: Option<PathBuf>,
    /// The objects that are shown.
    pub selection: Selection,
    /// Animation to play: a name, an index, `all` or `none`. `None` plays all that have different targets.
    pub animation: Option<String>,
    /// Width and height in pixels. `None` for the file's, or the aspect ratio of its camera, or else 16:9.
    pub size: Option<(u32, u32)>,
    /// Longer side in pixels, if there is no size.
    pub max_size: Option<u32>,
    /// Samples per pixel; a single sample is at the pixel's centre.
    pub samples: u32,
    /// Reconstruction filter.
    pub filter: PixelFilter,
    /// Seed of the sample positions.
    pub seed: u32,
    /// Use all samples only where neighbouring pixels differ by more than this, as displayed from 0 to 1, and four
    /// elsewhere.
    pub adaptive: Option<f32>,
    /// The rendered region; `None` for the file's, or all.
    pub crop: Option<PixelRect>,
    /// The background; `None` for the file's, or [`DEFAULT_BACKGROUND`], or black for [`Stage::Color`].
    pub background: Option<ImageBackground>,
    /// Blur of the environment as the background, from 0 (sharp) to 1. `None` for 0.
    pub background_blur: Option<f32>,
    /// Exposure; `None` for the file's, or to meter if the lights are the file's, and else 0.
    pub exposure: Option<Exposure>,
    /// View transform; `None` for the file's, or to choose by the origin of the scene.
    pub view_transform: Option<ViewTransform>,
    /// A look of AgX; `None` for that of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look: Option<Look>,
    /// Encoded colours are raised to the power 1 / gamma; `None` for that of the file, else 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    /// Layers beside the colour.
    pub aovs: AovSelection,
    /// Metres per step of 16-bit depth beside images; `None` for a preview, and for what suits the scene in a dataset.
    pub depth_unit: Option<f64>,
    /// The camera.
    pub view: View,
    /// A file with the lecture's `<camera>` block. Fields of `view` take precedence over it.
    #[serde(serialize_with = "crate::settings_hash::optional_path")]
    pub camera_file: Option<PathBuf>,
    /// Light sources, ambient light and environment.
    pub lighting: Lighting,
    /// The environment to load; it replaces that of `lighting`.
    pub environment: Option<EnvironmentSource>,
    /// False to disable shadows.
    pub shadows: bool,
    /// Ambient occlusion.
    pub ao: Option<OcclusionSampling>,
    /// A ground below the scene.
    pub ground: Option<GroundKind>,
    /// Terms of the shading model.
    pub stage: Stage,
    /// Coefficients that replace those of all materials.
    pub overrides: MaterialOverrides,
    /// Maximum reflections along a path.
    pub bounces: u8,
    /// Maximum diffuse bounces along a path, in place of the ambient light. `None` for the file's, or 0.
    pub indirect: Option<u8>,
    /// True if indirect light includes what specular surfaces send to matte ones. `None` for the file's choice, or false.
    pub caustics: Option<bool>,
    /// The noisy light that is reconstructed.
    pub denoise: Denoise,
    /// Diameter of points.
    pub point_size: RoundWidth,
    /// Width of lines.
    pub line_width: RoundWidth,
    /// Edges over the picture.
    pub edges: EdgeOptions,
    /// The back faces that eye rays pass through.
    pub cull: BackFaceCulling,
    /// The shape that what is written of a dataset is scaled to.
    pub normalize: Option<UnitShape>,
    /// Set for turntables.
    pub rotation: Option<TurntableRotation>,
}

/// The background where there is nothing: dark grey, linear.
pub const DEFAULT_BACKGROUND: Background = Background::Color(Rgb::splat(0.05));

impl Default for Options {
    fn default() -> Options {
        let RenderSettings { samples, filter, seed, .. } = RenderSettings::default();
        Options {
            load: LoadOptions::default(),
            blender: None,
            selection: Selection::default(),
            animation: None,
            size: None,
            max_size: None,
            samples,
            filter,
            seed,
            adaptive: None,
            crop: None,
            background: None,
            background_blur: None,
            exposure: None,
            view_transform: None,
            look: None,
            gamma: None,
            aovs: AovSelection::default(),
            depth_unit: None,
            view: View::default(),
            camera_file: None,
            lighting: Lighting::default(),
            environment: None,
            shadows: true,
            ao: None,
            ground: None,
            stage: Stage::Phong,
            overrides: MaterialOverrides::default(),
            bounces: DEFAULT_BOUNCES,
            indirect: None,
            caustics: None,
            denoise: Denoise::Auto,
            point_size: RoundWidth::Auto,
            line_width: RoundWidth::Auto,
            edges: EdgeOptions::default(),
            cull: BackFaceCulling::SingleSided,
            normalize: None,
            rotation: None,
        }
    }
}

/// A background of images.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum ImageBackground {
    /// The same for all pixels.
    Fixed(Background),
    /// The environment that lights the scene.
    Environment,
}

/// An environment before it is loaded.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub enum EnvironmentSource {
    /// An equirectangular picture.
    File(#[serde(serialize_with = "crate::settings_hash::path")] PathBuf),
    /// Soft boxes in a dark room.
    Studio,
    /// A clear sky.
    Sky,
}

impl EnvironmentSource {
    /// Reads a name, `studio` or `sky`, or else a path.
    pub fn new(path: &Path) -> EnvironmentSource {
        match path.to_str() {
            Some("studio") => EnvironmentSource::Studio,
            Some("sky") => EnvironmentSource::Sky,
            _ => EnvironmentSource::File(path.to_path_buf()),
        }
    }

    /// The file, if it is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            EnvironmentSource::File(path) => Some(path),
            EnvironmentSource::Studio | EnvironmentSource::Sky => None,
        }
    }
}

/// An exposure.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum Exposure {
    /// Metered.
    Auto,
    /// In stops.
    Stops(f64),
}

/// Ambient occlusion as options describe it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct OcclusionSampling {
    /// Rays per pixel.
    pub samples: u32,
    /// Maximum distance of occluders in metres; `None` for a quarter of the scene's diagonal.
    pub distance: Option<f64>,
}

/// The AOVs to write beside the colour.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct AovSelection {
    /// AOVs sampled at pixel centres.
    pub aovs: Vec<Aov>,
    /// Cryptomattes of objects and materials.
    pub cryptomatte: bool,
}

/// The name that selects cryptomattes in a list of AOVs.
pub const CRYPTOMATTE: &str = "cryptomatte";

impl AovSelection {
    /// Selects every AOV.
    pub fn all() -> AovSelection {
        AovSelection { aovs: Aov::ALL.to_vec(), cryptomatte: true }
    }

    /// True if nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.aovs.is_empty() && !self.cryptomatte
    }

    /// Names of the preview images.
    pub fn preview_names(&self) -> Vec<String> {
        let aovs = self.aovs.iter().map(|aov| aov.name().to_string());
        let mattes = MatteKind::ALL.iter().filter(|_| self.cryptomatte);
        aovs.chain(mattes.map(|kind| format!("{CRYPTOMATTE}-{}", kind.name()))).collect()
    }
}

/// The back faces that eye rays pass through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum BackFaceCulling {
    /// None.
    Off,
    /// Those of single-sided materials.
    SingleSided,
    /// Those of all materials.
    All,
}

/// The object that a turntable rotates, and its axis.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct TurntableRotation {
    /// Unit length.
    pub axis: DVec3,
    /// True to rotate the camera around the scene, false to rotate the scene in front of camera and lights.
    pub rotates_camera: bool,
}

impl Options {
    /// The background where there is nothing; opaque if the background is the environment.
    pub fn fixed_background(&self) -> Background {
        match (self.background, self.stage) {
            (None, _) if self.edges.alone => Background::Transparent,
            (Some(ImageBackground::Fixed(background)), _) => background,
            // The environment covers it.
            (Some(ImageBackground::Environment), _) => Background::Color(Rgb::ZERO),
            // As in the lecture: the colour of the surface, else black.
            (None, Stage::Color) => Background::Color(Rgb::ZERO),
            (None, _) => DEFAULT_BACKGROUND,
        }
    }

    /// The blur of the environment as the background; `None` if the background is not the environment.
    pub fn environment_blur(&self) -> Option<f32> {
        let is_environment = self.background == Some(ImageBackground::Environment);
        is_environment.then(|| self.background_blur.unwrap_or(0.0))
    }

    /// The animation of `scene` that the options select. A name takes precedence over an index.
    ///
    /// # Errors
    /// The scene has no such animation.
    pub fn animation(&self, scene: &Scene) -> Result<AnimationChoice, SessionError> {
        let Some(choice) = self.animation.as_deref() else { return Ok(AnimationChoice::Default) };
        let animations = &scene.animations;
        if let Some(i) = animations.iter().position(|animation| animation.name == choice) {
            return Ok(AnimationChoice::One(i));
        }
        match (choice, choice.parse::<usize>()) {
            ("all", _) => Ok(AnimationChoice::All),
            ("none", _) => Ok(AnimationChoice::Rest),
            (_, Ok(i)) if i < animations.len() => Ok(AnimationChoice::One(i)),
            (_, Ok(0)) => Ok(AnimationChoice::Rest),
            _ => {
                let names = animations.iter().enumerate().map(|(i, a)| format!("{i} '{}'", a.name));
                let names = names.collect::<Vec<_>>().join(", ");
                let names = if names.is_empty() { "none" } else { &names };
                let hint = did_you_mean(choice, animations.iter().map(|animation| &animation.name));
                let text = format!("there is no animation '{choice}'; the file has: {names}{hint}");
                Err(SessionError::Option(text))
            }
        }
    }

    /// The camera of a frame, for an image of `size` pixels.
    ///
    /// # Errors
    /// The view does not suit the scene.
    pub fn camera(
        &self,
        frame: &PlannedFrame,
        posed: &PosedScene,
        size: (u32, u32),
    ) -> Result<Camera, ViewError> {
        let orbit = frame.view.map(|view| view.orbit).or(self.view.orbit);
        let view = View { orbit, ..self.view.clone() };
        let (mut camera, _) = view.resolve(posed, size.0, size.1)?;
        if let Some(sampled) = frame.view.filter(|view| view.moves_camera()) {
            let sphere = posed.clip_sphere();
            let centre = self.view.look_at.unwrap_or(sphere.centre);
            let metres_per_unit = 1.0 / self.normalization(posed).scale;
            sampled.in_metres(metres_per_unit).place(&mut camera, centre, sphere.radius);
        }
        Ok(camera)
    }

    /// From the scene's world to the coordinates that are written.
    pub fn normalization(&self, posed: &PosedScene) -> Normalization {
        self.normalize.map_or(Normalization::IDENTITY, |shape| Normalization::new(shape, posed))
    }

    /// How an image of `size` pixels is sampled. `ev` is its exposure in stops.
    pub fn render_settings(&self, (width, height): (u32, u32), ev: f64) -> RenderSettings {
        RenderSettings {
            width,
            height,
            samples: self.samples,
            filter: self.filter,
            seed: self.seed,
            adaptive: self.adaptive.map(|threshold| AdaptiveSampling { threshold, ev }),
            denoise: self.denoise,
            crop: self.crop,
            tile: if self.samples > 16 { 16 } else { 32 },
        }
    }

    /// Width and height of the rendered region, if they do not depend on the scene.
    pub fn known_size(&self) -> Option<(u32, u32)> {
        self.crop.map(|crop| (crop.width, crop.height)).or(self.size)
    }

    /// Number of camera samples of `frames` images. Each ray of ambient occlusion counts as a sample.
    pub fn samples_of_frames(&self, scene: &Scene, frames: usize) -> u64 {
        self.samples_at(self.known_size().unwrap_or_else(|| self.size_for(scene)), frames)
    }

    /// Samples in `frames` images of a scene that is not known yet, of the default size if that depends on the scene.
    pub(crate) fn planned_samples(&self, frames: usize) -> u64 {
        self.samples_at(
            self.known_size().or(self.max_size.map(|side| (side, side))).unwrap_or(DEFAULT_SIZE),
            frames,
        )
    }

    fn samples_at(&self, (width, height): (u32, u32), frames: usize) -> u64 {
        let pixels = u64::from(width) * u64::from(height);
        let per_pixel = u64::from(self.samples) + self.ao.map_or(0, |ao| u64::from(ao.samples));
        pixels.saturating_mul(per_pixel).saturating_mul(frames as u64)
    }

    /// Index of the file's camera that images use.
    pub(crate) fn file_camera(&self, scene: &Scene) -> Option<usize> {
        match &self.view.camera {
            Some(name) => scene.find_camera(name),
            None if self.view.replaces_file_camera() => None,
            None => scene.default_camera(),
        }
    }

    /// Width and height of the image: [`Options::size`], else the file's, else the aspect ratio of the file's camera, else
    /// 16:9, or square for [`Options::max_size`].
    pub fn size_for(&self, scene: &Scene) -> (u32, u32) {
        if let Some(size) = self.size {
            return size;
        }
        let camera = self.file_camera(scene);
        match (self.max_size, camera) {
            (None, _) => scene.settings.size.unwrap_or_else(|| natural_size(scene, camera)),
            // Framing shows a sphere.
            (Some(side), None) => (side, side),
            (Some(side), Some(_)) => scaled_to(side, natural_size(scene, camera)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_environments_are_no_files() {
        let parse = |text: &str| EnvironmentSource::new(text.as_ref());
        assert_eq!((parse("studio"), parse("sky")), (EnvironmentSource::Studio, EnvironmentSource::Sky));
        for file in ["./studio", "Sky", "a/sky", "sky.hdr"] {
            assert_eq!(parse(file).file(), Some(file.as_ref()));
        }
    }
}
