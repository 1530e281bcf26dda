//! Colour quantization: a palette per frame (Wu's method), and Floyd–Steinberg dithering.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use quantette::color_map::{IndexedColorMap, NearestNeighborColorMap};
use quantette::color_space::srgb8_to_oklab;
use quantette::deps::palette::{Oklab, Srgb};
use quantette::{PaletteSize, Pipeline, QuantizeMethod};

/// Largest number of colours: one of the 256 indices stands for transparent.
const MAX_COLORS: u8 = 255;
/// Fraction of the error that dithering diffuses. A little less than 1 keeps noise out of nearly flat areas.
const DIFFUSION: f32 = 0.875;

/// Pixels as indices into a palette.
pub(super) struct IndexedImage {
    /// sRGB triples, the last of which belongs to [`IndexedImage::transparent`].
    pub palette: Vec<u8>,
    /// Row-major.
    pub indices: Vec<u8>,
    /// The index of transparent pixels.
    pub transparent: u8,
}

/// Quantizes rows of `width` pixels. `None` is transparent and does not influence the palette.
pub(super) fn quantize(pixels: &[Option<[u8; 3]>], width: usize) -> IndexedImage {
    if let Some(exact) = index_exactly(pixels) {
        return exact;
    }
    let opaque: Vec<Srgb<u8>> = pixels.iter().flatten().map(|&rgb| rgb.into()).collect();
    let pipeline = Pipeline::new()
        .palette_size(PaletteSize::from_u8_clamped(MAX_COLORS))
        .quantize_method(QuantizeMethod::Wu);
    // Fails only for an empty slice, which is exact, and for 2^32 pixels, which no GIF has.
    let Ok(input) = pipeline.input_slice(&opaque) else {
        return IndexedImage { palette: vec![0; 3], indices: vec![0; pixels.len()], transparent: 0 };
    };
    let colors = NearestNeighborColorMap::new(input.output_oklab_palette());
    let transparent = colors.palette().len() as u8;
    let indices = dither(pixels, width, &srgb8_to_oklab(&opaque), &colors, transparent);
    let srgb = quantette::color_space::oklab_to_srgb8(colors.palette());
    let mut palette: Vec<u8> = srgb.iter().flat_map(|c| [c.red, c.green, c.blue]).collect();
    palette.extend([0; 3]);
    IndexedImage { palette, indices, transparent }
}

/// Indexes the pixels without loss. `None` if there are too many colours.
fn index_exactly(pixels: &[Option<[u8; 3]>]) -> Option<IndexedImage> {
    let mut index_of: HashMap<[u8; 3], u8> = HashMap::new();
    let mut palette = Vec::new();
    for &rgb in pixels.iter().flatten() {
        if let Entry::Vacant(entry) = index_of.entry(rgb) {
            let index = u8::try_from(palette.len() / 3).ok().filter(|&n| n < MAX_COLORS)?;
            entry.insert(index);
            palette.extend(rgb);
        }
    }
    let transparent = index_of.len() as u8;
    palette.extend([0; 3]);
    let index = |p: &Option<[u8; 3]>| p.and_then(|rgb| index_of.get(&rgb).copied()).unwrap_or(transparent);
    Some(IndexedImage { indices: pixels.iter().map(index).collect(), palette, transparent })
}

/// Floyd–Steinberg error diffusion in serpentine order. Transparent pixels neither cause nor receive errors, which
/// quantette's dithering does not support. `opaque` holds the colours of the other pixels.
fn dither(
    pixels: &[Option<[u8; 3]>],
    width: usize,
    opaque: &[Oklab],
    colors: &NearestNeighborColorMap<Oklab, f32, 3>,
    transparent: u8,
) -> Vec<u8> {
    let mut indices = vec![transparent; pixels.len()];
    // The errors of a row and the next. A column on each side takes what leaves the image.
    let mut current = vec![[0.0f32; 3]; width + 2];
    let mut next = vec![[0.0f32; 3]; width + 2];
    let mut first = 0;
    for (y, row) in pixels.chunks_exact(width).enumerate() {
        let count = row.iter().flatten().count();
        let opaque_columns = (0..width).filter(|&x| row[x].is_some()).zip(&opaque[first..first + count]);
        first += count;
        let mut columns: Vec<(usize, &Oklab)> = opaque_columns.collect();
        // Offsets of the next and the previous pixel in the padded rows.
        let (ahead, behind) = if y % 2 == 0 { (2, 0) } else { (0, 2) };
        if y % 2 == 1 {
            columns.reverse();
        }
        for (x, color) in columns {
            let target: [f32; 3] =
                std::array::from_fn(|c| [color.l, color.a, color.b][c] + current[x + 1][c]);
            let index = colors.palette_index(&Oklab::new(target[0], target[1], target[2]));
            let nearest = &colors.palette()[usize::from(index)];
            let nearest = [nearest.l, nearest.a, nearest.b];
            indices[y * width + x] = index;
            for c in 0..3 {
                let error = DIFFUSION * (target[c] - nearest[c]);
                current[x + ahead][c] += error * (7.0 / 16.0);
                next[x + behind][c] += error * (3.0 / 16.0);
                next[x + 1][c] += error * (5.0 / 16.0);
                next[x + ahead][c] += error * (1.0 / 16.0);
            }
        }
        std::mem::swap(&mut current, &mut next);
        next.fill([0.0; 3]);
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact() {
        let pixels: Vec<_> = (0..1000u32).map(|i| (i % 7 != 0).then_some([(i % 255) as u8, 3, 4])).collect();
        let indexed = quantize(&pixels, 10);
        for (pixel, &i) in pixels.iter().zip(&indexed.indices) {
            let at = usize::from(i) * 3;
            assert_eq!(
                *pixel,
                (i != indexed.transparent).then(|| indexed.palette[at..at + 3].try_into().unwrap())
            );
        }
        assert_eq!(quantize(&[None; 4], 2).indices, [0; 4]);
    }

    /// The mean of each block of a ramp of many colours is within 1 %.
    #[test]
    fn dithering_keeps_the_mean_colour_beside_transparent_pixels() {
        let side = 128;
        let color = |x: usize, y: usize| [(2 * x) as u8, (2 * y) as u8, (x + y) as u8];
        let ramp: Vec<_> = (0..side * side)
            .map(|i| (color(i % side, i / side), (i % side) % 16 < 8))
            .map(|(rgb, opaque)| opaque.then_some(rgb))
            .collect();
        let indexed = quantize(&ramp, side);
        assert!(indexed.palette.len() <= 256 * 3);
        for block in 0..(side / 16) * (side / 16) {
            let (x0, y0) = (block % 8 * 16, block / 8 * 16);
            let opaque = (0..256).map(|i| (y0 + i / 16) * side + x0 + i % 16).filter(|&i| ramp[i].is_some());
            let mut error = [0i32; 3];
            let mut count = 0;
            for i in opaque {
                let at = usize::from(indexed.indices[i]) * 3;
                assert_ne!(indexed.indices[i], indexed.transparent);
                for (c, error) in error.iter_mut().enumerate() {
                    *error += i32::from(indexed.palette[at + c]) - i32::from(ramp[i].unwrap()[c]);
                }
                count += 1;
            }
            assert!(error.iter().all(|e| e.abs() <= 4 * count), "{block}: {error:?} of {count}");
        }
        assert!(ramp.iter().zip(&indexed.indices).all(|(p, &i)| p.is_some() == (i != indexed.transparent)));
    }
}
