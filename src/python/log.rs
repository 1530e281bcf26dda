//! Warnings of a render, in the words of Python.

use std::sync::Mutex;

use blinn_session::{Notice, SessionError, SessionLog, without_error_codes};

/// Collects each warning of a render once, in order.
#[derive(Default)]
pub struct WarningLog(Mutex<Vec<String>>);

impl WarningLog {
    /// Returns the warnings.
    pub fn into_warnings(self) -> Vec<String> {
        self.0.into_inner().unwrap_or_else(|e| e.into_inner())
    }
}

impl SessionLog for WarningLog {
    fn warn(&self, notice: Notice) -> Result<(), SessionError> {
        let text = without_error_codes(&notice.to_string());
        let mut warnings = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if !warnings.contains(&text) {
            warnings.push(text);
        }
        Ok(())
    }
}

/// Words an option as a keyword argument: `clip='off'`.
pub fn keyword(name: &str, value: Option<&str>) -> String {
    let name = match name {
        // Arguments of their own.
        "aov" => "layers".to_string(),
        "dataset" => "formats".to_string(),
        "output" => "name".to_string(),
        _ => name.replace('-', "_"),
    };
    match value {
        Some(value) => format!("{name}='{value}'"),
        None => name,
    }
}
