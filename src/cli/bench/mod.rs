//! `blinn bench`: measures, keeps, shows and compares.

mod memory;
mod table;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::args::BenchArgs;
use super::console::{is_stdout, print, tell};
use super::{Summary, Usage, describe, one_line};
use crate::bench::{
    BenchObserver, BenchResults, BenchRun, BenchSettings, Comparison, HeatMap, Verdict, Workload, compare,
    measure, report_page, standard_suite,
};
use crate::cli::plan::{Claims, Writer, scene_list, tier};
use crate::cli::run::panics;
use crate::import::{LoadOptions, Warning};
use crate::output::{Overwrite, check_writable, write_atomically};
use crate::render::RenderSettings;

/// Triangles of the standard scenes where no size is given.
const USUAL_SIZE: usize = 70_000;
/// Width and height of pictures where none are given.
const USUAL_PICTURE: (u32, u32) = (640, 360);

pub(super) fn run(args: &BenchArgs) -> Result<Summary, Usage> {
    let plan = plan(args)?;
    let scenes = if args.scenes.is_empty() { Vec::new() } else { scene_list(&args.scenes)? };
    let mut summary = Summary::default();
    // Whatever would be in vain is found before minutes of measuring.
    let old = args
        .compare
        .as_deref()
        .map(BenchResults::read)
        .transpose()
        .map_err(|e| Usage(format!("--compare: {e}")))?;
    let from = args
        .from
        .as_deref()
        .map(BenchResults::read)
        .transpose()
        .map_err(|e| Usage(format!("--from: {e}")))?;
    let mut claims = Claims::of_read(&scenes);
    for (flag, file) in [("--json", &args.json), ("--report", &args.report)] {
        if let Some(file) = file {
            claims.write(file, Writer::Flag(flag)).map_err(Usage)?;
            if is_stdout(file) {
                continue;
            }
            crate::cli::run::scene_job::folder_of(file).map_err(|e| Usage(format!("{flag}: {e:#}")))?;
            if let Err(e) = check_writable(file, Overwrite::Yes) {
                fail(&mut summary, &format!("{flag}: {e}"));
                return Ok(summary);
            }
        }
    }
    let (figures, heat_maps) = match from {
        Some(figures) => (figures, Vec::new()),
        None => match panics::caught(|| measured(args, &scenes, &plan, &mut summary)) {
            Ok(Some(measurement)) => measurement,
            // Every scene has failed, and was told.
            Ok(None) => return Ok(summary),
            Err(e) => {
                fail(&mut summary, &format!("{e:#}"));
                return Ok(summary);
            }
        },
    };
    if args.memory {
        summary.note(print(figures.to_json().as_bytes()));
        return Ok(summary);
    }
    let compared = old.map(|old| compare(&old, &figures));
    let mut text = table::figures(&figures);
    text += &compared.as_ref().map(table::comparison).unwrap_or_default();
    // Standard output takes one thing, whole.
    if [&args.json, &args.report].into_iter().flatten().any(|file| is_stdout(file)) {
        tell(text.trim_end());
    } else {
        summary.note(print(text.as_bytes()));
    }
    let report = || report_page(&figures, &heat_maps, compared.as_ref());
    keep(&mut summary, args, args.json.as_deref(), || figures.to_json());
    keep(&mut summary, args, args.report.as_deref(), report);
    if let Some(compared) = &compared
        && args.common.strict
    {
        judge(&mut summary, compared);
    }
    Ok(summary)
}

/// What is measured, and how.
fn plan(args: &BenchArgs) -> Result<BenchSettings, Usage> {
    let (width, height) = args.size.unwrap_or(USUAL_PICTURE);
    let threads = match &args.threads {
        Some(list) => list.iter().map(|&n| usize::from(n)).collect(),
        None => usual_threads(std::thread::available_parallelism().map_or(1, usize::from)),
    };
    let mut unique = Vec::new();
    for n in threads {
        if !unique.contains(&n) {
            unique.push(n);
        }
    }
    Ok(BenchSettings {
        load: LoadOptions { allow_outside: args.common.allow_outside, ..LoadOptions::default() },
        render: RenderSettings { width, height, samples: args.samples, ..RenderSettings::default() },
        rounds: args.rounds,
        threads: unique,
        simd: tier(std::env::var_os("BLINN_SIMD"))?,
        heat_maps: args.report.is_some(),
        memory: args.memory,
        command: std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect(),
    })
}

/// 1, 2, 4 and so on, and all.
fn usual_threads(all: usize) -> Vec<usize> {
    std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < all).chain([all]).collect()
}

/// Measures all that was asked for.
fn measured(
    args: &BenchArgs,
    scenes: &[PathBuf],
    plan: &BenchSettings,
    summary: &mut Summary,
) -> Result<Option<(BenchResults, Vec<HeatMap>)>> {
    let mut subjects: Vec<Workload> = scenes.iter().map(|path| Workload::file(path)).collect();
    let sizes = args.suite.as_ref().map(|sizes| sizes.as_deref().unwrap_or(&[USUAL_SIZE]));
    for (kind, triangles) in sizes.map(standard_suite).unwrap_or_default() {
        if !args.common.quiet {
            tell(&format!("making {kind} of {triangles} triangles"));
        }
        subjects.push(Workload::generate(kind, triangles)?);
    }
    let mut teller = Teller { quiet: args.common.quiet, strict: args.common.strict, rounds: plan.rounds };
    let BenchRun { mut figures, heat_maps, failed } = measure(plan, &subjects, &mut teller);
    if !plan.memory {
        let measured = |i: &usize| failed.iter().all(|(other, _)| other != i);
        let measured = (0..subjects.len()).filter(measured).map(|i| &subjects[i]);
        for (scene, subject) in figures.scenes.iter_mut().zip(measured) {
            memory::add(scene, subject, plan, args);
        }
    }
    for (i, error) in failed {
        let subject = &subjects[i];
        fail(
            summary,
            &describe(
                if subject.is_generated() { Path::new(&subject.name) } else { &subject.file },
                &error.into(),
            ),
        );
    }
    Ok((!figures.scenes.is_empty()).then_some((figures, heat_maps)))
}

/// Tells of a failure, once: there are few, and they do not scroll away.
fn fail(summary: &mut Summary, text: &str) {
    let line = one_line(text);
    tell(&format!("blinn: {line}"));
    summary.failed.push(line);
}

fn keep(summary: &mut Summary, args: &BenchArgs, file: Option<&Path>, text: impl FnOnce() -> String) {
    let Some(file) = file else { return };
    if is_stdout(file) {
        return summary.note(print(text().as_bytes()));
    }
    let written = crate::cli::run::scene_job::folder_of(file).and_then(|()| {
        write_atomically(file, text().as_bytes(), Overwrite::Yes)
            .with_context(|| format!("{} cannot be written", file.display()))
    });
    match written {
        Ok(()) if args.common.quiet => {}
        Ok(()) => tell(&format!("wrote {}", file.display())),
        Err(e) => fail(summary, &format!("{e:#}")),
    }
}

/// With `--strict`, whatever costs more is an error.
fn judge(summary: &mut Summary, compared: &Comparison) {
    for change in compared.significant().filter(|change| change.verdict == Verdict::More) {
        fail(
            summary,
            &format!(
                "{}: {} is {:.2} of what it was (an error because of --strict)",
                change.scene, change.what, change.ratio
            ),
        );
    }
}

/// Tells of progress and warnings on standard error.
struct Teller {
    quiet: bool,
    strict: bool,
    rounds: u32,
}

impl BenchObserver for Teller {
    fn scene_started(&mut self, subject: &Workload, round: u32) {
        if !self.quiet {
            tell(&format!("round {round} of {}: {}", self.rounds, one_line(&subject.name)));
        }
    }

    fn scene_loaded(&mut self, subject: &Workload, warnings: &[Warning]) -> Result<(), String> {
        for warning in warnings {
            if self.strict {
                return Err(format!("{warning} (an error because of --strict)"));
            }
            if !self.quiet {
                tell(&one_line(&format!("warning: {}: {warning}", subject.name)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_double_up_to_all() {
        assert_eq!(usual_threads(1), [1]);
        assert_eq!(usual_threads(2), [1, 2]);
        assert_eq!(usual_threads(6), [1, 2, 4, 6]);
        assert_eq!(usual_threads(8), [1, 2, 4, 8]);
    }
}
