//! Options of `blinn render` that compare images with golden ones.

use std::path::PathBuf;

use clap::Args;

use super::compare::CompareArgs;
use super::values;

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Comparison")]
pub struct CheckArgs {
    /// Compare each image with the golden one of the same name in FOLDER; those that differ fail, with a page beside them
    #[arg(long, value_name = "FOLDER")]
    pub check: Option<PathBuf>,
    /// Write the images to the folder of --check as the golden ones
    #[arg(long, requires = "check", conflicts_with_all = ["tolerance", "flip"])]
    pub bless: bool,
    /// Largest difference of a pixel that --check accepts, in values of 0 to 1 as displayed, or in the values of an .exr
    /// [default: 0]
    #[arg(long, value_name = "T", requires = "check", value_parser = values::tolerance)]
    pub tolerance: Option<f32>,
    /// Compare by the FLIP error, from 0 to 1: how visible a difference is when the pictures alternate
    #[arg(long, requires = "check")]
    pub flip: bool,
}

impl CheckArgs {
    /// How images are compared.
    pub fn compare(&self) -> CompareArgs {
        CompareArgs { tolerance: self.tolerance, flip: self.flip }
    }
}
