//! Smaller copies of images: each half as wide and high as the one before, down to a single texel.
//!
//! A texel of a smaller copy is the mean of what it covers, also where sides are odd. What a mean is
//! depends on what the numbers say ([`TexelSemantics`]): light is averaged as light, normals as vectors. So
//! an image has a pyramid for each way in which it is read, made when it is first needed: textures
//! that are only ever seen magnified have none. Levels are stored as the image is, in 8 or 16 bits and
//! with colours encoded, so that a pyramid is a third of its image.

use std::sync::{Mutex, OnceLock, PoisonError};

use glam::Vec4;

use crate::scene::material::TextureChannel;
use crate::scene::texture::image::{Channels, TexelView, Texels};
use crate::scene::texture::min_mip::MinMip;
use crate::scene::texture::srgb::{decode_colors, linear_to_srgb, linear_to_srgb8};

/// What the numbers of a texture say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelSemantics {
    /// Colours, sRGB-encoded, and an alpha that nobody looks at, or on its own.
    Color,
    /// Colours of which only as much is seen as alpha leaves: what is clear has no say in a mean.
    AlphaWeightedColor,
    /// Plain numbers.
    Data,
}

/// How levels are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DownsampleFilter {
    /// Of light.
    Light { covered: bool },
    /// Of the light that bilinear interpolation of *encoded* colours shows, which is less than that
    /// of the texels: so the first smaller copy is as bright as the image that it stands for.
    Shown { covered: bool },
    /// Of numbers.
    Numbers,
    /// Of vectors. Levels have unit vectors, and in alpha how much shorter their mean was.
    Normals,
}

impl DownsampleFilter {
    fn place(self) -> usize {
        match self {
            DownsampleFilter::Light { covered } => usize::from(covered),
            DownsampleFilter::Shown { covered } => 2 + usize::from(covered),
            DownsampleFilter::Numbers => 4,
            DownsampleFilter::Normals => 5,
        }
    }
}

/// The smaller copies of an image: of its means, and of a channel's least numbers.
#[derive(Clone, Debug, Default)]
pub struct MipMaps {
    means: [OnceLock<Vec<MipLevel>>; 6],
    lowest: [OnceLock<MinMip>; 5],
}

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct MipLevel {
    width: u32,
    height: u32,
    channels: Channels,
    texels: Texels,
}

impl MipLevel {
    pub fn plane(&self) -> TexelView<'_> {
        TexelView { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

/// Weight of the colour of a clear texel: where all are clear there is still a colour.
pub(crate) const CLEAR: f32 = 1e-4;

impl MipMaps {
    /// The smaller copies of `image`, from half its size down. Whoever comes first makes them.
    pub(crate) fn of(&self, image: TexelView, mean: DownsampleFilter) -> &[MipLevel] {
        self.means[mean.place()].get_or_init(|| pyramid(image, mean))
    }

    /// The least of a channel of `image` in its parts. Whoever comes first looks for them.
    pub(crate) fn lowest(&self, image: TexelView, channel: TextureChannel) -> &MinMip {
        self.lowest[channel as usize].get_or_init(|| MinMip::new(image, channel))
    }
}

fn pyramid(image: TexelView, mean: DownsampleFilter) -> Vec<MipLevel> {
    let channels = if mean == DownsampleFilter::Normals { Channels::Rgba } else { image.channels };
    let mut levels = Vec::new();
    let mut size = (image.width as usize, image.height as usize);
    let mut finer: Vec<Vec4> = Vec::new();
    while size != (1, 1) {
        let half = ((size.0 / 2).max(1), (size.1 / 2).max(1));
        let mut means = vec![Vec4::ZERO; half.0 * half.1];
        let first = levels.is_empty();
        let row = |y: usize, row: &mut [Vec4]| match first {
            true => {
                let one = |x, y| averaged(image, mean, [(x, y)])[0];
                shrink(size, half, (y, row), one, |places| averaged(image, mean, places));
            }
            false => {
                let one = |x: usize, y: usize| finer[y * size.0 + x];
                shrink(size, half, (y, row), one, |places| places.map(|(x, y)| one(x, y)));
            }
        };
        let row = (half.0, &row as &Row);
        let texels = match image.texels {
            Texels::U8(_) => {
                let codes = (|v| (v * 255.0 + 0.5) as u8, linear_to_srgb8);
                Texels::U8(fill(&mut means, row, channels, &|means, to| store(means, mean, codes, to)))
            }
            Texels::U16(_) => {
                let codes = (|v| (v * 65535.0 + 0.5) as u16, |v| (linear_to_srgb(v) * 65535.0 + 0.5) as u16);
                Texels::U16(fill(&mut means, row, channels, &|means, to| store(means, mean, codes, to)))
            }
        };
        levels.push(MipLevel { width: half.0 as u32, height: half.1 as u32, channels, texels });
        (finer, size) = (means, half);
    }
    levels
}

/// Computes the means of a row.
type Row<'a> = dyn Fn(usize, &mut [Vec4]) + Sync + 'a;
/// Makes texels of means.
type Store<'a, T> = dyn Fn(&[Vec4], &mut [T]) + Sync + 'a;

/// Computes means by rows of a width, and makes texels of them. Large ones are divided among threads of their
/// own: a task of a pool that waits for the pool, while another thread waits for the pyramid, may wait
/// for itself.
fn fill<T: Copy + Default + Send>(
    means: &mut [Vec4],
    (width, row): (usize, &Row),
    channels: Channels,
    store: &Store<T>,
) -> Vec<T> {
    let channels = channels as usize;
    let mut texels = vec![T::default(); means.len() * channels];
    let threads = if means.len() < 1 << 16 { 1 } else { rayon::current_num_threads().clamp(1, 16) };
    // Small parts: what was computed is still at hand when texels are made of it.
    let rows = (means.len() / width).div_ceil(threads).min((1 << 14) / width + 1);
    let parts = means.chunks_mut(rows * width).zip(texels.chunks_mut(rows * width * channels));
    let parts = Mutex::new(parts.enumerate());
    let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || {
        while let Some((i, (means, texels))) = next() {
            for (k, means) in means.chunks_mut(width).enumerate() {
                row(i * rows + k, means);
            }
            store(means, texels);
        }
    };
    std::thread::scope(|scope| {
        // Where there are no more threads, those that are there do it.
        let helps = |_: &usize| std::thread::Builder::new().spawn_scoped(scope, work).is_ok();
        let _ = (1..threads).take_while(helps).count();
        work();
    });
    texels
}

/// A row of means, the `y`th of `half`, of what is at places of `size`, asked for one by one or by four.
fn shrink(
    size: (usize, usize),
    half: (usize, usize),
    (y, row): (usize, &mut [Vec4]),
    one: impl Fn(usize, usize) -> Vec4,
    four: impl Fn([(usize, usize); 4]) -> [Vec4; 4],
) {
    let even = size.0 == 2 * half.0 && size.1 == 2 * half.1;
    for (x, mean) in row.iter_mut().enumerate() {
        *mean = if even {
            let (x, y) = (2 * x, 2 * y);
            let [a, b, c, d] = four([(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]);
            a * 0.25 + b * 0.25 + c * 0.25 + d * 0.25
        } else {
            shrunk(size, half, (x, y), &one)
        };
    }
}

/// The mean of what texel (x, y) of `half` covers of `size`: two texels along a side, or three of an
/// odd one, the outer ones in part.
fn shrunk(
    size: (usize, usize),
    half: (usize, usize),
    (x, y): (usize, usize),
    at: &impl Fn(usize, usize) -> Vec4,
) -> Vec4 {
    let (first_x, across) = taps(x, size.0, half.0);
    let (first_y, down) = taps(y, size.1, half.1);
    let mut sum = Vec4::ZERO;
    for (j, wy) in down.into_iter().enumerate().filter(|w| w.1 > 0.0) {
        for (i, wx) in across.into_iter().enumerate().filter(|w| w.1 > 0.0) {
            sum += at(first_x + i, first_y + j) * (wx * wy);
        }
    }
    sum
}

/// The first texel along a side that `i` of `half` covers, and how much it has of it and the next two.
fn taps(i: usize, size: usize, half: usize) -> (usize, [f32; 3]) {
    if size == 1 {
        return (0, [1.0, 0.0, 0.0]);
    }
    if size == 2 * half {
        return (2 * i, [0.5, 0.5, 0.0]);
    }
    // It covers i·(2 + 1/half) to (i + 1)·(2 + 1/half).
    let n = size as f32;
    (2 * i, [(half - i) as f32 / n, half as f32 / n, (i + 1) as f32 / n])
}

/// What is averaged of some of the image's texels.
fn averaged<const N: usize>(
    image: TexelView,
    mean: DownsampleFilter,
    places: [(usize, usize); N],
) -> [Vec4; N] {
    let at = places.map(|(x, y)| y * image.width as usize + x);
    match mean {
        DownsampleFilter::Numbers => image.all_stored(at),
        DownsampleFilter::Light { covered } => image.all_decoded(at).map(|v| weighed(v, covered)),
        DownsampleFilter::Shown { covered } => places.map(|(x, y)| shown(image, x, y, covered)),
        DownsampleFilter::Normals => image.all_stored(at).map(|v| {
            let v = v.truncate() * 2.0 - 1.0;
            v.normalize_or_zero().extend(0.0)
        }),
    }
}

fn weighed(v: Vec4, covered: bool) -> Vec4 {
    if covered { (v.truncate() * (v.w + CLEAR)).extend(v.w) } else { v }
}

/// The mean light over a texel of the image interpolated as it is encoded, by Gauss's rule of two
/// points in each direction between texel centres.
fn shown(image: TexelView, x: usize, y: usize, covered: bool) -> Vec4 {
    const NEAR: f32 = 0.788_675_1;
    const FAR: f32 = 1.0 - NEAR;
    let (w, h) = (image.width as usize, image.height as usize);
    let at = |x: usize, y: usize| image.stored((y % h) * w + x % w);
    let middle = at(x, y);
    let mut sum = Vec4::ZERO;
    for dx in [w - 1, 1] {
        for dy in [h - 1, 1] {
            let corner = at(x + dx, y + dy);
            let sides = at(x + dx, y) + at(x, y + dy);
            let v = middle * (NEAR * NEAR) + sides * (NEAR * FAR) + corner * (FAR * FAR);
            sum += weighed(decode_colors(v), covered);
        }
    }
    sum * 0.25
}

/// Means as texels: `plain` makes a code of a number, `light` one of linear light.
fn store<T>(
    means: &[Vec4],
    mean: DownsampleFilter,
    (plain, light): (impl Fn(f32) -> T, impl Fn(f32) -> T),
    texels: &mut [T],
) {
    let channels = texels.len() / means.len().max(1);
    let colors = if channels < 3 { 1 } else { 3 };
    for (&v, texel) in means.iter().zip(texels.chunks_exact_mut(channels.max(1))) {
        let (v, encoded) = match mean {
            DownsampleFilter::Numbers => (v, false),
            DownsampleFilter::Normals => (direction(v), false),
            DownsampleFilter::Light { covered: true } | DownsampleFilter::Shown { covered: true } => {
                ((v.truncate() / (v.w + CLEAR)).extend(v.w), true)
            }
            DownsampleFilter::Light { .. } | DownsampleFilter::Shown { .. } => (v, true),
        };
        let (color, alpha) = texel.split_at_mut(colors);
        for (c, to) in color.iter_mut().enumerate() {
            *to = if encoded { light(v[c]) } else { plain(v[c]) };
        }
        for to in alpha {
            *to = plain(v.w);
        }
    }
}

/// A mean of unit vectors as a texel: its direction, and the root of what its length lacks to 1.
fn direction(mean: Vec4) -> Vec4 {
    let n = mean.truncate();
    let length = n.length().min(1.0);
    let unit = n.try_normalize().unwrap_or(glam::Vec3::Z);
    (unit * 0.5 + 0.5).extend((1.0 - length).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Image;

    fn image(width: u32, height: u32, channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width, height, channels, texels, mips: MipMaps::default() }
    }

    /// A checker of single texels, black and white.
    fn checker(width: u32, height: u32) -> Image {
        let texels =
            (0..width * height).map(|i| if (i % width + i / width).is_multiple_of(2) { 255 } else { 0 });
        image(width, height, Channels::L, Texels::U8(texels.collect()))
    }

    fn bytes(level: &MipLevel) -> &[u8] {
        let Texels::U8(t) = &level.texels else { panic!("8 bits stay 8 bits") };
        t
    }

    const LIGHT: DownsampleFilter = DownsampleFilter::Light { covered: false };

    #[test]
    fn light_is_averaged_as_light_and_numbers_as_numbers() {
        let image = checker(8, 4);
        let light = image.mips.of(image.plane(), LIGHT);
        let numbers = image.mips.of(image.plane(), DownsampleFilter::Numbers);
        assert_eq!(light.len(), 3);
        for (light, numbers) in light.iter().zip(numbers) {
            assert!(bytes(light).iter().all(|&v| v == 188) && bytes(numbers).iter().all(|&v| v == 128));
        }
        assert_eq!((light[2].width, light[2].height), (1, 1));
    }

    #[test]
    fn odd_sides_keep_the_mean() {
        // Rounding to 8 bits comes once for each level, from means that were not rounded.
        for (w, h) in [(1, 1), (1, 7), (2, 2), (3, 5), (7, 1), (37, 11), (64, 3), (101, 255)] {
            let texels: Vec<u8> = (0..w * h).map(|i| (i * 7919 % 251) as u8).collect();
            let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / f64::from(w * h);
            let image = image(w, h, Channels::L, Texels::U8(texels));
            let levels = image.mips.of(image.plane(), DownsampleFilter::Numbers);
            assert_eq!(levels.len(), w.max(h).ilog2() as usize);
            if let Some(last) = levels.last() {
                assert!((f64::from(bytes(last)[0]) - mean).abs() < 0.51, "{w} x {h}");
            }
        }
    }

    #[test]
    fn sixteen_bits_stay_sixteen() {
        let image = image(2, 1, Channels::La, Texels::U16(vec![0, 0, 65535, 4]));
        let Texels::U16(t) = &image.mips.of(image.plane(), LIGHT)[0].texels else { panic!("16 bits") };
        assert_eq!(t, &[48192, 2]);
    }

    #[test]
    fn clear_texels_have_no_say_in_covered_colours() {
        let texels = vec![255, 0, 0, 255, 0, 255, 0, 0];
        let image = image(2, 1, Channels::Rgba, Texels::U8(texels));
        assert_eq!(
            bytes(&image.mips.of(image.plane(), DownsampleFilter::Light { covered: true })[0]),
            [255, 0, 0, 128]
        );
        assert_eq!(bytes(&image.mips.of(image.plane(), LIGHT)[0]), [188, 188, 0, 128]);
    }

    #[test]
    fn normals_are_averaged_as_vectors_and_leave_their_spread() {
        // Two that lean 45° to either side: their mean is upright, and cos 45° long.
        let lean = |x: f32| [(x * 0.5 + 0.5) * 255.0, 127.5, 255.0 * (0.5 + 0.5 * 0.5f32.sqrt())];
        let s = 0.5f32.sqrt();
        let texels = [lean(s), lean(-s)].concat().iter().map(|&v| v.round() as u8).collect();
        let image = image(2, 1, Channels::Rgb, Texels::U8(texels));
        let level = &image.mips.of(image.plane(), DownsampleFilter::Normals)[0];
        let expected = (1.0 - s).sqrt() * 255.0;
        let [x, y, z, lack] = bytes(level) else { panic!("one texel of four channels") };
        assert!(x.abs_diff(128) <= 1 && y.abs_diff(128) <= 1 && *z == 255);
        assert!((f32::from(*lack) - expected).abs() < 2.0, "{lack}");
    }

    #[test]
    fn encoded_interpolation_has_levels_as_bright_as_it_looks() {
        // The integral over the interpolated checker, by brute force.
        let image = checker(8, 8);
        let texture = crate::scene::Texture { decode_last: true, ..Default::default() };
        let n = 256;
        let at = |i: u32| (f64::from(i) + 0.5) as f32 / n as f32 / 4.0;
        let places = (0..n * n).map(|i| glam::Vec2::new(at(i % n), at(i / n)));
        let images = [image];
        let sum: f64 = places.map(|uv| f64::from(texture.sample(&images, uv, TexelSemantics::Color).x)).sum();
        let mean = sum / f64::from(n * n);
        let level = &images[0].mips.of(images[0].plane(), DownsampleFilter::Shown { covered: false })[0];
        let found = f64::from(level.plane().decoded(0).x);
        assert!((found / mean - 1.0).abs() < 0.01, "{found} where {mean} is seen");
        assert!(mean < 0.26, "less than half of the light, as Blender shows it");
    }

    #[test]
    fn any_number_of_threads_makes_the_same_levels() {
        let texels: Vec<u8> =
            (0..1021u32 * 517).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let made = |threads: usize| {
            let image = image(1021, 517, Channels::L, Texels::U8(texels.clone()));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                image.mips.of(image.plane(), LIGHT).iter().map(|l| bytes(l).to_vec()).collect::<Vec<_>>()
            })
        };
        let one = made(1);
        assert!(one.len() == 9 && one == made(3) && one == made(7));
    }
}
