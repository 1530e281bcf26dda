//! The page's plots.

use super::format_duration;
use super::svg::{Scale, Svg, color, ticks};
use crate::bench::results::{BenchResults, BenchStage, SceneResults, StageResults};
use crate::bench::stats::median;
use crate::output::escape_html;

const AXIS: &str = "stroke=\"#999\"";
const GRID: &str = "stroke=\"#e4e4e4\"";

/// Numbers of threads in a scene's figures, rising.
fn threads<'f>(stages: impl Iterator<Item = &'f StageResults>) -> Vec<u32> {
    let mut all: Vec<u32> = stages.map(|s| s.threads).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn in_words(threads: u32) -> String {
    if threads == 1 { "1 thread".into() } else { format!("{threads} threads") }
}

/// Bars: a group for each stage, a bar for each number of threads.
pub(super) fn stages(scene: &SceneResults) -> String {
    let rounds = |s: &StageResults| -> Vec<f64> {
        s.seconds.iter().copied().flatten().filter(|v| v.is_finite() && *v >= 0.0).collect()
    };
    let longest = scene.stages.iter().flat_map(rounds).fold(0.0, f64::max);
    let threads = threads(scene.stages.iter());
    let timed = |stage: &BenchStage| scene.stages.iter().any(|s| s.stage == *stage && s.median().is_some());
    let present: Vec<BenchStage> = BenchStage::ALL.into_iter().filter(timed).collect();
    if present.is_empty() {
        return String::new();
    }
    const BAR: f64 = 13.0;
    let group = BAR * threads.len() as f64 + 9.0;
    let (left, right, top) = (80.0, 430.0, 26.0);
    let height = top + group * present.len() as f64 + 24.0;
    let mut svg = Svg::new(500.0, height, &format!("Time of each stage of {}", scene.name));
    svg.legend((left, 14.0), threads.iter().map(|&n| in_words(n)));
    let scale = Scale::linear((0.0, longest), (left, right));
    for tick in ticks(longest) {
        svg.line((scale.at(tick), top), (scale.at(tick), height - 20.0), GRID);
        svg.text((scale.at(tick), height - 6.0), "middle", &format_duration(tick));
    }
    for (i, &stage) in present.iter().enumerate() {
        let y = top + group * i as f64 + 5.0;
        svg.text((left - 8.0, y + (group - 9.0) / 2.0 + 4.0), "end", stage.name());
        for s in scene.stages.iter().filter(|s| s.stage == stage) {
            let (Some(middle), Some(row)) = (s.median(), threads.iter().position(|&n| n == s.threads)) else {
                continue;
            };
            let at = y + BAR * row as f64;
            let title = format!("{}, {}: {}", stage.name(), in_words(s.threads), format_duration(middle));
            svg.bar((left, at), (scale.at(middle) - left, BAR - 2.0), color(row), &title);
            let all = rounds(s);
            let (low, high) =
                (all.iter().copied().fold(middle, f64::min), all.iter().copied().fold(middle, f64::max));
            let centre = at + (BAR - 2.0) / 2.0;
            svg.line((scale.at(low), centre), (scale.at(high), centre), "stroke=\"#222\"");
            svg.text((scale.at(high) + 6.0, centre + 4.0), "start", &format_duration(middle));
        }
    }
    svg.line((left, top), (left, height - 20.0), AXIS);
    let name = escape_html(&scene.name);
    format!(
        "<figure>{}<figcaption>{name}, {} triangles</figcaption></figure>\n",
        svg.finish(),
        scene.triangles
    )
}

/// BenchRays a second of one thread by the number of triangles in trees.
pub(super) fn rays_by_triangles(figures: &BenchResults) -> Option<String> {
    let kinds = [BenchStage::Eye, BenchStage::Shadow, BenchStage::Incoherent];
    // (kind, scene, triangles, rate)
    let mut points: Vec<(usize, &str, f64, f64)> = Vec::new();
    for scene in &figures.scenes {
        let in_trees = scene.tree.as_ref().map_or(scene.triangles, |tree| tree.entries);
        for s in scene.stages.iter().filter(|s| s.threads == 1 && in_trees > 0) {
            if let (Some(kind), Some(rate)) = (kinds.iter().position(|k| *k == s.stage), s.mrays()) {
                points.push((kind, &scene.name, in_trees as f64, rate));
            }
        }
    }
    let span = |of: fn(&(usize, &str, f64, f64)) -> f64| {
        points
            .iter()
            .map(of)
            .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)))
    };
    let (fewest, most) = span(|p| p.2);
    let (_, fastest) = span(|p| p.3);
    if points.is_empty() {
        return None;
    }
    let (left, right, top, bottom) = (56.0, 620.0, 30.0, 300.0);
    let mut svg = Svg::new(660.0, 350.0, "Millions of rays a second against triangles");
    svg.legend((left, 14.0), kinds.iter().map(|k| k.name().to_string()));
    let x = Scale::log((fewest / 1.3, most * 1.3), (left, right));
    let y = Scale::linear((0.0, fastest * 1.05), (bottom, top));
    for tick in ticks(fastest * 1.05) {
        svg.line((left, y.at(tick)), (right, y.at(tick)), GRID);
        svg.text((left - 6.0, y.at(tick) + 4.0), "end", &format!("{tick}"));
    }
    for power in 0..12 {
        for digit in [1.0, 2.0, 5.0] {
            let tick = digit * libm::pow(10.0, f64::from(power));
            if tick >= fewest / 1.3 && tick <= most * 1.3 {
                svg.line((x.at(tick), top), (x.at(tick), bottom), GRID);
                svg.text((x.at(tick), bottom + 18.0), "middle", &short(tick));
            }
        }
    }
    svg.text((0.5 * (left + right), bottom + 40.0), "middle", "triangles in trees");
    svg.text((4.0, 14.0), "start", "Mray/s");
    points.sort_by(|a, b| (a.0, family(a.1)).cmp(&(b.0, family(b.1))).then(a.2.total_cmp(&b.2)));
    for pair in points.windows(2) {
        if (pair[0].0, family(pair[0].1)) == (pair[1].0, family(pair[1].1)) {
            let place = |p: &(usize, &str, f64, f64)| (x.at(p.2), y.at(p.3));
            let style = format!("stroke=\"{}\" stroke-opacity=\".5\"", color(pair[0].0));
            svg.line(place(&pair[0]), place(&pair[1]), &style);
        }
    }
    for (kind, name, triangles, rate) in &points {
        let title = format!("{name}, {}: {rate:.2} Mray/s", kinds[*kind].name());
        svg.dot((x.at(*triangles), y.at(*rate)), color(*kind), &title);
    }
    svg.line((left, bottom), (right, bottom), AXIS);
    Some(svg.finish())
}

/// Standard scenes are called by their kind and size; files are by themselves.
fn family(name: &str) -> &str {
    name.split_once(' ').map_or(name, |(kind, _)| kind)
}

fn short(n: f64) -> String {
    match n {
        n if n >= 1e6 => format!("{}m", n / 1e6),
        n if n >= 1e3 => format!("{}k", n / 1e3),
        n => format!("{n}"),
    }
}

/// Speed-ups by threads: `None` where there is but one number of them.
pub(super) fn scaling(figures: &BenchResults) -> Option<String> {
    let all = threads(figures.scenes.iter().flat_map(|scene| &scene.stages));
    let (&fewest, &most) = (all.first()?, all.last()?);
    if fewest != 1 || most == 1 {
        return None;
    }
    let speedup = |scene: &SceneResults, stage: BenchStage, threads: u32| {
        let of = |n: u32| scene.stages.iter().find(|s| (s.stage, s.threads) == (stage, n))?.median();
        Some(of(1)? / of(threads)?).filter(|v| v.is_finite())
    };
    let (left, right, top, bottom) = (56.0, 460.0, 46.0, 300.0);
    let mut svg = Svg::new(620.0, 350.0, "Speed-up against threads");
    svg.legend((left, 14.0), BenchStage::ALL.iter().map(|s| s.name().to_string()));
    let x = Scale::linear((1.0, f64::from(most)), (left, right));
    let mut lines = Vec::new();
    for (i, stage) in BenchStage::ALL.into_iter().enumerate() {
        let at = |&n: &u32| {
            let over_scenes = median(figures.scenes.iter().filter_map(|scene| speedup(scene, stage, n)))?;
            Some((f64::from(n), over_scenes))
        };
        lines.push((i, stage, all.iter().filter_map(at).collect::<Vec<_>>()));
    }
    let best = lines.iter().flat_map(|l| &l.2).map(|p| p.1).fold(f64::from(most), f64::max);
    let y = Scale::linear((0.0, best), (bottom, top));
    for tick in ticks(best) {
        svg.line((left, y.at(tick)), (right, y.at(tick)), GRID);
        svg.text((left - 6.0, y.at(tick) + 4.0), "end", &format!("{tick}"));
    }
    for &n in &all {
        svg.text((x.at(f64::from(n)), bottom + 18.0), "middle", &n.to_string());
    }
    svg.text((0.5 * (left + right), bottom + 40.0), "middle", "threads");
    let end = f64::from(most);
    svg.line((x.at(1.0), y.at(1.0)), (x.at(end), y.at(end)), "stroke=\"#999\" stroke-dasharray=\"5 4\"");
    let mut ends: Vec<(f64, String)> = Vec::new();
    for (i, stage, points) in &lines {
        for pair in points.windows(2) {
            let place = |p: (f64, f64)| (x.at(p.0), y.at(p.1));
            svg.line(place(pair[0]), place(pair[1]), &format!("stroke=\"{}\" stroke-width=\"2\"", color(*i)));
        }
        for &(n, v) in points {
            svg.dot((x.at(n), y.at(v)), color(*i), &format!("{}, {n} threads: {v:.2}", stage.name()));
        }
        ends.extend(points.last().map(|&(_, v)| (y.at(v), format!("{} {v:.2}", stage.name()))));
    }
    // Names beside the lines' ends, moved apart where they would lie upon each other.
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    for (place, name) in ends {
        let place = place.max(free);
        svg.text((right + 10.0, place + 4.0), "start", &name);
        free = place + 14.0;
    }
    svg.line((left, bottom), (right, bottom), AXIS);
    Some(svg.finish())
}
