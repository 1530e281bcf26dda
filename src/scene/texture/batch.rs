//! One texture looked up at several places together.
//!
//! What comes before the texels and after them is the same arithmetic for each, so it goes by the column, as
//! [`Texture::sample_filtered`] does it one by one: to the same bits.

use glam::{Vec2, Vec4};

use crate::scene::texture::anisotropic::Footprint;
use crate::scene::texture::image::Image;
use crate::scene::texture::mips::TexelSemantics;
use crate::scene::texture::sampling::{Texture, TextureFilter, Wrap, blend};
use crate::scene::texture::srgb::decode_colors;

/// SampleCoords of a texture, by the column, with what each stands for.
#[derive(Clone, Copy, Debug)]
pub struct SampleCoords<const N: usize> {
    uv: [[f32; N]; 2],
    dx: [[f32; N]; 2],
    dy: [[f32; N]; 2],
}

impl<const N: usize> SampleCoords<N> {
    /// The origin, as a point.
    pub const ORIGIN: SampleCoords<N> =
        SampleCoords { uv: [[0.0; N]; 2], dx: [[0.0; N]; 2], dy: [[0.0; N]; 2] };

    /// Sets one.
    #[inline(always)]
    pub fn set(&mut self, i: usize, uv: Vec2, over: Footprint) {
        for axis in 0..2 {
            self.uv[axis][i] = uv[axis];
            self.dx[axis][i] = over.dx[axis];
            self.dy[axis][i] = over.dy[axis];
        }
    }

    #[inline(always)]
    fn uv(&self, i: usize) -> Vec2 {
        Vec2::new(self.uv[0][i], self.uv[1][i])
    }

    #[inline(always)]
    fn over(&self, i: usize) -> Footprint {
        let at = |of: &[[f32; N]; 2]| Vec2::new(of[0][i], of[1][i]);
        Footprint { dx: at(&self.dx), dy: at(&self.dy) }
    }
}

/// Along an axis, the first of the two texels that a place is between, and how far it is to the other.
struct Between<const N: usize> {
    first: [f64; N],
    share: [f32; N],
}

impl<const N: usize> Between<N> {
    #[inline(always)]
    fn new(wrap: Wrap, x: &[f32; N], texels: u32) -> Between<N> {
        /// A sum with this has no digits after the point.
        const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
        // Mostly there is nothing to fold.
        let inside = x.iter().all(|x| (0.0..1.0).contains(x));
        let folded = if inside { x.map(f64::from) } else { x.map(|x| wrap.fold(x)) };
        let mut between = Between { first: [0.0; N], share: [0.0; N] };
        for ((folded, first), share) in folded.iter().zip(&mut between.first).zip(&mut between.share) {
            let x = folded * f64::from(texels) - 0.5;
            let near = (x + WHOLE) - WHOLE;
            *first = if near > x { near - 1.0 } else { near };
            *share = (x - *first) as f32;
        }
        between
    }

    /// Both texels of place `i`, and the share of the second.
    #[inline(always)]
    fn at(&self, i: usize, wrap: Wrap, texels: u32) -> (usize, usize, f32) {
        let (first, texels) = (self.first[i] as i64, i64::from(texels));
        (wrap.texel(first, texels), wrap.texel(first + 1, texels), self.share[i])
    }
}

impl Texture {
    /// [`Texture::sample_filtered`] at the first of `places`, as many as `out` takes; nothing where a place stands for more
    /// than a texel, unless `all` are asked for.
    #[inline(always)]
    pub fn sample_batch<const N: usize>(
        &self,
        images: &[Image],
        places: &SampleCoords<N>,
        (reading, all): (TexelSemantics, bool),
        out: &mut [Option<Vec4>],
    ) {
        let image = &images[self.image as usize];
        let plane = image.plane();
        let mut within = [false; N];
        for (i, within) in within.iter_mut().enumerate() {
            *within = places.over(i).is_small(image.width, image.height);
        }
        let interpolated = self.filter == TextureFilter::Linear;
        let x = Between::new(self.wrap[0], &places.uv[0], plane.width);
        let y = Between::new(self.wrap[1], &places.uv[1], plane.height);
        let colors = reading != TexelSemantics::Data;
        for (i, out) in out.iter_mut().enumerate().take(N) {
            if !(within[i] && interpolated) {
                let one_by_one = all || within[i];
                *out =
                    one_by_one.then(|| self.sample_filtered(images, places.uv(i), &places.over(i), reading));
                continue;
            }
            let (xa, xb, fx) = x.at(i, self.wrap[0], plane.width);
            let (ya, yb, fy) = y.at(i, self.wrap[1], plane.height);
            let (ya, yb) = (ya * plane.width as usize, yb * plane.width as usize);
            let at = [ya + xa, ya + xb, yb + xa, yb + xb];
            let decoded = colors && !self.decode_last;
            let texels = if decoded { plane.all_decoded(at) } else { plane.all_stored(at) };
            let value = blend(texels, [fx, fy]);
            *out = Some(if colors && self.decode_last { decode_colors(value) } else { value });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Channels, MipMaps, Texels};

    /// Inside, on edges, far outside and nowhere; points, small footprints and large ones; every layout, way of
    /// wrapping, filter and reading.
    #[test]
    fn places_together_find_what_each_finds_alone() {
        const N: usize = 8;
        let uvs = [0.0, 0.3, 0.999_999_94, 1.0, -0.2, 7.6, -1e9, f32::NAN, f32::INFINITY, 0.5, 0.124, 1.5];
        let steps = [0.0, 1e-4, 0.02, 0.4, f32::NAN];
        let place = |i: usize| {
            let over = |k: usize| Vec2::new(steps[k % 5], -steps[(k / 2) % 5]);
            (Vec2::new(uvs[i % 12], uvs[(i / 5) % 12]), Footprint { dx: over(i), dy: over(i / 3) })
        };
        for channels in [Channels::L, Channels::La, Channels::Rgb, Channels::Rgba] {
            let (width, height) = (7, 5);
            let count = width * height * channels as usize;
            let eight: Vec<u8> = (0..count).map(|i| (i * 89 % 256) as u8).collect();
            let sixteen: Vec<u16> = (0..count).map(|i| (i * 9973 % 65536) as u16).collect();
            for texels in [Texels::U8(eight), Texels::U16(sixteen)] {
                let mips = MipMaps::default();
                let (width, height) = (width as u32, height as u32);
                let images = [Image { name: String::new(), width, height, channels, texels, mips }];
                for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    for (filter, decode_last) in [
                        (TextureFilter::Linear, false),
                        (TextureFilter::Linear, true),
                        (TextureFilter::Nearest, false),
                    ] {
                        let texture = Texture { image: 0, wrap: [wrap, Wrap::Repeat], filter, decode_last };
                        for reading in
                            [TexelSemantics::Color, TexelSemantics::AlphaWeightedColor, TexelSemantics::Data]
                        {
                            for first in (0..120).step_by(N) {
                                let mut places = SampleCoords::<N>::ORIGIN;
                                (0..N).for_each(|i| places.set(i, place(first + i).0, place(first + i).1));
                                let mut together = [None; N];
                                let some = &mut together[..N - first % 3];
                                let all = first % 16 == 0;
                                texture.sample_batch(&images, &places, (reading, all), some);
                                for (i, found) in some.iter().enumerate() {
                                    let (uv, over) = place(first + i);
                                    let alone = texture.sample_filtered(&images, uv, &over, reading);
                                    let alone = (all || over.is_small(7, 5)).then_some(alone);
                                    // NaN is one number here.
                                    assert_eq!(format!("{found:?}"), format!("{alone:?}"), "{uv} {over:?}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
