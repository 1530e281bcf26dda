//! Arguments of `blinn rays`.

use std::path::PathBuf;

use clap::Args;

use super::process::CommonArgs;
use super::values;
use blinn_bench::BenchStage;

#[derive(Debug, Args)]
pub struct RaysArgs {
    /// Scene file: .gltf, .glb, .obj, .stl, .ply or .blend
    #[arg(value_name = "SCENE", help_heading = "Scene")]
    pub scene: PathBuf,
    /// Program that converts .blend files: Blender 4.2 or later, or a Python with the module bpy [default:
    /// $BLINN_BLENDER, or the newest on PATH]
    #[arg(long, value_name = "PATH", help_heading = "Scene")]
    pub blender: Option<PathBuf>,
    /// Write the rays and their hits as an uncompressed NumPy archive
    #[arg(long, value_name = "FILE.npz", help_heading = "Output")]
    pub dump: PathBuf,
    /// Kinds of rays: eye, shadow, sun, ao, reflection, bounce1 to bounce4 [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::ray_kind, help_heading = "Output")]
    pub kinds: Option<Vec<BenchStage>>,
    /// Also write all triangles of the scene
    #[arg(long, help_heading = "Output")]
    pub triangles: bool,
    /// Width and height of the image in pixels, one eye ray per pixel
    #[arg(long, value_name = "WxH", default_value = "256x256", value_parser = values::size, help_heading = "Output")]
    pub size: (u32, u32),
    #[command(flatten)]
    pub common: CommonArgs,
}
