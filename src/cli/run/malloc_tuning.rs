//! Advice to the system's allocator, for what a process is about to do.
//!
//! Small scenes are done soonest where memory comes in large pages and many at once: a sixth of a picture of 70
//! thousand triangles goes into asking for pages else. Many scenes shall take no more memory than their
//! largest, or little more; but the allocator learns from a large buffer that is freed to keep the next ones,
//! and keeps small ones for each thread.
//!
//! It takes advice only from the environment in which a program begins; so the process begins once more,
//! which takes two or three milliseconds. All of this is of glibc on Linux: other allocators take no such
//! advice.

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;

use crate::cli::plan::Job;
use crate::cli::plan::memory;

/// From so many scenes on memory counts more than time.
const MANY: usize = 8;

/// Where glibc reads advice.
const TUNABLES: &str = "GLIBC_TUNABLES";

/// Large pages where there are any, and 16 MiB of pages at once.
const FAST: &str = "glibc.malloc.hugetlb=1:glibc.malloc.top_pad=16777216";

/// Scenes of larger files than this, in bytes, may take longer with large pages: the system works twice as long
/// for those of a million triangles as for small pages.
const SMALL: u64 = 16 << 20;

/// With less memory than this, in bytes, none is taken for the sake of time: the fast way takes some 10 MiB more.
const ROOMY: u64 = 512 << 20;

/// Buffers from 256 KiB on come from the system and go back to it, what is free at an end of the rest goes
/// back from 128 KiB on, and threads keep nothing of their own. Each scene takes up to a quarter longer, as
/// what it freed has to be asked for again.
const FRUGAL: &str =
    "glibc.malloc.mmap_threshold=262144:glibc.malloc.trim_threshold=131072:glibc.malloc.tcache_count=0";

/// Begins this process once more, with advice for its allocator that suits a job. It goes on as it is where
/// none does, where it had advice already, where that cannot be, and where it read what is read but once:
/// `words` are those of the command line and of its `--config`.
pub(crate) fn begin_again(job: &Job, words: &[OsString]) {
    let small = |scene: &PathBuf| std::fs::metadata(scene).is_ok_and(|file| file.len() <= SMALL);
    let roomy = || job.max_memory.is_none() && memory::limits(None).memory_bytes >= ROOMY;
    let advice = match job.scenes.len() {
        MANY.. => FRUGAL,
        _ if job.scenes.iter().all(small) && roomy() => FAST,
        _ => return,
    };
    if std::env::var_os(TUNABLES).is_some() || words.iter().any(|word| is_a_stream(word)) {
        return;
    }
    let mut given = std::env::args_os();
    let name = given.next();
    let Ok(program) = std::env::current_exe() else { return };
    let mut command = std::process::Command::new(&program);
    command.args(given).env(TUNABLES, advice);
    if let Some(name) = name {
        command.arg0(name);
    }
    // It comes back only where it failed, and nothing is lost then but time or memory.
    let _ = command.exec();
}

/// Whether a word, `@word` or `--flag=word` is standard input, a pipe or a device.
fn is_a_stream(word: &OsStr) -> bool {
    let bytes = word.as_bytes();
    let begins = bytes.iter().position(|&b| b == b'=').map_or(0, |at| at + 1);
    [0, 1, begins].into_iter().any(|begins| {
        let name = OsStr::from_bytes(bytes.get(begins..).unwrap_or_default());
        let found = std::fs::metadata(name);
        name == "-" || found.is_ok_and(|found| !found.is_file() && !found.is_dir())
    })
}

#[cfg(test)]
mod tests {
    use super::is_a_stream;

    #[test]
    fn what_is_read_but_once_is_known() {
        for word in ["-", "@-", "@/dev/null", "/dev/null", "--config=/dev/null", "--config=-"] {
            assert!(is_a_stream(word.as_ref()), "{word}");
        }
        for word in
            ["", "@", "@Cargo.toml", "Cargo.toml", "src", "--config=Cargo.toml", "--threads", "-q", "no such"]
        {
            assert!(!is_a_stream(word.as_ref()), "{word}");
        }
    }
}
