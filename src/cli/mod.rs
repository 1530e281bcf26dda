//! The program: words on the command line to plans, plans to files.

mod args;
mod assemble;
mod info;
mod job;
mod progress;
mod render;
mod sequence;
mod signals;
mod values;

use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use args::{Cli, Command};

/// Everything was done.
const DONE: u8 = 0;
/// Something failed; the rest was done.
const FAILED: u8 = 1;
/// The command line is wrong.
const USAGE: u8 = 2;

/// Runs the program and returns what it exits with: 0 all done, 1 something failed, 2 the command
/// line is wrong, 130 or 143 interrupted or terminated.
pub fn run() -> ExitCode {
    signals::watch();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            let asked = matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
            // A closed pipe is no error: `blinn --help | head -1`.
            let _ = e.print();
            return ExitCode::from(if asked { DONE } else { USAGE });
        }
    };
    let outcome = match &cli.command {
        Command::Render(args) => render::run(args),
        Command::Assemble(args) => assemble::run(args),
        Command::Info(args) => info::run(args),
    };
    match outcome {
        Ok(Summary { failed: 0, .. }) => ExitCode::from(DONE),
        Ok(summary) => {
            summary.report();
            ExitCode::from(FAILED)
        }
        Err(Usage(line)) => {
            eprintln!("blinn: {line}");
            ExitCode::from(USAGE)
        }
    }
}

/// A command line that makes no sense, in one line.
#[derive(Debug)]
struct Usage(String);

/// What became of the scenes.
#[derive(Debug, Default)]
struct Summary {
    scenes: usize,
    failed: usize,
}

impl Summary {
    /// Notes a scene's outcome; a failure is told at once, in one line.
    fn add(&mut self, scene: &std::path::Path, outcome: anyhow::Result<()>) {
        self.scenes += 1;
        if let Err(e) = outcome {
            self.failed += 1;
            eprintln!("blinn: {}", one_line(&describe(scene, &e)));
        }
    }

    fn report(&self) {
        if self.scenes > 1 {
            eprintln!("blinn: {} of {} scenes failed", self.failed, self.scenes);
        }
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
