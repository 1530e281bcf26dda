//! Plot of the speed-up against the number of threads.

use super::stage_plot::thread_counts;
use super::svg::{AXIS_STYLE, GRID_STYLE, Scale, Svg, color, round_ticks};
use super::units::format_threads;
use crate::results::{BenchResults, SceneResults, StageResults};
use crate::stage::BenchStage;
use crate::stats::median;

const LEFT: f64 = 56.0;
const RIGHT: f64 = 460.0;
const TOP: f64 = 46.0;
const BOTTOM: f64 = 300.0;
/// The stages that are shown.
const STAGES: [BenchStage; 7] = [
    BenchStage::Load,
    BenchStage::Build,
    BenchStage::Eye,
    BenchStage::Shadow,
    BenchStage::Bounce1,
    BenchStage::Frame,
    BenchStage::Encode,
];
/// Distance of the labels at the ends of the lines.
const LABEL_SPACING: f64 = 14.0;

/// The speed-ups of a stage.
struct Curve {
    stage: BenchStage,
    color: &'static str,
    /// Numbers of threads, and the median speed-up over all scenes, cameras and sizes.
    points: Vec<(f64, f64)>,
}

/// Speed-up over one thread. `None` without results of one thread and of several.
pub(super) fn scaling_plot(results: &BenchResults) -> Option<String> {
    let threads = thread_counts(results.scenes.iter().flat_map(|scene| &scene.stages));
    let (&fewest, &most) = (threads.first()?, threads.last()?);
    if fewest != 1 || most == 1 {
        return None;
    }
    let max_threads = f64::from(most);
    let curves = curves(results, &threads);
    let max_speedup = curves.iter().flat_map(|c| &c.points).map(|p| p.1).fold(max_threads, f64::max);
    let x = Scale::linear((1.0, max_threads), (LEFT, RIGHT));
    let y = Scale::linear((0.0, max_speedup), (BOTTOM, TOP));
    let position = |p: (f64, f64)| (x.at(p.0), y.at(p.1));

    let mut svg = Svg::new(620.0, 350.0, "Speed-up against threads");
    svg.legend((LEFT, 14.0), curves.iter().map(|curve| (curve.stage.name().to_string(), curve.color)));
    for tick in round_ticks(max_speedup) {
        svg.line((LEFT, y.at(tick)), (RIGHT, y.at(tick)), GRID_STYLE);
        svg.text((LEFT - 6.0, y.at(tick) + 4.0), "end", &format!("{tick}"));
    }
    for &n in &threads {
        svg.text((x.at(f64::from(n)), BOTTOM + 18.0), "middle", &n.to_string());
    }
    svg.text((0.5 * (LEFT + RIGHT), BOTTOM + 40.0), "middle", "threads");
    let linear_scaling = "stroke=\"var(--soft)\" stroke-dasharray=\"5 4\"";
    svg.line(position((1.0, 1.0)), position((max_threads, max_threads)), linear_scaling);
    for Curve { stage, color, points } in &curves {
        for pair in points.windows(2) {
            let style = format!("stroke=\"{color}\" stroke-width=\"2\"");
            svg.line(position(pair[0]), position(pair[1]), &style);
        }
        for &(n, v) in points {
            svg.dot(
                position((n, v)),
                color,
                &format!("{}, {}: {v:.2}", stage.name(), format_threads(n as u32)),
            );
        }
    }
    label_ends(&mut svg, &curves, &y);
    svg.line((LEFT, BOTTOM), (RIGHT, BOTTOM), AXIS_STYLE);
    Some(svg.finish())
}

fn curves(results: &BenchResults, threads: &[u32]) -> Vec<Curve> {
    let curve = |(i, stage): (usize, BenchStage)| {
        let point = |&n: &u32| {
            let speedups = results.scenes.iter().flat_map(|scene| speedups(scene, stage, n));
            Some((f64::from(n), median(speedups)?))
        };
        Curve { stage, color: color(i), points: threads.iter().filter_map(point).collect() }
    };
    let curves = STAGES.into_iter().enumerate().map(curve);
    curves.filter(|curve| !curve.points.is_empty()).collect()
}

/// The speed-ups of a stage of a scene, one for each camera and size.
fn speedups(scene: &SceneResults, stage: BenchStage, threads: u32) -> impl Iterator<Item = f64> {
    let of = move |n: u32| scene.stages.iter().filter(move |s| (s.stage, s.threads) == (stage, n));
    let ratio = move |several: &StageResults| {
        let single = of(1).find(|single| single.has_same_view(several))?;
        Some(single.median()? / several.median()?).filter(|v| v.is_finite())
    };
    of(threads).filter_map(ratio)
}

/// Labels the ends of the curves, moved down where they would overlap.
fn label_ends(svg: &mut Svg, curves: &[Curve], y: &Scale) {
    let label = |curve: &Curve| {
        let &(_, v) = curve.points.last()?;
        Some((y.at(v), format!("{} {v:.2}", curve.stage.name())))
    };
    let mut labels: Vec<(f64, String)> = curves.iter().filter_map(label).collect();
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut next_free = f64::NEG_INFINITY;
    for (end, text) in labels {
        let at = end.max(next_free);
        svg.text((RIGHT + 10.0, at + 4.0), "start", &text);
        next_free = at + LABEL_SPACING;
    }
}
