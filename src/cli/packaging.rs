//! What packagers ask for: completions for shells, pages for `man`.

use std::io::Write;

use super::args::{CompletionsArgs, ManArgs};
use super::{Summary, Usage, help};

/// `blinn completions SHELL`.
pub(super) fn completions(args: &CompletionsArgs) -> Result<Summary, Usage> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut help::full(), "blinn", &mut text);
    print(&text)
}

/// `blinn man [COMMAND]`.
pub(super) fn man(args: &ManArgs) -> Result<Summary, Usage> {
    let mut cli = help::full();
    cli.build();
    let command = match &args.command {
        None => &cli,
        Some(name) => cli
            .find_subcommand(name)
            .ok_or_else(|| Usage(format!("there is no command '{name}' to make a page of")))?,
    };
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(command.clone()).source(concat!("blinn ", env!("CARGO_PKG_VERSION")));
    page.render(&mut text).map_err(|e| Usage(e.to_string()))?;
    print(&text)
}

fn print(text: &[u8]) -> Result<Summary, Usage> {
    // A closed pipe is no error.
    let _ = std::io::stdout().lock().write_all(text);
    Ok(Summary::default())
}
