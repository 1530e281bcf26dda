//! Frames as `blinn render` renders them: two threads against one, and the fraction of ray traversal.

use std::hint::black_box;
use std::time::Instant;

use blinn::accel::{Accel, Coherence, RayBatch, ShadowRayBatch};
use blinn::geometry::{HitId, Ray};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong, SurfacePoint};
use blinn::render::{RenderSettings, render};
use blinn::scene::{LightSample, Lighting, PoseSettings, PosedLightKind, View, pose};
use blinn_scenes::write_glb;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::measure::median;
use crate::options::Options;
use crate::rays::Opaque;

/// The rays of a tile: eye rays, and shadow rays to each light.
struct TileRays {
    eye: RayBatch,
    shadows: Vec<ShadowRayBatch>,
}

/// Measures frames of 1280 × 720 pixels with 4 samples, two lights and textures.
pub fn frames(options: &Options) -> Result<Value, String> {
    let mut out = Vec::new();
    println!(
        "\n### Whole frames, 1280 × 720 pixels, 4 samples, two lights, textured, medians of {}",
        options.rounds
    );
    println!(
        "| scene | 1 thread s | 2 threads s | speed-up | of it tracing, 1 thread s | the rest to tracing |"
    );
    println!("|---|---|---|---|---|---|");
    let pools = [1, 2].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build());
    let [one, two] = pools;
    let (one, two) = (one.map_err(|e| e.to_string())?, two.map_err(|e| e.to_string())?);
    for &(kind, triangles) in &options.scenes {
        let mut generated = kind.generate(triangles);
        generated.textured = true;
        let path = std::env::temp_dir().join(format!("blinn-peers-{}.glb", std::process::id()));
        write_glb(&generated, &path).map_err(|e| e.to_string())?;
        let loaded = load(&path, &LoadOptions::default()).map_err(|e| e.to_string());
        std::fs::remove_file(&path).map_err(|e| e.to_string())?;
        let (scene, _) = loaded?;
        let posed = pose(&scene, &PoseSettings::default()).map_err(|e| e.to_string())?;
        let (accel, _) = Accel::build(&posed, &options.build);
        let settings = RenderSettings::default();
        let view = View::default().resolve(&posed, settings.width, settings.height);
        let (camera, _) = view.map_err(|e| e.to_string())?;
        let lit = Lighting::default().resolve(&posed, &camera);
        let frame = Frame::new(&posed, &accel, camera, &lit);
        let tiles = tiles(&frame, &settings);
        let whole = || {
            let start = Instant::now();
            black_box(render(&frame, &Phong::default(), &settings, &()).is_ok());
            start.elapsed().as_secs_f64()
        };
        let traced = || {
            let start = Instant::now();
            tiles.par_iter().for_each(|tile| trace(&accel, tile));
            start.elapsed().as_secs_f64()
        };
        let mut times = [Vec::new(), Vec::new(), Vec::new()];
        for round in 0..=options.rounds {
            let now = [one.install(whole), two.install(whole), one.install(traced)];
            if round > 0 {
                times.iter_mut().zip(now).for_each(|(times, t)| times.push(t));
            }
        }
        let [single, double, tracing] = times.map(median);
        let rest = (single - tracing) / tracing;
        println!(
            "| {} {} | {single:.3} | {double:.3} | {:.2} | {tracing:.3} | {rest:.2} |",
            generated.name,
            generated.stored_triangles(),
            single / double
        );
        out.push(
            json!({"scene": generated.name, "triangles": generated.stored_triangles(), "1 thread": single, "2 threads": double,
            "speed-up": single / double, "tracing": tracing, "rest to tracing": rest}),
        );
    }
    Ok(out.into())
}

fn trace(accel: &Accel, TileRays { eye, shadows }: &TileRays) {
    let (mut hits, mut blocked) = (Vec::new(), Vec::new());
    accel.intersect(eye, &Opaque, &mut hits);
    black_box(&hits);
    for segments in shadows {
        accel.occluded(segments, &Opaque, &mut blocked);
        black_box(&blocked);
    }
}

/// The rays that the frame traces, except for the exact positions of the samples.
fn tiles(frame: &Frame, settings: &RenderSettings) -> Vec<TileRays> {
    let (w, h, side) = (settings.width, settings.height, settings.tile);
    let corners: Vec<(u32, u32)> = (0..h)
        .step_by(side as usize)
        .flat_map(|y| (0..w).step_by(side as usize).map(move |x| (x, y)))
        .collect();
    let samples = (1..=settings.samples).map(|s| f64::from(s) / f64::from(settings.samples + 1));
    let samples: Vec<f64> = samples.collect();
    let tile = |&(left, top): &(u32, u32)| {
        let mut eye = RayBatch { cull_back_faces: frame.cull_back_faces, ..RayBatch::default() };
        for y in top..(top + side).min(h) {
            for x in left..(left + side).min(w) {
                for (i, &s) in samples.iter().enumerate() {
                    let t = samples[(2 * i + 1) % samples.len()];
                    let (u, v) = ((f64::from(x) + s) / f64::from(w), 1.0 - (f64::from(y) + t) / f64::from(h));
                    let ray = frame.camera.eye_ray(u, v, frame.posed.centre);
                    eye.coherence = Coherence::Origin(ray.o);
                    eye.push(ray.o, ray.d);
                }
            }
        }
        let shadows = shadows(frame, &eye);
        TileRays { eye, shadows }
    };
    corners.par_iter().map(tile).collect()
}

/// A batch of shadow rays for each light.
fn shadows(frame: &Frame, eye: &RayBatch) -> Vec<ShadowRayBatch> {
    let mut hits = Vec::new();
    frame.accel.intersect(eye, &Opaque, &mut hits);
    let surfaces: Vec<SurfacePoint> = hits
        .iter()
        .enumerate()
        .filter(|(_, hit)| !hit.is_miss())
        .map(|(i, hit)| SurfacePoint::at(frame.posed, hit, Ray { o: eye.origins[i], d: eye.directions[i] }))
        .collect();
    let batch = |light: &blinn::scene::PosedLight| {
        let shared = match light.kind {
            PosedLightKind::Directional { direction } => Coherence::Direction(-direction),
            _ => Coherence::Origin(light.position().unwrap_or_default()),
        };
        let mut segments = ShadowRayBatch { coherence: shared, ..ShadowRayBatch::default() };
        for s in &surfaces {
            let LightSample { l, attenuation } = light.sample(s.p);
            let is_lit = (light.intensity * attenuation).max_element() > 0.0;
            if is_lit && s.shading_normal(frame.posed).dot(l) > 0.0 && s.n_v.dot(l) > 0.0 {
                let source = if s.n_g.dot(l) > 0.0 { s.id } else { HitId::NONE };
                let to = light.position().unwrap_or_default();
                segments.push(s.shadow_origin(frame.posed, l), to, source);
            }
        }
        segments
    };
    frame.lights.iter().map(batch).collect()
}
