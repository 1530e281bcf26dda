//! Arguments of `blinn bench`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::process::CommonArgs;
use super::values;
use blinn_bench::BenchStage;

/// Widths and heights of images in pixels. An alias, so that clap takes the list for one value.
type Sizes = Vec<(u32, u32)>;

/// Numbers of threads. An alias for the same reason.
type ThreadCounts = Vec<u16>;

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Scene files: .gltf, .glb, .obj, .stl, .ply or .blend
    #[arg(value_name = "SCENE", help_heading = "Scene")]
    pub scenes: Vec<PathBuf>,
    /// Program that converts .blend files: Blender 4.2 or later, or a Python with the module bpy [default:
    /// $BLINN_BLENDER, or the newest on PATH]
    #[arg(long, value_name = "PATH", help_heading = "Scene")]
    pub blender: Option<PathBuf>,
    /// Measure all standard scenes, with each number of triangles in SIZES, such as 70k or 10k,70k,1.1m [default
    /// SIZES: 70k]
    #[arg(long, value_name = "SIZES", num_args = 0..=1, require_equals = true, help_heading = "Scene",
          value_parser = values::triangle_counts)]
    pub suite: Option<Option<Vec<usize>>>,
    /// Measure the public scenes whose files are in DIR, each from three cameras, and list those that are missing with
    /// their sources. DIR/manifest.toml may add scenes
    #[arg(long = "scenes", value_name = "DIR", help_heading = "Scene")]
    pub scene_folder: Option<PathBuf>,
    /// Read the results of an earlier run instead of measuring, or those of several machines to show side by side
    #[arg(long, value_name = "FILE.json", num_args = 1.., help_heading = "Scene",
          conflicts_with_all = ["scenes", "suite", "scene_folder", "size", "samples", "rounds", "min_time", "threads",
                                "stages"])]
    pub from: Vec<PathBuf>,
    /// Read files of `blinn render --trace` of one command instead of measuring, one of them with --threads 1, and print
    /// its work, its critical path and the speed-up that more cores could give
    #[arg(long, value_name = "FILE.json", num_args = 1.., help_heading = "Scene",
          conflicts_with_all = ["scenes", "suite", "scene_folder", "from", "compare", "size", "samples", "rounds",
                                "min_time", "threads", "stages"])]
    pub trace_bound: Vec<PathBuf>,
    /// Write all results as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub json: Option<PathBuf>,
    /// Write an HTML page with plots and tables
    #[arg(long, value_name = "FILE.html", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Write tables in Markdown
    #[arg(long, value_name = "FILE.md", help_heading = "Output")]
    pub markdown: Option<PathBuf>,
    /// Write a line of comma-separated values for each stage, with the speed-up over one thread; with --trace-bound, for
    /// each figure
    #[arg(long, value_name = "FILE.csv", help_heading = "Output")]
    pub csv: Option<PathBuf>,
    /// Print what changed since an earlier run by more than the noise of both; with --strict, any higher cost is an
    /// error
    #[arg(long, value_name = "OLD.json", help_heading = "Output")]
    pub compare: Option<PathBuf>,
    /// Width and height of images in pixels, one eye ray per pixel; or several, such as 480x270,1920x1080
    /// [default: 640x360]
    #[arg(long, value_name = "SIZES", value_parser = values::sizes, help_heading = "Measuring")]
    pub size: Option<Sizes>,
    /// Samples per pixel of whole frames
    #[arg(short, long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65536),
          help_heading = "Measuring")]
    pub samples: u32,
    /// Number of rounds over all scenes
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000),
          help_heading = "Measuring")]
    pub rounds: u32,
    /// Repeat each stage for at least this many seconds in each round
    #[arg(long, value_name = "SECONDS", default_value_t = 0.2, value_parser = values::positive, help_heading = "Measuring")]
    pub min_time: f64,
    /// Thread counts to measure, such as 1,2,4-8 [default: 1, 2, 4 and so on up to the processors available to this process]
    #[arg(long, value_name = "LIST", help_heading = "Measuring", value_parser = values::thread_counts)]
    pub threads: Option<ThreadCounts>,
    /// Stages to measure, such as eye,shadow,frame; the others run only where these need their results [default: all]
    ///
    /// Rays are traced at the SIMD level that the environment variable BLINN_SIMD names: portable, avx2 or avx512.
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Measuring",
          value_parser = PossibleValuesParser::new(BenchStage::ALL.map(stage_value)).map(|name| stage(&name)))]
    pub stages: Option<Vec<BenchStage>>,
    /// Run everything once and print the peak memory as JSON: run by `blinn bench` as a child process
    #[arg(long, hide = true, conflicts_with_all = ["suite", "from", "trace_bound", "json", "report", "markdown", "csv", "compare"])]
    pub memory: bool,
    /// Measure only the scene of --scenes with this name: run by `blinn bench` as a child process
    #[arg(long, value_name = "NAME", hide = true, requires = "scene_folder")]
    pub only_scene: Option<String>,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The name of a stage, with the names that other programs have for it.
fn stage_value(stage: BenchStage) -> PossibleValue {
    PossibleValue::new(stage.name()).aliases(aliases(stage))
}

fn aliases(stage: BenchStage) -> &'static [&'static str] {
    match stage {
        BenchStage::Eye => &["primary", "camera"],
        BenchStage::AmbientOcclusion => &["ambient-occlusion"],
        BenchStage::Reflection => &["reflections"],
        BenchStage::Bounce1 => &["diffuse", "bounce"],
        _ => &[],
    }
}

/// The stage of a name or an alias. The parser has checked it.
fn stage(name: &str) -> BenchStage {
    let is_named = |stage: &BenchStage| {
        let mut names = aliases(*stage).iter().copied().chain([stage.name()]);
        names.any(|known| known.eq_ignore_ascii_case(name))
    };
    BenchStage::ALL.into_iter().find(is_named).unwrap_or(BenchStage::Load)
}
