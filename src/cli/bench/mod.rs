//! `blinn bench`: measures scenes, then prints, writes and compares the results.

mod machines;
mod memory;
mod observer;
mod output;
mod public_scenes;
mod table;
mod trace_bound;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::args::{BenchArgs, CommonArgs};
use super::console::{eprint_line, is_stdout, print_stdout, print_warning, scene_error, strict_error};
use super::files::create_parent_folder;
use super::plan::{PathConflicts, Writer, scene_list};
use super::plural::plural;
use super::run::panics;
use super::run::signals::HeldInterrupt;
use super::scene_file::is_stdin;
use super::summary::Summary;
use super::usage::UsageError;
use blinn_bench::manifest::sha256_of_file;
use blinn_bench::{
    BenchResults, BenchRun, BenchSettings, BenchStage, Comparison, HeatMap, MachineResults, Verdict,
    Workload, compare, comparison_table, measure, report_page, result_tables, results_csv, standard_suite,
};
use blinn_core::option_words::option_word;
use blinn_core::worded;
use blinn_import::LoadOptions;
use blinn_output::{Overwrite, check_writable};
use blinn_render::RenderSettings;
use blinn_session::simd_level;
use observer::ConsoleObserver;
use output::{check_extension, fail, output_files, print, write};
use public_scenes::PublicScenes;

/// Triangles of the standard scenes without a size.
const DEFAULT_TRIANGLES: usize = 70_000;
/// Share of waiting from which a warning says that speed-ups are too good.
const LARGE_WAIT: f64 = 0.1;
/// Width and height of images without --size.
const DEFAULT_SIZE: (u32, u32) = (640, 360);

/// The measurements of a run.
struct Measurement {
    results: BenchResults,
    heat_maps: Vec<HeatMap>,
    /// Ends the process after the results are written, if it was interrupted.
    interrupt: Option<HeldInterrupt>,
}

pub fn run(args: &BenchArgs) -> Result<Summary, UsageError> {
    if !args.trace_bound.is_empty() {
        return trace_bound::run(args);
    }
    if args.scenes.is_empty() && args.suite.is_none() && args.scene_folder.is_none() && args.from.is_empty() {
        return Err(UsageError(
            "bench: name scene files, or --suite, --scenes DIR, --from FILE.json or --trace-bound FILE.json"
                .into(),
        ));
    }
    let settings = settings(args)?;
    warn_of_threads(&settings, args);
    let scenes = if args.scenes.is_empty() { Vec::new() } else { scene_list(&args.scenes)?.to_vec()? };
    if scenes.iter().any(|scene| is_stdin(scene)) {
        return Err(UsageError("bench reads scenes several times; save standard input to a file".into()));
    }
    let mut summary = Summary::default();
    // Errors in files are found before minutes of measuring.
    let old = read_results("compare", args.compare.as_deref())?;
    let from = read_machines(args)?;
    let public = args.scene_folder.as_deref().map(PublicScenes::find).transpose()?;
    let public = public.map(|public| public.with_only(args.only_scene.as_deref()));
    if let Some(public) = &public {
        public.list_missing(args.common.quiet);
        if public.workloads.is_empty() && scenes.is_empty() && args.suite.is_none() {
            fail(&mut summary, &public.none_found(args.common.quiet));
            return Ok(summary);
        }
    }
    if let Err(error) = check_outputs(args, &scenes)? {
        fail(&mut summary, &format!("{error:#}"));
        return Ok(summary);
    }
    if from.len() > 1 {
        machines::show(args, &from, &mut summary);
        return Ok(summary);
    }
    if let Some((path, error)) = scenes.iter().find_map(|path| Some((path, fs::metadata(path).err()?))) {
        fail(&mut summary, &scene_error(path, &anyhow::Error::new(error)));
        return Ok(summary);
    }
    let measurement = match from.into_iter().next() {
        Some(MachineResults { results, .. }) => {
            Measurement { results, heat_maps: Vec::new(), interrupt: None }
        }
        None => {
            match panics::catch(|| measure_all(args, &scenes, public, &settings, &mut summary)) {
                Ok(Some(measurement)) => measurement,
                // Every scene has failed, which was reported.
                Ok(None) => return Ok(summary),
                Err(error) => {
                    fail(&mut summary, &format!("{error:#}"));
                    return Ok(summary);
                }
            }
        }
    };
    if args.memory {
        summary.record(print_stdout(measurement.results.to_json().as_bytes()));
        return Ok(summary);
    }
    if args.from.is_empty() && !args.common.quiet {
        warn_of_waiting(&measurement.results);
    }
    let comparison = old.map(|old| compare(&old, &measurement.results));
    print_tables(args, &measurement.results, comparison.as_ref(), &mut summary);
    write_files(args, &measurement, comparison.as_ref(), &mut summary);
    if let Some(comparison) = &comparison {
        if comparison.changes.is_empty() && comparison.different_work.is_empty() {
            fail(&mut summary, "--compare: both runs have no measurement in common");
        }
        comparison.different_work.iter().for_each(|text| fail(&mut summary, text));
        if args.common.strict {
            fail_higher_costs(&mut summary, comparison);
        }
    }
    // Files of the finished rounds are written.
    if let Some(interrupt) = &measurement.interrupt {
        interrupt.release();
    }
    Ok(summary)
}

fn settings(args: &BenchArgs) -> Result<BenchSettings, UsageError> {
    let sizes = args.size.clone().unwrap_or_else(|| vec![DEFAULT_SIZE]);
    let threads = match &args.threads {
        Some(list) => list.iter().map(|&n| usize::from(n)).collect(),
        None => default_threads(available_processors()),
    };
    let mut unique = Vec::new();
    for n in threads {
        if !unique.contains(&n) {
            unique.push(n);
        }
    }
    Ok(BenchSettings {
        load: LoadOptions { allow_outside: args.common.allow_outside(), ..LoadOptions::default() },
        blender: args.blender.clone(),
        render: RenderSettings { samples: args.samples, ..RenderSettings::default() },
        sizes,
        rounds: args.rounds,
        min_seconds: args.min_time,
        threads: unique,
        stages: args.stages.clone().unwrap_or_else(|| BenchStage::ALL.to_vec()),
        simd: simd_level()?,
        heat_maps: args.report.is_some(),
        memory: args.memory,
        command: std::env::args_os().skip(1).map(|arg| arg.to_string_lossy().into_owned()).collect(),
    })
}

/// Warns of more threads than processors.
fn warn_of_threads(settings: &BenchSettings, args: &BenchArgs) {
    let processors = available_processors();
    let most = settings.threads.iter().copied().max().unwrap_or(1);
    if args.from.is_empty() && !args.memory && most > processors {
        let processors = plural(processors as u64, "processor");
        print_warning(&format!(
            "--threads {most}: this process has {processors}; the times of more threads say nothing about larger machines"
        ));
    }
}

/// Warns of times on several threads from which much waiting was subtracted.
fn warn_of_waiting(results: &BenchResults) {
    let stages = results.scenes.iter().flat_map(|scene| &scene.stages);
    let waited = stages.filter(|stage| stage.threads > 1).filter_map(|stage| Some((stage.waited?, stage)));
    let Some((share, stage)) = waited.max_by(|a, b| a.0.total_cmp(&b.0)) else { return };
    if share >= LARGE_WAIT {
        print_warning(&format!(
            "other programs had the processors for up to {:.0} % of the time ({}): times are without it, as if the work \
             were even on all threads, which favours several threads; measure on an idle machine or compare \
             \"wall_seconds\" of --json",
            100.0 * share,
            stage.description()
        ));
    }
}

fn available_processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Powers of two below the number of processors, and that number.
fn default_threads(processors: usize) -> Vec<usize> {
    let powers = std::iter::successors(Some(1), |n| Some(2 * n));
    powers.take_while(|n| *n < processors).chain([processors]).collect()
}

/// Reads the results of an earlier run.
fn read_results(option: &str, file: Option<&Path>) -> Result<Option<BenchResults>, UsageError> {
    file.map(BenchResults::read).transpose().map_err(|e| UsageError(worded!("`{}`: {}", option, e)))
}

/// Reads the results of --from, each labelled by the name of its file.
fn read_machines(args: &BenchArgs) -> Result<Vec<MachineResults>, UsageError> {
    let mut machines: Vec<MachineResults> = Vec::new();
    for file in &args.from {
        let results = BenchResults::read(file).map_err(|e| UsageError(format!("--from: {e}")))?;
        let name = file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let is_taken = |label: &str| machines.iter().any(|machine| machine.label == label);
        let numbered = (2..).map(|i| format!("{name} {i}"));
        let label = std::iter::once(name.clone()).chain(numbered).find(|label| !is_taken(label));
        machines.push(MachineResults { label: label.unwrap_or(name), results });
    }
    let of_one_run = [("compare", &args.compare), ("json", &args.json), ("csv", &args.csv)];
    if let Some((option, _)) = of_one_run.iter().find(|(_, file)| file.is_some() && machines.len() > 1) {
        return Err(UsageError(worded!(
            "`{}` takes the results of one run; name one file with `from`",
            option
        )));
    }
    Ok(machines)
}

/// Checks that the files of results can be written, and are none of `inputs`. The inner error is one of the file system.
fn check_outputs(args: &BenchArgs, inputs: &[PathBuf]) -> Result<Result<()>, UsageError> {
    let mut paths = PathConflicts::with_inputs(inputs);
    for (option, file) in output_files(args) {
        let Some(file) = file else { continue };
        check_extension(option, file)?;
        paths.add_output(file, Writer::Option(option)).map_err(UsageError)?;
        if is_stdout(file) {
            continue;
        }
        create_parent_folder(file)
            .map_err(|e| UsageError(worded!("`{}`: {}", option, format_args!("{e:#}"))))?;
        if let Err(error) = check_writable(file, Overwrite::Yes) {
            return Ok(Err(anyhow::Error::new(error).context(option_word(option, None))));
        }
    }
    Ok(Ok(()))
}

/// Measures all scenes. Returns `None` if all have failed.
fn measure_all(
    args: &BenchArgs,
    scenes: &[PathBuf],
    public: Option<PublicScenes>,
    settings: &BenchSettings,
    summary: &mut Summary,
) -> Result<Option<Measurement>> {
    let mut workloads: Vec<Workload> = scenes.iter().map(|path| Workload::file(path)).collect();
    workloads.extend(public.into_iter().flat_map(|public| public.workloads));
    let sizes = args.suite.as_ref().map(|sizes| sizes.as_deref().unwrap_or(&[DEFAULT_TRIANGLES]));
    for (kind, triangles) in sizes.map(standard_suite).unwrap_or_default() {
        if !args.common.quiet {
            eprint_line(&format!("generating {kind} with {triangles} triangles"));
        }
        workloads.push(Workload::generate(kind, triangles)?);
    }
    if !settings.memory {
        // A file that cannot be read fails when it is measured.
        workloads.iter_mut().for_each(|workload| workload.sha256 = sha256_of_file(&workload.file).ok());
        for line in public_scenes::changed_files(&workloads) {
            if args.common.strict {
                fail(summary, &strict_error(line).to_string());
            } else {
                print_warning(&line);
            }
        }
    }
    let CommonArgs { quiet, strict, .. } = args.common;
    let interrupt = HeldInterrupt::new();
    let mut observer = ConsoleObserver { interrupt: &interrupt, quiet, strict, rounds: settings.rounds };
    let BenchRun { mut results, measured, heat_maps, failed } = measure(settings, &workloads, &mut observer);
    if !settings.memory {
        for (scene, i) in results.scenes.iter_mut().zip(measured) {
            if !interrupt.is_interrupted() {
                memory::measure(scene, &workloads[i], settings, args);
            }
        }
    }
    for (i, error) in failed {
        let workload = &workloads[i];
        let name = if workload.is_generated() { Path::new(&workload.name) } else { &workload.file };
        fail(summary, &scene_error(name, &error.into()));
    }
    if results.scenes.is_empty() {
        interrupt.release();
        return Ok(None);
    }
    Ok(Some(Measurement { results, heat_maps, interrupt: Some(interrupt) }))
}

/// Prints tables to standard output, or to standard error if a file of results goes there.
fn print_tables(
    args: &BenchArgs,
    results: &BenchResults,
    comparison: Option<&Comparison>,
    summary: &mut Summary,
) {
    let mut text = table::results(results);
    text += &comparison.map(table::comparison).unwrap_or_default();
    print(args, &text, summary);
}

/// Writes the files of results.
fn write_files(
    args: &BenchArgs,
    measurement: &Measurement,
    comparison: Option<&Comparison>,
    summary: &mut Summary,
) {
    let Measurement { results, heat_maps, .. } = measurement;
    write(summary, args, args.json.as_deref(), || results.to_json());
    write(summary, args, args.csv.as_deref(), || results_csv(results));
    write(summary, args, args.report.as_deref(), || report_page(results, heat_maps, comparison));
    write(summary, args, args.markdown.as_deref(), || {
        let machine = MachineResults { label: results.machine.cpu.clone(), results: results.clone() };
        let mut tables = result_tables(&[machine]);
        tables.extend(comparison.map(comparison_table));
        machines::markdown(&tables)
    });
}

/// With --strict, any higher cost is an error.
fn fail_higher_costs(summary: &mut Summary, comparison: &Comparison) {
    for change in comparison.significant().filter(|change| change.verdict == Verdict::More) {
        let text = format!("{}: {} is {:.2}× the earlier value", change.scene, change.metric, change.ratio);
        fail(summary, &strict_error(text).to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_threads_double_up_to_all_processors() {
        assert_eq!(default_threads(1), [1]);
        assert_eq!(default_threads(2), [1, 2]);
        assert_eq!(default_threads(6), [1, 2, 4, 6]);
        assert_eq!(default_threads(8), [1, 2, 4, 8]);
    }
}
