//! The tables of the report.

use super::units::format_duration;
use crate::compare::{Comparison, Verdict};
use crate::results::{BenchResults, SceneResults};
use blinn_output::escape_html;

fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|h| format!("<th>{h}</th>")).collect();
    let rows: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", row.concat())).collect();
    format!("<div class=\"wide\"><table><tr>{head}</tr>\n{rows}</table></div>\n")
}

fn cell(text: &str) -> String {
    format!("<td>{}</td>", escape_html(text))
}

fn optional(value: Option<f64>, show: impl Fn(f64) -> String) -> String {
    cell(&value.filter(|v| v.is_finite()).map_or_else(|| "–".into(), show))
}

/// The first digits of a hash, with all of them as a tooltip.
fn hash_cell(hash: Option<&str>) -> String {
    let Some(hash) = hash else { return cell("–") };
    let start: String = hash.chars().take(8).collect();
    format!("<td title=\"{}\">{}</td>", escape_html(hash), escape_html(&start))
}

/// A row of BVH statistics for each scene.
pub(super) fn bvhs(results: &BenchResults) -> String {
    let row = |scene: &SceneResults| {
        let tree = scene.tree.clone().unwrap_or_default();
        vec![
            cell(&scene.name),
            cell(&scene.triangles.to_string()),
            cell(&tree.entries.to_string()),
            cell(&tree.nodes.to_string()),
            optional(tree.bytes_per_triangle, |v| format!("{v:.1}")),
            optional(tree.sah_cost, |v| format!("{v:.1}")),
        ]
    };
    let head = ["scene", "triangles", "in BVHs", "nodes", "bytes a triangle", "SAH cost"];
    table(&head, &results.scenes.iter().map(row).collect::<Vec<_>>())
}

/// A row for each stage.
pub(super) fn stages(results: &BenchResults) -> String {
    let mut rows = Vec::new();
    for (scene, s) in results.scenes.iter().flat_map(|scene| scene.stages.iter().map(move |s| (scene, s))) {
        rows.push(vec![
            cell(&scene.name),
            cell(s.stage.name()),
            cell(s.camera.as_deref().unwrap_or("–")),
            cell(&s.size().map_or_else(|| "–".into(), |(width, height)| format!("{width}x{height}"))),
            cell(&s.threads.to_string()),
            optional(s.median(), format_duration),
            optional(s.least_seconds, format_duration),
            optional(s.mrays(), |v| format!("{v:.2}")),
            optional(s.nodes_per_ray, |v| format!("{v:.1}")),
            optional(s.triangles_per_ray, |v| format!("{v:.1}")),
            optional(s.relative_spread(), |v| format!("{:.1} %", 100.0 * v)),
            optional(s.waited, |v| format!("{:.0} %", 100.0 * v)),
            optional(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20))),
            optional(s.median_joules(), |v| format!("{v:.3} J")),
            hash_cell(s.hash.as_deref()),
        ]);
    }
    let head = [
        "scene",
        "stage",
        "pixels",
        "threads",
        "time",
        "least",
        "Mray/s",
        "nodes a ray",
        "triangles a ray",
        "spread",
        "waited",
        "peak memory",
        "energy",
        "hash",
    ];
    table(&head, &rows)
}

/// A summary of the comparison, and a row for each change.
pub(super) fn comparison(comparison: &Comparison) -> String {
    let mut out = String::from("<h2 id=\"compared\">Comparison with the baseline</h2>\n");
    for text in &comparison.different_work {
        out += &format!("<p class=\"more\">{}</p>\n", escape_html(text));
    }
    for note in &comparison.notes {
        out += &format!("<p class=\"note\">{}</p>\n", escape_html(note));
    }
    out += &match comparison.significant().count() {
        0 => "<p>No change beyond the noise.</p>\n".to_string(),
        n => format!(
            "<p>{n} of {} measurements changed by more than the noise.</p>\n",
            comparison.changes.len()
        ),
    };
    let mut rows = Vec::new();
    for change in &comparison.changes {
        let verdict = match change.verdict {
            Verdict::Same => "<td></td>",
            Verdict::Less => "<td class=\"word less\">less</td>",
            Verdict::More => "<td class=\"word more\">more</td>",
        };
        rows.push(vec![
            cell(&change.scene),
            format!("<td class=\"word\">{}</td>", escape_html(&change.metric)),
            cell(&format!("{:.3}", change.ratio)),
            cell(&change.interval.map_or_else(|| "–".into(), |i| format!("{:.3}–{:.3}", i.low, i.high))),
            optional(Some(change.noise), |v| format!("{:.1} %", 100.0 * v)),
            optional(change.min_ratio, |v| format!("{v:.3}")),
            verdict.to_string(),
        ]);
    }
    out + &table(&["scene", "cost", "new / old", "95 % interval", "noise", "by least", ""], &rows)
}
