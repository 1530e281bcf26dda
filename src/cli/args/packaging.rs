//! Arguments of `blinn completions` and `blinn man`.

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Shell
    #[arg(value_enum)]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct ManArgs {
    /// Command, such as render or job slurm [default: blinn itself]
    #[arg(value_name = "COMMAND")]
    pub command: Vec<String>,
}
