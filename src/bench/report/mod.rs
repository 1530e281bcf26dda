//! `--report`: one page with everything in it, to be opened without a network.

mod heat_map;
mod plots;
mod svg;
mod tables;

use super::compare::Comparison;
use super::results::{BenchResults, Machine, RecordedSettings};
use crate::output::escape_html;

pub use heat_map::HeatMap;

const HEAD: &str = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:\">\n\
<meta name=\"viewport\" content=\"width=device-width\"><title>blinn bench</title>\n<style>\n\
body { font: 14px/1.45 sans-serif; margin: 2em auto; max-width: 62em; padding: 0 1em; background: #fff; color: #222 }\n\
h1 { font-size: 1.4em } h2 { font-size: 1.1em; margin: 2.2em 0 .6em }\n\
table { border-collapse: collapse; font-variant-numeric: tabular-nums } .wide { overflow-x: auto }\n\
th, td { padding: .15em .7em; text-align: right; border-bottom: 1px solid #e4e4e4; white-space: nowrap }\n\
th:first-child, td:first-child, td.word, th.word { text-align: left }\n\
figure { display: inline-block; vertical-align: top; margin: 0 1.5em 1.5em 0 }\n\
figcaption { font-size: 12px; color: #555; overflow-wrap: anywhere }\n\
svg { display: block; max-width: 100%; height: auto } svg text { font: 12px sans-serif; fill: #333 }\n\
img { display: block; max-width: 100%; border: 1px solid #ccc }\n\
.more { color: #b00020; font-weight: bold } .less { color: #1b6e2d; font-weight: bold } .note { color: #555 }\n\
</style></head><body>\n";

/// The page. BenchResults that are missing are left out of its plots.
pub fn report_page(figures: &BenchResults, heat_maps: &[HeatMap], comparison: Option<&Comparison>) -> String {
    let mut page = format!("{HEAD}<h1>blinn bench</h1>\n<p>{}</p>\n", escape_html(&about(figures)));
    page += &comparison.map(tables::comparison).unwrap_or_default();
    page += "<h2 id=\"stages\">Time of each stage</h2>\n<p class=\"note\">Medians over the rounds; whiskers reach \
             from the fastest round to the slowest.</p>\n";
    page += &figures.scenes.iter().map(plots::stages).collect::<String>();
    for (id, title, note, plot) in [
        (
            "rays",
            "BenchRays against triangles",
            "One thread. Lines join sizes of one scene.",
            plots::rays_by_triangles(figures),
        ),
        (
            "threads",
            "Scaling with threads",
            "How many times faster than on one thread: the median over all scenes. Dashed: as many times as \
             threads.",
            plots::scaling(figures),
        ),
    ] {
        if let Some(plot) = plot {
            page += &format!("<h2 id=\"{id}\">{title}</h2>\n<p class=\"note\">{note}</p>\n{plot}");
        }
    }
    if !heat_maps.is_empty() {
        page += "<h2 id=\"steps\">Steps of eye rays</h2>\n<p class=\"note\">Nodes and blocks of triangles that each \
                 pixel's ray looks into until its hit is known, when it goes alone.</p>\n";
        page += &heat_maps.iter().map(HeatMap::figure).collect::<String>();
    }
    page += "<h2 id=\"figures\">BenchResults</h2>\n";
    page += &tables::trees(figures);
    page += &tables::stages(figures);
    page + "</body></html>\n"
}

/// Where, when and how, in one paragraph.
fn about(figures: &BenchResults) -> String {
    let Machine { cpu, cores, memory_bytes, os, kernel, .. } = &figures.machine;
    let RecordedSettings { width, height, samples, rounds, simd, debug_build, .. } = &figures.settings;
    let gib = *memory_bytes as f64 / f64::from(1 << 30);
    let since = std::time::Duration::from_secs(figures.unix_time.min(LATEST));
    let when = humantime::format_rfc3339_seconds(std::time::UNIX_EPOCH + since);
    let debug = if *debug_build { " A build without optimisation." } else { "" };
    format!(
        "blinn {}, {when}. {cpu}, {cores} processors, {gib:.1} GiB, {os} {kernel}. {width}x{height} pixels, {samples} \
         samples a pixel in frames, {rounds} rounds, {simd} instructions.{debug}",
        figures.version
    )
}

/// The end of the year 9999, beyond which dates are not written.
const LATEST: u64 = 253_402_300_799;

/// Seconds in words.
pub fn format_duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "–".into(),
        s if s < 0.9995e-3 => format!("{:.1} µs", s * 1e6),
        s if s < 0.9995 => format!("{:.1} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}
