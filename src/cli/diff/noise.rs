//! Noise of pictures, told from their changes.
//!
//! A picture with random light that is rendered again with other random numbers shows what noise does to each pixel. A
//! difference is noise if it is no larger than that nearby, and has no trend either: the means over small windows differ
//! no more than those of the two renderings. A change of a material is far below the noise of a pixel, but not below that
//! of a window.

use glam::DVec3;

use super::comparison::PicturePair;

/// Pixels from the centre of a window to its edge.
const RADIUS: usize = 4;
/// Multiple of the largest noise in a window up to which a difference is noise.
const FACTOR: f32 = 1.5;

/// Clears the differences of `pair` that `noise`, two renderings of its first scene, explains. Returns their number.
pub fn forgive_noise(pair: &mut PicturePair, noise: &PicturePair) -> u64 {
    let size = (pair.width as usize, pair.height as usize);
    let largest = window_max(&noise.map.magnitudes, size);
    let largest_mean = window_max(&means(noise, size), size);
    let trend = means(pair, size);
    let mut count = 0;
    for (i, magnitude) in pair.map.magnitudes.iter_mut().enumerate() {
        if *magnitude > 0.0 && *magnitude <= FACTOR * largest[i] && trend[i] <= FACTOR * largest_mean[i] {
            *magnitude = 0.0;
            count += 1;
        }
    }
    count
}

/// The largest absolute mean difference of a channel, over the window around each pixel.
fn means(pair: &PicturePair, size: (usize, usize)) -> Vec<f32> {
    let [old, new] = &pair.colors;
    let differences: Vec<DVec3> = old.iter().zip(new).map(|(a, b)| *b - *a).collect();
    let rows = windows(&differences, size, true, |window| window.iter().sum::<DVec3>() / window.len() as f64);
    let both = windows(&rows, size, false, |window| window.iter().sum::<DVec3>() / window.len() as f64);
    both.into_iter().map(|mean| mean.abs().max_element() as f32).collect()
}

/// The largest value in the window around each pixel.
fn window_max(values: &[f32], size: (usize, usize)) -> Vec<f32> {
    let max = |window: &[f32]| window.iter().fold(0.0, |max: f32, v| max.max(*v));
    windows(&windows(values, size, true, max), size, false, max)
}

/// Folds the values around each pixel, along its row or its column.
fn windows<T: Copy>(
    values: &[T],
    (width, height): (usize, usize),
    is_row: bool,
    fold: impl Fn(&[T]) -> T,
) -> Vec<T> {
    let (length, step) = if is_row { (width, 1) } else { (height, width) };
    let mut window = Vec::with_capacity(2 * RADIUS + 1);
    let mut at = |i: usize| {
        let along = if is_row { i % width } else { i / width };
        let first = i - along * step;
        window.clear();
        let range = along.saturating_sub(RADIUS)..(along + RADIUS + 1).min(length);
        window.extend(range.map(|k| values[first + k * step]));
        fold(&window)
    };
    (0..width * height).map(&mut at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_output::compare::DifferenceMap;

    const SIZE: (usize, usize) = (40, 30);

    /// Two grey pictures.
    fn pair(old: impl Fn(usize) -> f64, new: impl Fn(usize) -> f64) -> PicturePair {
        let count = SIZE.0 * SIZE.1;
        let (old, new): (Vec<f64>, Vec<f64>) = ((0..count).map(old).collect(), (0..count).map(new).collect());
        let magnitudes = old.iter().zip(&new).map(|(a, b)| (a - b).abs() as f32).collect();
        let (width, height) = (SIZE.0 as u32, SIZE.1 as u32);
        PicturePair {
            width,
            height,
            map: DifferenceMap { width, height, magnitudes },
            colors: [old, new].map(|values| values.into_iter().map(DVec3::splat).collect()),
            shown: [vec![[0; 4]; count], vec![[0; 4]; count]],
        }
    }

    /// Random numbers from -0.1 to 0.1.
    fn random(i: usize, seed: u64) -> f64 {
        let mut x =
            (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ seed.wrapping_mul(0xd1b5_4a32_d192_ed03);
        x ^= x >> 31;
        x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x ^= x >> 29;
        0.2 * ((x >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    }

    #[test]
    fn noise_is_cleared_and_changes_stay() {
        let picture = |seed: u64, change: fn(usize) -> f64| move |i: usize| 0.5 + random(i, seed) + change(i);
        let noise = pair(picture(1, |_| 0.0), picture(2, |_| 0.0));
        let changed = |pair: &PicturePair| pair.map.magnitudes.iter().filter(|m| **m > 0.0).count();

        let mut only_noise = pair(picture(1, |_| 0.0), picture(3, |_| 0.0));
        let cleared = forgive_noise(&mut only_noise, &noise);
        assert!(cleared as usize + changed(&only_noise) == 1200 && changed(&only_noise) < 24);

        // A little brighter on the left, with the same random numbers and with others.
        let left: fn(usize) -> f64 = |i| if i % 40 < 20 { 0.08 } else { 0.0 };
        for seed in [1, 3] {
            let mut brighter = pair(picture(1, |_| 0.0), picture(seed, left));
            forgive_noise(&mut brighter, &noise);
            let is_found = |i: &usize| brighter.map.magnitudes[*i] > 0.0;
            let found = (0..1200).filter(|i| i % 40 < 16).filter(is_found).count();
            assert!(found > 450, "{found} of 480");
            assert!((0..1200).filter(|i| i % 40 >= 26).filter(is_found).count() < 20);
        }
        // A small object.
        let mut object = pair(picture(1, |_| 0.0), picture(3, |i| if i == 615 { 0.4 } else { 0.0 }));
        forgive_noise(&mut object, &noise);
        assert!(object.map.magnitudes[615] > 0.0);
    }

    #[test]
    fn pictures_without_noise_keep_their_differences() {
        let still = pair(|_| 0.5, |_| 0.5);
        let mut changed = pair(|_| 0.5, |i| if i == 7 { 0.5 + 1e-6 } else { 0.5 });
        assert_eq!(forgive_noise(&mut changed, &still), 0);
        assert!(changed.map.magnitudes[7] > 0.0);
    }
}
