//! Tiles that no ray can hit are skipped, and the picture is the same.

use std::sync::atomic::{AtomicUsize, Ordering};

use blinn::accel::{Accel, AccelSettings, Preset};
use blinn::geometry::Rgba;
use blinn::integrator::{Frame, Integrator, Phong, Sample, Scratch};
use blinn::render::{LowDiscrepancySampler, PixelFilter, RenderSettings, render};
use blinn::scene::{Ground, GroundKind, Lighting, PoseSettings, Projection, View, pose};
use glam::DVec3;

use crate::common::load_model;
use crate::common::scenes::{self, Rng};

/// Counts shaded samples, with or without the region where something may be visible.
struct Counting {
    everywhere: bool,
    samples: AtomicUsize,
}

impl Integrator for Counting {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        self.samples.fetch_add(samples.len(), Ordering::Relaxed);
        Phong::default().render(frame, samples, sampler, scratch, out);
    }

    fn may_hit(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        self.everywhere || Phong::default().may_hit(frame, low, high)
    }
}

/// Checks that both pictures are equal. Returns the number of samples without and with culling.
fn sample_counts(frame: &Frame, settings: &RenderSettings) -> [usize; 2] {
    let [all, some] = [true, false].map(|everywhere| {
        let integrator = Counting { everywhere, samples: AtomicUsize::new(0) };
        let pixels = render(frame, &integrator, settings, &()).unwrap();
        (pixels, integrator.samples.into_inner())
    });
    let bits = |colors: &[Rgba]| colors.iter().map(|c| c.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    assert_eq!(bits(&all.0.colors), bits(&some.0.colors));
    [all.1, some.1]
}

#[test]
fn culling_does_not_change_pictures() {
    let mut rng = Rng::new(5);
    let mut culled = 0;
    for (name, presets) in [
        ("cornell/cornell.glb", [Preset::BruteForce, Preset::Medium]),
        ("alpha/alpha.glb", [Preset::BruteForce, Preset::Medium]),
        ("assembly/assembly.glb", [Preset::Fast, Preset::Medium]),
    ] {
        let scene = load_model(name);
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        for preset in presets {
            let (accel, _) = Accel::build(&posed, &AccelSettings { preset, ..AccelSettings::default() });
            let bounds = posed.bounds();
            let (middle, size) = (bounds.centre(), (bounds.max - bounds.min).length());
            for round in 0..12 {
                let samples = [1, 2, 9][round % 3];
                let filter = [PixelFilter::Box, PixelFilter::BlackmanHarris][round % 2];
                let settings =
                    RenderSettings { width: 64, height: 40, samples, filter, tile: 16, ..Default::default() };
                // From outside and inside, towards the scene and past it.
                let from = middle + rng.direction() * size * [0.2, 0.8, 3.0][round / 4];
                let at = middle + rng.direction() * size * 0.4;
                let view = View {
                    view_point: Some(from),
                    look_at: Some(at),
                    projection: (round % 5 == 0).then_some(Projection::Orthographic),
                    ..View::default()
                };
                let (camera, _) = view.resolve(&posed, settings.width, settings.height).unwrap();
                let lit = Lighting::default().resolve(&posed, &camera);
                let frame = Frame::new(&posed, &accel, camera, &lit);
                let [all, some] = sample_counts(&frame, &settings);
                assert_eq!(all, 64 * 40 * samples as usize);
                culled += usize::from(some < all);
            }
        }
    }
    assert!(culled >= 24, "{culled} of 72 pictures took fewer samples");
}

#[test]
fn an_empty_view_takes_no_samples_and_a_ground_takes_all() {
    let scene = scenes::scene(scenes::cube(1), &[glam::DAffine3::IDENTITY]);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let settings = RenderSettings { width: 64, height: 64, ..RenderSettings::default() };
    let away = View { view_point: Some(DVec3::Z * 9.0), view_dir: Some(DVec3::Z), ..View::default() };
    let (camera, _) = away.resolve(&posed, 64, 64).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    assert_eq!(sample_counts(&frame, &settings)[1], 0);
    let ground = Some(Ground::under(&posed.bounds(), GroundKind::Plane));
    let [all, some] = sample_counts(&Frame { ground, ..frame }, &settings);
    assert_eq!(all, some);
}
