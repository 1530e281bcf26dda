//! The page's tables.

use super::format_duration;
use crate::bench::compare::{Comparison, Verdict};
use crate::bench::results::BenchResults;
use crate::output::escape_html;

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

/// Trees, a row for each scene.
pub(super) fn trees(figures: &BenchResults) -> String {
    let row = |scene: &crate::bench::results::SceneResults| {
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
    let head = ["scene", "triangles", "in trees", "nodes", "bytes a triangle", "SAH cost"];
    table(&head, &figures.scenes.iter().map(row).collect::<Vec<_>>())
}

/// Stages, a row for each.
pub(super) fn stages(figures: &BenchResults) -> String {
    let mut rows = Vec::new();
    for (scene, s) in figures.scenes.iter().flat_map(|scene| scene.stages.iter().map(move |s| (scene, s))) {
        rows.push(vec![
            cell(&scene.name),
            cell(s.stage.name()),
            cell(&s.threads.to_string()),
            optional(s.median(), format_duration),
            optional(s.least_seconds, format_duration),
            optional(s.mrays(), |v| format!("{v:.2}")),
            optional(s.spread_of_rounds(), |v| format!("{:.1} %", 100.0 * v)),
            optional(s.waited, |v| format!("{:.0} %", 100.0 * v)),
            optional(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20))),
        ]);
    }
    table(&["scene", "stage", "threads", "time", "least", "Mray/s", "spread", "waited", "peak memory"], &rows)
}

/// What moved, and beneath it everything.
pub(super) fn comparison(compared: &Comparison) -> String {
    let mut out = String::from("<h2 id=\"compared\">Beside the earlier figures</h2>\n");
    for note in &compared.notes {
        out += &format!("<p class=\"note\">{}</p>\n", escape_html(note));
    }
    out += &match compared.significant().count() {
        0 => "<p>Nothing moved beyond the noise.</p>\n".to_string(),
        n => format!("<p>{n} of {} figures moved beyond the noise.</p>\n", compared.changes.len()),
    };
    let mut rows = Vec::new();
    for change in &compared.changes {
        let verdict = match change.verdict {
            Verdict::Same => "<td></td>",
            Verdict::Less => "<td class=\"word less\">less</td>",
            Verdict::More => "<td class=\"word more\">more</td>",
        };
        rows.push(vec![
            cell(&change.scene),
            format!("<td class=\"word\">{}</td>", escape_html(&change.what)),
            cell(&format!("{:.3}", change.ratio)),
            optional(Some(change.noise), |v| format!("{:.1} %", 100.0 * v)),
            optional(change.by_least, |v| format!("{v:.3}")),
            verdict.to_string(),
        ]);
    }
    out + &table(&["scene", "cost of", "now to then", "noise", "by least", ""], &rows)
}
