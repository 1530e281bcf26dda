//! The words of `blinn completions` and `blinn man`.

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell that reads them
    #[arg(value_enum)]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct ManArgs {
    /// The command that the page is about, such as render or job slurm [default: blinn itself]
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
}
