//! Compares the scenes in two folders, several pairs at once.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::{Value, json};

use super::folder_pairs::{FolderScene, pair_scenes};
use super::page_names::PageNames;
use super::pair_job::{PairJob, PairReport};
use super::plan;
use crate::args::DiffArgs;
use crate::console::{scene_error, single_line};
use crate::files::with_slashes;
use crate::plan::{PathConflicts, RenderPlan, SceneList, Writer, scene_list};
use crate::plural::plural;
use crate::run::batch::is_queue_full;
use crate::run::progress::{Reporter, SceneLog};
use crate::run::runtime;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_session::{Finished, Scheduler, run_scheduled};

/// Two scene files of the same name.
struct ScenePair {
    old: PathBuf,
    new: PathBuf,
    page: Option<PathBuf>,
}

/// Compares the scenes in the folders `old` and `new`. A pair that fails does not affect the others.
///
/// # Errors
/// A wrong command line, a folder without scenes, a pair that failed, and standard output that cannot be written.
pub fn run(args: &DiffArgs, folders: [&Path; 2]) -> Result<Summary, UsageError> {
    let names = args.output.as_deref().map(PageNames::new).transpose()?;
    let [old_list, new_list] = folders.map(|folder| scene_list(&[folder.to_path_buf()]));
    let lists = [old_list?, new_list?];
    let scenes = pair_scenes(relative_paths(&lists[0], folders[0])?, relative_paths(&lists[1], folders[1])?);
    let pairs = scene_pairs(&scenes, folders, names.as_ref());
    check_pages(&pairs, &lists)?;
    let mut plan = plan(args, &lists[0].first()?)?;
    let process = &args.preview.process;
    runtime::start(process.threads).map_err(failure)?;
    plan.read_files()?;
    let reporter = Reporter::new(&process.log, pairs.len(), args.preview.common.quiet);
    for (folder, text) in lists.iter().flat_map(SceneList::left_out) {
        reporter.warn(folder, &text);
    }
    let mut report = FolderReport {
        folders,
        reporter: &reporter,
        json: args.json.then(Vec::new),
        equal: 0,
        different: 0,
        failed: 0,
        only: [0; 2],
    };
    let waiting = pairs.iter().enumerate().map(|(i, pair)| job(args, &plan, &reporter, i + 1, pair));
    run_scheduled(plan.session.capacity(), |jobs| compare_pairs(jobs, waiting, &scenes, &mut report))
        .map_err(failure)?;
    report.finish()
}

fn failure(error: anyhow::Error) -> UsageError {
    UsageError(single_line(&format!("{error:#}")))
}

fn relative_paths(list: &SceneList, folder: &Path) -> Result<Vec<PathBuf>, UsageError> {
    list.iter()
        .map(|path| path.map(|path| path.strip_prefix(folder).map(Path::to_path_buf).unwrap_or(path)))
        .collect()
}

/// The files of each pair, and the page that is written about it.
fn scene_pairs(scenes: &[FolderScene], folders: [&Path; 2], names: Option<&PageNames>) -> Vec<ScenePair> {
    let both = scenes.iter().filter_map(|scene| match scene {
        FolderScene::Pair { old, new } => Some((old, new)),
        FolderScene::OnlyOld(_) | FolderScene::OnlyNew(_) => None,
    });
    let pair = |(i, (name, new)): (usize, (&PathBuf, &PathBuf))| {
        let old = folders[0].join(name);
        let page = names.map(|names| names.page(&old, name, i + 1));
        ScenePair { old, new: folders[1].join(new), page }
    };
    both.enumerate().map(pair).collect()
}

/// Checks that no page has the name of another one or of an input.
fn check_pages(pairs: &[ScenePair], lists: &[SceneList; 2]) -> Result<(), UsageError> {
    let mut inputs = Vec::new();
    for list in lists {
        inputs.extend(list.to_vec()?);
    }
    let mut paths = PathConflicts::with_inputs(inputs);
    for pair in pairs {
        if let Some(page) = &pair.page {
            paths.add_output(page, Writer::Scene(&pair.old)).map_err(UsageError)?;
        }
    }
    Ok(())
}

/// The job of the pair of a number.
fn job<'a>(
    args: &'a DiffArgs,
    plan: &'a RenderPlan,
    reporter: &'a Reporter,
    number: usize,
    pair: &'a ScenePair,
) -> PairJob<'a> {
    let log = |file: &Path| SceneLog::of_batch(reporter, number, file, plan.strict);
    PairJob {
        args,
        plan,
        old: &pair.old,
        new: &pair.new,
        page: pair.page.clone(),
        logs: [log(&pair.old), log(&pair.new)],
        cancel: CancelToken::new(),
    }
}

/// Compares the pairs, and reports all scenes in their order.
fn compare_pairs<'a: 'scope, 'scope>(
    jobs: &mut Scheduler<'_, 'scope, PairJob<'a>>,
    mut waiting: impl Iterator<Item = PairJob<'a>>,
    scenes: &[FolderScene],
    report: &mut FolderReport,
) -> Result<()> {
    for scene in scenes {
        match scene {
            FolderScene::Pair { old, new } => {
                while !is_queue_full(jobs)
                    && let Some(job) = waiting.next()
                {
                    jobs.push(job);
                }
                let Some(finished) = jobs.next_finished() else { break };
                report.add_pair([old, new], finished)?;
            }
            FolderScene::OnlyOld(name) => report.add_only(0, name)?,
            FolderScene::OnlyNew(name) => report.add_only(1, name)?,
        }
    }
    Ok(())
}

/// Results so far: lines on standard output, or elements of one JSON array.
struct FolderReport<'a> {
    folders: [&'a Path; 2],
    reporter: &'a Reporter,
    /// The results for --json.
    json: Option<Vec<Value>>,
    equal: u64,
    different: u64,
    failed: u64,
    /// Scenes that only the old or the new folder has.
    only: [u64; 2],
}

impl FolderReport<'_> {
    /// Reports a pair by its paths relative to the folders.
    fn add_pair(&mut self, names: [&Path; 2], finished: Finished<PairJob>) -> Result<()> {
        let Finished { job, output, .. } = finished;
        job.logs[0].scene_done();
        job.logs.iter().for_each(|log| drop(log.finish()));
        let [old, new] = names.map(|name| single_line(&with_slashes(name)));
        let name = if old == new { old } else { format!("{old} and {new}") };
        let (line, value) = match output {
            Ok(PairReport { is_different: false, json, .. }) => {
                self.equal += 1;
                (format!("equal: {name}"), json)
            }
            Ok(PairReport { summary, json, .. }) => {
                self.different += 1;
                (format!("different: {name}: {summary}"), json)
            }
            Err(error) => {
                self.failed += 1;
                let is_of_new = format!("{error:#}").contains(&*job.new.to_string_lossy());
                let file = if is_of_new { job.new } else { job.old };
                let error = single_line(&scene_error(file, &error));
                self.reporter.fail(Some(file), &error);
                let [old, new] = [job.old, job.new].map(Path::to_string_lossy);
                (format!("failed: {name}"), Some(json!({"old": old, "new": new, "error": error})))
            }
        };
        self.add(&line, value)
    }

    /// Reports a scene that only one folder has: the old one has the index 0, the new one 1.
    fn add_only(&mut self, index: usize, name: &Path) -> Result<()> {
        self.only[index] += 1;
        let folder = self.folders[index];
        let path = folder.join(name);
        let [old, new] = [0, 1].map(|i| (i == index).then(|| path.to_string_lossy()));
        let line = format!("only in {}: {}", folder.display(), single_line(&with_slashes(name)));
        self.add(&line, Some(json!({"old": old, "new": new, "equal": false})))
    }

    fn add(&mut self, line: &str, value: Option<Value>) -> Result<()> {
        match &mut self.json {
            Some(values) => values.extend(value),
            None => self.reporter.print(format!("{line}\n").as_bytes())?,
        }
        Ok(())
    }

    /// Prints the totals or the JSON array.
    fn finish(mut self) -> Result<Summary, UsageError> {
        let text = match self.json.take() {
            Some(values) => format!("{:#}\n", Value::Array(values)),
            None => self.totals(),
        };
        self.reporter.print(text.as_bytes()).map_err(failure)?;
        if self.failed > 0 {
            let pairs = plural(self.equal + self.different + self.failed, "pair");
            return Err(UsageError(format!("{} of {pairs} could not be compared", self.failed)));
        }
        let is_different = self.different > 0 || self.only != [0; 2];
        Ok(Summary { is_different, ..Summary::default() })
    }

    /// A line with all counts.
    fn totals(&self) -> String {
        let pairs = plural(self.equal + self.different + self.failed, "pair");
        let only = |index: usize| format!("only in {}", self.folders[index].display());
        let counts = [
            (self.equal, "equal".to_string()),
            (self.different, "different".into()),
            (self.failed, "failed".into()),
            (self.only[0], only(0)),
            (self.only[1], only(1)),
        ];
        let parts = counts.into_iter().filter(|(count, _)| *count > 0);
        let parts: Vec<String> = parts.map(|(count, what)| format!("{count} {what}")).collect();
        format!("{pairs}: {}\n", parts.join(", "))
    }
}
