//! Results as comma-separated values, for spreadsheets and data frames.

use crate::results::{BenchResults, SceneResults, StageResults};
use crate::stats::median;
use crate::trace::TraceBound;

/// The columns: units are those of the JSON file.
const COLUMNS: [&str; 20] = [
    "scene",
    "triangles",
    "stage",
    "camera",
    "width",
    "height",
    "threads",
    "rays",
    "median_seconds",
    "median_wall_seconds",
    "least_seconds",
    "speedup",
    "mrays_per_second",
    "spread",
    "waited",
    "peak_bytes",
    "joules",
    "nodes_per_ray",
    "triangles_per_ray",
    "hash",
];

/// A line for each stage of each scene, after a line of names (RFC 4180). Missing numbers are empty. `speedup` is the
/// time on one thread divided by this one, of the same stage, camera and size.
pub fn results_csv(results: &BenchResults) -> String {
    let mut out = line(&COLUMNS.map(str::to_string));
    for scene in &results.scenes {
        for stage in &scene.stages {
            out += &line(&row(scene, stage));
        }
    }
    out
}

fn row(scene: &SceneResults, s: &StageResults) -> [String; COLUMNS.len()] {
    let single =
        |other: &&StageResults| other.threads == 1 && other.stage == s.stage && other.has_same_view(s);
    let single = scene.stages.iter().find(single).and_then(StageResults::median);
    let speedup = single.zip(s.median()).map(|(single, own)| single / own);
    [
        scene.name.clone(),
        scene.triangles.to_string(),
        s.stage.name().to_string(),
        s.camera.clone().unwrap_or_default(),
        whole(s.width.map(u64::from)),
        whole(s.height.map(u64::from)),
        s.threads.to_string(),
        whole(s.rays),
        number(s.median()),
        number(median(s.wall_seconds.iter().copied().flatten())),
        number(s.least_seconds),
        number(speedup),
        number(s.mrays()),
        number(s.relative_spread()),
        number(s.waited),
        number(s.peak()),
        number(s.median_joules()),
        number(s.nodes_per_ray),
        number(s.triangles_per_ray),
        s.hash.clone().unwrap_or_default(),
    ]
}

/// The columns of bounds of traces.
const BOUND_COLUMNS: [&str; 5] = ["quantity", "stage", "cores", "least", "most"];

/// A line for each figure of the bounds of a job, with the names of the JSON file. A figure that is known has two equal
/// values.
pub fn trace_csv(bound: &TraceBound) -> String {
    let row = |quantity: &str, stage: &str, cores: Option<u32>, [least, most]: [f64; 2]| {
        line(&[
            quantity.into(),
            stage.into(),
            whole(cores.map(u64::from)),
            number(Some(least)),
            number(Some(most)),
        ])
    };
    let mut out = line(&BOUND_COLUMNS.map(str::to_string));
    let span = bound.span_seconds;
    for (quantity, values) in [
        ("work_seconds", [bound.work_seconds; 2]),
        ("outside_seconds", [bound.outside_seconds; 2]),
        ("span_seconds", [span.least, span.most]),
    ] {
        out += &row(quantity, "", None, values);
    }
    for stage in &bound.stages {
        out += &row("count", &stage.stage, None, [stage.count as f64; 2]);
        out += &row("work_seconds", &stage.stage, None, [stage.work_seconds; 2]);
        if let Some(fraction) = stage.serial_fraction {
            out += &row("serial_fraction", &stage.stage, None, [fraction; 2]);
        }
    }
    for speed_up in &bound.speed_ups {
        out += &row("speed_up", "", Some(speed_up.cores), [speed_up.at_least, speed_up.at_most]);
    }
    out
}

fn whole(value: Option<u64>) -> String {
    value.map(|v| v.to_string()).unwrap_or_default()
}

fn number(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map(|v| v.to_string()).unwrap_or_default()
}

fn line(cells: &[String]) -> String {
    cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\r\n"
}

/// Quotes a cell that holds separators, quotes or line breaks.
fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\r', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::RecordedSettings;

    #[test]
    fn speedups_are_those_of_the_same_stage() {
        let stage = |name: &str, threads: u32, seconds: f64| -> StageResults {
            let text = format!(r#"{{"stage": "{name}", "threads": {threads}, "seconds": [{seconds}]}}"#);
            serde_json::from_str(&text).unwrap()
        };
        let stages = vec![stage("load", 1, 3.0), stage("build", 1, 8.0), stage("build", 2, 4.0)];
        let scene = SceneResults { name: "a \"b\", c".into(), stages, ..SceneResults::default() };
        let text = results_csv(&BenchResults::new(RecordedSettings::default(), vec![scene]));
        let lines: Vec<&str> = text.split_terminator("\r\n").collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[0].starts_with("scene,triangles,stage,"));
        assert_eq!(lines[3], "\"a \"\"b\"\", c\",0,build,,,,2,,4,,,2,,,,,,,,");
    }
}
