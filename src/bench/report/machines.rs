//! The results of one or of several machines side by side, as tables and as a page.

use super::table::{Table, texts};
use super::units::format_duration;
use super::{date, page_head};
use crate::bootstrap::ratio_interval;
use crate::compare::{Change, Comparison, Verdict};
use crate::results::{BenchResults, Machine, SceneResults, StageResults};
use blinn_output::escape_html;

/// The results of a machine with a name for tables.
#[derive(Clone, Debug)]
pub struct MachineResults {
    /// The name.
    pub label: String,
    /// The results.
    pub results: BenchResults,
}

/// Tables of the machines and of each scene. With several machines, times are given with their ratios to those of the
/// first.
pub fn result_tables(machines: &[MachineResults]) -> Vec<Table> {
    let mut tables = vec![machine_table(machines)];
    for scene in all_scenes(machines) {
        let scenes: Vec<Option<&SceneResults>> =
            machines.iter().map(|machine| machine.results.find_scene(scene)).collect();
        tables.push(match scenes[..] {
            [Some(scene)] => scene_table(scene),
            _ => machines_table(&scene.name, machines, &scenes),
        });
    }
    tables
}

/// The differences of hashes between the machines: they did different work.
pub fn different_work(machines: &[MachineResults]) -> Vec<String> {
    let mut texts = Vec::new();
    let Some((first, others)) = machines.split_first() else { return texts };
    for scene in &first.results.scenes {
        for stage in &scene.stages {
            for other in others {
                let found = other.results.find_scene(scene).and_then(|scene| find_stage(scene, stage));
                if let (Some(a), Some(b)) = (&stage.hash, found.and_then(|found| found.hash.as_ref()))
                    && a != b
                    && is_same_work(stage, first, other)
                {
                    texts.push(format!(
                        "{}: {}: hash {a} of {}, {b} of {}: the runs did different work",
                        scene.name,
                        stage.description(),
                        first.label,
                        other.label
                    ));
                }
            }
        }
    }
    texts
}

/// Returns false for pictures of different samples.
fn is_same_work(stage: &StageResults, first: &MachineResults, other: &MachineResults) -> bool {
    !stage.stage.has_samples() || first.results.settings.samples == other.results.settings.samples
}

/// Returns true if the first machine and another one have hashes of the same stage.
fn has_common_hash(machines: &[MachineResults]) -> bool {
    let Some((first, others)) = machines.split_first() else { return false };
    let is_common = |scene: &SceneResults, stage: &StageResults| {
        stage.hash.is_some()
            && others.iter().any(|other| {
                let found = other.results.find_scene(scene).and_then(|scene| find_stage(scene, stage));
                found.is_some_and(|found| found.hash.is_some()) && is_same_work(stage, first, other)
            })
    };
    first.results.scenes.iter().any(|scene| scene.stages.iter().any(|stage| is_common(scene, stage)))
}

/// The HTML page of several machines.
pub fn machines_page(machines: &[MachineResults]) -> String {
    let mut page = page_head(&format!("blinn bench: {} machines", machines.len()));
    let different = different_work(machines);
    page += match (different.is_empty(), has_common_hash(machines)) {
        (true, true) => "<p>All hashes that several machines have are equal: they did the same work.</p>\n",
        (true, false) => {
            "<p class=\"facts\">The machines have no hash in common that shows the same work.</p>\n"
        }
        (false, _) => "<p class=\"bad\">The machines did different work.</p>\n",
    };
    for text in different {
        page += &format!("<p class=\"bad\">{}</p>\n", escape_html(&text));
    }
    page += "<p class=\"facts\">Rates in Mray/s of stages that only trace, times of the others. Ratios are times divided \
             by those of the first machine, with 95 % bootstrap confidence intervals over the rounds.</p>\n";
    page += &result_tables(machines).iter().map(Table::to_html).collect::<String>();
    page + "</body></html>\n"
}

/// All scenes in the order in which they appear. Scenes that several machines measured are those of the first of them.
fn all_scenes(machines: &[MachineResults]) -> Vec<&SceneResults> {
    let mut scenes: Vec<&SceneResults> = Vec::new();
    for (i, machine) in machines.iter().enumerate() {
        for scene in &machine.results.scenes {
            let is_known = scenes.iter().any(|known| known.name == scene.name)
                || machines[..i].iter().any(|other| other.results.find_scene(scene).is_some());
            if !is_known {
                scenes.push(scene);
            }
        }
    }
    scenes
}

fn find_stage<'s>(scene: &'s SceneResults, like: &StageResults) -> Option<&'s StageResults> {
    scene.stages.iter().find(|stage| stage.is_same_stage(like))
}

fn machine_table(machines: &[MachineResults]) -> Table {
    let row = |MachineResults { label, results }: &MachineResults| {
        let Machine { cores, memory_bytes, os, kernel, .. } = &results.machine;
        let debug = if results.settings.debug_build { " (not optimised)" } else { "" };
        vec![
            label.clone(),
            results.machine.processor(),
            cores.to_string(),
            format!("{:.1} GiB", *memory_bytes as f64 / f64::from(1 << 30)),
            format!("{os} {kernel}"),
            results.settings.simd.clone(),
            format!("{}{debug}", results.version),
            results.settings.rounds.to_string(),
            date(results.unix_time),
        ]
    };
    Table {
        title: "Machines".into(),
        head: texts(["machine", "processor", "cores", "memory", "system", "SIMD", "blinn", "rounds", "date"]),
        rows: machines.iter().map(row).collect(),
    }
}

fn or_dash(value: Option<f64>, show: impl Fn(f64) -> String) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "–".into(), show)
}

/// The stage, with the camera if it has a name.
fn stage_name(stage: &StageResults) -> String {
    let camera = stage.camera.as_ref().map(|name| format!(", {name}")).unwrap_or_default();
    format!("{}{camera}", stage.stage.name())
}

fn size(stage: &StageResults) -> String {
    stage.size().map_or_else(|| "–".into(), |(width, height)| format!("{width}x{height}"))
}

/// The first digits of a hash.
fn short_hash(hash: Option<&str>) -> String {
    hash.map_or_else(|| "–".into(), |hash| hash.chars().take(8).collect())
}

/// The measurements of two runs side by side.
pub fn comparison_table(comparison: &Comparison) -> Table {
    let row = |change: &Change| {
        let verdict = match change.verdict {
            Verdict::Same => "",
            Verdict::Less => "less",
            Verdict::More => "more",
        };
        vec![
            format!("{}: {}", change.scene, change.metric),
            format!("{:.3}", change.ratio),
            change.interval.map_or_else(|| "–".into(), |i| format!("{:.3}–{:.3}", i.low, i.high)),
            or_dash(Some(change.noise), |v| format!("{:.1} %", 100.0 * v)),
            or_dash(change.min_ratio, |v| format!("{v:.3}")),
            verdict.into(),
        ]
    };
    Table {
        title: format!("Comparison with the baseline ({})", comparison.program_line()),
        head: texts(["cost", "new / old", "95 % interval", "noise", "by least", "verdict"]),
        rows: comparison.changes.iter().map(row).collect(),
    }
}

/// All stages of a scene on one machine.
fn scene_table(scene: &SceneResults) -> Table {
    let row = |s: &StageResults| {
        vec![
            stage_name(s),
            size(s),
            s.threads.to_string(),
            or_dash(s.median(), format_duration),
            or_dash(s.mrays(), |v| format!("{v:.2}")),
            or_dash(s.relative_spread(), |v| format!("{:.1} %", 100.0 * v)),
            or_dash(s.peak(), |v| format!("{:.0} MiB", v / f64::from(1 << 20))),
            or_dash(s.nodes_per_ray, |v| format!("{v:.1}")),
            or_dash(s.triangles_per_ray, |v| format!("{v:.1}")),
            short_hash(s.hash.as_deref()),
        ]
    };
    let tree = scene.tree.as_ref().filter(|tree| tree.bytes > 0).map(|tree| {
        let bytes = or_dash(tree.bytes_per_triangle, |v| format!("{v:.1}"));
        let cost = or_dash(tree.sah_cost, |v| format!("{v:.1}"));
        format!("; BVHs: {} nodes, {bytes} bytes per triangle, SAH cost {cost}", tree.nodes)
    });
    Table {
        title: format!("{}, {} triangles{}", scene.name, scene.triangles, tree.unwrap_or_default()),
        head: texts([
            "stage",
            "pixels",
            "threads",
            "time",
            "Mray/s",
            "spread",
            "memory",
            "nodes",
            "triangles",
            "hash",
        ]),
        rows: scene.stages.iter().map(row).collect(),
    }
}

/// The stages of a scene on several machines. A machine that lacks the scene or a stage has dashes.
fn machines_table(name: &str, machines: &[MachineResults], scenes: &[Option<&SceneResults>]) -> Table {
    let mut head = texts(["stage", "pixels", "threads"]);
    for (i, machine) in machines.iter().enumerate() {
        head.push(machine.label.clone());
        if i > 0 {
            head.push(format!("time / {}", machines[0].label));
        }
    }
    head.push("hash".into());
    let mut keys: Vec<&StageResults> = Vec::new();
    for stage in scenes.iter().flatten().flat_map(|scene| &scene.stages) {
        if !keys.iter().any(|key| key.is_same_stage(stage)) {
            keys.push(stage);
        }
    }
    let row = |key: &&StageResults| {
        let found: Vec<Option<&StageResults>> =
            scenes.iter().map(|scene| scene.and_then(|scene| find_stage(scene, key))).collect();
        let mut cells = vec![stage_name(key), size(key), key.threads.to_string()];
        for (i, stage) in found.iter().enumerate() {
            cells.push(stage.map_or_else(|| "–".into(), rate_or_time));
            if i > 0 && !is_same_work(key, &machines[0], &machines[i]) {
                cells.push("–".into());
            } else if i > 0 {
                cells.push(found[0].zip(*stage).map_or_else(|| "–".into(), |(first, s)| ratio(first, s)));
            }
        }
        let mut hashes: Vec<Option<&str>> =
            found.iter().flatten().filter(|s| s.hash.is_some()).map(|s| s.hash.as_deref()).collect();
        hashes.dedup();
        cells.push(match hashes[..] {
            [] => "–".into(),
            [hash] => short_hash(hash),
            _ => "differs".into(),
        });
        cells
    };
    let triangles: Vec<String> = scenes.iter().flatten().map(|scene| scene.triangles.to_string()).collect();
    let same = triangles.iter().all(|count| *count == triangles[0]);
    let count = if same { triangles.first().cloned().unwrap_or_default() } else { triangles.join(" or ") };
    Table { title: format!("{name}, {count} triangles"), head, rows: keys.iter().map(row).collect() }
}

/// Mray/s of a stage that only traces, or the time.
fn rate_or_time(stage: &StageResults) -> String {
    match stage.mrays() {
        Some(rate) => format!("{rate:.2} Mray/s"),
        None => or_dash(stage.median(), format_duration),
    }
}

/// The ratio of the median times with its confidence interval.
fn ratio(first: &StageResults, other: &StageResults) -> String {
    let seconds = |s: &StageResults| -> Vec<f64> {
        s.seconds.iter().copied().flatten().filter(|v| v.is_finite() && *v > 0.0).collect()
    };
    let (old, new) = (seconds(first), seconds(other));
    let ratio = first.median().zip(other.median()).map(|(a, b)| b / a);
    match ratio.filter(|ratio| ratio.is_finite() && *ratio > 0.0) {
        None => "–".into(),
        Some(ratio) => match ratio_interval(&old, &new) {
            Some(interval) => format!("{ratio:.2} [{:.2}, {:.2}]", interval.low, interval.high),
            None => format!("{ratio:.2}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::RecordedSettings;
    use crate::stage::BenchStage;

    fn stage(stage: BenchStage, seconds: f64, hash: Option<&str>) -> StageResults {
        let text = format!(r#"{{"stage": "{}", "threads": 1, "width": 8, "height": 4}}"#, stage.name());
        let mut results: StageResults = serde_json::from_str(&text).unwrap();
        results.seconds = vec![Some(seconds); 3];
        results.rays = stage.traces_rays().then_some(1_000_000);
        results.hash = hash.map(str::to_string);
        results
    }

    fn machine(label: &str, factor: f64, hash: &str) -> MachineResults {
        let stages =
            vec![stage(BenchStage::Eye, factor, Some(hash)), stage(BenchStage::Encode, factor, None)];
        let scene = SceneResults { name: "scan".into(), triangles: 5, stages, ..SceneResults::default() };
        let results = BenchResults::new(RecordedSettings::default(), vec![scene]);
        MachineResults { label: label.into(), results }
    }

    #[test]
    fn several_machines_are_side_by_side() {
        let mut machines =
            vec![machine("a", 1.0, "same"), machine("b", 2.0, "same"), machine("c", 0.5, "same")];
        machines[2].results.scenes[0].stages.pop();
        let tables = result_tables(&machines);
        assert_eq!(tables.len(), 2);
        assert_eq!(tables[0].rows.len(), 3);
        assert_eq!(
            tables[1].head,
            ["stage", "pixels", "threads", "a", "b", "time / a", "c", "time / a", "hash"]
        );
        let expected = [
            "eye",
            "8x4",
            "1",
            "1.00 Mray/s",
            "0.50 Mray/s",
            "2.00 [2.00, 2.00]",
            "2.00 Mray/s",
            "0.50 [0.50, 0.50]",
            "same",
        ];
        assert_eq!(tables[1].rows[0], expected);
        assert_eq!(tables[1].rows[1][5..], ["2.00 [2.00, 2.00]", "–", "–", "–"]);
        assert!(different_work(&machines).is_empty());
        assert!(machines_page(&machines).contains("they did the same work"));
        machines.truncate(2);
        machines[1].results.scenes[0].stages[0].hash = None;
        assert!(machines_page(&machines).contains("no hash in common"));
    }

    #[test]
    fn scenes_of_other_paths_are_one_scene_if_their_files_are_equal() {
        let mut machines = vec![machine("a", 1.0, "same"), machine("b", 2.0, "same")];
        machines[1].results.scenes[0].name = "folder/scan".into();
        assert_eq!(result_tables(&machines).len(), 3);
        machines.iter_mut().for_each(|machine| machine.results.scenes[0].sha256 = Some("5ca1".into()));
        let tables = result_tables(&machines);
        assert_eq!((tables.len(), tables[1].rows[0][5].as_str()), (2, "2.00 [2.00, 2.00]"));
    }

    #[test]
    fn different_hashes_are_reported() {
        let machines = [machine("a", 1.0, "one"), machine("b", 1.0, "one"), machine("c", 1.0, "two")];
        let different = different_work(&machines);
        assert_eq!(different.len(), 1);
        assert_eq!(
            different[0],
            "scan: eye, 8x4, 1 thread: hash one of a, two of c: the runs did different work"
        );
        assert_eq!(result_tables(&machines)[1].rows[0].last().unwrap(), "differs");
        assert!(machines_page(&machines).contains("did different work"));
    }

    #[test]
    fn one_machine_has_all_columns() {
        let tables = result_tables(&[machine("a", 1.0, "0123456789")]);
        assert_eq!(tables[1].title, "scan, 5 triangles");
        assert_eq!(tables[1].rows[0], ["eye", "8x4", "1", "1.00 s", "1.00", "–", "–", "–", "–", "01234567"]);
    }
}
