//! The report of `blinn bench --report`, a self-contained HTML page, and tables of results.

mod heat_map;
mod machines;
mod rays_plot;
mod scaling_plot;
mod stage_plot;
mod svg;
mod table;
mod tables;
mod units;

use super::compare::Comparison;
use super::results::{BenchResults, Machine, RecordedSettings, StageResults};
use blinn_output::escape_html;
use rays_plot::rays_plot;
use scaling_plot::scaling_plot;
use stage_plot::stage_plot;

pub use heat_map::HeatMap;
pub use machines::{MachineResults, different_work, machines_page, result_tables};
pub use table::Table;
pub use units::format_duration;

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

/// The largest time that is formatted: the end of the year 9999, in seconds since 1970.
const MAX_UNIX_TIME: u64 = 253_402_300_799;

/// The HTML of the report. Missing results are left out of the plots.
pub fn report_page(results: &BenchResults, heat_maps: &[HeatMap], comparison: Option<&Comparison>) -> String {
    let mut page = format!("{HEAD}<h1>blinn bench</h1>\n<p>{}</p>\n", escape_html(&description(results)));
    page += &comparison.map(tables::comparison).unwrap_or_default();
    page += &heading(
        "stages",
        "Time of each stage",
        "Medians of the rounds, from the fastest round to the slowest.",
    );
    for scene in &results.scenes {
        let mut views: Vec<&StageResults> = Vec::new();
        for stage in scene.stages.iter().filter(|stage| stage.size().is_some()) {
            if !views.iter().any(|view| view.has_same_view(stage)) {
                views.push(stage);
            }
        }
        page += &views.iter().map(|view| stage_plot(scene, Some(view))).collect::<String>();
        if views.is_empty() {
            page += &stage_plot(scene, None);
        }
    }
    let sizes = image_sizes(results.scenes.iter().flat_map(|scene| &scene.stages));
    let plots: String = sizes.into_iter().filter_map(|size| rays_plot(results, size)).collect();
    if !plots.is_empty() {
        page += &heading("rays", "Rays against triangles", "One thread. Lines join sizes of one scene.");
        page += &plots;
    }
    if let Some(plot) = scaling_plot(results) {
        let note = "Speed-up over one thread: the median of all scenes. Dashed: linear scaling.";
        page += &heading("threads", "Scaling with threads", note);
        page += &plot;
    }
    if !heat_maps.is_empty() {
        let note = "Nodes and blocks of triangles that each pixel's ray visits, traced as a single ray.";
        page += &heading("steps", "Traversal steps of eye rays", note);
        page += &heat_maps.iter().map(HeatMap::figure).collect::<String>();
    }
    page += "<h2 id=\"figures\">Figures</h2>\n";
    page += &tables::bvhs(results);
    page += &tables::stages(results);
    page + "</body></html>\n"
}

/// The sizes of images, without duplicates, in the order of the results.
fn image_sizes<'r>(stages: impl IntoIterator<Item = &'r StageResults>) -> Vec<(u32, u32)> {
    let mut sizes = Vec::new();
    for size in stages.into_iter().filter_map(StageResults::size) {
        if !sizes.contains(&size) {
            sizes.push(size);
        }
    }
    sizes
}

fn heading(id: &str, title: &str, note: &str) -> String {
    format!("<h2 id=\"{id}\">{title}</h2>\n<p class=\"note\">{note}</p>\n")
}

/// Version, date, machine and settings, in one paragraph.
fn description(results: &BenchResults) -> String {
    let Machine { cpu, cores, memory_bytes, os, kernel, .. } = &results.machine;
    let RecordedSettings { sizes, samples, rounds, simd, debug_build, .. } = &results.settings;
    let sizes: Vec<String> = sizes.iter().map(|[width, height]| format!("{width}x{height}")).collect();
    let sizes = sizes.join(", ");
    let gib = *memory_bytes as f64 / f64::from(1 << 30);
    let date = date(results.unix_time);
    let debug = if *debug_build { " Build without optimisation." } else { "" };
    format!(
        "blinn {}, {date}. {cpu}, {cores} processors, {gib:.1} GiB, {os} {kernel}. {sizes} pixels, {samples} \
         samples per pixel in frames, {rounds} rounds, SIMD level {simd}.{debug}",
        results.version
    )
}

/// Date and time in UTC, as RFC 3339 has it.
fn date(unix_time: u64) -> String {
    let since_epoch = std::time::Duration::from_secs(unix_time.min(MAX_UNIX_TIME));
    humantime::format_rfc3339_seconds(std::time::UNIX_EPOCH + since_epoch).to_string()
}
