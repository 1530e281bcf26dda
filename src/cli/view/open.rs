//! Opens the page in the browser.

use std::io::Write;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};

/// The system's program that opens files.
const OPENER: &str = if cfg!(target_os = "macos") {
    "open"
} else if cfg!(windows) {
    "explorer"
} else {
    "xdg-open"
};
/// Time until the file is removed: the browser has read it by then.
const KEPT: Duration = Duration::from_secs(30);

/// Opens an address. It goes through a file that only this user can read: other users see the arguments of programs.
///
/// # Errors
/// There is no such program, or no temporary file.
pub fn in_browser(url: &str) -> Result<()> {
    let mut file = tempfile::Builder::new().prefix("blinn-view-").suffix(".html").tempfile()?;
    writeln!(
        file,
        "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url={url}\"><title>blinn view</title>"
    )?;
    file.flush()?;
    let mut command = Command::new(OPENER);
    command.arg(file.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().with_context(|| format!("{OPENER} cannot be run"))?;
    thread::Builder::new().name("open".into()).spawn(move || {
        let _ = child.wait();
        thread::sleep(KEPT);
        drop(file);
    })?;
    Ok(())
}
