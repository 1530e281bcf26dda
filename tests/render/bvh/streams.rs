//! Ray streams against single rays, bit for bit: batches of rays that share nothing against one ray at a time.

use blinn::accel::{Accel, AccelSettings, Coherence, FlattenBudget, Preset, RayBatch, ShadowRayBatch};
use blinn::geometry::{Hit, HitId};
use glam::Vec3;

use super::{FLATTENED, all_scenes, rays};
use crate::common::scenes::{self, Holes, Rng};

/// Rays of every length, some too long or too short for a stream, some not finite or without a direction.
fn mixed_rays(posed: &blinn::scene::PosedScene) -> Vec<(Vec3, Vec3)> {
    let mut rays = rays(posed, 1500);
    let mut rng = Rng::new(9);
    for (i, (o, d)) in rays.iter_mut().enumerate() {
        match i % 23 {
            0 => *d *= 10f32.powi(rng.below(60) as i32 - 30),
            1 => *o *= 10f32.powi(rng.below(8) as i32),
            2 if i % 4 == 0 => *d = [Vec3::ZERO, Vec3::NAN, Vec3::X * f32::INFINITY][i / 92 % 3],
            2 => (*o, *d) = (*o * 1e25, *d * -1e25),
            3 => *d *= 1e-37,
            4 => *d = Vec3::from(d.to_array().map(|x| if rng.one_in(2) { x } else { 0.0 * x })),
            _ => {}
        }
    }
    rays
}

fn bits(hits: &[Hit]) -> Vec<(u32, HitId)> {
    hits.iter().map(|hit| (hit.t.to_bits(), hit.id)).collect()
}

#[test]
fn streams_answer_as_single_rays_do() {
    for ((name, scene), flatten) in
        all_scenes().iter().flat_map(|scene| FLATTENED.map(|flatten| (scene, flatten)))
    {
        let posed = scenes::posed(scene);
        if flatten == FlattenBudget::ZERO && posed.instances.len() == 1 {
            continue;
        }
        let rays = mixed_rays(&posed);
        for simd in scenes::simd_levels() {
            let accel = Accel::build(&posed, &AccelSettings { preset: Preset::Medium, simd, flatten }).0;
            let context = format!("{name} {flatten:?} {simd:?}");
            closest_hits(&accel, &rays, &context);
            any_hits(&accel, &rays, &context);
        }
    }
}

/// Hits of whole batches and of single rays, from t_min to t_max and behind their first hits.
fn closest_hits(accel: &Accel, rays: &[(Vec3, Vec3)], context: &str) {
    let batch = |rays: &[(Vec3, Vec3)], t: [f32; 2], after: &[Hit]| {
        let mut batch = RayBatch { t_min: t[0], t_max: t[1], after: after.to_vec(), ..RayBatch::default() };
        rays.iter().for_each(|&(o, d)| batch.push(o, d));
        let mut hits = Vec::new();
        accel.intersect(&batch, &Holes, &mut hits);
        hits
    };
    let mut first = Vec::new();
    for t in [[0.0, f32::INFINITY], [0.25, 0.75], [0.0, 0.0], [0.0, f32::NAN]] {
        let together = batch(rays, t, &[]);
        let apart: Vec<Hit> = rays.iter().flat_map(|ray| batch(&[*ray], t, &[])).collect();
        assert_eq!(bits(&together), bits(&apart), "{context} {t:?}");
        if first.is_empty() {
            first = together;
        }
    }
    assert!(first.iter().filter(|hit| !hit.is_miss()).count() > 300, "{context}");
    let together = batch(rays, [0.0, f32::INFINITY], &first);
    let apart: Vec<Hit> = rays
        .iter()
        .zip(&first)
        .flat_map(|(ray, &hit)| batch(&[*ray], [0.0, f32::INFINITY], &[hit]))
        .collect();
    assert_eq!(bits(&together), bits(&apart), "{context}: second hits");
    let without_first = |from: usize, to: usize| {
        let mut batch = RayBatch::default();
        for i in from..to {
            batch.push(rays[i].0, rays[i].1);
            batch.source.push(first[i].id);
        }
        let mut hits = Vec::new();
        accel.intersect(&batch, &Holes, &mut hits);
        let counted = accel.intersect_with_stats(&batch, &Holes);
        assert!(hits.iter().zip(counted).all(|(hit, (counted, _))| *hit == counted), "{context}: counted");
        hits
    };
    let together = without_first(0, rays.len());
    let apart: Vec<Hit> = (0..rays.len()).flat_map(|i| without_first(i, i + 1)).collect();
    assert_eq!(bits(&together), bits(&apart), "{context}: sources");
    let hits_source = |(hit, first): (&Hit, &Hit)| !hit.is_miss() && hit.id == first.id;
    assert!(!together.iter().zip(&first).any(hits_source), "{context}: sources are hit");
}

/// Occlusion and transmittance of whole batches and of single rays, to points, to one light and to the sun.
fn any_hits(accel: &Accel, rays: &[(Vec3, Vec3)], context: &str) {
    let light = Vec3::new(0.5, 3.0, 0.25);
    for coherence in [Coherence::None, Coherence::Origin(light), Coherence::Direction(light)] {
        let answers = |rays: &[(Vec3, Vec3)], first: usize| {
            let mut segments = ShadowRayBatch { coherence, ..ShadowRayBatch::default() };
            for (i, &(o, d)) in rays.iter().enumerate() {
                let to = if matches!(coherence, Coherence::Origin(_)) { light } else { o + d * 0.8 };
                segments.push(o, to, HitId { instance: 0, triangle: ((first + i) % 40) as u32 });
            }
            let (mut occluded, mut left) = (Vec::new(), Vec::new());
            accel.occluded(&segments, &Holes, &mut occluded);
            accel.transmittance(&segments, &Holes, &mut left);
            let left = left.into_iter().map(|left| left.to_array().map(f32::to_bits));
            occluded.into_iter().zip(left).collect::<Vec<_>>()
        };
        let together = answers(rays, 0);
        let apart: Vec<_> = (0..rays.len()).flat_map(|i| answers(&rays[i..=i], i)).collect();
        assert_eq!(together.len(), rays.len());
        for (i, (together, apart)) in together.iter().zip(&apart).enumerate() {
            assert_eq!(together, apart, "{context} {coherence:?}: ray {i} {:?}", rays[i]);
        }
    }
}
