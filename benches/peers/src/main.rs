//! Compares blinn with Embree and obvhs: the same meshes and rays, in one process, with interleaved timing.

mod embree;
mod engines;
mod frame;
mod measure;
mod npz;
mod obvhs;
mod options;
mod ray_dump;
mod rays;
mod scene;

use std::process::ExitCode;

use blinn_bench::Machine;
use embree::Embree;
use options::{Mode, Options};
use serde_json::json;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &[String]) -> Result<(), String> {
    let options = Options::parse(args)?;
    let embree = || Embree::open(&options.embree);
    let figures = match options.mode {
        Mode::Rays => measure::rays(&options, &embree()?)?,
        Mode::Build => measure::builds(&options, &embree()?)?,
        Mode::Dump => measure::dumps(&options, &embree()?)?,
        Mode::Scale => measure::scale(&options, &embree()?)?,
        Mode::Frame => frame::frames(&options)?,
        Mode::Alone => measure::alone(&options)?,
    };
    if let Some(path) = &options.json {
        let machine = Machine { simd: options.build.simd.name().into(), ..Machine::detect() };
        let text = json!({"mode": args[0], "machine": machine, "rounds": options.rounds, "figures": figures});
        std::fs::write(path, format!("{text:#}\n")).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(())
}
