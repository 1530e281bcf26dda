//! SIGINT, SIGTERM and SIGHUP: the process exits at once, but never while it writes a file, so that no partial file is
//! left.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::console::eprint_line;
use crate::message_style::{Level, MessageStyle};
use blinn_bench::remove_generated_scenes;
use blinn_output::block_writes;

/// A process that ends by a signal exits with this plus the signal's number.
const EXIT_SIGNAL: i32 = 128;

/// Longest wait for a file that is being written. Farms kill a process two seconds after they terminate it, or a little
/// later.
const WRITE_TIMEOUT: Duration = Duration::from_millis(1500);

/// SIGINT, or Ctrl-C.
const INTERRUPT: i32 = 2;

/// True while a [`HeldInterrupt`] exists.
static IS_HELD: AtomicBool = AtomicBool::new(false);
/// True after an interrupt that was held.
static IS_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Holds the first interrupt back, so that work can end at a suitable point. The second one ends the process. One exists
/// at a time.
pub struct HeldInterrupt(());

impl HeldInterrupt {
    pub fn new() -> HeldInterrupt {
        IS_HELD.store(true, Ordering::SeqCst);
        HeldInterrupt(())
    }

    /// Returns true after an interrupt.
    pub fn is_interrupted(&self) -> bool {
        IS_INTERRUPTED.load(Ordering::SeqCst)
    }

    /// Ends the process if it was interrupted.
    pub fn release(&self) {
        IS_HELD.store(false, Ordering::SeqCst);
        if self.is_interrupted() {
            exit(INTERRUPT);
        }
    }
}

/// Returns true for an interrupt that is held back.
fn holds(signal: i32) -> bool {
    let is_held = signal == INTERRUPT && IS_HELD.load(Ordering::SeqCst);
    let holds = is_held && !IS_INTERRUPTED.swap(true, Ordering::SeqCst);
    if holds {
        eprint_line("interrupted: ending after this round; interrupt again to end at once");
    }
    holds
}

/// Exits because of a signal.
fn exit(signal: i32) -> ! {
    // A disk that hangs, such as one on a network, does not delay the exit. It leaves only a temporary file. If no
    // thread can be started, the exit waits for the disk.
    let _ = std::thread::Builder::new().spawn(move || {
        std::thread::sleep(WRITE_TIMEOUT);
        std::process::exit(EXIT_SIGNAL + signal)
    });
    let _no_file_is_half_written = block_writes();
    remove_generated_scenes();
    let reason = match signal {
        1 => "hung up",
        INTERRUPT => "interrupted",
        _ => "terminated",
    };
    // A terminal may show a progress bar and the pressed keys.
    let line_break = if std::io::stderr().is_terminal() { "\n" } else { "" };
    eprint_line(&format!("{line_break}{}", MessageStyle::of_stderr().label(Level::Error, reason)));
    std::process::exit(EXIT_SIGNAL + signal)
}

/// Watches for signals. If they cannot be watched, they end the process in the system's way.
///
/// # Errors
/// No thread can be started.
#[cfg(unix)]
pub fn watch() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // With a handler, a file over the size limit is a write error and does not end the process.
    let _ = signal_hook::flag::register(SIGXFSZ, Default::default());
    let ignored = ignored_signals();
    // If the mask is unknown, SIGHUP is left to the system, which ignores it after `nohup`.
    let is_watched = |signal: i32| ignored.map_or(signal != SIGHUP, |mask| mask >> (signal - 1) & 1 == 0);
    let watched = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| is_watched(*signal));
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(watched) {
        std::thread::Builder::new().spawn(move || {
            if let Some(signal) = signals.forever().find(|signal| !holds(*signal)) {
                exit(signal);
            }
        })?;
    }
    Ok(())
}

/// Mask of the signals that this process inherited as ignored, from Linux's `/proc`. `nohup` ignores SIGHUP, and a
/// shell script ignores SIGINT in background processes.
#[cfg(unix)]
fn ignored_signals() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// Watches for Ctrl-C.
#[cfg(not(unix))]
pub fn watch() -> std::io::Result<()> {
    let _ = ctrlc::set_handler(|| {
        if !holds(INTERRUPT) {
            exit(INTERRUPT)
        }
    });
    Ok(())
}
