//! The words of `blinn bench`.

use std::path::PathBuf;

use clap::Args;

use super::CommonArgs;
use crate::cli::args::{argv, values};

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Scene files: .gltf, .glb or .obj
    #[arg(required_unless_present_any = ["suite", "from"], value_name = "SCENE", help_heading = "Scene")]
    pub scenes: Vec<PathBuf>,
    /// Measures the standard scenes too: all kinds, with as many triangles as each SIZE says, such as
    /// 70k or 10k,70k,1.1m [default SIZE: 70k]
    #[arg(long, value_name = "SIZES", num_args = 0..=1, require_equals = true, help_heading = "Scene",
          value_parser = argv::sizes)]
    pub suite: Option<Option<Vec<usize>>>,
    /// Takes the figures of an earlier run, and measures nothing
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["scenes", "suite"], help_heading = "Scene")]
    pub from: Option<PathBuf>,
    /// Writes all figures
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub json: Option<PathBuf>,
    /// Writes a page of plots and tables
    #[arg(long, value_name = "FILE.html", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Tells what moved since an earlier run, beyond the noise of both; with --strict, more of anything is
    /// an error
    #[arg(long, value_name = "OLD.json", help_heading = "Output")]
    pub compare: Option<PathBuf>,
    /// Width and height of pictures in pixels, of which each is an eye ray [default: 640x360]
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "Measuring")]
    pub size: Option<(u32, u32)>,
    /// Samples for each pixel of whole frames
    #[arg(short, long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65536),
          help_heading = "Measuring")]
    pub samples: u32,
    /// Rounds over all scenes
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000),
          help_heading = "Measuring")]
    pub rounds: u32,
    /// Numbers of threads [default: 1, 2, 4 and so on, and all processors that this process may use]
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Measuring",
          value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<Vec<u16>>,
    /// Does everything once and writes the memory that it took as JSON to standard output: what a bench
    /// asks of processes of its own
    #[arg(long, hide = true, conflicts_with_all = ["suite", "from", "json", "report", "compare"])]
    pub memory: bool,
    #[command(flatten)]
    pub common: CommonArgs,
}
