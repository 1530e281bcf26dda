//! The measurements. Every figure is a median of rounds in which all sides take turns, so that a
//! slow moment of the machine meets them all; only ratios within one run mean anything.

use std::time::Instant;

use blinn::accel::{Accel, BuildSettings};
use blinn_scenes::{GeneratedScene, format_triangle_count};
use serde_json::{Value, json};

use crate::embree::{Built, Embree};
use crate::engines::{Flat, Way, differing, ours, ours_found};
use crate::options::Options;
use crate::rays::{Rays, Set};
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

/// One way with its times.
struct Runs {
    way: Way,
    robust: bool,
    times: Vec<f64>,
}

/// Rays a second of blinn and of Embree.
pub fn rays(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    for &(kind, triangles) in &options.scenes {
        let made = kind.generate(triangles);
        let scene = convert(&made);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &BuildSettings::default());
        let built = [false, true].map(|robust| Built::new(embree, &made, 2, robust));
        let [plain, robust] = built;
        let built = [plain?, robust?];
        let rays = Rays::new(&made, &posed, &accel, options.film);
        println!("\n### {}, {}", title(&made), about(options));
        println!(
            "| threads | rays | Mrays | blinn Mray/s | Embree best (way) | robust best (way) | to best | to robust | to Embree 1 | to robust 1 | differ |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        for &threads in &options.threads {
            let (mut sums, mut some) = ([0.0; 5], 0);
            for set in rays.all() {
                if set.rays() == 0 {
                    continue;
                }
                let row = compare(set, &accel, &built, threads, options.rounds);
                print_row(threads, set, &row);
                if set.name == "eye" || set.name == "shadow, point" {
                    some += set.rays();
                    sums = [0, 1, 2, 3, 4].map(|i| sums[i] + row.seconds()[i]);
                }
                out.push(row.json(&made, threads, set));
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
            out.push(json!({"scene": made.name, "triangles": made.stored_triangles(), "threads": threads, "rays": "eye + shadow",
                "to best": best / ours, "to robust best": robust / ours, "to 1": one / ours, "to robust 1": robust_one / ours}));
        }
    }
    Ok(out.into())
}

/// blinn's rays a second alone: what a profiler is pointed at.
pub fn alone(options: &Options) -> Result<Value, String> {
    let mut out = Vec::new();
    for &(kind, triangles) in &options.scenes {
        let made = kind.generate(triangles);
        let scene = convert(&made);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &BuildSettings::default());
        let rays = Rays::new(&made, &posed, &accel, options.film);
        for set in rays.all().into_iter().filter(|set| options.only.as_deref().is_none_or(|o| o == set.name))
        {
            for &threads in &options.threads {
                let times = (0..options.rounds).map(|_| ours(&accel, set, threads)).collect();
                let rate = set.rays() as f64 / median(times) / 1e6;
                println!("{}, {threads} thread(s), {}: {rate:.2} Mray/s", title(&made), set.name);
                out.push(
                    json!({"scene": made.name, "triangles": made.stored_triangles(), "threads": threads,
                    "rays": set.name, "blinn": rate}),
                );
            }
        }
    }
    Ok(out.into())
}

fn about(options: &Options) -> String {
    let film = options.film;
    format!(
        "{} × {} pixels, {} sample(s), tiles of {}, medians of {}",
        film.width, film.height, film.samples, film.tile, options.rounds
    )
}

struct Row {
    ours: f64,
    /// Embree's best and its single rays; plain, then robust.
    best: [(Way, f64); 2],
    one: [f64; 2],
    /// Share of rays that differ from Embree's robust single rays.
    differ: f64,
}

impl Row {
    /// blinn, Embree's best, robust best, single, robust single.
    fn seconds(&self) -> [f64; 5] {
        [self.ours, self.best[0].1, self.best[1].1, self.one[0], self.one[1]]
    }

    fn json(&self, scene: &GeneratedScene, threads: usize, set: &Set) -> Value {
        let rate = |seconds: f64| set.rays() as f64 / seconds / 1e6;
        json!({
            "scene": scene.name, "triangles": scene.stored_triangles(), "threads": threads, "rays": set.name,
            "count": set.rays(), "blinn": rate(self.ours),
            "best": rate(self.best[0].1), "best way": self.best[0].0.name(),
            "robust best": rate(self.best[1].1), "robust best way": self.best[1].0.name(),
            "1": rate(self.one[0]), "robust 1": rate(self.one[1]), "differ": self.differ,
        })
    }
}

fn print_row(threads: usize, set: &Set, row: &Row) {
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
        row.differ,
    );
}

/// Times all by turns. A first round, which does not count, warms up and lets go of the ways that
/// are far behind.
fn compare(set: &Set, accel: &Accel, built: &[Built; 2], threads: usize, rounds: usize) -> Row {
    let flats = [false, true].map(|light| (!light || set.light().is_some()).then(|| Flat::new(set, light)));
    let time = |way: Way, robust: bool| {
        let flat = flats[usize::from(way.from_light)].as_ref();
        flat.map_or(f64::INFINITY, |flat| flat.time(&built[usize::from(robust)], way, threads))
    };
    let mut runs = Vec::new();
    for robust in [false, true] {
        let first: Vec<(Way, f64)> = Way::all(set).into_iter().map(|way| (way, time(way, robust))).collect();
        let best = first.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
        let kept = first.into_iter().enumerate().filter(|(i, (_, t))| *i == 0 || *t <= 1.25 * best);
        runs.extend(kept.map(|(_, (way, _))| Runs { way, robust, times: Vec::new() }));
    }
    let differ = flats[0].as_ref().map_or(f64::NAN, |flat| {
        let way = Way { width: 1, coherent: false, from_light: false };
        differing(&ours_found(accel, set), &flat.found(&built[1], way))
    });
    let mut own = Vec::new();
    for _ in 0..rounds {
        own.push(ours(accel, set, threads));
        for run in &mut runs {
            run.times.push(time(run.way, run.robust));
        }
    }
    let medians: Vec<(Way, bool, f64)> =
        runs.into_iter().map(|r| (r.way, r.robust, median(r.times))).collect();
    let of = |robust| medians.iter().filter(move |m| m.1 == robust).map(|m| (m.0, m.2));
    let best = [false, true]
        .map(|robust| of(robust).fold((medians[0].0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a }));
    let one = [false, true].map(|robust| of(robust).next().map_or(f64::NAN, |m| m.1));
    Row { ours: median(own), best, one, differ }
}

/// Seconds and bytes of builds.
pub fn builds(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    println!("\n### Builds, medians of {}", options.rounds);
    println!(
        "| scene | threads | blinn ms | Embree medium ms | to Embree | blinn B/triangle | Embree B/triangle |"
    );
    println!("|---|---|---|---|---|---|---|");
    for &(kind, triangles) in &options.scenes {
        let made = kind.generate(triangles);
        let scene = convert(&made);
        let posed = posed(&scene)?;
        for &threads in &options.threads {
            let pool = pool(threads)?;
            let (mut own, mut theirs, mut bytes) = (Vec::new(), Vec::new(), [0; 2]);
            for round in 0..=options.rounds {
                let start = Instant::now();
                let (accel, _) = pool.install(|| Accel::build(&posed, &BuildSettings::default()));
                let seconds = start.elapsed().as_secs_f64();
                let stats = accel.stats();
                drop(accel);
                let built = Built::new(embree, &made, threads, false)?;
                bytes = [stats.bytes, built.bytes];
                // The first warms up.
                if round > 0 {
                    own.push(seconds);
                    theirs.push(built.seconds);
                }
            }
            let (own, theirs) = (median(own), median(theirs));
            let [a, b] = bytes.map(|b| b as f64 / made.stored_triangles() as f64);
            println!(
                "| {} | {threads} | {:.1} | {:.1} | {:.2} | {a:.1} | {b:.1} |",
                title(&made),
                own * 1e3,
                theirs * 1e3,
                own / theirs
            );
            out.push(
                json!({"scene": made.name, "triangles": made.stored_triangles(), "threads": threads, "blinn": own,
                "embree": theirs, "ratio": own / theirs, "bytes": a, "embree bytes": b}),
            );
        }
    }
    Ok(out.into())
}

/// Time per ray by the number of triangles.
pub fn scale(options: &Options, embree: &Embree) -> Result<Value, String> {
    let mut out = Vec::new();
    println!("\n### Time per ray by triangles, one thread, {}", about(options));
    println!(
        "| scene | eye ns | shadow ns | Embree eye ns | Embree shadow ns | blinn's growth over log n | Embree's |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut first = None;
    for &(kind, triangles) in &options.scenes {
        let made = kind.generate(triangles);
        let scene = convert(&made);
        let posed = posed(&scene)?;
        let (accel, _) = Accel::build(&posed, &BuildSettings::default());
        let built = [Built::new(embree, &made, 2, false)?, Built::new(embree, &made, 2, true)?];
        let rays = Rays::new(&made, &posed, &accel, options.film);
        let row = [&rays.eye, &rays.shadow].map(|set| {
            let row = compare(set, &accel, &built, 1, options.rounds);
            [row.ours, row.best[0].1].map(|s| s / set.rays().max(1) as f64 * 1e9)
        });
        let [[eye, their_eye], [shadow, their_shadow]] = row;
        let log = (made.stored_triangles() as f64).ln();
        let sums = [eye + shadow, their_eye + their_shadow];
        let (sums0, log0) = *first.get_or_insert((sums, log));
        let growth = [0, 1].map(|i| sums[i] / sums0[i] / (log / log0));
        println!(
            "| {} | {eye:.1} | {shadow:.1} | {their_eye:.1} | {their_shadow:.1} | {:.2} | {:.2} |",
            title(&made),
            growth[0],
            growth[1]
        );
        out.push(json!({"scene": made.name, "triangles": made.stored_triangles(), "eye ns": eye, "shadow ns": shadow,
            "embree eye ns": their_eye, "embree shadow ns": their_shadow, "growth": growth}));
    }
    Ok(out.into())
}
