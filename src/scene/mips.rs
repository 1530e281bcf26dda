//! Smaller copies of images: each half as wide and high as the one before, down to a single texel.
//!
//! A texel of a smaller copy is the mean of what it covers, also where sides are odd. What a mean is
//! depends on what the numbers say ([`Reading`]): light is averaged as light, normals as vectors. So
//! an image has a pyramid for each way in which it is read, made when it is first needed: textures
//! that are only ever seen magnified have none. Levels are stored as the image is, in 8 or 16 bits and
//! with colours encoded, so that a pyramid is a third of its image.

use std::sync::{Mutex, OnceLock, PoisonError};

use glam::Vec4;

use super::image::{Channels, Plane, Texels};
use super::lowest::Lowest;
use super::material::Channel4;
use super::srgb::{decode_colors, linear_to_srgb, linear_to_srgb8};

/// What the numbers of a texture say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Colours, sRGB-encoded, and an alpha that nobody looks at, or on its own.
    Color,
    /// Colours of which only as much is seen as alpha leaves: what is clear has no say in a mean.
    Covered,
    /// Plain numbers.
    Data,
}

/// How levels are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
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

impl Mean {
    fn place(self) -> usize {
        match self {
            Mean::Light { covered } => usize::from(covered),
            Mean::Shown { covered } => 2 + usize::from(covered),
            Mean::Numbers => 4,
            Mean::Normals => 5,
        }
    }
}

/// The smaller copies of an image: of its means, and of a channel's least numbers.
#[derive(Clone, Debug, Default)]
pub struct Mips {
    means: [OnceLock<Vec<Level>>; 6],
    lowest: [OnceLock<Lowest>; 5],
}

/// One of them.
#[derive(Clone, Debug)]
pub(super) struct Level {
    width: u32,
    height: u32,
    channels: Channels,
    texels: Texels,
}

impl Level {
    pub fn plane(&self) -> Plane<'_> {
        Plane { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

/// Weight of the colour of a clear texel: where all are clear there is still a colour.
pub(super) const CLEAR: f32 = 1e-4;

impl Mips {
    /// The smaller copies of `image`, from half its size down. Whoever comes first makes them.
    pub(super) fn of(&self, image: Plane, mean: Mean) -> &[Level] {
        self.means[mean.place()].get_or_init(|| pyramid(image, mean))
    }

    /// The least of a channel of `image` in its parts. Whoever comes first looks for them.
    pub(super) fn lowest(&self, image: Plane, channel: Channel4) -> &Lowest {
        self.lowest[channel as usize].get_or_init(|| Lowest::new(image, channel))
    }
}

fn pyramid(image: Plane, mean: Mean) -> Vec<Level> {
    let channels = if mean == Mean::Normals { Channels::Rgba } else { image.channels };
    let sixteen = matches!(image.texels, Texels::U16(_));
    let mut levels = Vec::new();
    let mut size = (image.width as usize, image.height as usize);
    let mut finer: Vec<Vec4> = Vec::new();
    while size != (1, 1) {
        let half = ((size.0 / 2).max(1), (size.1 / 2).max(1));
        let mut coarser = vec![Vec4::ZERO; half.0 * half.1];
        if levels.is_empty() {
            let averaged = |x, y| averaged(image, mean, x, y);
            fill(&mut coarser, half.0, &|x, y| shrunk(size, half, (x, y), &averaged));
        } else {
            let at = |x: usize, y: usize| finer[y * size.0 + x];
            fill(&mut coarser, half.0, &|x, y| shrunk(size, half, (x, y), &at));
        }
        let texels = if sixteen {
            Texels::U16(stored(
                &coarser,
                mean,
                channels,
                |v| (v * 65535.0 + 0.5) as u16,
                |v| (linear_to_srgb(v) * 65535.0 + 0.5) as u16,
            ))
        } else {
            Texels::U8(stored(&coarser, mean, channels, |v| (v * 255.0 + 0.5) as u8, linear_to_srgb8))
        };
        levels.push(Level { width: half.0 as u32, height: half.1 as u32, channels, texels });
        (finer, size) = (coarser, half);
    }
    levels
}

/// Computes every texel of rows of `width`. Large ones are divided among threads of their own:
/// a task of a pool that waits for the pool, while another thread waits for the pyramid, may wait
/// for itself.
fn fill(out: &mut [Vec4], width: usize, at: &(dyn Fn(usize, usize) -> Vec4 + Sync)) {
    let fill_rows = |first: usize, rows: &mut [Vec4]| {
        for (i, row) in rows.chunks_mut(width).enumerate() {
            for (x, texel) in row.iter_mut().enumerate() {
                *texel = at(x, first + i);
            }
        }
    };
    let threads = if out.len() < 1 << 16 { 1 } else { rayon::current_num_threads().clamp(1, 16) };
    let rows = (out.len() / width).div_ceil(threads);
    let parts = Mutex::new(out.chunks_mut(rows * width).enumerate());
    let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || {
        while let Some((i, part)) = next() {
            fill_rows(i * rows, part);
        }
    };
    std::thread::scope(|scope| {
        // Where there are no more threads, those that are there do it.
        let helps = |_: &usize| std::thread::Builder::new().spawn_scoped(scope, work).is_ok();
        let _ = (1..threads).take_while(helps).count();
        work();
    });
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

/// What is averaged of the image's texel (x, y).
fn averaged(image: Plane, mean: Mean, x: usize, y: usize) -> Vec4 {
    let i = y * image.width as usize + x;
    match mean {
        Mean::Numbers => image.stored(i),
        Mean::Light { covered } => weighed(image.decoded(i), covered),
        Mean::Shown { covered } => shown(image, x, y, covered),
        Mean::Normals => {
            let v = image.stored(i).truncate() * 2.0 - 1.0;
            v.normalize_or_zero().extend(0.0)
        }
    }
}

fn weighed(v: Vec4, covered: bool) -> Vec4 {
    if covered { (v.truncate() * (v.w + CLEAR)).extend(v.w) } else { v }
}

/// The mean light over a texel of the image interpolated as it is encoded, by Gauss's rule of two
/// points in each direction between texel centres.
fn shown(image: Plane, x: usize, y: usize, covered: bool) -> Vec4 {
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
fn stored<T>(
    means: &[Vec4],
    mean: Mean,
    channels: Channels,
    plain: impl Fn(f32) -> T,
    light: impl Fn(f32) -> T,
) -> Vec<T> {
    let mut out = Vec::with_capacity(means.len() * channels as usize);
    for &v in means {
        let (v, encoded) = match mean {
            Mean::Numbers => (v, false),
            Mean::Normals => (direction(v), false),
            Mean::Light { covered: true } | Mean::Shown { covered: true } => {
                ((v.truncate() / (v.w + CLEAR)).extend(v.w), true)
            }
            Mean::Light { .. } | Mean::Shown { .. } => (v, true),
        };
        let colors = if matches!(channels, Channels::L | Channels::La) { 1 } else { 3 };
        for c in 0..colors {
            out.push(if encoded { light(v[c]) } else { plain(v[c]) });
        }
        if matches!(channels, Channels::La | Channels::Rgba) {
            out.push(plain(v.w));
        }
    }
    out
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
        Image { name: String::new(), width, height, channels, texels, mips: Mips::default() }
    }

    /// A checker of single texels, black and white.
    fn checker(width: u32, height: u32) -> Image {
        let texels =
            (0..width * height).map(|i| if (i % width + i / width).is_multiple_of(2) { 255 } else { 0 });
        image(width, height, Channels::L, Texels::U8(texels.collect()))
    }

    fn bytes(level: &Level) -> &[u8] {
        let Texels::U8(t) = &level.texels else { panic!("8 bits stay 8 bits") };
        t
    }

    const LIGHT: Mean = Mean::Light { covered: false };

    #[test]
    fn light_is_averaged_as_light_and_numbers_as_numbers() {
        let image = checker(8, 4);
        let light = image.mips.of(image.plane(), LIGHT);
        let numbers = image.mips.of(image.plane(), Mean::Numbers);
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
            let levels = image.mips.of(image.plane(), Mean::Numbers);
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
        assert_eq!(bytes(&image.mips.of(image.plane(), Mean::Light { covered: true })[0]), [255, 0, 0, 128]);
        assert_eq!(bytes(&image.mips.of(image.plane(), LIGHT)[0]), [188, 188, 0, 128]);
    }

    #[test]
    fn normals_are_averaged_as_vectors_and_leave_their_spread() {
        // Two that lean 45° to either side: their mean is upright, and cos 45° long.
        let lean = |x: f32| [(x * 0.5 + 0.5) * 255.0, 127.5, 255.0 * (0.5 + 0.5 * 0.5f32.sqrt())];
        let s = 0.5f32.sqrt();
        let texels = [lean(s), lean(-s)].concat().iter().map(|&v| v.round() as u8).collect();
        let image = image(2, 1, Channels::Rgb, Texels::U8(texels));
        let level = &image.mips.of(image.plane(), Mean::Normals)[0];
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
        let sum: f64 = places.map(|uv| f64::from(texture.sample(&images, uv, Reading::Color).x)).sum();
        let mean = sum / f64::from(n * n);
        let level = &images[0].mips.of(images[0].plane(), Mean::Shown { covered: false })[0];
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
