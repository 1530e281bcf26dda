//! Figures as text.

use crate::bench::{BenchResults, Change, Comparison, SceneResults, StageResults, Verdict, format_duration};
use crate::cli::one_line;

/// Columns side by side: the first to the left, the others to the right.
fn columns(rows: &[Vec<String>]) -> String {
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

/// A table for each scene.
pub(super) fn figures(figures: &BenchResults) -> String {
    let mut out = String::new();
    for scene in &figures.scenes {
        out += &head(scene);
        let mut rows =
            vec![cells(["stage", "threads", "time", "least", "Mray/s", "spread", "waited", "memory"])];
        rows.extend(scene.stages.iter().map(row));
        out += &columns(&rows);
        out.push('\n');
    }
    out
}

fn head(scene: &SceneResults) -> String {
    let mut line = format!("{}: {} triangles", one_line(&scene.name), scene.triangles);
    if let Some(tree) = &scene.tree {
        line += &format!(
            ", {} in trees of {} nodes, {} bytes a triangle, SAH cost {}",
            tree.entries,
            tree.nodes,
            or_dash(tree.bytes_per_triangle, |v| format!("{v:.1}")),
            or_dash(tree.sah_cost, |v| format!("{v:.1}")),
        );
    }
    line + "\n"
}

fn row(s: &StageResults) -> Vec<String> {
    vec![
        s.stage.name().to_string(),
        s.threads.to_string(),
        or_dash(s.median(), format_duration),
        or_dash(s.least_seconds, format_duration),
        or_dash(s.mrays(), |v| format!("{v:.2}")),
        or_dash(s.spread_of_rounds(), |v| format!("{:.1} %", 100.0 * v)),
        or_dash(s.waited, |v| format!("{:.0} %", 100.0 * v)),
        or_dash(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20))),
    ]
}

/// All ratios, what is to be said, and at the end what moved.
pub(super) fn comparison(compared: &Comparison) -> String {
    let mut rows = vec![cells(["cost, now to then", "ratio", "noise", "by least", ""])];
    let name = |c: &Change| format!("{}: {}", one_line(&c.scene), one_line(&c.what));
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
            noise(change),
            or_dash(change.by_least, |v| format!("{v:.3}")),
            verdict.into(),
        ]);
    }
    let mut out = columns(&rows);
    out.push('\n');
    for note in &compared.notes {
        out += &format!("note: {}\n", one_line(note));
    }
    let moved: Vec<&Change> = compared.significant().collect();
    match moved.len() {
        0 => out += &format!("nothing moved beyond the noise: {} figures\n", compared.changes.len()),
        n => out += &format!("{n} of {} figures moved beyond the noise:\n", compared.changes.len()),
    }
    for change in moved {
        let way = if change.verdict == Verdict::More { "more" } else { "less" };
        out += &format!("  {way}: {} {:.3} (noise {})\n", name(change), change.ratio, noise(change));
    }
    out
}
