//! The report of `blinn bench --report`, a self-contained HTML page, and tables of results.

mod csv;
mod heat_map;
mod machines;
mod rays_plot;
mod scaling_plot;
mod stage_plot;
mod svg;
mod table;
mod tables;
mod trace_tables;
mod units;

use super::compare::Comparison;
use super::results::{BenchResults, Machine, RecordedSettings, StageResults};
use blinn_output::{PAGE_STYLE, escape_html};
use rays_plot::rays_plot;
use scaling_plot::scaling_plot;
use stage_plot::stage_plot;

pub use csv::{results_csv, trace_csv};
pub use heat_map::HeatMap;
pub use machines::{MachineResults, comparison_table, different_work, machines_page, result_tables};
pub use table::Table;
pub use trace_tables::{trace_page, trace_tables};
use units::counted;
pub use units::format_duration;

/// The style of the plots, besides the style sheet of all pages.
const STYLE: &str = include_str!("report.css");

/// The meaning of the columns of the table of stages.
const COLUMNS: &str = "<p class=\"facts\">time: median of the rounds, without the time that other programs had the \
                       processors (waited); least: the fastest sample; spread: standard deviation of the rounds relative to \
                       the calibration loop; nodes and triangles a ray: those that a single ray visits; hash: equal where \
                       the same rays hit the same, or pictures are the same.</p>\n";

/// The start of a page, up to its heading.
fn page_head(title: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; img-src \
         data:\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\"><title>{title}</title>\n\
         <style>\n{PAGE_STYLE}{STYLE}</style></head>\n<body class=\"page\">\n<h1>{title}</h1>\n"
    )
}

/// The largest time that is formatted: the end of the year 9999, in seconds since 1970.
const MAX_UNIX_TIME: u64 = 253_402_300_799;

/// The HTML of the report. Missing results are left out of the plots.
pub fn report_page(results: &BenchResults, heat_maps: &[HeatMap], comparison: Option<&Comparison>) -> String {
    let mut page = format!("{}<p>{}</p>\n", page_head("blinn bench"), escape_html(&description(results)));
    page += &comparison.map(tables::comparison).unwrap_or_default();
    page += &heading(
        "stages",
        "Time of each stage",
        "Medians of the rounds, from the fastest round to the slowest.",
    );
    let mut plots = String::new();
    for scene in &results.scenes {
        let mut views: Vec<&StageResults> = Vec::new();
        for stage in scene.stages.iter().filter(|stage| stage.size().is_some()) {
            if !views.iter().any(|view| view.has_same_view(stage)) {
                views.push(stage);
            }
        }
        plots += &views.iter().map(|view| stage_plot(scene, Some(view))).collect::<String>();
        if views.is_empty() {
            plots += &stage_plot(scene, None);
        }
    }
    page += &grid(&plots);
    let sizes = image_sizes(results.scenes.iter().flat_map(|scene| &scene.stages));
    let plots: String = sizes.into_iter().filter_map(|size| rays_plot(results, size)).collect();
    if !plots.is_empty() {
        page += &heading("rays", "Rays against triangles", "One thread. Lines join sizes of one scene.");
        page += &grid(&plots);
    }
    if let Some(plot) = scaling_plot(results) {
        let note = "Speed-up over one thread: the median of all scenes. Dashed: linear scaling.";
        page += &heading("threads", "Scaling with threads", note);
        page += &grid(&plot);
    }
    if !heat_maps.is_empty() {
        let note = "Nodes and blocks of triangles that each pixel's ray visits, traced as a single ray.";
        page += &heading("steps", "Traversal steps of eye rays", note);
        page += &grid(&heat_maps.iter().map(HeatMap::figure).collect::<String>());
    }
    page += "<h2 id=\"figures\">Figures</h2>\n";
    page += &tables::bvhs(results);
    page += &tables::stages(results);
    page += COLUMNS;
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

/// Figures side by side, as many as the window is wide.
fn grid(figures: &str) -> String {
    format!("<div class=\"grid\">\n{figures}</div>\n")
}

fn heading(id: &str, title: &str, note: &str) -> String {
    format!("<h2 id=\"{id}\">{title}</h2>\n<p class=\"facts\">{note}</p>\n")
}

/// Version, date, machine and settings, in one paragraph.
fn description(results: &BenchResults) -> String {
    let Machine { cores, memory_bytes, os, kernel, .. } = &results.machine;
    let cpu = results.machine.processor();
    let RecordedSettings { sizes, samples, rounds, simd, debug_build, .. } = &results.settings;
    let sizes: Vec<String> = sizes.iter().map(|[width, height]| format!("{width}x{height}")).collect();
    let sizes = sizes.join(", ");
    let gib = *memory_bytes as f64 / f64::from(1 << 30);
    let date = date(results.unix_time);
    let debug = if *debug_build { " Build without optimisation." } else { "" };
    format!(
        "{}, {date}. {cpu}, {}, {gib:.1} GiB, {os} {kernel}. {sizes} pixels, {} \
         per pixel in frames, {}, SIMD level {simd}.{debug}",
        results.program_name(),
        counted(*cores, "processor"),
        counted(*samples, "sample"),
        counted(*rounds, "round")
    )
}

/// Date and time in UTC, as RFC 3339 has it.
fn date(unix_time: u64) -> String {
    let since_epoch = std::time::Duration::from_secs(unix_time.min(MAX_UNIX_TIME));
    humantime::format_rfc3339_seconds(std::time::UNIX_EPOCH + since_epoch).to_string()
}
