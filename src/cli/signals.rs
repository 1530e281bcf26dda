//! Ctrl-C and termination: the process ends at once, but never while a file is being written, so
//! that nothing partial stays behind.

use std::time::Duration;

use super::console::tell;
use crate::bench::sweep;
use crate::output::hold_writes;

/// Exit code of an interrupted process.
const INTERRUPTED: i32 = 130;

/// How long a file that is being written may take. Farms kill whoever has not ended two seconds after
/// they were told to, or a little later.
const PATIENCE: Duration = Duration::from_millis(1500);

fn end(code: i32) -> ! {
    // A disk that hangs, as one behind a network may, holds nobody up. What it leaves has a passing name.
    std::thread::spawn(move || {
        std::thread::sleep(PATIENCE);
        std::process::exit(code)
    });
    let _no_file_is_half_written = hold_writes();
    sweep();
    tell(&format!("\nblinn: {}", if code == INTERRUPTED { "interrupted" } else { "terminated" }));
    std::process::exit(code)
}

/// Watches for signals from now on. Where they cannot be watched the system's way of ending a
/// process holds.
#[cfg(unix)]
pub(super) fn watch() {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    // A file that grows too large is then an error of that file, not the end of the process.
    let _ = signal_hook::flag::register(SIGXFSZ, Default::default());
    if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
        std::thread::spawn(move || {
            if let Some(signal) = signals.forever().next() {
                end(128 + signal);
            }
        });
    }
}

/// Watches for signals from now on.
#[cfg(not(unix))]
pub(super) fn watch() {
    let _ = ctrlc::set_handler(|| end(INTERRUPTED));
}
