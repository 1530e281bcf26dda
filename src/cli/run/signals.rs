//! Ctrl-C, termination and a terminal that hangs up: the process ends at once, but never while a file is
//! being written, so that nothing partial stays behind.

use std::io::IsTerminal;
use std::time::Duration;

use crate::bench::remove_generated_scenes;
use crate::cli::console::tell;
use crate::output::block_writes;

/// What a process exits with that a signal ended: this and the signal's number.
const SIGNALLED: i32 = 128;

/// How long a file that is being written may take. Farms kill whoever has not ended two seconds after
/// they were told to, or a little later.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Ends the process as `signal` asks for.
fn end(signal: i32) -> ! {
    // A disk that hangs, as one behind a network may, holds nobody up. What it leaves has a passing name.
    // Where no thread is to be had the disk has to answer.
    let _ = std::thread::Builder::new().spawn(move || {
        std::thread::sleep(PATIENCE);
        std::process::exit(SIGNALLED + signal)
    });
    let _no_file_is_half_written = block_writes();
    remove_generated_scenes();
    let what = match signal {
        1 => "hung up",
        2 => "interrupted",
        _ => "terminated",
    };
    // Whoever hung up reads nothing, and there may be nothing left to write to. A terminal may show a bar, and
    // the keys that were pressed.
    let below = if std::io::stderr().is_terminal() { "\n" } else { "" };
    tell(&format!("{below}blinn: {what}"));
    std::process::exit(SIGNALLED + signal)
}

/// Watches for signals from now on. Where they cannot be watched the system's way of ending a
/// process holds.
///
/// # Errors
/// No thread can be had to watch for them.
#[cfg(unix)]
pub(crate) fn watch() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // A file that grows too large is then an error of that file, not the end of the process.
    let _ = signal_hook::flag::register(SIGXFSZ, Default::default());
    let ignored = ignored();
    // Where nothing is known, a hangup is left to the system, which ignores it after `nohup`.
    let is_heeded = |signal: i32| ignored.map_or(signal != SIGHUP, |mask| mask >> (signal - 1) & 1 == 0);
    let watched = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| is_heeded(*signal));
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(watched) {
        std::thread::Builder::new().spawn(move || {
            if let Some(signal) = signals.forever().next() {
                end(signal);
            }
        })?;
    }
    Ok(())
}

/// The signals that this process was begun to ignore, a bit each, where the system tells: `nohup` has it ignore
/// one, and a shell's script two of what it puts into the background.
#[cfg(unix)]
fn ignored() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// Watches for signals from now on.
#[cfg(not(unix))]
pub(crate) fn watch() -> std::io::Result<()> {
    let _ = ctrlc::set_handler(|| end(2));
    Ok(())
}
