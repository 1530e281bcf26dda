//! Sampling error of procedural pictures against 1,024 samples, compared with stratified sampling.
//! docs/explanation/antialiasing.md has the table; `cargo test --test render antialiasing:: -- --nocapture`
//! prints it.

use blinn::geometry::Rgba;
use blinn::integrator::{Frame, Integrator, Sample, Scratch};
use blinn::render::{
    AdaptiveSampling, FilterSampler, LowDiscrepancySampler, PixelFilter, PixelRect, RenderSettings, Sampler,
    render,
};
use blinn::scene::{Lighting, Scene, View};
use glam::UVec2;

use crate::common::scenes;

/// Width and height of the pictures in pixels.
const SIDE: u32 = 64;

/// The baseline: jittered sampling, one random sample in each cell of a grid.
struct Stratified {
    count: u32,
}

impl Sampler for Stratified {
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32 {
        let rows = f64::from(self.count).sqrt().round() as u32;
        assert_eq!(self.count % rows, 0, "the test has counts that fill a rectangle");
        let columns = self.count / rows;
        let (cell, cells) = if dimension == 0 { (index % columns, columns) } else { (index / columns, rows) };
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        for word in [pixel.x, pixel.y, index, dimension] {
            state = (state ^ u64::from(word)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            state ^= state >> 29;
            state = state.wrapping_mul(0x94d0_49bb_1331_11eb);
            state ^= state >> 32;
        }
        let jitter = (state >> 11) as f64 / (1u64 << 53) as f64;
        (((f64::from(cell) + jitter) / f64::from(cells)) as f32).min(1.0f32.next_down())
    }
}

/// A picture: brightness as a function of a point on the film, in pixels from the upper left corner.
type Picture = Box<dyn Fn(f64, f64) -> f64>;

/// Half planes with edges of sixteen slopes.
fn edges() -> Vec<Picture> {
    let edge = |k: i32| -> Picture {
        let angle = (f64::from(k) + 0.13) / 16.0 * std::f64::consts::PI;
        let (sin, cos) = libm::sincos(angle);
        let offset = 0.37 * f64::from(k) % 1.0;
        Box::new(move |x, y| f64::from(u8::from((x - 32.0) * cos + (y - 32.0) * sin > offset)))
    };
    (0..16).map(edge).collect()
}

/// Rings up to 0.7 cycles per pixel in the far corner.
fn zone_plate() -> Picture {
    Box::new(|x, y| 0.5 + 0.5 * libm::sin((x * x + y * y) * std::f64::consts::PI / 128.0))
}

/// A checkerboard floor up to the horizon.
fn floor() -> Picture {
    let tiles = |x: f64, y: f64| {
        if y < 8.0 {
            return 0.5;
        }
        let depth = 40.0 / (y - 8.0);
        let (u, v) = ((x - 29.3) * depth / 12.0, depth * 3.0);
        f64::from((u.floor() as i64 + v.floor() as i64) & 1 == 0)
    };
    Box::new(tiles)
}

/// Pixel values of each picture.
fn draw(pictures: &[Picture], sampler: &dyn Sampler, count: u32, filter: PixelFilter) -> Vec<Vec<f64>> {
    let filter = FilterSampler::of(filter);
    let mut values = vec![Vec::new(); pictures.len()];
    for pixel in (0..SIDE * SIDE).map(|i| UVec2::new(i % SIDE, i / SIDE)) {
        let offset = |index, axis| 0.5 + filter.offset(sampler.get(pixel, index, axis));
        let position = |index| (f64::from(pixel.x) + offset(index, 0), f64::from(pixel.y) + offset(index, 1));
        let positions: Vec<_> = (0..count).map(position).collect();
        for (picture, values) in pictures.iter().zip(&mut values) {
            let sum: f64 = positions.iter().map(|&(x, y)| picture(x, y)).sum();
            values.push(sum / f64::from(count));
        }
    }
    values
}

/// The root mean square error over the pixels that are not uniform.
fn error(actual: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (&a, &b) in actual.iter().flatten().zip(expected.iter().flatten()) {
        if b > 0.0 && b < 1.0 {
            (sum, n) = (sum + (a - b) * (a - b), n + 1.0);
        }
    }
    f64::sqrt(sum / n)
}

#[test]
fn error_is_below_that_of_stratified_sampling() {
    let mut pictures = edges();
    let slopes = pictures.len();
    pictures.extend([zone_plate(), floor()]);
    let scenes =
        [("edges", 0..slopes), ("zone plate", slopes..slopes + 1), ("floor", slopes + 1..slopes + 2)];
    for filter in [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris] {
        // A different seed, so that the reference shares no samples.
        let reference = draw(&pictures, &LowDiscrepancySampler { seed: 1, count: 1024 }, 1024, filter);
        for count in [4, 16, 64] {
            let ours = draw(&pictures, &LowDiscrepancySampler { seed: 0, count }, count, filter);
            let stratified = draw(&pictures, &Stratified { count }, count, filter);
            for (name, range) in scenes.clone() {
                let rms = |values: &[Vec<f64>]| error(&values[range.clone()], &reference[range.clone()]);
                let (ours, stratified) = (rms(&ours), rms(&stratified));
                println!(
                    "{filter:?} {name} {count}: {ours:.4}, stratified {stratified:.4}, {:.2}",
                    ours / stratified
                );
                assert!(
                    ours < 0.95 * stratified,
                    "{filter:?}, {name}, {count} samples: {ours} against {stratified}"
                );
            }
        }
    }
}

/// A bright disc on an empty background.
struct Disc;

impl Integrator for Disc {
    fn render(
        &self,
        _: &Frame,
        samples: &[Sample],
        _: &LowDiscrepancySampler,
        _: &mut Scratch,
        out: &mut [Rgba],
    ) {
        for (s, out) in samples.iter().zip(out) {
            let r2 = (s.x - 0.5).powi(2) + (s.y - 0.47).powi(2);
            *out = if r2 < 0.09 { Rgba::new(0.9, 0.5, 0.1, 1.0) } else { Rgba::ZERO };
        }
    }
}

fn disc(settings: &RenderSettings) -> Vec<Rgba> {
    let scene = Scene::default();
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = View::default().resolve(&posed, 97, 61).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    render(&frame, &Disc, settings, &()).unwrap().colors
}

/// Adaptive sampling has nearly the error of full sampling on edges, and takes four samples in uniform
/// regions. Crops and tiles of any size take the same samples as the whole picture.
#[test]
fn adaptive_samples_are_taken_at_edges() {
    let settings = |samples| RenderSettings { width: 97, height: 61, samples, ..RenderSettings::default() };
    let adaptive = |threshold| Some(AdaptiveSampling { threshold, ev: 0.0 });
    let some = RenderSettings { adaptive: adaptive(0.08), ..settings(64) };
    let (truth, four, all, chosen) =
        (disc(&settings(4096)), disc(&settings(4)), disc(&settings(64)), disc(&some));
    let error = |actual: &[Rgba]| {
        let sum: f64 = actual.iter().zip(&truth).map(|(a, b)| f64::from((*a - *b).length_squared())).sum();
        f64::sqrt(sum / truth.len() as f64)
    };
    let (of_four, of_all, of_chosen) = (error(&four), error(&all), error(&chosen));
    println!("four {of_four:.5}, 64 {of_all:.5}, adaptive {of_chosen:.5}");
    assert!(of_chosen < 1.2 * of_all && of_chosen < 0.2 * of_four);
    let changed = chosen.iter().zip(&four).filter(|(a, b)| a != b).count();
    assert!(changed < chosen.len() / 5, "{changed} pixels were refined");

    assert_eq!(
        disc(&RenderSettings { adaptive: adaptive(1.0), ..settings(64) }),
        four,
        "no pixel differs by that much"
    );
    for tile in [1, 7, 4096] {
        assert_eq!(disc(&RenderSettings { tile, ..some }), chosen, "tiles of {tile}");
    }
    for crop in [(30, 11, 33, 20), (31, 12, 1, 1), (96, 60, 1, 1), (0, 0, 97, 61)] {
        let (x, y, width, height) = crop;
        let part = disc(&RenderSettings { crop: Some(PixelRect { x, y, width, height }), ..some });
        let rows = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (y * 97 + x) as usize));
        assert_eq!(part, rows.map(|i| chosen[i]).collect::<Vec<_>>(), "{crop:?}");
    }
}
