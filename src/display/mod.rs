//! From linear light to what a screen shows: exposure, view transform, sRGB.

mod agx;
mod lut3d;
mod neutral;
#[cfg(test)]
mod reference;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::geometry::{Rgb, Rgba};
use crate::render::Pixels;
use crate::scene::{Source, SourceFormat, linear_to_srgb8, srgb_to_linear};

pub use crate::scene::linear_to_srgb;

/// How linear light becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewTransform {
    /// Clipped, then sRGB.
    #[default]
    Standard,
    /// Blender's AgX without a look, for an sRGB display.
    Agx,
    /// Khronos PBR Neutral, then sRGB.
    PbrNeutral,
    /// Clipped and stored as it is, without encoding.
    Raw,
}

/// Pixels that are shown at once, so that processors work on several.
const AT_ONCE: usize = 16;
/// Pixels of a thread's share.
const PART: usize = 256 * AT_ONCE;

/// Linear light of pixels: red, green, blue.
type Lights = [[f32; AT_ONCE]; 3];

/// What is behind everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// A colour as the screen shows it, linear: neither exposure nor view transform touch it.
    Color(Rgb),
    /// Nothing: alpha says where.
    Transparent,
}

/// A display: pixels in, encoded values out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Stops: light is multiplied by 2^ev.
    pub ev: f64,
    /// The view transform.
    pub view: ViewTransform,
    /// What is behind.
    pub background: Background,
}

/// A pixel of a picture, sRGB and straight alpha, over a linear colour: as [`Display`] puts light over it.
pub fn composite_over([r, g, b, alpha]: [u8; 4], background: Rgb) -> [u8; 4] {
    let alpha = f32::from(alpha) / 255.0;
    let light = Vec3::from_array([r, g, b].map(|v| srgb_to_linear(f32::from(v) / 255.0)));
    let shown = light * alpha + background * (1.0 - alpha);
    [linear_to_srgb8(shown.x), linear_to_srgb8(shown.y), linear_to_srgb8(shown.z), 255]
}

impl ViewTransform {
    /// What Blender's users expect of its glTF files, and everyone else of the others.
    pub fn default_for(source: &Source) -> ViewTransform {
        if source.format == SourceFormat::Gltf && source.is_blender() {
            ViewTransform::Agx
        } else {
            ViewTransform::Standard
        }
    }
}

impl Display {
    /// Display-linear colours and straight alphas of premultiplied scene colours.
    fn show(&self, pixels: &[Rgba; AT_ONCE], gain: f32) -> (Lights, [f32; AT_ONCE]) {
        let alpha = pixels.map(|p| p.w.clamp(0.0, 1.0));
        let mut light = [[0.0; AT_ONCE]; 3];
        for (c, channel) in light.iter_mut().enumerate() {
            for (i, v) in channel.iter_mut().enumerate() {
                *v = if alpha[i] > 0.0 { pixels[i][c] / alpha[i] * gain } else { 0.0 };
            }
        }
        let mut shown = match self.view {
            // NaN is less than nothing here.
            ViewTransform::Standard | ViewTransform::Raw => {
                light.map(|channel| channel.map(|v| if v > 0.0 { v.min(1.0) } else { 0.0 }))
            }
            ViewTransform::Agx => agx::agx(&light),
            ViewTransform::PbrNeutral => neutral::pbr_neutral(&light),
        };
        match self.background {
            Background::Transparent => (shown, alpha),
            Background::Color(b) => {
                for (channel, b) in shown.iter_mut().zip(b.to_array()) {
                    for (v, alpha) in channel.iter_mut().zip(alpha) {
                        *v = *v * alpha + b * (1.0 - alpha);
                    }
                }
                (shown, [1.0; AT_ONCE])
            }
        }
    }

    /// Pixels as numbers: colours by `color`, alpha by `alpha`.
    fn encoded<T: Copy + Default + Send + Sync>(
        &self,
        pixels: &Pixels,
        color: impl Fn(f32) -> T + Sync,
        alpha: impl Fn(f32) -> T + Sync,
    ) -> Vec<[T; 4]> {
        let gain = libm::exp2(self.ev) as f32;
        let show = |some: &[Rgba; AT_ONCE]| -> [[T; 4]; AT_ONCE] {
            let ([r, g, b], a) = self.show(some, gain);
            std::array::from_fn(|i| [color(r[i]), color(g[i]), color(b[i]), alpha(a[i])])
        };
        // Much of many pictures.
        let nothing = show(&[Rgba::ZERO; AT_ONCE]);
        let part = |(out, pixels): (&mut [[T; 4]], &[Rgba])| {
            for (out, pixels) in out.chunks_mut(AT_ONCE).zip(pixels.chunks(AT_ONCE)) {
                let mut some = [Rgba::ZERO; AT_ONCE];
                some[..pixels.len()].copy_from_slice(pixels);
                let shown = if some == [Rgba::ZERO; AT_ONCE] { nothing } else { show(&some) };
                out.copy_from_slice(&shown[..pixels.len()]);
            }
        };
        let mut out = vec![[T::default(); 4]; pixels.colors.len()];
        out.par_chunks_mut(PART).zip(pixels.colors.par_chunks(PART)).for_each(part);
        out
    }

    /// Straight RGBA, 8 bits a channel, row-major, row 0 on top.
    pub fn to_rgba8(&self, pixels: &Pixels) -> Vec<[u8; 4]> {
        let linear = |v: f32| (v * 255.0 + 0.5) as u8;
        match self.view {
            ViewTransform::Raw => self.encoded(pixels, linear, linear),
            _ => self.encoded(pixels, linear_to_srgb8, linear),
        }
    }

    /// Straight RGBA, 16 bits a channel.
    pub fn to_rgba16(&self, pixels: &Pixels) -> Vec<[u16; 4]> {
        let linear = |v: f32| (v * 65535.0 + 0.5) as u16;
        match self.view {
            ViewTransform::Raw => self.encoded(pixels, linear, linear),
            _ => self.encoded(pixels, |v| linear(linear_to_srgb(v)), linear),
        }
    }

    /// A pixel as linear premultiplied RGBA for files of linear light: neither exposure nor view
    /// transform, only the background.
    pub fn linear(&self, pixel: Rgba) -> Rgba {
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

    fn one(display: Display, pixel: Rgba) -> [u8; 4] {
        display.to_rgba8(&Pixels { width: 1, height: 1, colors: vec![pixel] })[0]
    }

    const PLAIN: Display =
        Display { ev: 0.0, view: ViewTransform::Standard, background: Background::Transparent };

    #[test]
    fn alpha_is_straight_and_a_given_background_is_untouched() {
        let half = Rgba::new(0.25, 0.25, 0.25, 0.5);
        assert_eq!(one(PLAIN, half)[3], 128);
        assert_eq!(one(PLAIN, half)[0], linear_to_srgb8(0.5));
        let over = Display { ev: 3.0, background: Background::Color(Rgb::splat(0.2)), ..PLAIN };
        assert_eq!(
            one(over, Rgba::ZERO),
            [linear_to_srgb8(0.2), linear_to_srgb8(0.2), linear_to_srgb8(0.2), 255]
        );
    }

    #[test]
    fn a_background_behind_bytes_is_the_one_behind_light() {
        let background = Rgb::new(0.2, 0.5, 0.9);
        let display = Display { background: Background::Color(background), ..PLAIN };
        for alpha in [0, 1, 77, 128, 254, 255] {
            let straight = [250, 30, 128, alpha];
            let a = f32::from(alpha) / 255.0;
            let light = [250, 30, 128].map(|v: u8| srgb_to_linear(f32::from(v) / 255.0) * a);
            assert_eq!(composite_over(straight, background), one(display, Vec3::from_array(light).extend(a)));
        }
        assert_eq!(composite_over([1, 2, 3, 255], background), [1, 2, 3, 255]);
    }

    #[test]
    fn exposure_counts_in_stops_and_nothing_wraps() {
        let up = Display { ev: 1.0, ..PLAIN };
        assert_eq!(one(up, Rgba::new(0.1, 0.1, 0.1, 1.0))[0], linear_to_srgb8(0.2));
        assert_eq!(one(up, Rgba::new(1e30, f32::INFINITY, f32::NAN, 1.0))[..2], [255, 255]);
        assert_eq!(one(up, Rgba::new(-1.0, 0.0, 0.0, 1.0))[0], 0);
    }
}
