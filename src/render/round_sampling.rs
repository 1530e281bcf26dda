//! More samples at the borders of points and lines: few samples make a line of a pixel ragged.
//!
//! The eye rays of pixel centres are traced against points and lines alone, each at least a pixel wide. A pixel gets more
//! samples if some of the nine centres around it hit and some miss. Inside of thick ones and of dense clouds nothing is ragged.

use glam::{DVec2, UVec2};

use crate::film::PixelRect;
use crate::integrator::{Frame, Sample};
use crate::memory::TileScratch;
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use blinn_accel::{AcceptAll, RayBatch, RoundSize, RoundSizes};
use blinn_scene::Projection;

/// Samples at borders of points and lines, as edges have.
const BORDER_SAMPLES: u32 = 16;

/// Returns the settings for the pixels at borders of points and lines; `None` if they are those of all pixels.
pub(super) fn border_settings(settings: &RenderSettings, frame: &Frame) -> Option<RenderSettings> {
    // A single sample is the centre of a pixel, and adaptive sampling finds the borders itself.
    let is_coarse = (2..BORDER_SAMPLES).contains(&settings.samples) && settings.adaptive.is_none();
    let has_rounds = frame.rounds != RoundSizes::NONE && frame.accel.round_counts() != [0; 2];
    (is_coarse && has_rounds).then_some(RenderSettings { samples: BORDER_SAMPLES, ..*settings })
}

/// The samples of a picture's pixels.
pub(super) struct PixelSampling<'s> {
    pub generator: SampleGenerator<'s>,
    at_borders: Option<BorderSampling<'s>>,
}

struct BorderSampling<'s> {
    generator: SampleGenerator<'s>,
    settings: &'s RenderSettings,
    sizes: RoundSizes,
}

impl<'s> PixelSampling<'s> {
    /// Creates the samples of a picture, with the settings that [`border_settings`] returns.
    pub fn new(
        settings: &'s RenderSettings,
        at_borders: Option<&'s RenderSettings>,
        frame: &Frame,
    ) -> PixelSampling<'s> {
        let border = |settings: &'s RenderSettings| BorderSampling {
            generator: SampleGenerator::new(settings, frame.camera.lens),
            settings,
            sizes: of_a_pixel_or_more(frame, settings.height),
        };
        PixelSampling {
            generator: SampleGenerator::new(settings, frame.camera.lens),
            at_borders: at_borders.map(border),
        }
    }

    /// Renders the pixels of a tile with `render`, in the order of [`PixelRect::pixels`].
    pub fn render<T: Default>(
        &self,
        frame: &Frame,
        tile: PixelRect,
        scratch: &mut TileScratch,
        mut render: impl FnMut(&SampleGenerator, &[UVec2], &mut TileScratch) -> Vec<T>,
    ) -> Vec<T> {
        let pixels: Vec<UVec2> = tile.pixels().collect();
        let Some(border) = &self.at_borders else { return render(&self.generator, &pixels, scratch) };
        let is_border = border.pixels(frame, tile);
        let at = |pixel: &UVec2| is_border[index(tile, *pixel)];
        let (at_borders, others): (Vec<UVec2>, Vec<UVec2>) = pixels.iter().partition(|pixel| at(pixel));
        if at_borders.is_empty() {
            return render(&self.generator, &pixels, scratch);
        }
        let mut others = render(&self.generator, &others, scratch).into_iter();
        let mut at_borders = render(&border.generator, &at_borders, scratch).into_iter();
        let next = |pixel| if at(pixel) { at_borders.next() } else { others.next() };
        pixels.iter().map(next).map(Option::unwrap_or_default).collect()
    }
}

impl BorderSampling<'_> {
    /// Returns for each pixel of a tile, row by row, true if it lies at a border.
    fn pixels(&self, frame: &Frame, tile: PixelRect) -> Vec<bool> {
        // With a pixel around the tile, also beyond the picture.
        let (width, height) = (tile.width as usize + 2, tile.height as usize + 2);
        let position = |from: u32, offset: usize| f64::from(from) + offset as f64 - 0.5;
        let centre = |i: usize| Sample {
            x: position(tile.x, i % width) / f64::from(self.settings.width),
            y: 1.0 - position(tile.y, i / width) / f64::from(self.settings.height),
            footprint: [0.0; 2],
            pixel: UVec2::ZERO,
            index: 0,
            aperture: DVec2::ZERO,
        };
        let centres: Vec<Sample> = (0..width * height).map(centre).collect();
        let mut rays = RayBatch::default();
        frame.generate_eye_rays(&centres, &mut rays);
        rays.rounds = self.sizes;
        let is_hit = frame.accel.hit_any_round(&rays, &AcceptAll);
        let is_border = |x: usize, y: usize| {
            let around = (y..y + 3).flat_map(|y| (x..x + 3).map(move |x| y * width + x));
            let seen = around.filter(|&i| is_hit[i]).count();
            0 < seen && seen < 9
        };
        (0..height - 2)
            .flat_map(|y| (0..width - 2).map(move |x| (x, y)))
            .map(|(x, y)| is_border(x, y))
            .collect()
    }
}

/// The index of a pixel of a tile, row by row.
fn index(tile: PixelRect, pixel: UVec2) -> usize {
    (pixel.y - tile.y) as usize * tile.width as usize + (pixel.x - tile.x) as usize
}

/// Returns the sizes of points and lines in a picture of `height` pixels, each at least a pixel: thinner ones would pass between the
/// centres of pixels.
fn of_a_pixel_or_more(frame: &Frame, height: u32) -> RoundSizes {
    let half_pixel = (0.5 * frame.camera.view_height / f64::from(height.max(1))) as f32;
    let enlarge = |size: RoundSize| match frame.camera.projection {
        _ if !size.is_drawn() => RoundSize::NONE,
        Projection::Perspective => {
            RoundSize { min: size.min.max(half_pixel), max: size.max.max(half_pixel), ..size }
        }
        Projection::Orthographic => RoundSize { in_scene: size.in_scene.max(half_pixel), ..size },
    };
    RoundSizes { points: enlarge(frame.rounds.points), lines: enlarge(frame.rounds.lines) }
}
