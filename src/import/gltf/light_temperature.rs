//! Colour keys of lights with a temperature: Blender's exporter multiplies a light's colour by that of its temperature, but not
//! the keys of the colour.

use glam::{DVec3, Vec3};

use crate::error::Warnings;
use crate::files::escape::printable;
use blinn_scene::{ChannelTarget, Light, LightProperty, Scene};

/// Range of Blender's temperatures whose colours differ, in kelvins.
const TEMPERATURES: std::ops::RangeInclusive<u32> = 800..=12_000;
/// Steps between the temperatures that are tried.
const STEP: usize = 20;
/// Relative deviation of a component from that of a temperature.
const TOLERANCE: f32 = 0.01;
/// Components below this have no meaningful quotient.
const DARK: f32 = 1e-4;

/// Multiplies the keys of colours by the colour of a temperature where the light's own colour is a key's times that of a
/// temperature: it is that of the frame at which the file was written. Warns where no temperature explains a colour that no
/// key has.
pub(super) fn restore(scene: &mut Scene, warnings: &mut Warnings) {
    let Scene { animations, lights, .. } = scene;
    for channel in animations.iter_mut().flat_map(|animation| &mut animation.channels) {
        let ChannelTarget::Light(id, LightProperty::Color) = channel.target else { continue };
        let light = &lights[id as usize];
        let keys = || channel.keyframes.values.as_chunks::<3>().0.iter().map(|&key| Vec3::from(key));
        let has_own_color = keys().any(|key| key.abs_diff_eq(light.color, 1e-3));
        if has_own_color || light.color == Vec3::ZERO {
            continue;
        }
        match keys()
            .filter_map(|key| temperature_between(key, light.color))
            .min_by(|a, b| a.error.total_cmp(&b.error))
        {
            Some(Fit { color, .. }) => {
                for key in channel.keyframes.values.as_chunks_mut::<3>().0 {
                    *key = (Vec3::from(*key) * color).to_array();
                }
            }
            None => warn_of_excess(light, keys().fold(Vec3::ZERO, Vec3::max), warnings),
        }
    }
}

/// Warns if a light is brighter than all its keys.
fn warn_of_excess(light: &Light, brightest: Vec3, warnings: &mut Warnings) {
    if light.color.max_element() > 1.0 && light.color.max_element() > brightest.max_element() {
        let name = printable(&light.name);
        let message = "Blender leaves its temperature out of the keys of its colour; bake the temperature into the colour";
        warnings.add("", format_args!("light '{name}': {message}"));
    }
}

/// A temperature that explains a colour.
struct Fit {
    color: Vec3,
    /// Largest relative deviation.
    error: f32,
}

/// Returns the temperature whose colour times `key` is `color`. `None` if there is none, or if too few components show it.
fn temperature_between(key: Vec3, color: Vec3) -> Option<Fit> {
    let bright = key.cmpgt(Vec3::splat(DARK));
    if bright.bitmask().count_ones() < 2 {
        return None;
    }
    let error = |temperature: Vec3| {
        let of = |i: usize| {
            let expected = key[i] * temperature[i];
            (color[i] - expected).abs() / expected.max(color[i]).max(0.01)
        };
        (0..3).map(of).fold(0.0, f32::max)
    };
    let fits = TEMPERATURES.step_by(STEP).map(|kelvins| {
        let color = blackbody(f64::from(kelvins));
        Fit { color, error: error(color) }
    });
    fits.min_by(|a, b| a.error.total_cmp(&b.error)).filter(|fit| fit.error < TOLERANCE)
}

/// Returns Blender's colour of a black body, linear Rec. 709: a/t + b t + c for red and green, a cubic for blue.
fn blackbody(t: f64) -> Vec3 {
    /// Ends of the segments.
    const ENDS: [f64; 6] = [965.0, 1167.0, 1449.0, 1902.0, 3315.0, 6365.0];
    const R: [[f64; 3]; 7] = [
        [1.619_191_1e3, -2.050_109_2e-3, 5.029_957_6],
        [2.488_454_7e3, -1.113_309_1e-3, 3.226_215_4],
        [3.341_431_9e3, -4.865_511_9e-4, 1.764_867_7],
        [4.094_617_4e3, -1.274_465_8e-4, 7.257_316_4e-1],
        [4.670_280_4e3, 2.912_582e-5, 1.267_034_4e-1],
        [4.595_091_9e3, 2.874_956_5e-5, 1.503_450_2e-1],
        [3.787_174_5e3, 9.359_078e-6, 3.990_758_7e-1],
    ];
    const G: [[f64; 3]; 7] = [
        [-4.889_997_5e2, 6.043_307_5e-4, -7.558_075_3e-2],
        [-7.559_942_8e2, 3.167_301e-4, 4.783_061_4e-1],
        [-1.023_639_8e3, 1.202_234_7e-4, 9.366_623_2e-1],
        [-1.265_713_2e3, 4.873_409e-6, 1.270_545],
        [-1.425_293_3e3, -4.011_504_3e-5, 1.439_727_8],
        [-1.175_548_2e3, -2.163_780_5e-5, 1.304_080_2],
        [-5.007_995_7e2, -4.598_320_3e-6, 1.090_987_6],
    ];
    const B: [[f64; 4]; 7] = [
        [5.969_453_1e-11, -4.857_428_9e-8, -9.706_222_5e-5, -4.079_361_5e-3],
        [2.404_303_7e-11, 5.550_210_8e-8, -1.985_037_1e-4, 2.893_128_6e-2],
        [-1.409_497_3e-11, 1.898_789_7e-7, -3.566_328_2e-4, 9.107_677_8e-2],
        [-3.614_608_7e-11, 2.848_220_1e-7, -4.932_113_2e-4, 1.567_234_4e-1],
        [-1.970_757_4e-11, 1.753_593_5e-7, -2.505_428_3e-4, -2.227_832_7e-2],
        [-1.619_979_6e-13, -1.642_160_1e-8, 3.862_162_7e-4, -7.380_774_2e-1],
        [6.726_502_8e-13, -2.730_788_1e-8, 4.240_982_6e-4, -7.523_356_9e-1],
    ];
    let segment = ENDS.iter().filter(|&&end| t >= end).count();
    let quotient = |[a, b, c]: [f64; 3]| a / t + b * t + c;
    let [a, b, c, d] = B[segment];
    let blue = ((a * t + b) * t + c) * t + d;
    DVec3::new(quotient(R[segment]), quotient(G[segment]), blue).max(DVec3::ZERO).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours that Blender writes for these temperatures.
    #[test]
    fn colours_of_black_bodies_are_blenders() {
        for (kelvins, expected) in [
            (6500.0, [1.0426, 0.9841, 1.0353]),
            (2500.0, [2.0676, 0.7693, 0.1394]),
            (800.0, [5.4139, 0.0, 0.0]),
        ] {
            let found = blackbody(kelvins);
            assert!(found.abs_diff_eq(expected.into(), 1e-3), "{kelvins}: {found}");
        }
    }

    #[test]
    fn a_temperature_is_found_from_two_components() {
        let found = |key: [f32; 3], color: [f32; 3]| temperature_between(key.into(), color.into());
        let warm = blackbody(3010.0);
        for key in [[1.0, 1.0, 1.0], [0.3, 0.2, 0.1], [0.5, 0.5, 0.0]] {
            let fit = found(key, (Vec3::from(key) * warm).to_array()).unwrap();
            assert!(fit.color.abs_diff_eq(warm, 0.02), "{key:?}: {}", fit.color);
        }
        assert!(found([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]).is_none());
        assert!(found([0.2, 0.5, 0.3], [0.5, 0.2, 0.3]).is_none());
    }
}
