//! Plot of the ray rate against the number of triangles.

use super::svg::{AXIS_STYLE, GRID_STYLE, Scale, Svg, color, round_ticks};
use super::units::format_count;
use crate::results::BenchResults;
use crate::stage::BenchStage;

const KINDS: [BenchStage; 7] = [
    BenchStage::Eye,
    BenchStage::Shadow,
    BenchStage::Sun,
    BenchStage::AmbientOcclusion,
    BenchStage::Reflection,
    BenchStage::Bounce1,
    BenchStage::Bounce4,
];
const LEFT: f64 = 56.0;
const RIGHT: f64 = 620.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 300.0;

/// The rate of one kind of ray in one scene.
struct Point<'r> {
    /// Index in [`KINDS`].
    kind: usize,
    scene: &'r str,
    /// Triangles in BVHs.
    triangles: f64,
    /// Millions of rays per second.
    rate: f64,
}

impl Point<'_> {
    /// Points with equal keys are joined by lines: standard scenes of one kind. Files have no partners.
    fn series(&self) -> (usize, &str) {
        (self.kind, self.scene.split_once(' ').map_or(self.scene, |(kind, _)| kind))
    }
}

/// Rays per second on one thread against the number of triangles in BVHs, for images of a size. `None` without such
/// results.
pub(super) fn rays_plot(results: &BenchResults, size: (u32, u32)) -> Option<String> {
    let mut points = points(results, size);
    if points.is_empty() {
        return None;
    }
    let fewest = points.iter().map(|p| p.triangles).fold(f64::INFINITY, f64::min);
    let most = points.iter().map(|p| p.triangles).fold(0.0, f64::max);
    let fastest = points.iter().map(|p| p.rate).fold(0.0, f64::max);
    let (min_x, max_x) = (fewest / 1.3, most * 1.3);
    let max_y = fastest * 1.05;
    let x = Scale::log((min_x, max_x), (LEFT, RIGHT));
    let y = Scale::linear((0.0, max_y), (BOTTOM, TOP));

    let mut svg = Svg::new(660.0, 350.0, "Millions of rays a second against triangles");
    let is_measured = |kind: &usize| points.iter().any(|p| p.kind == *kind);
    let measured = (0..KINDS.len()).filter(is_measured);
    svg.legend((LEFT, 14.0), measured.map(|kind| (KINDS[kind].name().to_string(), color(kind))));
    for tick in round_ticks(max_y) {
        svg.line((LEFT, y.at(tick)), (RIGHT, y.at(tick)), GRID_STYLE);
        svg.text((LEFT - 6.0, y.at(tick) + 4.0), "end", &format!("{tick}"));
    }
    for tick in log_ticks().filter(|&tick| tick >= min_x && tick <= max_x) {
        svg.line((x.at(tick), TOP), (x.at(tick), BOTTOM), GRID_STYLE);
        svg.text((x.at(tick), BOTTOM + 18.0), "middle", &format_count(tick));
    }
    svg.text((0.5 * (LEFT + RIGHT), BOTTOM + 40.0), "middle", "triangles in BVHs");
    svg.text((4.0, 14.0), "start", "Mray/s");

    points.sort_by(|a, b| a.series().cmp(&b.series()).then(a.triangles.total_cmp(&b.triangles)));
    let position = |p: &Point| (x.at(p.triangles), y.at(p.rate));
    for pair in points.windows(2) {
        if pair[0].series() == pair[1].series() {
            let style = format!("stroke=\"{}\" stroke-opacity=\".5\"", color(pair[0].kind));
            svg.line(position(&pair[0]), position(&pair[1]), &style);
        }
    }
    for p in &points {
        let title = format!("{}, {}: {:.2} Mray/s", p.scene, KINDS[p.kind].name(), p.rate);
        svg.dot(position(p), color(p.kind), &title);
    }
    svg.line((LEFT, BOTTOM), (RIGHT, BOTTOM), AXIS_STYLE);
    Some(format!("<figure>{}<figcaption>{}x{} pixels</figcaption></figure>\n", svg.finish(), size.0, size.1))
}

fn points(results: &BenchResults, size: (u32, u32)) -> Vec<Point<'_>> {
    let mut points = Vec::new();
    for scene in &results.scenes {
        let triangles = scene.tree.as_ref().map_or(scene.triangles, |tree| tree.entries);
        for s in scene.stages.iter().filter(|s| s.threads == 1 && s.size() == Some(size) && triangles > 0) {
            if let (Some(kind), Some(rate)) = (KINDS.iter().position(|k| *k == s.stage), s.mrays()) {
                points.push(Point { kind, scene: &scene.name, triangles: triangles as f64, rate });
            }
        }
    }
    points
}

/// 1, 2, 5, 10, 20, …
fn log_ticks() -> impl Iterator<Item = f64> {
    (0..12).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * libm::pow(10.0, f64::from(power))))
}
