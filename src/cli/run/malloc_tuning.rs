//! Tunes glibc's malloc for a plan.
//!
//! Small scenes render faster with huge pages that are requested many at once: without them, page faults take a sixth
//! of the time of an image of 70 thousand triangles. A batch of many scenes should need hardly more memory than its
//! largest scene, but malloc raises its thresholds when a large buffer is freed and caches small ones per thread.
//!
//! glibc reads tunables only from the environment of a new process. Therefore the process executes itself again, which
//! takes two to three milliseconds. Other allocators have no tunables.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;

use crate::plan::RenderPlan;
use blinn_session::load_limits;

/// From this number of scenes on, memory matters more than time.
const MANY_SCENES: usize = 8;

/// The environment variable that glibc reads.
const TUNABLES: &str = "GLIBC_TUNABLES";

/// Huge pages if available, and 16 MiB of pages per request.
const FAST: &str = "glibc.malloc.hugetlb=1:glibc.malloc.top_pad=16777216";

/// Scenes with larger files, in bytes, may take longer with huge pages: for a million triangles the kernel works twice as
/// long as for small pages.
const SMALL_FILE: u64 = 16 << 20;

/// With less available memory, in bytes, the fast tunables are not used: they need about 10 MiB more.
const AMPLE_MEMORY: u64 = 512 << 20;

/// Buffers from 256 KiB on are mapped and unmapped, with huge pages if available, free memory at the top of the heap is
/// returned from 128 KiB on, and threads cache nothing. Each scene takes up to a quarter longer, as freed memory has to be
/// requested again.
const FRUGAL: &str = "glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=262144:\
                      glibc.malloc.trim_threshold=131072:glibc.malloc.tcache_count=0";

/// Executes this process again with tunables for a plan. Returns if none fit, if the environment has some already, if
/// an argument in `argv` is a stream, which can be read only once, and if the execution fails.
pub fn restart_with_tunables(plan: &RenderPlan, argv: &[OsString]) {
    let is_small = |scene: Result<PathBuf, _>| {
        let file = scene.ok().and_then(|scene| std::fs::metadata(scene).ok());
        file.is_some_and(|file| file.len() <= SMALL_FILE)
    };
    let has_memory = || plan.session.max_memory.is_none() && load_limits(None).memory_bytes >= AMPLE_MEMORY;
    let tunables = match plan.scenes.len() {
        MANY_SCENES.. => FRUGAL,
        2.. if plan.session.max_memory.is_some() => FRUGAL,
        _ if plan.scenes.iter().all(is_small) && has_memory() => FAST,
        _ => return,
    };
    if std::env::var_os(TUNABLES).is_some() || argv.iter().any(|arg| is_stream(arg)) {
        return;
    }
    let mut args = std::env::args_os();
    let name = args.next();
    let Ok(program) = std::env::current_exe() else { return };
    let mut command = std::process::Command::new(&program);
    command.args(args).env(TUNABLES, tunables);
    if let Some(name) = name {
        command.arg0(name);
    }
    // Returns only on failure, which costs time or memory but nothing else.
    let _ = command.exec();
}

/// True if an argument, `@FILE` or `--flag=FILE` names standard input, a pipe or a device.
fn is_stream(arg: &OsStr) -> bool {
    let bytes = arg.as_bytes();
    let value = bytes.iter().position(|&b| b == b'=').map_or(0, |at| at + 1);
    [0, 1, value].into_iter().any(|start| {
        let name = OsStr::from_bytes(bytes.get(start..).unwrap_or_default());
        let metadata = std::fs::metadata(name);
        name == "-" || metadata.is_ok_and(|file| !file.is_file() && !file.is_dir())
    })
}

#[cfg(test)]
mod tests {
    use super::is_stream;

    #[test]
    fn streams_are_recognized() {
        for arg in ["-", "@-", "@/dev/null", "/dev/null", "--config=/dev/null", "--config=-"] {
            assert!(is_stream(arg.as_ref()), "{arg}");
        }
        for arg in
            ["", "@", "@Cargo.toml", "Cargo.toml", "src", "--config=Cargo.toml", "--threads", "-q", "no such"]
        {
            assert!(!is_stream(arg.as_ref()), "{arg}");
        }
    }
}
