//! Time to load an OBJ with the fast and the lenient parser, compared to tobj alone, on a generated sphere
//! with normals and texture coordinates: `cargo bench --bench import`. Only ratios within one run are
//! meaningful, since machines drift.

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

use blinn::import::{LoadOptions, load};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// The text of a sphere of `2·rings²` triangles, with numbers formatted as by exporters.
fn sphere(rings: u32) -> String {
    let mut text = String::from("# a bumpy sphere\no sphere\n");
    for i in 0..=rings {
        for j in 0..=rings {
            let theta = std::f32::consts::PI * i as f32 / rings as f32;
            let phi = std::f32::consts::TAU * j as f32 / rings as f32;
            let n = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            let r = 1.0 + 0.02 * ((9.0 * theta).sin() * (11.0 * phi).sin());
            let [x, y, z] = n.map(|n| n * r);
            let u = j as f32 / rings as f32;
            let v = 1.0 - i as f32 / rings as f32;
            let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
            let _ = writeln!(text, "vt {u:.6} {v:.6}\nvn {:.4} {:.4} {:.4}", n[0], n[1], n[2]);
        }
    }
    for i in 0..rings {
        for j in 0..rings {
            let a = i * (rings + 1) + j + 1;
            let b = a + rings + 1;
            for [p, q, r] in [[a, a + 1, b + 1], [a, b + 1, b]] {
                let _ = writeln!(text, "f {p}/{p}/{p} {q}/{q}/{q} {r}/{r}/{r}");
            }
        }
    }
    text
}

fn load_triangles(path: &Path) -> usize {
    let (scene, warnings) = load(path, &LoadOptions::default()).unwrap();
    assert!(warnings.is_empty());
    scene.meshes[0].triangles.len()
}

/// Loads the file with both libraries in turn, and prints the median times.
fn compare(path: &Path, rounds: usize) {
    let seconds = |load: &dyn Fn()| {
        let start = std::time::Instant::now();
        load();
        start.elapsed().as_secs_f64()
    };
    let mut blinn_times = Vec::new();
    let mut tobj_times = Vec::new();
    for _ in 0..rounds {
        blinn_times.push(seconds(&|| {
            black_box(load_triangles(path));
        }));
        tobj_times.push(seconds(&|| {
            black_box(tobj::load_obj(path, &tobj::LoadOptions::default()).unwrap().0);
        }));
    }
    let [blinn, tobj] = [blinn_times, tobj_times].map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!(
        "medians of {rounds} interleaved runs: blinn {blinn:.3} s, tobj {tobj:.3} s, ratio {:.2}",
        tobj / blinn
    );
}

fn import(c: &mut Criterion) {
    let rings = std::env::var("RINGS").ok().and_then(|r| r.parse().ok()).unwrap_or(200);
    let folder = tempfile::tempdir().unwrap();
    let well_formed = folder.path().join("well_formed.obj");
    let continued = folder.path().join("continued.obj");
    let text = sphere(rings);
    std::fs::write(&well_formed, &text).unwrap();
    // One continued line is enough for the lenient parser to be used.
    std::fs::write(&continued, format!("{text}s \\\noff\n")).unwrap();
    let name = format!(
        "OBJ {} triangles, {:.1} MB, {} threads",
        2 * rings * rings,
        text.len() as f64 / 1e6,
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    println!("{name}");
    compare(&well_formed, 7);
    let mut group = c.benchmark_group(name);
    group.sample_size(10);
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("fast parser", |b| b.iter(|| load_triangles(black_box(&well_formed))));
    group.bench_function("lenient parser", |b| b.iter(|| load_triangles(black_box(&continued))));
    group.bench_function("tobj alone", |b| {
        b.iter(|| tobj::load_obj(black_box(&well_formed), &tobj::LoadOptions::default()).unwrap().0.len())
    });
    group.finish();
}

criterion_group!(benches, import);
criterion_main!(benches);
