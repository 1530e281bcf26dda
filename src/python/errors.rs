//! Exceptions: one class for each kind of error of the library.

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning, PyValueError};
use pyo3::prelude::*;

use blinn_import::LoadError as ImportError;
use blinn_session::without_error_codes;

create_exception!(blinn, Error, PyException, "Base class of all errors of blinn.");
create_exception!(blinn, LoadError, Error, "A scene cannot be loaded.");
create_exception!(blinn, LimitError, LoadError, "A scene exceeds a limit, such as max_memory.");
create_exception!(blinn, UnsupportedError, LoadError, "A scene needs a feature that is not supported.");
create_exception!(blinn, RenderError, Error, "A scene cannot be rendered.");
create_exception!(blinn, SceneWarning, PyUserWarning, "A defect of a scene that was repaired or ignored.");

/// Adds the exceptions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("Error", py.get_type::<Error>())?;
    module.add("LoadError", py.get_type::<LoadError>())?;
    module.add("LimitError", py.get_type::<LimitError>())?;
    module.add("UnsupportedError", py.get_type::<UnsupportedError>())?;
    module.add("RenderError", py.get_type::<RenderError>())?;
    module.add("SceneWarning", py.get_type::<SceneWarning>())?;
    Ok(())
}

/// The exception for an error of the importer in the scene `name`. A missing file is Python's own FileNotFoundError.
pub fn load_error(name: &str, error: ImportError) -> PyErr {
    import_error(error, |message| format!("{name}: {message}"))
}

/// The exception for an error in a list of cameras, which names its file, one of several in a folder.
pub fn camera_list_error(error: ImportError) -> PyErr {
    import_error(error, |message| message)
}

fn import_error(error: ImportError, in_file: impl FnOnce(String) -> String) -> PyErr {
    let message = without_error_codes(&error.to_string());
    let text = match &error {
        ImportError::Io { cause, .. } if cause.raw_os_error().is_some() => {
            return std::io::Error::new(cause.kind(), message).into();
        }
        ImportError::Io { .. } => message,
        _ => in_file(message),
    };
    match error {
        ImportError::Limit { .. } => LimitError::new_err(text),
        ImportError::Cancelled(_) | ImportError::Unsupported(_) => UnsupportedError::new_err(text),
        ImportError::Io { .. } | ImportError::Parse { .. } | ImportError::Invalid { .. } => {
            LoadError::new_err(text)
        }
    }
}

/// The exception for a failed render.
pub fn render_error(error: &anyhow::Error) -> PyErr {
    RenderError::new_err(without_error_codes(&format!("{error:#}")))
}

/// A `ValueError`.
pub fn value_error(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(without_error_codes(&text.into()))
}

/// Number of Python functions between the user's code and this module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallDepth {
    Direct = 1,
    /// Called by a method of the package.
    Wrapped = 2,
}

/// Issues warnings about a scene through Python's `warnings`, at the line of the user's code.
pub fn warn(py: Python<'_>, scene: &str, warnings: &[String], depth: CallDepth) -> PyResult<()> {
    let category = py.get_type::<SceneWarning>();
    for warning in warnings {
        let text =
            std::ffi::CString::new(format!("{scene}: {}", without_error_codes(warning)).replace('\0', " "))?;
        PyErr::warn(py, &category, &text, depth as i32)?;
    }
    Ok(())
}
