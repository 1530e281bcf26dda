//! Tone mapping for display: exposure, look, view transform (sRGB, AgX, Filmic, PBR Neutral), gamma, background, encoding.

mod agx;
mod agx_look;
mod agx_space;
mod batch;
mod filmic;
mod filmic_look;
mod look;
mod lut3d;
mod neutral;
#[cfg(test)]
mod reference;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::Pixels;
use crate::display::batch::{BATCH, RgbBatch};
use blinn_core::geometry::{Rgb, Rgba};
use blinn_core::simd::SimdLevel;
use blinn_scene::{BlenderVersion, Source, SourceFormat, linear_to_srgb8, srgb_to_linear};

pub use blinn_scene::linear_to_srgb;
pub use look::Look;

/// Maps scene-linear light to display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum ViewTransform {
    /// Clips to 0…1, then encodes as sRGB.
    #[default]
    Standard,
    /// Blender's AgX, for an sRGB display.
    Agx,
    /// Blender's Filmic, for an sRGB display.
    Filmic,
    /// Khronos PBR Neutral, then sRGB.
    PbrNeutral,
    /// Clips to 0…1 and stores linear values without encoding.
    Raw,
}

/// Version of Blender from which on AgX is its default.
const FIRST_WITH_AGX: BlenderVersion = BlenderVersion::new(4, 0);

/// Pixels of one parallel task.
const TASK_PIXELS: usize = 256 * BATCH;

/// The background of a picture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum Background {
    /// A display-linear colour. Exposure, look, view transform and gamma do not change it.
    Color(Rgb),
    /// Nothing: the alpha channel shows coverage.
    Transparent,
}

/// Converts rendered pixels to encoded display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Exposure in stops: light is multiplied by 2^ev.
    pub ev: f64,
    /// The view transform.
    pub view: ViewTransform,
    /// A look. Those that the view transform lacks ([`Look::is_of`]) change nothing.
    pub look: Look,
    /// Encoded values are raised to the power 1 / gamma. Greater than zero.
    pub gamma: f32,
    /// The background.
    pub background: Background,
}

/// The standard view without exposure, over a transparent background.
impl Default for Display {
    fn default() -> Display {
        Display {
            ev: 0.0,
            view: ViewTransform::Standard,
            look: Look::None,
            gamma: 1.0,
            background: Background::Transparent,
        }
    }
}

/// Composites an sRGB pixel with straight alpha over a linear colour, as [`Display`] does with light.
pub fn composite_over([r, g, b, alpha]: [u8; 4], background: Rgb) -> [u8; 4] {
    let alpha = f32::from(alpha) / 255.0;
    let light = Vec3::from_array([r, g, b].map(|v| srgb_to_linear(f32::from(v) / 255.0)));
    let shown = light * alpha + background * (1.0 - alpha);
    [linear_to_srgb8(shown.x), linear_to_srgb8(shown.y), linear_to_srgb8(shown.z), 255]
}

impl ViewTransform {
    /// Returns the default: for glTF files written by Blender, whose users expect Blender's view, that of their version
    /// (Filmic before 4.0, AgX from then on or if it is unknown), and `Standard` for all others.
    pub fn default_for(source: &Source) -> ViewTransform {
        if source.format != SourceFormat::Gltf || !source.is_blender() {
            return ViewTransform::Standard;
        }
        // The exporter had numbers of its own, from 0.9 to 1.8, for Blender 2.8 to 3.2.
        match source.blender_version() {
            Some(version) if version < FIRST_WITH_AGX => ViewTransform::Filmic,
            _ => ViewTransform::Agx,
        }
    }
}

impl Display {
    /// Converts premultiplied scene-linear colours to display-linear colours and straight alphas.
    fn show(&self, simd: SimdLevel, pixels: &[Rgba; BATCH], gain: f32) -> (RgbBatch, [f32; BATCH]) {
        let alpha = pixels.map(|p| p.w.clamp(0.0, 1.0));
        let mut light = [[0.0; BATCH]; 3];
        for (c, channel) in light.iter_mut().enumerate() {
            for (i, v) in channel.iter_mut().enumerate() {
                *v = if alpha[i] > 0.0 { pixels[i][c] / alpha[i] * gain } else { 0.0 };
            }
        }
        let has_filmic_look =
            self.view != ViewTransform::Agx && self.look != Look::None && self.look.is_of(self.view);
        if has_filmic_look {
            light = filmic_look::apply(self.look, &light);
        }
        let mut shown = match self.view {
            // NaN compares false and becomes 0.
            ViewTransform::Standard | ViewTransform::Raw => {
                light.map(|channel| channel.map(|v| if v > 0.0 { v.min(1.0) } else { 0.0 }))
            }
            ViewTransform::Agx => agx::agx(simd, &light, self.look),
            ViewTransform::Filmic if has_filmic_look => filmic_look::filmic(&light),
            ViewTransform::Filmic => filmic::filmic(&light),
            ViewTransform::PbrNeutral => neutral::pbr_neutral(&light),
        };
        if self.gamma != 1.0 {
            shown = shown.map(|channel| channel.map(|v| self.with_gamma(v)));
        }
        match self.background {
            Background::Transparent => (shown, alpha),
            Background::Color(b) => {
                for (channel, b) in shown.iter_mut().zip(b.to_array()) {
                    for (v, alpha) in channel.iter_mut().zip(alpha) {
                        *v = *v * alpha + b * (1.0 - alpha);
                    }
                }
                (shown, [1.0; BATCH])
            }
        }
    }

    /// Applies gamma to a display-linear value in 0…1, as encoded.
    fn with_gamma(&self, v: f32) -> f32 {
        let power = |v: f32| libm::powf(v, 1.0 / self.gamma);
        match self.view {
            ViewTransform::Raw => power(v),
            _ => srgb_to_linear(power(linear_to_srgb(v))),
        }
    }

    /// Encodes all pixels: colours with `color`, alphas with `alpha`. N of 3 leaves out alpha.
    fn encode<T: Copy + Default + Send + Sync, const N: usize>(
        &self,
        pixels: &Pixels,
        color: impl Fn(f32) -> T + Sync,
        alpha: impl Fn(f32) -> T + Sync,
    ) -> Vec<[T; N]> {
        let gain = libm::exp2(self.ev) as f32;
        let simd = SimdLevel::detect();
        let encode_batch = |batch: &[Rgba; BATCH], out: &mut [[T; N]]| {
            let ([r, g, b], a) = self.show(simd, batch, gain);
            for (i, out) in out.iter_mut().enumerate() {
                let rgba = [color(r[i]), color(g[i]), color(b[i]), alpha(a[i])];
                for (out, value) in out.iter_mut().zip(rgba) {
                    *out = value;
                }
            }
        };
        let mut empty = [[T::default(); N]];
        encode_batch(&[Rgba::ZERO; BATCH], &mut empty);
        let [empty] = empty;
        let encode_task = |(out, pixels): (&mut [[T; N]], &[Rgba])| {
            for (out, pixels) in out.chunks_mut(BATCH).zip(pixels.chunks(BATCH)) {
                // Empty batches are common.
                if pixels.iter().all(|pixel| *pixel == Rgba::ZERO) {
                    out.fill(empty);
                    continue;
                }
                match pixels.try_into() {
                    Ok(batch) => encode_batch(batch, out),
                    Err(_) => {
                        let mut batch = [Rgba::ZERO; BATCH];
                        batch[..pixels.len()].copy_from_slice(pixels);
                        encode_batch(&batch, out);
                    }
                }
            }
        };
        let mut out = vec![[T::default(); N]; pixels.colors.len()];
        out.par_chunks_mut(TASK_PIXELS).zip(pixels.colors.par_chunks(TASK_PIXELS)).for_each(encode_task);
        out
    }

    /// Encodes all pixels with 8 bits a channel.
    fn encode8<const N: usize>(&self, pixels: &Pixels) -> Vec<[u8; N]> {
        let linear = |v: f32| (v * 255.0 + 0.5) as u8;
        match self.view {
            ViewTransform::Raw => self.encode(pixels, linear, linear),
            _ => self.encode(pixels, linear_to_srgb8, linear),
        }
    }

    /// Returns straight RGBA, 8 bits a channel, row-major, row 0 on top.
    pub fn to_rgba8(&self, pixels: &Pixels) -> Vec<[u8; 4]> {
        self.encode8(pixels)
    }

    /// Returns the colours of [`Display::to_rgba8`] if the background is a colour, so that every pixel is opaque.
    pub fn to_rgb8(&self, pixels: &Pixels) -> Option<Vec<[u8; 3]>> {
        matches!(self.background, Background::Color(_)).then(|| self.encode8(pixels))
    }

    /// Returns straight RGBA, 16 bits a channel, row-major, row 0 on top.
    pub fn to_rgba16(&self, pixels: &Pixels) -> Vec<[u16; 4]> {
        let linear = |v: f32| (v * 65535.0 + 0.5) as u16;
        match self.view {
            ViewTransform::Raw => self.encode(pixels, linear, linear),
            _ => self.encode(pixels, |v| linear(linear_to_srgb(v)), linear),
        }
    }

    /// Composites a pixel over the background for files of linear light, without exposure and view
    /// transform. Returns linear premultiplied RGBA.
    pub fn composite_linear(&self, pixel: Rgba) -> Rgba {
        match self.background {
            Background::Transparent => pixel,
            Background::Color(b) => {
                let under = pixel.truncate() + b * (1.0 - pixel.w);
                Vec4::new(under.x, under.y, under.z, 1.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(display: Display, pixel: Rgba) -> [u8; 4] {
        display.to_rgba8(&Pixels { width: 1, height: 1, colors: vec![pixel] })[0]
    }

    const STANDARD: Display = Display {
        ev: 0.0,
        view: ViewTransform::Standard,
        look: Look::None,
        gamma: 1.0,
        background: Background::Transparent,
    };

    #[test]
    fn alpha_is_straight_and_exposure_does_not_change_the_background() {
        let half = Rgba::new(0.25, 0.25, 0.25, 0.5);
        assert_eq!(shown(STANDARD, half)[3], 128);
        assert_eq!(shown(STANDARD, half)[0], linear_to_srgb8(0.5));
        let over = Display { ev: 3.0, background: Background::Color(Rgb::splat(0.2)), ..STANDARD };
        assert_eq!(
            shown(over, Rgba::ZERO),
            [linear_to_srgb8(0.2), linear_to_srgb8(0.2), linear_to_srgb8(0.2), 255]
        );
    }

    #[test]
    fn the_default_is_that_of_the_version_of_blender() {
        let view = |format, generator: &str| {
            let source = Source { format, generator: generator.into(), ..Source::default() };
            ViewTransform::default_for(&source)
        };
        for (version, expected) in [
            ("v3.4.50", ViewTransform::Filmic),
            ("v1.8.19", ViewTransform::Filmic),
            ("v3.6.6", ViewTransform::Filmic),
            ("v4.0.44", ViewTransform::Agx),
            ("v5.0.21", ViewTransform::Agx),
            ("", ViewTransform::Agx),
        ] {
            let generator = format!("Khronos glTF Blender I/O {version}");
            assert_eq!(view(SourceFormat::Gltf, &generator), expected, "{version}");
        }
        assert_eq!(view(SourceFormat::Obj, "Blender v2.79 OBJ File: ''"), ViewTransform::Standard);
        assert_eq!(view(SourceFormat::Gltf, "VTK"), ViewTransform::Standard);
    }

    #[test]
    fn colours_without_alpha_are_those_of_an_opaque_background() {
        let colors: Vec<Rgba> = (0..40).map(|i| Rgba::new(0.1, 0.3, 0.02 * i as f32, 1.0) * 0.5).collect();
        let pixels = Pixels { width: 8, height: 5, colors };
        assert_eq!(STANDARD.to_rgb8(&pixels), None);
        for view in [ViewTransform::Standard, ViewTransform::Agx, ViewTransform::Filmic, ViewTransform::Raw] {
            let background = Background::Color(Rgb::new(0.2, 0.5, 0.9));
            let display = Display { view, background, ..STANDARD };
            let rgb: Vec<_> = display.to_rgba8(&pixels).iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            assert_eq!(display.to_rgb8(&pixels), Some(rgb));
        }
    }

    #[test]
    fn compositing_encoded_pixels_equals_compositing_light() {
        let background = Rgb::new(0.2, 0.5, 0.9);
        let display = Display { background: Background::Color(background), ..STANDARD };
        for alpha in [0, 1, 77, 128, 254, 255] {
            let straight = [250, 30, 128, alpha];
            let a = f32::from(alpha) / 255.0;
            let light = [250, 30, 128].map(|v: u8| srgb_to_linear(f32::from(v) / 255.0) * a);
            assert_eq!(
                composite_over(straight, background),
                shown(display, Vec3::from_array(light).extend(a))
            );
        }
        assert_eq!(composite_over([1, 2, 3, 255], background), [1, 2, 3, 255]);
    }

    #[test]
    fn gamma_is_a_power_of_encoded_values_and_leaves_the_background() {
        let half = Rgba::new(0.3, 0.3, 0.3, 1.0);
        for view in [ViewTransform::Standard, ViewTransform::Raw, ViewTransform::Agx] {
            let background = Background::Color(Rgb::splat(0.2));
            let plain = Display { view, background, ..STANDARD };
            let display = Display { gamma: 2.0, ..plain };
            let expected = (f32::from(shown(plain, half)[0]) / 255.0).sqrt() * 255.0;
            assert!((f32::from(shown(display, half)[0]) - expected).abs() < 1.0, "{view:?}");
            assert_eq!(shown(display, Rgba::ZERO), shown(plain, Rgba::ZERO));
        }
    }

    #[test]
    fn exposure_is_in_stops_and_values_are_clamped() {
        let up = Display { ev: 1.0, ..STANDARD };
        assert_eq!(shown(up, Rgba::new(0.1, 0.1, 0.1, 1.0))[0], linear_to_srgb8(0.2));
        assert_eq!(shown(up, Rgba::new(1e30, f32::INFINITY, f32::NAN, 1.0))[..2], [255, 255]);
        assert_eq!(shown(up, Rgba::new(-1.0, 0.0, 0.0, 1.0))[0], 0);
    }
}
