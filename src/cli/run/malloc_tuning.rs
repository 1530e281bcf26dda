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
use std::path::{Path, PathBuf};

use crate::plan::{FrameSet, RenderPlan};
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

/// Files of so many bytes and pictures of so many pixels, and smaller ones, touch so little memory that starting again
/// takes longer than the page faults that it saves.
const TINY_FILE: u64 = 64 << 10;
const TINY_PICTURE: u64 = 256 * 256;

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
    if std::env::var_os(TUNABLES).is_some() || is_tiny(plan) {
        return;
    }
    let is_small = |scene: Result<PathBuf, _>| scene.is_ok_and(|scene| has_at_most(&scene, SMALL_FILE));
    let has_memory = || plan.session.max_memory.is_none() && load_limits(None).memory_bytes >= AMPLE_MEMORY;
    let tunables = match plan.scenes.len() {
        MANY_SCENES.. => FRUGAL,
        2.. if plan.session.max_memory.is_some() => FRUGAL,
        _ if plan.scenes.iter().all(is_small) && has_memory() => FAST,
        _ => return,
    };
    if argv.iter().any(|arg| is_stream(arg)) {
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

/// True for a single tiny picture of a tiny file.
fn is_tiny(plan: &RenderPlan) -> bool {
    let options = &plan.session.options;
    let size = options.size.or(options.max_size.map(|side| (side, side)));
    let is_tiny_picture = size.is_some_and(|(w, h)| u64::from(w) * u64::from(h) <= TINY_PICTURE);
    let is_tiny_scene = |scene: PathBuf| has_at_most(&scene, TINY_FILE) && !may_name_files(&scene);
    is_tiny_picture
        && options.environment.is_none()
        && matches!(plan.frames, FrameSet::Single(_))
        && plan.scenes.len() == 1
        && plan.scenes.first().is_ok_and(is_tiny_scene)
}

/// True for a scene that may have buffers or textures in other files.
fn may_name_files(scene: &Path) -> bool {
    let is = |format: &str| scene.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(format));
    // `mtllib`, and `usemtl` without it.
    let is_plain = || std::fs::read_to_string(scene).is_ok_and(|text| !text.contains("mtl"));
    !(is("glb") || is("stl") || is("ply") || is("obj") && is_plain())
}

/// True for a file, not a pipe, of at most so many bytes.
fn has_at_most(file: &Path, most: u64) -> bool {
    std::fs::metadata(file).is_ok_and(|file| file.is_file() && file.len() <= most)
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
    use super::{is_stream, may_name_files};

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

    #[test]
    fn scenes_that_may_name_files_are_recognized() {
        let dir = tempfile::tempdir().unwrap();
        let names_files = |name: &str, text: &str| {
            let file = dir.path().join(name);
            std::fs::write(&file, text).unwrap();
            may_name_files(&file)
        };
        for (name, text) in [("a.gltf", "{}"), ("b.obj", "mtllib b.mtl"), ("c.OBJ", "usemtl c"), ("d", "")] {
            assert!(names_files(name, text), "{name}");
        }
        for (name, text) in [("a.GLB", "glTF"), ("b.obj", "v 0 0 0"), ("c.stl", ""), ("d.ply", "ply")] {
            assert!(!names_files(name, text), "{name}");
        }
    }
}
