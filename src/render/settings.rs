//! How a picture is sampled.

use glam::{DVec2, UVec2};

use crate::film::PixelRect;
use crate::filter::PixelFilter;
use crate::integrator::{Frame, Sample};

/// The noisy light of a picture that is reconstructed from its samples (`--denoise`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Denoise {
    /// All that random estimators find: of area lights, indirect light, soft shadows and ambient occlusion; in pictures
    /// without them, what rough metals reflect, with a faster filter.
    Auto,
    /// The same, with the better filter for rough metals, too.
    On,
    /// None.
    Off,
}

/// How a picture is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Pixels to the right, n_x.
    pub width: u32,
    /// Pixels downward, n_y.
    pub height: u32,
    /// Samples per pixel; 1 is the pixel's centre.
    pub samples: u32,
    /// How samples are distributed about the pixel's centre.
    pub filter: PixelFilter,
    /// Varies the positions of samples.
    pub seed: u32,
    /// Only some pixels get more than four samples; `None`: all do.
    pub adaptive: Option<AdaptiveSampling>,
    /// The noisy light that is reconstructed. Not with `adaptive`.
    pub denoise: Denoise,
    /// The part that is rendered; `None` for all.
    pub crop: Option<PixelRect>,
    /// Side of a tile in pixels. The picture does not depend on it.
    pub tile: u32,
}

/// Sources of noise in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoiseSources {
    /// Random estimators find part of the light.
    pub random_light: bool,
    /// Metals reflect in lobes that are wider than a mirror's.
    pub rough_metals: bool,
    /// The camera has a lens.
    pub lens: bool,
}

impl NoiseSources {
    /// Those of a frame.
    pub(crate) fn of_frame(frame: &Frame) -> NoiseSources {
        NoiseSources {
            random_light: frame.has_random_light(),
            rough_metals: frame.has_rough_metals(),
            lens: frame.camera.lens.is_some(),
        }
    }

    /// Each source without the others.
    pub(crate) fn each(&self) -> [NoiseSources; 3] {
        let NoiseSources { random_light, rough_metals, lens } = *self;
        let none = NoiseSources::default();
        [
            NoiseSources { random_light, ..none },
            NoiseSources { rough_metals, ..none },
            NoiseSources { lens, ..none },
        ]
    }
}

/// Adaptive sampling: which pixels get all their samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSampling {
    /// The least difference of neighbouring pixels, as displayed: black is 0, white is 1.
    pub threshold: f32,
    /// Exposure of the display in stops.
    pub ev: f64,
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            width: 1280,
            height: 720,
            samples: 4,
            filter: PixelFilter::BlackmanHarris,
            seed: 0,
            adaptive: None,
            denoise: Denoise::Off,
            crop: None,
            tile: 32,
        }
    }
}

impl RenderSettings {
    /// The pixels that are rendered: the crop window, or the whole picture.
    pub fn window(&self) -> PixelRect {
        self.crop.unwrap_or(PixelRect { x: 0, y: 0, width: self.width, height: self.height })
    }

    /// True if the noise of a frame stays although it should be removed: a single sample does not show what is noise.
    pub fn keeps_noise(&self, frame: &Frame) -> bool {
        self.samples == 1 && self.denoise != Denoise::Off && frame.has_random_light()
    }

    /// True if all noisy light is reconstructed.
    pub(crate) fn filters_all_light(&self, noise: &NoiseSources) -> bool {
        let applies = match self.denoise {
            Denoise::Auto => noise.random_light,
            Denoise::On => noise.random_light || noise.rough_metals || noise.lens,
            Denoise::Off => false,
        };
        applies && self.filters_noise()
    }

    /// True if what rough metals reflect is reconstructed, and all other light is as it is.
    pub(crate) fn filters_rough_reflections(&self, noise: &NoiseSources) -> bool {
        noise.rough_metals && self.filters_noise() && !self.filters_all_light(noise)
    }

    /// True if what the camera's lens blurs is reconstructed.
    pub(crate) fn filters_lens_blur(&self, noise: &NoiseSources) -> bool {
        noise.lens && self.filters_noise()
    }

    fn filters_noise(&self) -> bool {
        self.denoise != Denoise::Off && self.adaptive.is_none() && self.samples > 1
    }

    /// A sample without footprint at the centre of a pixel, through the centre of the lens.
    #[inline(always)]
    pub(super) fn centre_sample(&self, pixel: UVec2) -> Sample {
        let x = (f64::from(pixel.x) + 0.5) / f64::from(self.width);
        let down = (f64::from(pixel.y) + 0.5) / f64::from(self.height);
        Sample { x, y: 1.0 - down, footprint: [0.0; 2], pixel, index: 0, aperture: DVec2::ZERO }
    }
}
