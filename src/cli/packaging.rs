//! What packagers ask for: completions for shells, pages for `man`.

use super::args::{CompletionsArgs, ManArgs};
use super::{Summary, Usage, console};
use crate::cli::args::config::command_at;
use crate::cli::args::help;

/// `blinn completions SHELL`.
pub(super) fn completions(args: &CompletionsArgs) -> Result<Summary, Usage> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut help::full(), "blinn", &mut text);
    Ok(Summary::of_printing(console::print(&text)))
}

/// `blinn man [COMMAND…]`.
pub(super) fn man(args: &ManArgs) -> Result<Summary, Usage> {
    // Pages name the pages of what is below a command, and there is none of `help`.
    let mut cli = help::full().disable_help_subcommand(true);
    cli.build();
    let names: Vec<&str> = args.command.iter().map(String::as_str).collect();
    let command = command_at(&cli, &names)
        .ok_or_else(|| Usage(format!("there is no command '{}' to make a page of", names.join(" "))))?;
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(command.clone()).source(concat!("blinn ", env!("CARGO_PKG_VERSION")));
    page.render(&mut text).map_err(|e| Usage(e.to_string()))?;
    let page = frames_of_jobs(&String::from_utf8_lossy(&text));
    Ok(Summary::of_printing(console::print(page.as_bytes())))
}

/// What a job renders has the words of the command of that name, and its page.
fn frames_of_jobs(page: &str) -> String {
    let mut page = page.to_string();
    for engine in ["openjd", "slurm"] {
        for frames in ["render", "turntable"] {
            let of_job = format!("blinn\\-job\\-{engine}\\-{frames}(1)");
            page = page.replace(&of_job, &format!("blinn\\-{frames}(1)"));
        }
    }
    page
}
