//! The program: words on the command line to plans, plans to files.

mod args;
mod bench;
mod console;
mod farm;
mod info;
mod packaging;
mod plan;
mod run;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::FromArgMatches;
use clap::error::ErrorKind;

use args::{Cli, Command};
use console::tell;

/// Everything was done.
const DONE: u8 = 0;
/// Something failed; the rest was done.
const FAILED: u8 = 1;
/// The command line is wrong.
const USAGE: u8 = 2;

/// Runs the program and returns what it exits with: 0 all done, 1 something failed, 2 the command
/// line is wrong, 129, 130 or 143 hung up, interrupted or terminated.
pub fn run() -> ExitCode {
    run::panics::keep_quiet();
    run::panics::caught(|| Ok(carry_out())).unwrap_or_else(|e| {
        tell(&format!("blinn: {}", one_line(&e.to_string())));
        ExitCode::from(FAILED)
    })
}

fn carry_out() -> ExitCode {
    let given = args::argv::join_lists(std::env::args_os());
    let words = match args::config::with_file(given.clone()) {
        Ok(words) => words,
        Err(usage) => return usage.exit(&given),
    };
    let parsed = args::help::command_line(&words).try_get_matches_from(&words);
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(e) => return instead_of_work(&e, &words, &given),
    };
    if cli.command.process().is_some_and(|process| process.print_config) {
        let settings = match args::config::print(&words) {
            Ok(settings) => settings,
            Err(usage) => return usage.exit(&words),
        };
        return Summary::of_printing(console::print(settings.as_bytes())).exit();
    }
    // What renders sets out by itself, once it knows with how many threads.
    if !matches!(cli.command, Command::Render(_) | Command::Turntable(_))
        && let Err(e) = set_out(None)
    {
        tell(&format!("blinn: {e}"));
        return ExitCode::from(FAILED);
    }
    let outcome = match &cli.command {
        Command::Render(args) => run::render::render(args, &words),
        Command::Turntable(args) => run::render::turntable(args, &words),
        Command::Assemble(args) => run::assemble::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Completions(args) => packaging::completions(args),
        Command::Man(args) => packaging::man(args),
        Command::Job(args) => farm::run(args, &words),
    };
    match outcome {
        Ok(summary) => summary.exit(),
        Err(usage) => usage.exit(&words),
    }
}

/// Readies the process for work: signals are watched for, and so many threads wait, or one for each processor.
fn set_out(threads: Option<u16>) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    let started = run::signals::watch().map_err(|e| e.to_string());
    started.and_then(|()| pool.build_global().map_err(|e| e.to_string())).map_err(|e| {
        let remedy = "let this user have more processes (ulimit -u), or take fewer --threads";
        anyhow::anyhow!("no thread could be started: {e}: {remedy}")
    })
}

/// What was asked for instead of work, or what is wrong with how it was asked for.
fn instead_of_work(found: &clap::Error, words: &[OsString], given: &[OsString]) -> ExitCode {
    match found.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            Summary::of_printing(console::printed(found.print())).exit()
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // It goes to standard error.
            let _ = found.print();
            ExitCode::from(USAGE)
        }
        _ => Usage(args::usage_error::one_line(found, words, given)).exit(words),
    }
}

/// A command line that makes no sense, in one line.
#[derive(Debug)]
struct Usage(String);

impl Usage {
    /// Tells what is wrong with `words`.
    fn exit(self, words: &[OsString]) -> ExitCode {
        let line = one_line(&self.0);
        if run::progress::is_for_openjd(words) {
            tell(&format!("openjd_fail: {line}"));
        }
        tell(&format!("blinn: {line}"));
        ExitCode::from(USAGE)
    }
}

/// What became of the scenes.
#[derive(Debug, Default)]
struct Summary {
    scenes: usize,
    /// Scenes that were not begun.
    left: usize,
    /// What went wrong, in a line for each scene.
    failed: Vec<String>,
    /// Whether anything else went wrong, of which was told.
    otherwise: bool,
}

impl Summary {
    /// Notes a scene's outcome: what went wrong, in one line that was told.
    fn add(&mut self, failure: Option<String>) {
        self.scenes += 1;
        self.failed.extend(failure);
    }

    /// Of nothing but what was printed.
    fn of_printing(printed: anyhow::Result<()>) -> Summary {
        let mut summary = Summary::default();
        summary.note(printed);
        summary
    }

    /// Notes an outcome that is of no scene, and tells of it where it is a failure.
    fn note(&mut self, outcome: anyhow::Result<()>) {
        if let Err(e) = outcome {
            self.otherwise = true;
            tell(&format!("blinn: {}", one_line(&format!("{e:#}"))));
        }
    }

    /// What the program exits with. Tells of all failures once more, where they may have scrolled away.
    fn exit(self) -> ExitCode {
        let all = self.scenes + self.left;
        if all > 1 && !self.failed.is_empty() {
            let left = if self.left > 0 { format!(", {} were not begun", self.left) } else { String::new() };
            tell(&format!("blinn: {} of {all} scenes failed{left}:", self.failed.len()));
            self.failed.iter().for_each(|line| tell(&format!("blinn:   {line}")));
        }
        ExitCode::from(self.code())
    }

    fn code(&self) -> u8 {
        if self.failed.is_empty() && !self.otherwise { DONE } else { FAILED }
    }
}

/// An error with its causes, headed by the scene unless it names a file itself.
fn describe(scene: &std::path::Path, error: &anyhow::Error) -> String {
    let text = format!("{error:#}");
    let name = scene.display().to_string();
    if text.contains(&name) { text } else { format!("{name}: {text}") }
}

/// Text without line breaks and control characters, for one line of standard error.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
