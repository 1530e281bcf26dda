//! Resolved options: everything that decides the pixels of an image except its scene and frame.

mod camera;
mod environment_cache;
mod from_args;
mod lights;

use glam::DVec3;

use super::frames::PlannedFrame;
use crate::args::values::{AoArg, AovSelection, Exposure};
use blinn_import::LoadOptions;
use blinn_render::RenderSettings;
use blinn_render::display::{Background, ViewTransform};
use blinn_render::integrator::{MaterialOverrides, Stage};
use blinn_scene::{
    AnimationChoice, Camera, GroundKind, Lighting, Normalization, PosedScene, Scene, Selection, UnitShape,
    View, ViewError,
};

pub use from_args::load_options;

/// Longer side of an image without --size, in pixels.
const DEFAULT_SIDE: u32 = 1280;
/// Size of an image without --size and without a file camera: 16:9.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);

/// Everything that decides the pixels of an image except its scene and frame.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// With default limits: limits depend on the machine and decide no pixels.
    pub load: LoadOptions,
    pub selection: Selection,
    /// The value of --animation.
    pub animation: Option<String>,
    /// Width and height from --size.
    pub size: Option<(u32, u32)>,
    /// Longer side in pixels from --max-size.
    pub max_size: Option<u32>,
    pub settings: RenderSettings,
    /// The colour of pixels where there is nothing; opaque if the background is the environment.
    pub background: Background,
    /// The blur of an environment as the background; `None` if the background is not the environment.
    pub environment_background: Option<f32>,
    pub exposure: Option<Exposure>,
    /// `None` to choose by the origin of the scene.
    pub view_transform: Option<ViewTransform>,
    pub aovs: AovSelection,
    /// Metres per step of 16-bit depth beside images, from --depth-unit.
    pub depth_unit: Option<f64>,
    pub view: View,
    pub lighting: Lighting,
    pub shadows: bool,
    pub ao: Option<AoArg>,
    pub ground: Option<GroundKind>,
    pub stage: Stage,
    pub overrides: MaterialOverrides,
    pub bounces: u8,
    pub cull: BackFaceCulling,
    /// The shape that what is written of a dataset is scaled to.
    pub normalize: Option<UnitShape>,
    /// Set for turntables.
    pub rotation: Option<TurntableRotation>,
}

/// The back faces that eye rays pass through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackFaceCulling {
    Off,
    /// Those of single-sided materials.
    SingleSided,
    /// Those of all materials.
    All,
}

/// The object that a turntable rotates, and its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurntableRotation {
    /// Unit length.
    pub axis: DVec3,
    /// True to rotate the camera around the scene, false to rotate the scene in front of camera and lights.
    pub rotates_camera: bool,
}

impl RenderOptions {
    /// The animation that --animation selects. A name takes precedence over an index.
    pub fn animation(&self, scene: &Scene) -> anyhow::Result<AnimationChoice> {
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
                anyhow::bail!("there is no animation '{choice}'; the file has: {names}")
            }
        }
    }

    /// The camera of a frame, for an image of `size` pixels.
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

    /// Width and height of the rendered region, if they do not depend on the scene.
    pub fn known_size(&self) -> Option<(u32, u32)> {
        self.settings.crop.map(|crop| (crop.width, crop.height)).or(self.size)
    }

    /// Number of camera samples of `frames` images. Each ray of ambient occlusion counts as a sample.
    pub fn samples_of_frames(&self, scene: &Scene, frames: usize) -> u64 {
        let (width, height) = self.known_size().unwrap_or_else(|| self.size_for(scene));
        let pixels = u64::from(width) * u64::from(height);
        let per_pixel = u64::from(self.settings.samples) + self.ao.map_or(0, |ao| u64::from(ao.samples));
        pixels.saturating_mul(per_pixel).saturating_mul(frames as u64)
    }

    /// Width and height of the image: --size, else the aspect ratio of the file's camera, else 16:9, or square for
    /// --max-size.
    pub fn size_for(&self, scene: &Scene) -> (u32, u32) {
        if let Some(size) = self.size {
            return size;
        }
        let camera = match &self.view.camera {
            Some(name) => scene.find_camera(name),
            None if self.view.replaces_file_camera() => None,
            None => (!scene.cameras.is_empty()).then_some(0),
        };
        match (self.max_size, camera) {
            (None, _) => natural_size(scene, camera),
            // Framing shows a sphere.
            (Some(side), None) => (side, side),
            (Some(side), Some(_)) => scaled_to(side, natural_size(scene, camera)),
        }
    }
}

/// A size of the same aspect ratio, with `side` pixels at its longer side.
pub fn scaled_to(side: u32, (width, height): (u32, u32)) -> (u32, u32) {
    let scaled = |pixels: u32| {
        let exact = f64::from(pixels) * f64::from(side) / f64::from(width.max(height).max(1));
        exact.round().max(1.0) as u32
    };
    (scaled(width), scaled(height))
}

/// The default image size for a camera of the file, or for a framed scene.
pub fn natural_size(scene: &Scene, camera: Option<usize>) -> (u32, u32) {
    let aspect = camera.and_then(|i| scene.cameras[i].aspect()).filter(|a| (0.01..=100.0).contains(a));
    match aspect {
        None => DEFAULT_SIZE,
        Some(a) => {
            let side = f64::from(DEFAULT_SIDE);
            let (w, h) = if a >= 1.0 { (side, side / a) } else { (side * a, side) };
            (w.round().max(1.0) as u32, h.round().max(1.0) as u32)
        }
    }
}
