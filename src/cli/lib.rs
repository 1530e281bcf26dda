//! The command line program: parses arguments, resolves them into a plan, executes it and returns an exit code.
#![deny(unsafe_code)]

mod args;
mod bench;
mod console;
mod diff;
pub mod embed;
mod exporters;
mod farm;
mod file_cameras;
mod files;
mod info;
mod light_sources;
mod material_info;
mod material_layers;
mod message_style;
mod option_words;
mod packaging;
mod pager;
mod part_info;
mod plan;
mod plural;
mod rays;
mod run;
mod scene_file;
mod sheet;
mod summary;
mod usage;
mod view;
mod warning_filter;
mod watched_files;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Context;
use clap::error::ErrorKind;
use clap::{ColorChoice, FromArgMatches};

use args::{Cli, ColorArg, Command};
use blinn_core::option_words::set_option_word;
use run::{panics, runtime};
use summary::{EXIT_FAILURE, Summary};
use usage::{EXIT_USAGE, UsageError};

/// Runs the program with the arguments of this process.
///
/// Exit codes: 0 success, 1 something failed, 2 wrong command line, 129, 130 or 143 after SIGHUP, SIGINT or SIGTERM.
pub fn run() -> ExitCode {
    set_option_word(option_words::flag);
    ExitCode::from(run_arguments(std::env::args_os().collect(), Host::Program))
}

/// The process that runs the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Host {
    /// The program. It may execute itself again.
    Program,
    /// Another program, such as Python.
    Other,
}

fn run_arguments(argv: Vec<OsString>, host: Host) -> u8 {
    panics::install_hook();
    panics::catch(|| Ok(execute(argv, host))).unwrap_or_else(|error| {
        console::print_error(&error.to_string());
        EXIT_FAILURE
    })
}

fn execute(argv: Vec<OsString>, host: Host) -> u8 {
    let command_line = args::argv::join_values(argv);
    message_style::set_color(args::argv::color(&command_line));
    if args::argv::asks_for_version(&command_line) {
        let version = concat!("blinn ", env!("CARGO_PKG_VERSION"), "\n");
        return Summary::of_output(console::print_stdout(version.as_bytes())).exit();
    }
    let argv = match args::config::merge_file(command_line.clone()) {
        Ok(argv) => argv,
        Err(error) => return error.exit(&command_line),
    };
    // The file may set it.
    message_style::set_color(args::argv::color(&argv));
    let color = match message_style::color() {
        ColorArg::Auto => ColorChoice::Auto,
        ColorArg::Always => ColorChoice::Always,
        ColorArg::Never => ColorChoice::Never,
    };
    let matches = args::help::command(&argv).color(color).try_get_matches_from(&argv);
    let cli = match matches.and_then(|mut matches| Cli::from_arg_matches_mut(&mut matches)) {
        Ok(cli) => cli,
        Err(error) => return exit_for_clap_error(&error, &argv, &command_line),
    };
    match execute_command(&cli.command, &argv, host) {
        Ok(summary) => summary.exit(),
        Err(error) => error.exit(&argv),
    }
}

fn execute_command(command: &Command, argv: &[OsString], host: Host) -> Result<Summary, UsageError> {
    if command.process().is_some_and(|process| process.print_config) {
        let settings = args::config::print(argv)?;
        return Ok(Summary::of_output(console::print_stdout(settings.as_bytes())));
    }
    // Commands that render start the runtime themselves, after `run::malloc_tuning`, with --threads.
    let starts_runtime = matches!(
        command,
        Command::Render(_) | Command::Turntable(_) | Command::View(_) | Command::Sheet(_) | Command::Diff(_)
    );
    if !starts_runtime {
        let started = runtime::start(None);
        if started.is_err() {
            return Ok(Summary::of_output(started));
        }
    }
    let restart_argv = (host == Host::Program).then_some(argv);
    match command {
        Command::Render(args) => run::render::render(args, restart_argv),
        Command::Turntable(args) => run::render::turntable(args, restart_argv),
        Command::View(args) => view::run(args, argv),
        Command::Sheet(args) => sheet::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Assemble(args) => run::assemble::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Rays(args) => rays::run(args),
        Command::Completions(args) => packaging::completions(args),
        Command::Man(args) => packaging::man(args),
        Command::Job(args) => farm::run(args, argv),
    }
}

/// Prints help or version, or reports a wrong command line.
fn exit_for_clap_error(error: &clap::Error, argv: &[OsString], command_line: &[OsString]) -> u8 {
    match error.kind() {
        ErrorKind::DisplayHelp if args::help::is_long(argv) => {
            let help = match message_style::color() {
                ColorArg::Never => error.render().to_string(),
                ColorArg::Auto | ColorArg::Always => error.render().ansi().to_string(),
            };
            match pager::show(&help) {
                Ok(false) => Summary::of_output(console::finish_stdout(error.print())).exit(),
                shown => Summary::of_output(shown.map(drop).context("the pager failed")).exit(),
            }
        }
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            Summary::of_output(console::finish_stdout(error.print())).exit()
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // clap prints this help to standard error.
            let _ = error.print();
            EXIT_USAGE
        }
        _ => UsageError(args::usage_error::message(error, argv, command_line)).exit(argv),
    }
}
