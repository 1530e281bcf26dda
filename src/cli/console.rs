//! Standard output for results, standard error for messages.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::path::Path;

use anyhow::{Context, Error, Result};

use super::files::similar_file;
use super::message_style::{Level, MessageStyle};
use blinn_core::worded;
use blinn_import::LoadError;
use blinn_session::without_error_codes;

/// True for the file name `-`, which stands for standard output.
pub fn is_stdout(name: &Path) -> bool {
    name == Path::new("-")
}

/// Writes a line to standard error, with options as flags. Ignores write errors, as they have nowhere to be reported.
pub fn eprint_line(line: &str) {
    let _ = writeln!(stderr().lock(), "{}", without_error_codes(line));
}

/// Reports an error on standard error as one line.
pub fn print_error(message: &str) {
    eprint_message(Level::Error, message);
}

/// Reports a part of the last error in a line of its own.
pub fn print_error_detail(detail: &str) {
    match MessageStyle::of_stderr() {
        MessageStyle::Plain => print_error(&format!("  {detail}")),
        MessageStyle::Words | MessageStyle::Colors => eprint_line(&format!("  {}", single_line(detail))),
    }
}

/// Reports a warning on standard error as one line.
pub fn print_warning(message: &str) {
    eprint_message(Level::Warning, message);
}

/// Reports a hint on standard error as one line.
pub fn print_hint(message: &str) {
    eprint_message(Level::Hint, message);
}

fn eprint_message(level: Level, message: &str) {
    eprint_line(&MessageStyle::of_stderr().label(level, &single_line(message)));
}

/// Writes bytes to standard output.
pub fn print_stdout(bytes: &[u8]) -> Result<()> {
    let written = stdout().lock().write_all(bytes);
    finish_stdout(written)
}

/// Flushes standard output after `written`. A closed pipe is not an error: its reader has read enough.
pub fn finish_stdout(written: io::Result<()>) -> Result<()> {
    match written.and_then(|()| stdout().lock().flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("standard output cannot be written"),
    }
}

/// Replaces line breaks, control characters and overrides of the writing direction by spaces.
pub fn single_line(text: &str) -> String {
    let is_hidden =
        |c: char| c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().map(|c| if is_hidden(c) { ' ' } else { c }).collect()
}

/// An error with its causes, preceded by the scene's path unless it names that already. For a missing file, a similar one is
/// suggested.
pub fn scene_error(scene: &Path, error: &Error) -> String {
    let text = without_error_codes(&format!("{error:#}"));
    let path = scene.display().to_string();
    let is_missing = |cause: &(dyn std::error::Error + 'static)| match cause.downcast_ref() {
        Some(LoadError::Io { path, cause }) => path == scene && cause.kind() == ErrorKind::NotFound,
        _ => false,
    };
    let similar = if error.chain().any(is_missing) { similar_file(scene) } else { String::new() };
    if text.contains(&path) { text + &similar } else { format!("{path}: {text}{similar}") }
}

/// The error that a warning becomes with `--strict`.
pub fn strict_error(warning: impl Display) -> Error {
    anyhow::anyhow!(worded!("{} (an error because of `strict`)", without_error_codes(&warning.to_string())))
}
