//! Bar chart of the time of each stage.

use super::svg::{AXIS_STYLE, GRID_STYLE, Scale, Svg, color, round_ticks};
use super::units::{format_duration, format_threads};
use crate::results::{SceneResults, StageResults};
use crate::stage::BenchStage;
use blinn_output::escape_html;

const BAR_HEIGHT: f64 = 13.0;
/// Space between the groups of bars.
const GROUP_GAP: f64 = 9.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 430.0;
const TOP: f64 = 26.0;

/// A figure with a group of bars for each stage, and a bar for each number of threads, for the camera and
/// the size of images of the stage `view`.
pub(super) fn stage_plot(scene: &SceneResults, view: Option<&StageResults>) -> String {
    let is_shown = |s: &&StageResults| s.size().is_none() || view.is_some_and(|view| view.has_same_view(s));
    let shown: Vec<&StageResults> = scene.stages.iter().filter(is_shown).collect();
    let is_timed = |stage: &BenchStage| shown.iter().any(|s| s.stage == *stage && s.median().is_some());
    let stages: Vec<BenchStage> = BenchStage::ALL.into_iter().filter(is_timed).collect();
    if stages.is_empty() {
        return String::new();
    }
    let threads = thread_counts(shown.iter().copied());
    let group_height = BAR_HEIGHT * threads.len() as f64 + GROUP_GAP;
    let height = TOP + group_height * stages.len() as f64 + 24.0;
    let longest = shown.iter().flat_map(|s| rounds(s)).fold(0.0, f64::max);
    let scale = Scale::linear((0.0, longest), (LEFT, RIGHT));

    let mut svg = Svg::new(500.0, height, &format!("Time of each stage of {}", scene.name));
    svg.legend((LEFT, 14.0), threads.iter().enumerate().map(|(i, &n)| (format_threads(n), color(i))));
    for tick in round_ticks(longest) {
        svg.line((scale.at(tick), TOP), (scale.at(tick), height - 20.0), GRID_STYLE);
        svg.text((scale.at(tick), height - 6.0), "middle", &format_duration(tick));
    }
    for (i, &stage) in stages.iter().enumerate() {
        let y = TOP + group_height * i as f64 + 5.0;
        svg.text((LEFT - 8.0, y + (group_height - GROUP_GAP) / 2.0 + 4.0), "end", stage.name());
        for s in shown.iter().filter(|s| s.stage == stage) {
            if let Some(row) = threads.iter().position(|&n| n == s.threads) {
                bar(&mut svg, &scale, s, row, y + BAR_HEIGHT * row as f64);
            }
        }
    }
    svg.line((LEFT, TOP), (LEFT, height - 20.0), AXIS_STYLE);
    let size = view.and_then(StageResults::size);
    let size = size.map(|(width, height)| format!(", {width}x{height} pixels")).unwrap_or_default();
    let camera =
        view.and_then(|view| view.camera.as_ref()).map(|name| format!(", {name}")).unwrap_or_default();
    format!(
        "<figure>{}<figcaption>{}, {} triangles{size}</figcaption></figure>\n",
        svg.finish(),
        escape_html(&format!("{}{camera}", scene.name)),
        scene.triangles
    )
}

/// A bar at height `y`, with a whisker from the fastest round to the slowest.
fn bar(svg: &mut Svg, scale: &Scale, s: &StageResults, row: usize, y: f64) {
    let Some(median) = s.median() else { return };
    let title = format!("{}, {}: {}", s.stage.name(), format_threads(s.threads), format_duration(median));
    svg.bar((LEFT, y), (scale.at(median) - LEFT, BAR_HEIGHT - 2.0), color(row), &title);
    let rounds = rounds(s);
    let fastest = rounds.iter().copied().fold(median, f64::min);
    let slowest = rounds.iter().copied().fold(median, f64::max);
    let centre = y + (BAR_HEIGHT - 2.0) / 2.0;
    svg.line((scale.at(fastest), centre), (scale.at(slowest), centre), "stroke=\"var(--ink)\"");
    svg.text((scale.at(slowest) + 6.0, centre + 4.0), "start", &format_duration(median));
}

/// The valid times of the rounds in seconds.
fn rounds(s: &StageResults) -> Vec<f64> {
    s.seconds.iter().copied().flatten().filter(|v| v.is_finite() && *v >= 0.0).collect()
}

/// The measured numbers of threads, ascending.
pub(super) fn thread_counts<'f>(stages: impl Iterator<Item = &'f StageResults>) -> Vec<u32> {
    let mut counts: Vec<u32> = stages.map(|s| s.threads).collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}
