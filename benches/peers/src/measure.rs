//! The measurements: medians of interleaved rounds, so that a slow phase of the machine affects all engines. Only ratios
//! within one run are meaningful.

use std::time::Instant;

use blinn::accel::Accel;
use blinn_scenes::{GeneratedScene, format_triangle_count};
use serde_json::{Value, json};

use crate::embree::{Embree, EmbreeScene};
use crate::engines::{EmbreeRays, EmbreeVariant, blinn_distances, mismatch_rate, time_blinn};
use crate::obvhs::ObvhsScene;
use crate::options::Options;
use crate::ray_dump::{DumpedSet, RayDump};
use crate::rays::{Film, RaySet, Rays};
use crate::scene::{convert, posed};

pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, String> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())
}

fn title(scene: &GeneratedScene) -> String {
    format!("{} {}", scene.name, format_triangle_count(scene.stored_triangles()))
}

/// The times of a variant of Embree.
struct VariantTimes {
    variant: EmbreeVariant,
    robust: bool,
    times: Vec<f64>,
}

/// Rays per second of blinn and of Embree.
pub fn rays(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    for &(kind, triangles) in &options.scenes {
        let generated = kind.generate(triangles);
        let scene = convert(&generated);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &options.build);
        let built = [false, true].map(|robust| EmbreeScene::new(embree, &generated, 2, robust));
        let [default, robust] = built;
        let built = [default?, robust?];
        for &film in &options.films {
            let rays = Rays::new(&generated, &posed, &accel, film);
            println!("\n### {}, {}", title(&generated), about(options, film));
            println!(
                "| threads | rays | Mrays | blinn Mray/s | Embree best (variant) | robust best (variant) | to best | to robust | to Embree 1 | to robust 1 | differ |"
            );
            println!("|---|---|---|---|---|---|---|---|---|---|---|");
            for &threads in &options.threads {
                let context = RowContext { scene: &generated, film, threads };
                compare_sets(context, &rays, &accel, &built, options.rounds, &mut out);
            }
        }
    }
    Ok(out.into())
}

/// Compares all ray sets of a film, and eye and shadow rays together.
fn compare_sets(
    context: RowContext,
    rays: &Rays,
    accel: &Accel,
    built: &[EmbreeScene; 2],
    rounds: usize,
    out: &mut Vec<Value>,
) {
    let threads = context.threads;
    let mut sums = [0.0; 5];
    let mut some = 0;
    for set in rays.all() {
        if set.rays() == 0 {
            continue;
        }
        let row = compare(set, accel, built, None, threads, rounds);
        print_row(threads, set, &row);
        if set.name == "eye" || set.name == "shadow, point" {
            some += set.rays();
            sums = [0, 1, 2, 3, 4].map(|i| sums[i] + row.seconds()[i]);
        }
        out.push(context.json(&set.name, row.json(set)));
    }
    let [ours, best, robust, one, robust_one] = sums;
    let rate = |s: f64| some as f64 / s / 1e6;
    println!(
        "| {threads} | **eye + shadow** | {:.2} | {:.2} | {:.2} | {:.2} | **{:.2}** | **{:.2}** | {:.2} | {:.2} | |",
        some as f64 / 1e6,
        rate(ours),
        rate(best),
        rate(robust),
        best / ours,
        robust / ours,
        one / ours,
        robust_one / ours,
    );
    let ratios = json!({"to best": best / ours, "to robust best": robust / ours, "to 1": one / ours, "to robust 1": robust_one / ours});
    out.push(context.json("eye + shadow", ratios));
}

/// Rays per second of blinn, Embree and obvhs on the rays of archives, and the fractions of rays whose hits differ from those
/// in the archive.
pub fn dumps(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    for path in &options.dumps {
        let dump = RayDump::read(path)?;
        let generated = &dump.scene;
        let scene = convert(generated);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &options.build);
        let built =
            [EmbreeScene::new(embree, generated, 2, false)?, EmbreeScene::new(embree, generated, 2, true)?];
        let obvhs = ObvhsScene::new(&generated.meshes[0]);
        let (width, height) = dump.size;
        println!("\n### {}, {width} × {height} pixels, medians of {}", title(generated), options.rounds);
        println!(
            "| threads | rays | Mrays | blinn Mray/s | Embree best (variant) | robust best (variant) | obvhs | to best | to robust | to obvhs | blinn differs | Embree robust | Embree | obvhs |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
        for &threads in &options.threads {
            for DumpedSet { rays: set, expected } in &dump.sets {
                let row = compare(set, &accel, &built, Some(&obvhs), threads, options.rounds);
                let single = EmbreeVariant { width: 1, coherent: false, from_light: false };
                let flat = EmbreeRays::new(set, false);
                let differ = [
                    blinn_distances(&accel, set),
                    flat.found(&built[1], single),
                    flat.found(&built[0], single),
                    obvhs.found(set),
                ]
                .map(|found| mismatch_rate(expected, &found));
                print_dumped(threads, set, &row, differ);
                let film = Film { width, height, tile: 32, samples: 1 };
                let mut figures = row.json(set);
                let [ours, robust, fast, other] = differ;
                figures["differ"] =
                    json!({"blinn": ours, "Embree robust": robust, "Embree": fast, "obvhs": other});
                out.push(RowContext { scene: generated, film, threads }.json(&set.name, figures));
            }
        }
    }
    Ok(out.into())
}

fn print_dumped(threads: usize, set: &RaySet, row: &Row, differ: [f64; 4]) {
    let rate = |seconds: f64| set.rays() as f64 / seconds / 1e6;
    let [ours, best, robust, ..] = row.seconds();
    let obvhs = row.obvhs.unwrap_or(f64::NAN);
    let [a, b, c, d] = differ;
    println!(
        "| {threads} | {} | {:.3} | {:.2} | {:.2} ({}) | {:.2} ({}) | {:.2} | {:.2} | {:.2} | {:.2} | {a:.1e} | {b:.1e} | {c:.1e} | {d:.1e} |",
        set.name,
        set.rays() as f64 / 1e6,
        rate(ours),
        rate(best),
        row.best[0].0.name(),
        rate(robust),
        row.best[1].0.name(),
        rate(obvhs),
        best / ours,
        robust / ours,
        obvhs / ours,
    );
}

/// Rays per second of blinn alone, for profilers.
pub fn alone(options: &Options) -> Result<Value, String> {
    let mut out = Vec::new();
    for &(kind, triangles) in &options.scenes {
        let generated = kind.generate(triangles);
        let scene = convert(&generated);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &options.build);
        for &film in &options.films {
            let rays = Rays::new(&generated, &posed, &accel, film);
            let is_wanted =
                |set: &&RaySet| options.only.as_deref().is_none_or(|name| name == set.name.as_str());
            for set in rays.all().into_iter().filter(is_wanted) {
                for &threads in &options.threads {
                    let times = (0..options.rounds).map(|_| time_blinn(&accel, set, threads)).collect();
                    let rate = set.rays() as f64 / median(times) / 1e6;
                    println!(
                        "{}, {} × {}, {threads} thread(s), {}: {rate:.2} Mray/s",
                        title(&generated),
                        film.width,
                        film.height,
                        set.name
                    );
                    let context = RowContext { scene: &generated, film, threads };
                    out.push(context.json(&set.name, json!({"blinn": rate})));
                }
            }
        }
    }
    Ok(out.into())
}

fn about(options: &Options, film: Film) -> String {
    format!(
        "{} × {} pixels, {} sample(s), tiles of {}, medians of {}",
        film.width, film.height, film.samples, film.tile, options.rounds
    )
}

/// The scene, film and threads of a row of the JSON file.
#[derive(Clone, Copy)]
struct RowContext<'a> {
    scene: &'a GeneratedScene,
    film: Film,
    threads: usize,
}

impl RowContext<'_> {
    /// The row of the rays `name` with its `figures`.
    fn json(&self, name: &str, figures: Value) -> Value {
        let mut row = json!({
            "scene": self.scene.name, "triangles": self.scene.stored_triangles(),
            "size": format!("{}x{}", self.film.width, self.film.height),
            "threads": self.threads, "rays": name,
        });
        if let (Value::Object(row), Value::Object(figures)) = (&mut row, figures) {
            row.extend(figures);
        }
        row
    }
}

/// Median times in seconds of a set of rays.
struct Row {
    blinn: f64,
    /// Embree's fastest variant: default mode, then robust mode.
    best: [(EmbreeVariant, f64); 2],
    /// Embree's single rays: default mode, then robust mode.
    single: [f64; 2],
    /// obvhs's single rays.
    obvhs: Option<f64>,
    /// Fraction of rays whose hits differ from Embree's robust single rays.
    mismatches: f64,
}

impl Row {
    /// blinn, then Embree: best, robust best, single, robust single.
    fn seconds(&self) -> [f64; 5] {
        [self.blinn, self.best[0].1, self.best[1].1, self.single[0], self.single[1]]
    }

    fn json(&self, set: &RaySet) -> Value {
        let rate = |seconds: f64| set.rays() as f64 / seconds / 1e6;
        json!({
            "count": set.rays(), "blinn": rate(self.blinn),
            "best": rate(self.best[0].1), "best way": self.best[0].0.name(),
            "robust best": rate(self.best[1].1), "robust best way": self.best[1].0.name(),
            "1": rate(self.single[0]), "robust 1": rate(self.single[1]), "obvhs": self.obvhs.map(rate), "differ": self.mismatches,
        })
    }
}

fn print_row(threads: usize, set: &RaySet, row: &Row) {
    let rate = |seconds: f64| set.rays() as f64 / seconds / 1e6;
    let [ours, best, robust, one, robust_one] = row.seconds();
    println!(
        "| {threads} | {} | {:.2} | {:.2} | {:.2} ({}) | {:.2} ({}) | {:.2} | {:.2} | {:.2} | {:.2} | {:.1e} |",
        set.name,
        set.rays() as f64 / 1e6,
        rate(ours),
        rate(best),
        row.best[0].0.name(),
        rate(robust),
        row.best[1].0.name(),
        best / ours,
        robust / ours,
        one / ours,
        robust_one / ours,
        row.mismatches,
    );
}

/// Times blinn, all variants of Embree, and obvhs in interleaved rounds. The first round warms up and drops slow variants.
fn compare(
    set: &RaySet,
    accel: &Accel,
    built: &[EmbreeScene; 2],
    obvhs: Option<&ObvhsScene>,
    threads: usize,
    rounds: usize,
) -> Row {
    let embree_rays =
        [false, true].map(|light| (!light || set.light().is_some()).then(|| EmbreeRays::new(set, light)));
    let time = |variant: EmbreeVariant, robust: bool| {
        let flat = embree_rays[usize::from(variant.from_light)].as_ref();
        flat.map_or(f64::INFINITY, |flat| flat.time(&built[usize::from(robust)], variant, threads))
    };
    let mut runs = Vec::new();
    for robust in [false, true] {
        let first: Vec<(EmbreeVariant, f64)> =
            EmbreeVariant::all(set).into_iter().map(|variant| (variant, time(variant, robust))).collect();
        let best = first.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
        let kept = first.into_iter().enumerate().filter(|(i, (_, t))| *i == 0 || *t <= 1.25 * best);
        runs.extend(kept.map(|(_, (variant, _))| VariantTimes { variant, robust, times: Vec::new() }));
    }
    let differ = embree_rays[0].as_ref().map_or(f64::NAN, |flat| {
        let variant = EmbreeVariant { width: 1, coherent: false, from_light: false };
        mismatch_rate(&blinn_distances(accel, set), &flat.found(&built[1], variant))
    });
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        own.push(time_blinn(accel, set, threads));
        others.extend(obvhs.map(|obvhs| obvhs.time(set, threads)));
        for run in &mut runs {
            run.times.push(time(run.variant, run.robust));
        }
    }
    let medians: Vec<(EmbreeVariant, bool, f64)> =
        runs.into_iter().map(|r| (r.variant, r.robust, median(r.times))).collect();
    let of = |robust| medians.iter().filter(move |m| m.1 == robust).map(|m| (m.0, m.2));
    let best = [false, true]
        .map(|robust| of(robust).fold((medians[0].0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a }));
    let one = [false, true].map(|robust| of(robust).next().map_or(f64::NAN, |m| m.1));
    let obvhs = obvhs.map(|_| median(others));
    Row { blinn: median(own), best, single: one, obvhs, mismatches: differ }
}

/// Build times in seconds and memory in bytes.
pub fn builds(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    println!("\n### Builds, medians of {}", options.rounds);
    println!(
        "| scene | threads | blinn ms | Embree medium ms | to Embree | blinn B/triangle | Embree B/triangle |"
    );
    println!("|---|---|---|---|---|---|---|");
    for &(kind, triangles) in &options.scenes {
        let generated = kind.generate(triangles);
        let scene = convert(&generated);
        let posed = posed(&scene)?;
        for &threads in &options.threads {
            let pool = pool(threads)?;
            let (mut own, mut theirs, mut bytes) = (Vec::new(), Vec::new(), [0; 2]);
            for round in 0..=options.rounds {
                let start = Instant::now();
                let (accel, _) = pool.install(|| Accel::build(&posed, &options.build));
                let seconds = start.elapsed().as_secs_f64();
                let stats = accel.stats();
                drop(accel);
                let built = EmbreeScene::new(embree, &generated, threads, false)?;
                bytes = [stats.bytes, built.bytes];
                // The first round warms up.
                if round > 0 {
                    own.push(seconds);
                    theirs.push(built.seconds);
                }
            }
            let (own, theirs) = (median(own), median(theirs));
            let [a, b] = bytes.map(|b| b as f64 / generated.stored_triangles() as f64);
            println!(
                "| {} | {threads} | {:.1} | {:.1} | {:.2} | {a:.1} | {b:.1} |",
                title(&generated),
                own * 1e3,
                theirs * 1e3,
                own / theirs
            );
            out.push(
                json!({"scene": generated.name, "triangles": generated.stored_triangles(), "threads": threads, "blinn": own,
                "embree": theirs, "ratio": own / theirs, "bytes": a, "embree bytes": b}),
            );
        }
    }
    Ok(out.into())
}

/// Time per ray by the number of triangles.
pub fn scale(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    let film = *options.films.first().ok_or("no size")?;
    println!("\n### Time per ray by triangles, one thread, {}", about(options, film));
    println!(
        "| scene | eye ns | shadow ns | Embree eye ns | Embree shadow ns | blinn's growth over log n | Embree's |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut first = None;
    for &(kind, triangles) in &options.scenes {
        let generated = kind.generate(triangles);
        let scene = convert(&generated);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &options.build);
        let built =
            [EmbreeScene::new(embree, &generated, 2, false)?, EmbreeScene::new(embree, &generated, 2, true)?];
        let rays = Rays::new(&generated, &posed, &accel, film);
        let row = [&rays.eye, &rays.shadow].map(|set| {
            let row = compare(set, &accel, &built, None, 1, options.rounds);
            [row.blinn, row.best[0].1].map(|s| s / set.rays().max(1) as f64 * 1e9)
        });
        let [[eye, their_eye], [shadow, their_shadow]] = row;
        let log = (generated.stored_triangles() as f64).ln();
        let sums = [eye + shadow, their_eye + their_shadow];
        let (sums0, log0) = *first.get_or_insert((sums, log));
        let growth = [0, 1].map(|i| sums[i] / sums0[i] / (log / log0));
        println!(
            "| {} | {eye:.1} | {shadow:.1} | {their_eye:.1} | {their_shadow:.1} | {:.2} | {:.2} |",
            title(&generated),
            growth[0],
            growth[1]
        );
        out.push(json!({"scene": generated.name, "triangles": generated.stored_triangles(), "eye ns": eye, "shadow ns": shadow,
            "embree eye ns": their_eye, "embree shadow ns": their_shadow, "growth": growth}));
    }
    Ok(out.into())
}
