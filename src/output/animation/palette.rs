//! Few colours for many: a palette of a frame's own, and its pixels by numbers in it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use quantette::color_map::{IndexedColorMap, NearestNeighborColorMap};
use quantette::color_space::srgb8_to_oklab;
use quantette::deps::palette::{Oklab, Srgb};
use quantette::{PaletteSize, Pipeline, QuantizeMethod};

/// Most colours of a palette: of 256 numbers, one means that nothing is drawn.
const COLOURS: u8 = 255;
/// Share of a pixel's error that its neighbours make up for. A little less than all of it keeps noise out
/// of what is nearly flat.
const DIFFUSION: f32 = 0.875;

/// A part of a picture by numbers in a palette.
pub(crate) struct Indexed {
    /// sRGB triples, the last of which belongs to [`Indexed::nothing`].
    pub palette: Vec<u8>,
    /// Row-major.
    pub indices: Vec<u8>,
    /// The number of pixels that are not drawn.
    pub nothing: u8,
}

/// Finds numbers for `pixels`, rows of `width`; none are not drawn, and count for nothing.
pub(crate) fn quantise(pixels: &[Option<[u8; 3]>], width: usize) -> Indexed {
    if let Some(exact) = exactly(pixels) {
        return exact;
    }
    let drawn: Vec<Srgb<u8>> = pixels.iter().flatten().map(|&rgb| rgb.into()).collect();
    let pipeline = Pipeline::new()
        .palette_size(PaletteSize::from_u8_clamped(COLOURS))
        .quantize_method(QuantizeMethod::Wu);
    // Only an empty slice or one of 2^32 pixels is refused: the former is exact, the latter no GIF.
    let Ok(input) = pipeline.input_slice(&drawn) else {
        return Indexed { palette: vec![0; 3], indices: vec![0; pixels.len()], nothing: 0 };
    };
    let colors = NearestNeighborColorMap::new(input.output_oklab_palette());
    let nothing = colors.palette().len() as u8;
    let indices = dither(pixels, width, &srgb8_to_oklab(&drawn), &colors, nothing);
    let shown = quantette::color_space::oklab_to_srgb8(colors.palette());
    let mut palette: Vec<u8> = shown.iter().flat_map(|c| [c.red, c.green, c.blue]).collect();
    palette.extend([0; 3]);
    Indexed { palette, indices, nothing }
}

/// The pixels' own colours, where they are few.
fn exactly(pixels: &[Option<[u8; 3]>]) -> Option<Indexed> {
    let mut numbers: HashMap<[u8; 3], u8> = HashMap::new();
    let mut palette = Vec::new();
    for &rgb in pixels.iter().flatten() {
        if let Entry::Vacant(place) = numbers.entry(rgb) {
            let number = u8::try_from(palette.len() / 3).ok().filter(|&n| n < COLOURS)?;
            place.insert(number);
            palette.extend(rgb);
        }
    }
    let nothing = numbers.len() as u8;
    palette.extend([0; 3]);
    let number = |p: &Option<[u8; 3]>| p.and_then(|rgb| numbers.get(&rgb).copied()).unwrap_or(nothing);
    Some(Indexed { indices: pixels.iter().map(number).collect(), palette, nothing })
}

/// Floyd and Steinberg's error diffusion, to and fro. What is not drawn neither makes nor takes errors,
/// which is why this is not the library's.
fn dither(
    pixels: &[Option<[u8; 3]>],
    width: usize,
    drawn: &[Oklab],
    colors: &NearestNeighborColorMap<Oklab, f32, 3>,
    nothing: u8,
) -> Vec<u8> {
    let mut indices = vec![nothing; pixels.len()];
    // A column more on both sides, for what diffuses out of the picture.
    let (mut here, mut below) = (vec![[0.0f32; 3]; width + 2], vec![[0.0f32; 3]; width + 2]);
    let mut first = 0;
    for (y, row) in pixels.chunks_exact(width).enumerate() {
        let count = row.iter().flatten().count();
        // The row's drawn columns, each with its colour.
        let columns = (0..width).filter(|&x| row[x].is_some()).zip(&drawn[first..first + count]);
        first += count;
        let mut columns: Vec<(usize, &Oklab)> = columns.collect();
        let (forth, back) = if y % 2 == 0 { (2, 0) } else { (0, 2) };
        if y % 2 == 1 {
            columns.reverse();
        }
        for (x, color) in columns {
            let wanted: [f32; 3] = std::array::from_fn(|c| [color.l, color.a, color.b][c] + here[x + 1][c]);
            let index = colors.palette_index(&Oklab::new(wanted[0], wanted[1], wanted[2]));
            let got = &colors.palette()[usize::from(index)];
            let got = [got.l, got.a, got.b];
            indices[y * width + x] = index;
            for c in 0..3 {
                let error = DIFFUSION * (wanted[c] - got[c]);
                here[x + forth][c] += error * (7.0 / 16.0);
                below[x + back][c] += error * (3.0 / 16.0);
                below[x + 1][c] += error * (5.0 / 16.0);
                below[x + forth][c] += error * (1.0 / 16.0);
            }
        }
        std::mem::swap(&mut here, &mut below);
        below.fill([0.0; 3]);
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_stay_exact() {
        let pixels: Vec<_> = (0..1000u32).map(|i| (i % 7 != 0).then_some([(i % 255) as u8, 3, 4])).collect();
        let indexed = quantise(&pixels, 10);
        for (pixel, &i) in pixels.iter().zip(&indexed.indices) {
            let at = usize::from(i) * 3;
            assert_eq!(
                *pixel,
                (i != indexed.nothing).then(|| indexed.palette[at..at + 3].try_into().unwrap())
            );
        }
        assert_eq!(quantise(&[None; 4], 2).indices, [0; 4]);
    }

    /// Seen from far enough, a ramp of many colours is itself: the mean of each block is within 1 %.
    #[test]
    fn many_colours_are_right_on_average_and_nothing_bleeds_in() {
        let side = 128;
        let color = |x: usize, y: usize| [(2 * x) as u8, (2 * y) as u8, (x + y) as u8];
        let ramp: Vec<_> = (0..side * side)
            .map(|i| (color(i % side, i / side), (i % side) % 16 < 8))
            .map(|(rgb, drawn)| drawn.then_some(rgb))
            .collect();
        let indexed = quantise(&ramp, side);
        assert!(indexed.palette.len() <= 256 * 3);
        for block in 0..(side / 16) * (side / 16) {
            let (x0, y0) = (block % 8 * 16, block / 8 * 16);
            let places = (0..256).map(|i| (y0 + i / 16) * side + x0 + i % 16).filter(|&i| ramp[i].is_some());
            let mut off = [0i32; 3];
            let mut count = 0;
            for i in places {
                let at = usize::from(indexed.indices[i]) * 3;
                assert_ne!(indexed.indices[i], indexed.nothing);
                for (c, off) in off.iter_mut().enumerate() {
                    *off += i32::from(indexed.palette[at + c]) - i32::from(ramp[i].unwrap()[c]);
                }
                count += 1;
            }
            assert!(off.iter().all(|o| o.abs() <= 4 * count), "{block}: {off:?} of {count}");
        }
        assert!(ramp.iter().zip(&indexed.indices).all(|(p, &i)| p.is_some() == (i != indexed.nothing)));
    }
}
