//! Reconstruction of pictures with a depth of field: noisy light as in [`AllLight`], and then what is out of focus, which a few
//! samples of the aperture leave grainy.

use std::ops::Range;

use crate::denoise::{PartKind, SmoothKind, WAVELET_PIXEL, WaveletLight, smooth_light};
use crate::film::PixelRect;
use crate::integrator::{
    Frame, Integrator, LightSplit, LowDiscrepancySampler, NoisyLight, Sample, SampleParts, Scratch,
};
use crate::pixel_features::{PixelFeatures, color_of};
use crate::progress::ProgressMonitor;
use crate::reconstruction::{AllLight, PixelParts, band_bytes, divisor_of, filter_light};
use crate::settings::RenderSettings;
use crate::strips::Reconstruction;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Rgb, Rgba};

/// Radius of the circle of confusion in pixels from which on a pixel is out of focus.
const OUT_OF_FOCUS: f64 = 0.75;

/// Rows around a strip that smoothing depends on.
const SMOOTHING_MARGIN: usize = SmoothKind::OutOfFocus.margin();

/// Reconstruction of noisy light and of what is out of focus.
pub(super) struct LensBlur;

/// A pixel in parts, with what differs between its even and its odd samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LensPixel {
    parts: PixelParts,
    halves: [HalfColors; 2],
}

impl AsRef<PixelParts> for LensPixel {
    fn as_ref(&self) -> &PixelParts {
        &self.parts
    }
}

/// Means over half of the samples of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct HalfColors {
    /// Light without noise of its own.
    exact: Rgba,
    /// Colours that the parts of the noisy light are divided by.
    direct: Rgb,
    indirect: Rgb,
    specular: Rgb,
}

impl HalfColors {
    /// Averages every other sample, from the first or the second on.
    fn of_samples(samples: &[SampleParts], first: usize) -> HalfColors {
        let mut sum = HalfColors::default();
        let mut count = 0;
        for SampleParts { exact, surface, .. } in samples.iter().skip(first).step_by(2) {
            sum.exact += *exact;
            sum.direct += color_of(surface, PartKind::DirectDiffuse);
            sum.indirect += color_of(surface, PartKind::IndirectDiffuse);
            sum.specular += color_of(surface, PartKind::Specular);
            count += 1;
        }
        let share = 1.0 / count.max(1) as f32;
        HalfColors {
            exact: sum.exact * share,
            direct: sum.direct * share,
            indirect: sum.indirect * share,
            specular: sum.specular * share,
        }
    }

    /// The colour of the half, whose surfaces reflect the `light` of a pixel with the mean colours of `surface`.
    fn color(&self, surface: &PixelFeatures, light: &NoisyLight) -> Rgba {
        let relit = |light: Rgb, own: Rgb, kind| light * divisor_of(own) / divisor_of(surface.color(kind));
        let light = relit(light.direct, self.direct, PartKind::DirectDiffuse)
            + relit(light.indirect, self.indirect, PartKind::IndirectDiffuse)
            + relit(light.specular, self.specular, PartKind::Specular);
        self.exact + light.extend(0.0)
    }
}

impl Reconstruction for LensBlur {
    type Sample = SampleParts;
    type Pixel = LensPixel;
    type Output = Rgba;

    const ROWS: u32 = AllLight::ROWS;
    const MARGIN: u32 = AllLight::MARGIN + SMOOTHING_MARGIN as u32;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleParts],
    ) {
        integrator.render_parts(frame, samples, sampler, scratch, LightSplit::All, out);
    }

    fn pixel(samples: &[SampleParts]) -> LensPixel {
        let halves = [0, 1].map(|first| HalfColors::of_samples(samples, first));
        LensPixel { parts: PixelParts::of_samples(samples), halves }
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        let wide = width * rows.min(u64::from(LensBlur::ROWS) + 2 * SMOOTHING_MARGIN as u64);
        let smoothed = wide * (2 * size_of::<Rgba>() as u64 + WAVELET_PIXEL);
        let light = wide * (size_of::<NoisyLight>() + size_of::<Rgba>()) as u64;
        light + band_bytes(width, rows).max(smoothed)
    }

    fn reconstruct(
        pixels: &[LensPixel],
        held: PixelRect,
        strip: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<Rgba>, Cancelled> {
        let width = held.width as usize;
        let first = strip.start.saturating_sub(SMOOTHING_MARGIN);
        let wide = first..(strip.end + SMOOTHING_MARGIN).min(held.height as usize);
        let light = filter_light(pixels, held, wide.clone(), settings.samples, frame, monitor)?;
        let pixels = &pixels[wide.start * width..wide.end * width];
        let rows = strip.start - first..strip.end - first;
        let wanted = rows.start * width..rows.end * width;
        let color = |(pixel, light): (&LensPixel, &NoisyLight)| pixel.parts.exact + light.sum().extend(0.0);
        let mut picture: Vec<Rgba> =
            pixels[wanted.clone()].iter().zip(&light[wanted.clone()]).map(color).collect();
        let is_blurred: Vec<bool> =
            pixels.iter().map(|pixel| is_out_of_focus(frame, settings.height, &pixel.parts)).collect();
        if !is_blurred[wanted.clone()].contains(&true) {
            return Ok(picture);
        }
        let half = |i: usize| -> Vec<Rgba> {
            let color = |(pixel, light): (&LensPixel, &NoisyLight)| {
                pixel.halves[i].color(&pixel.parts.surface, light)
            };
            pixels.iter().zip(&light).map(color).collect()
        };
        let halves = [half(0), half(1)];
        let smooth = |channels: fn(&Rgba) -> Rgb| {
            let light = WaveletLight {
                kind: SmoothKind::OutOfFocus,
                width,
                halves: [0, 1].map(|i| halves[i].iter().map(channels).collect()),
                samples: settings.samples,
                is_noisy: is_blurred.clone(),
                normal: vec![Rgb::ZERO; pixels.len()],
                position: vec![Rgb::ZERO; pixels.len()],
                alpha: vec![0.0; pixels.len()],
            };
            smooth_light(&light, frame.simd(), rows.clone())
        };
        let colors = smooth(|color| color.truncate());
        // Alpha has noise before a transparent background only.
        let is_open = halves.iter().flatten().any(|color| color.w < 1.0);
        let alphas = is_open.then(|| smooth(|color| Rgb::splat(color.w)));
        for (i, to) in picture.iter_mut().enumerate().filter(|(i, _)| is_blurred[wanted.start + i]) {
            let alpha = alphas.as_ref().map_or(to.w, |alphas| alphas[i].x);
            *to = colors[i].extend(alpha);
        }
        Ok(picture)
    }
}

/// True if what most of a pixel shows is blurred over more than the pixel.
fn is_out_of_focus(frame: &Frame, height: u32, pixel: &PixelParts) -> bool {
    let surface = &pixel.surface;
    let depth = if surface.coverage > 0.5 {
        let p = surface.position.as_dvec3() + frame.posed.centre;
        -frame.camera.to_camera(p).z
    } else {
        f64::INFINITY
    };
    frame.camera.circle_of_confusion(depth) * f64::from(height) > OUT_OF_FOCUS
}
