//! Options of comparisons of pictures.

use clap::Args;

use super::values;

/// Options of comparisons of pictures.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Comparison")]
pub struct CompareArgs {
    /// Largest difference of a pixel that counts as equal, in values of 0 to 1 as displayed, or in the values of an .exr
    /// or .hdr [default: 0]
    #[arg(long, value_name = "T", value_parser = values::tolerance)]
    pub tolerance: Option<f32>,
    /// Compare by the FLIP error, from 0 to 1: how visible a difference is when the pictures alternate
    #[arg(long)]
    pub flip: bool,
}
