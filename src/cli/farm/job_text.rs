//! Text that can be written on one line of a job, whatever its language.

use std::ffi::OsStr;

use crate::args::ExplicitFlags;
use crate::usage::UsageError;

/// The text of a value. `what` names it in the error.
///
/// # Errors
/// Text that is not UTF-8 or contains control characters.
pub fn single_line_text(what: &str, value: &OsStr) -> Result<String, UsageError> {
    match value.to_str() {
        Some(text) if !text.contains(char::is_control) => Ok(text.into()),
        _ => Err(UsageError(format!(
            "{what} {}: a job cannot contain line breaks, control characters or text that is not UTF-8; rename it",
            value.to_string_lossy()
        ))),
    }
}

/// Checks the values of all flags.
///
/// # Errors
/// As for [`single_line_text`].
pub fn check_values(flags: &ExplicitFlags) -> Result<(), UsageError> {
    for flag in flags.iter() {
        if let Some(value) = &flag.value {
            single_line_text(&format!("--{}", flag.name), value)?;
        }
    }
    Ok(())
}

/// Flags with checked values as arguments.
pub fn text_args(flags: &ExplicitFlags) -> Vec<String> {
    flags.to_args().iter().map(|arg| arg.to_string_lossy().into_owned()).collect()
}
