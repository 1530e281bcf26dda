//! `blinn completions` and `blinn man`.

use super::args::command_tree::find_command;
use super::args::help;
use super::args::{CompletionsArgs, ManArgs};
use super::console::print_stdout;
use super::summary::Summary;
use super::usage::UsageError;

/// Prints completions for a shell.
pub fn completions(args: &CompletionsArgs) -> Result<Summary, UsageError> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut help::full(), "blinn", &mut text);
    Ok(Summary::of_output(print_stdout(&text)))
}

/// Prints a man page.
pub fn man(args: &ManArgs) -> Result<Summary, UsageError> {
    // Pages refer to the pages of their subcommands, and `help` has none.
    let mut root = help::full().disable_help_subcommand(true);
    root.build();
    let names: Vec<&str> = args.command.iter().map(String::as_str).collect();
    let command = find_command(&root, &names)
        .ok_or_else(|| UsageError(format!("unknown command '{}': see blinn --help", names.join(" "))))?;
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(command.clone()).source(concat!("blinn ", env!("CARGO_PKG_VERSION")));
    page.render(&mut text).map_err(|error| UsageError(error.to_string()))?;
    let page = refer_to_render_pages(&String::from_utf8_lossy(&text));
    Ok(Summary::of_output(print_stdout(page.as_bytes())))
}

/// Replaces references to `blinn job ENGINE render` by `blinn render`: both have the same options and one page.
fn refer_to_render_pages(page: &str) -> String {
    let mut page = page.to_string();
    for engine in ["openjd", "slurm"] {
        for command in ["render", "turntable"] {
            let job_page = format!("blinn\\-job\\-{engine}\\-{command}(1)");
            page = page.replace(&job_page, &format!("blinn\\-{command}(1)"));
        }
    }
    page
}
