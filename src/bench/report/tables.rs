//! The tables of the report.

use super::units::format_duration;
use crate::compare::{Change, Comparison, Verdict};
use crate::results::{BenchResults, BvhResults, SceneResults, StageResults};
use blinn_output::escape_html;

/// A column of a table whose rows are made from values of `R`: its heading and its cell in a row.
struct Column<'c, R> {
    heading: &'c str,
    cell: fn(&R) -> String,
}

/// Returns a table with a row for each value. Every row has a cell for each heading.
fn table<R>(columns: &[Column<R>], values: &[R]) -> String {
    let head: String = columns.iter().map(|column| format!("<th>{}</th>", column.heading)).collect();
    let row = |value: &R| columns.iter().map(|column| (column.cell)(value)).collect::<String>();
    let rows: String = values.iter().map(|value| format!("<tr>{}</tr>\n", row(value))).collect();
    format!(
        "<div class=\"scrolls\" tabindex=\"0\"><table><thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table></div>\n"
    )
}

fn column<R>(heading: &str, cell: fn(&R) -> String) -> Column<'_, R> {
    Column { heading, cell }
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
    let rows: Vec<_> =
        results.scenes.iter().map(|scene| (scene, scene.tree.clone().unwrap_or_default())).collect();
    let columns = [
        column("scene", |(scene, _): &(&SceneResults, BvhResults)| cell(&scene.name)),
        column("triangles", |(scene, _)| cell(&scene.triangles.to_string())),
        column("in BVHs", |(_, tree)| cell(&tree.entries.to_string())),
        column("nodes", |(_, tree)| cell(&tree.nodes.to_string())),
        column("bytes a triangle", |(_, tree)| optional(tree.bytes_per_triangle, |v| format!("{v:.1}"))),
        column("SAH cost", |(_, tree)| optional(tree.sah_cost, |v| format!("{v:.1}"))),
    ];
    table(&columns, &rows)
}

/// A row for each stage.
pub(super) fn stages(results: &BenchResults) -> String {
    let rows: Vec<_> =
        results.scenes.iter().flat_map(|scene| scene.stages.iter().map(move |s| (scene, s))).collect();
    let columns = [
        column("scene", |(scene, _): &(&SceneResults, &StageResults)| cell(&scene.name)),
        column("stage", |(_, s)| cell(s.stage.name())),
        column("camera", |(_, s)| cell(s.camera.as_deref().unwrap_or("–"))),
        column("pixels", |(_, s)| cell(&s.size().map_or_else(|| "–".into(), |(w, h)| format!("{w}x{h}")))),
        column("threads", |(_, s)| cell(&s.threads.to_string())),
        column("time", |(_, s)| optional(s.median(), format_duration)),
        column("least", |(_, s)| optional(s.least_seconds, format_duration)),
        column("Mray/s", |(_, s)| optional(s.mrays(), |v| format!("{v:.2}"))),
        column("nodes a ray", |(_, s)| optional(s.nodes_per_ray, |v| format!("{v:.1}"))),
        column("triangles a ray", |(_, s)| optional(s.triangles_per_ray, |v| format!("{v:.1}"))),
        column("spread", |(_, s)| optional(s.relative_spread(), |v| format!("{:.1} %", 100.0 * v))),
        column("waited", |(_, s)| optional(s.waited, |v| format!("{:.0} %", 100.0 * v))),
        column("peak memory", |(_, s)| optional(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20)))),
        column("energy", |(_, s)| optional(s.median_joules(), |v| format!("{v:.3} J"))),
        column("hash", |(_, s)| hash_cell(s.hash.as_deref())),
    ];
    table(&columns, &rows)
}

/// The meaning of the columns of a comparison.
const COMPARED_COLUMNS: &str = "<p class=\"facts\">new / old: ratio of the medians of the rounds, relative to the \
                                calibration loop; noise: the change that the spread of the rounds of both runs may cause; \
                                less, more: beyond the noise, and the interval excludes 1; by least: ratio of the fastest \
                                samples.</p>\n";

/// A summary of the comparison, and a row for each change.
pub(super) fn comparison(comparison: &Comparison) -> String {
    let mut out = String::from("<h2 id=\"compared\">Comparison with the baseline</h2>\n");
    out += &format!("<p class=\"facts\">{}</p>\n", escape_html(&comparison.program_line()));
    for text in &comparison.different_work {
        out += &format!("<p class=\"bad\">{}</p>\n", escape_html(text));
    }
    for note in &comparison.notes {
        out += &format!("<p class=\"facts\">{}</p>\n", escape_html(note));
    }
    out += &match comparison.significant().count() {
        0 => "<p>No change beyond the noise.</p>\n".to_string(),
        n => format!(
            "<p>{n} of {} measurements changed by more than the noise.</p>\n",
            comparison.changes.len()
        ),
    };
    let verdict = |change: &Change| {
        let cell = match change.verdict {
            Verdict::Same => "<td></td>",
            Verdict::Less => "<td class=\"word good\">less</td>",
            Verdict::More => "<td class=\"word bad\">more</td>",
        };
        cell.to_string()
    };
    let interval = |change: &Change| {
        cell(&change.interval.map_or_else(|| "–".into(), |i| format!("{:.3}–{:.3}", i.low, i.high)))
    };
    let columns = [
        column("scene", |change: &Change| cell(&change.scene)),
        column("cost", |change| format!("<td class=\"word\">{}</td>", escape_html(&change.metric))),
        column("new / old", |change| cell(&format!("{:.3}", change.ratio))),
        column("95 % interval", interval),
        column("noise", |change| optional(Some(change.noise), |v| format!("{:.1} %", 100.0 * v))),
        column("by least", |change| optional(change.min_ratio, |v| format!("{v:.3}"))),
        column("", verdict),
    ];
    out + &table(&columns, &comparison.changes) + COMPARED_COLUMNS
}
