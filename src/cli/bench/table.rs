//! Benchmark results as text tables.

use crate::console::single_line;
use crate::plural::plural;
use blinn_bench::{
    BenchResults, Change, Comparison, SceneResults, StageResults, Table, Verdict, format_duration,
};

/// Aligns columns: the first to the left, the others to the right.
fn align(rows: &[Vec<String>]) -> String {
    let width = |i: usize| rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count()).max();
    let mut out = String::new();
    for row in rows {
        let mut line = String::new();
        for (i, cell) in row.iter().enumerate() {
            let width = width(i).unwrap_or(0);
            line += &if i == 0 { format!("{cell:width$}") } else { format!("  {cell:>width$}") };
        }
        out += line.trim_end();
        out.push('\n');
    }
    out
}

fn cells<const N: usize>(row: [&str; N]) -> Vec<String> {
    row.map(str::to_string).to_vec()
}

fn or_dash(value: Option<f64>, show: impl Fn(f64) -> String) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "-".into(), show)
}

const HEAD: [&str; 13] = [
    "stage", "pixels", "threads", "time", "least", "Mray/s", "nodes", "tris", "spread", "waited", "memory",
    "energy", "hash",
];

/// A table of the stages of each scene.
pub fn results(results: &BenchResults) -> String {
    let mut out = String::new();
    for scene in &results.scenes {
        out += &heading(scene);
        let mut rows = vec![cells(HEAD)];
        rows.extend(scene.stages.iter().map(stage_row));
        out += &align(&rows);
        out.push('\n');
    }
    out
}

fn heading(scene: &SceneResults) -> String {
    let mut line = format!("{}: {} triangles", single_line(&scene.name), scene.triangles);
    if let Some(tree) = &scene.tree {
        line += &format!(
            ", {} in BVHs with {} nodes, {} bytes per triangle, SAH cost {}",
            tree.entries,
            tree.nodes,
            or_dash(tree.bytes_per_triangle, |v| format!("{v:.1}")),
            or_dash(tree.sah_cost, |v| format!("{v:.1}")),
        );
    }
    line + "\n"
}

fn stage_row(s: &StageResults) -> Vec<String> {
    vec![
        match &s.camera {
            Some(camera) => format!("{}, {}", s.stage.name(), single_line(camera)),
            None => s.stage.name().to_string(),
        },
        s.size().map_or_else(|| "-".into(), |(width, height)| format!("{width}x{height}")),
        s.threads.to_string(),
        or_dash(s.median(), format_duration),
        or_dash(s.least_seconds, format_duration),
        or_dash(s.mrays(), |v| format!("{v:.2}")),
        or_dash(s.nodes_per_ray, |v| format!("{v:.1}")),
        or_dash(s.triangles_per_ray, |v| format!("{v:.1}")),
        or_dash(s.relative_spread(), |v| format!("{:.1} %", 100.0 * v)),
        or_dash(s.waited, |v| format!("{:.0} %", 100.0 * v)),
        or_dash(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20))),
        or_dash(s.median_joules(), |v| format!("{v:.3} J")),
        s.hash.as_deref().map_or_else(|| "-".into(), |hash| single_line(hash).chars().take(8).collect()),
    ]
}

/// Tables with their titles.
pub fn text(tables: &[Table]) -> String {
    let mut out = String::new();
    for table in tables {
        let mut rows = vec![table.head.clone()];
        rows.extend(table.rows.iter().cloned());
        rows.iter_mut().flatten().for_each(|cell| *cell = single_line(cell));
        out += &format!("{}\n{}\n", single_line(&table.title), align(&rows));
    }
    out
}

/// The ratios of all measurements, notes, and a list of the significant changes.
pub fn comparison(compared: &Comparison) -> String {
    let mut rows = vec![cells(["cost, new / old", "ratio", "95 % interval", "noise", "by least", ""])];
    let name = |c: &Change| format!("{}: {}", single_line(&c.scene), single_line(&c.metric));
    let noise = |c: &Change| or_dash(Some(c.noise), |v| format!("{:.1} %", 100.0 * v));
    for change in &compared.changes {
        let verdict = match change.verdict {
            Verdict::Same => "",
            Verdict::Less => "less",
            Verdict::More => "MORE",
        };
        rows.push(vec![
            name(change),
            format!("{:.3}", change.ratio),
            change.interval.map_or_else(|| "-".into(), |i| format!("{:.3} to {:.3}", i.low, i.high)),
            noise(change),
            or_dash(change.min_ratio, |v| format!("{v:.3}")),
            verdict.into(),
        ]);
    }
    let mut out = align(&rows);
    out += "\nratio: new / old, of the medians of the rounds; noise: the change that the spread of the rounds of both runs \
            may cause\nless, MORE: beyond the noise, and the interval excludes 1; by least: ratio of the fastest samples\n\n";
    out += &format!("{}\n", single_line(&compared.program_line()));
    for note in &compared.notes {
        out += &format!("note: {}\n", single_line(note));
    }
    if compared.without_counterpart > 0 {
        let count = plural(compared.without_counterpart as u64, "stage");
        out += &format!("note: {count} were not measured in the same way before, and are not compared\n");
    }
    let significant: Vec<&Change> = compared.significant().collect();
    match significant.len() {
        0 => {
            out += &format!("no change beyond the noise in {} measurements", compared.changes.len());
            let noise = compared.changes.iter().map(|change| change.noise).fold(0.0, f64::max);
            if noise > 0.0 && noise.is_finite() {
                out += &format!("; of the noisiest, no change below {:.0} % is seen", 100.0 * noise);
            }
            out.push('\n');
        }
        n => {
            out +=
                &format!("{n} of {} measurements changed by more than the noise:\n", compared.changes.len())
        }
    }
    for change in significant {
        let direction = if change.verdict == Verdict::More { "more" } else { "less" };
        out += &format!("  {direction}: {} {:.3} (noise {})\n", name(change), change.ratio, noise(change));
    }
    out
}
