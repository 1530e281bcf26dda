//! Batches that take no more memory than their largest scene, or little more.
//!
//! The system's allocator learns from a large buffer that is freed to keep the next ones, and keeps small
//! ones for each thread: after many scenes it holds as much again as any of them needs. It takes other
//! advice, but only from the environment in which a program begins; so a batch begins once more. All of
//! this is of glibc on Linux: other allocators take no such advice.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::CommandExt;

/// From so many scenes on: each takes up to a quarter longer, as what it freed has to be asked for again.
const MANY: usize = 8;

/// Where glibc reads advice.
const TUNABLES: &str = "GLIBC_TUNABLES";

/// Buffers from 256 KiB on come from the system and go back to it, what is free at an end of the rest goes
/// back from 128 KiB on, and threads keep nothing of their own.
const ADVICE: &str =
    "glibc.malloc.mmap_threshold=262144:glibc.malloc.trim_threshold=131072:glibc.malloc.tcache_count=0";

/// Begins this process once more, with advice for its allocator, if it is to render many scenes. It goes on
/// as it is where it had advice already, where that cannot be, and where it read what is read but once.
pub(super) fn begin_again(scenes: usize) {
    let mut words = std::env::args_os();
    let name = words.next();
    let words: Vec<_> = words.collect();
    if scenes < MANY || std::env::var_os(TUNABLES).is_some() || words.iter().any(|word| is_a_stream(word)) {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let mut command = std::process::Command::new(&program);
    command.args(words).env(TUNABLES, ADVICE);
    if let Some(name) = name {
        command.arg0(name);
    }
    // It comes back only where it failed, and nothing is lost then but memory.
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
