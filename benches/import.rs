//! OBJ text to a scene, through both readers, with tobj's own reading beside them. The file is
//! generated: a bumpy sphere with normals and texture coordinates. `cargo bench --bench import`;
//! ratios within one run are what counts, since machines drift.

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

use blinn::import::{LoadOptions, load};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// The text of a sphere of `2·rings²` triangles, with numbers as exporters write them.
fn sphere(rings: u32) -> String {
    let mut text = String::from("# a bumpy sphere\no sphere\n");
    for i in 0..=rings {
        for j in 0..=rings {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * j as f32 / rings as f32,
            );
            let n = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            let r = 1.0 + 0.02 * ((9.0 * theta).sin() * (11.0 * phi).sin());
            let [x, y, z] = n.map(|n| n * r);
            let (u, v) = (j as f32 / rings as f32, 1.0 - i as f32 / rings as f32);
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

fn read(path: &Path) -> usize {
    let (scene, warnings) = load(path, &LoadOptions::default()).unwrap();
    assert!(warnings.is_empty());
    scene.meshes[0].triangles.len()
}

/// Reads by turns, so that both meet the same machine, and tells the medians.
fn compare(path: &Path, rounds: usize) {
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..rounds {
        for (who, times) in times.iter_mut().enumerate() {
            let start = std::time::Instant::now();
            if who == 0 {
                black_box(read(path));
            } else {
                black_box(tobj::load_obj(path, &tobj::LoadOptions::default()).unwrap().0);
            }
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let [ours, tobj] = times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    });
    println!("medians of {rounds} by turns: {ours:.3} s, tobj {tobj:.3} s, ratio {:.2}", tobj / ours);
}

fn import(c: &mut Criterion) {
    let rings = std::env::var("RINGS").ok().and_then(|r| r.parse().ok()).unwrap_or(200);
    let folder = tempfile::tempdir().unwrap();
    let (plain, joined) = (folder.path().join("plain.obj"), folder.path().join("joined.obj"));
    let text = sphere(rings);
    std::fs::write(&plain, &text).unwrap();
    // One joined line is enough for the careful reader to take the file.
    std::fs::write(&joined, format!("{text}s \\\noff\n")).unwrap();
    let name = format!(
        "OBJ {} triangles, {:.1} MB, {} threads",
        2 * rings * rings,
        text.len() as f64 / 1e6,
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    println!("{name}");
    compare(&plain, 7);
    let mut group = c.benchmark_group(name);
    group.sample_size(10);
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("fast reader", |b| b.iter(|| read(black_box(&plain))));
    group.bench_function("careful reader", |b| b.iter(|| read(black_box(&joined))));
    group.bench_function("tobj alone", |b| {
        b.iter(|| tobj::load_obj(black_box(&plain), &tobj::LoadOptions::default()).unwrap().0.len())
    });
    group.finish();
}

criterion_group!(benches, import);
criterion_main!(benches);
