//! `blinn rays`: writes the rays of a benchmark and their hits for other engines.

use std::path::Path;

use anyhow::{Context, Result};

use super::args::RaysArgs;
use super::console::{
    eprint_line, is_stdout, print_error, print_stdout, print_warning, scene_error, single_line, strict_error,
};
use super::files::create_parent_folder;
use super::plan::{PathConflicts, Writer};
use super::run::panics;
use super::scene_file::is_stdin;
use super::summary::Summary;
use super::usage::UsageError;
use blinn_bench::npz::encode_npz;
use blinn_bench::{BenchStage, DumpSettings, dump_rays};
use blinn_core::worded;
use blinn_import::LoadOptions;
use blinn_output::{Overwrite, check_writable, write_atomically};
use blinn_session::simd_level;

pub fn run(args: &RaysArgs) -> Result<Summary, UsageError> {
    if is_stdin(&args.scene) {
        return Err(UsageError("rays reads a file; save standard input to one".into()));
    }
    let mut paths = PathConflicts::with_inputs(std::slice::from_ref(&args.scene));
    paths.add_output(&args.dump, Writer::Option("dump")).map_err(UsageError)?;
    let all = || BenchStage::ALL.into_iter().filter(|stage| stage.traces_rays()).collect();
    let settings = DumpSettings {
        load: LoadOptions { allow_outside: args.common.allow_outside(), ..LoadOptions::default() },
        blender: args.blender.clone(),
        size: args.size,
        stages: args.kinds.clone().unwrap_or_else(all),
        triangles: args.triangles,
        simd: simd_level()?,
    };
    let mut summary = Summary::default();
    if let Err(error) = panics::catch(|| dump(args, &settings)) {
        let text = scene_error(&args.scene, &error).to_string();
        print_error(&text);
        summary.add_failure(single_line(&text));
    }
    Ok(summary)
}

fn dump(args: &RaysArgs, settings: &DumpSettings) -> Result<()> {
    prepare(&args.dump)?;
    let dump = dump_rays(&args.scene, settings)?;
    if let Some(warning) = dump.warnings.first().filter(|_| args.common.strict) {
        return Err(strict_error(warning));
    }
    for warning in dump.warnings.iter().filter(|_| !args.common.quiet) {
        print_warning(&format!("{}: {warning}", args.scene.display()));
    }
    let bytes = encode_npz(&dump.arrays)?;
    if is_stdout(&args.dump) {
        print_stdout(&bytes)?;
        return Ok(());
    }
    write_atomically(&args.dump, &bytes, Overwrite::Yes)
        .with_context(|| format!("{} cannot be written", args.dump.display()))?;
    if !args.common.quiet {
        eprint_line(&single_line(&format!("wrote {} rays to {}", dump.rays, args.dump.display())));
    }
    Ok(())
}

/// Finds errors of the file system before rays are traced.
fn prepare(file: &Path) -> Result<()> {
    if is_stdout(file) {
        return Ok(());
    }
    create_parent_folder(file)?;
    check_writable(file, Overwrite::Yes).context(worded!("`dump`"))
}
