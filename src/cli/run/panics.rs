//! Turns panics into errors of the file at which they happened, so that a batch goes on.
//!
//! This program does not panic on purpose, but libraries that read files may.

use std::panic::{AssertUnwindSafe, Location, catch_unwind, set_hook};
use std::path::Path;
use std::sync::Mutex;

use anyhow::{Result, anyhow};

/// Location of the last panic. The payload that `catch_unwind` returns does not have it.
static LOCATION: Mutex<Option<String>> = Mutex::new(None);

/// Replaces the default output of panics. From now on [`catch`] reports them.
pub fn install_hook() {
    set_hook(Box::new(|info| {
        *LOCATION.lock().unwrap_or_else(|e| e.into_inner()) = info.location().map(source_location);
    }));
}

/// Calls a function and turns a panic, on any thread, into an error.
pub fn catch<T>(function: impl FnOnce() -> Result<T>) -> Result<T> {
    // Unwind safe: whatever the function changed is dropped.
    catch_unwind(AssertUnwindSafe(function)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        let location = LOCATION.lock().unwrap_or_else(|e| e.into_inner()).take();
        let location = location.map(|location| format!(" ({location})")).unwrap_or_default();
        Err(anyhow!("this is a bug in blinn, please report it with the file: {message}{location}"))
    })
}

/// File and line without the folders of the machine that built the program.
fn source_location(location: &Location) -> String {
    let file = Path::new(location.file());
    let parts: Vec<_> = file.components().map(|c| c.as_os_str().to_string_lossy()).collect();
    let package = parts.iter().rposition(|part| part == "src").map_or(0, |i| i.saturating_sub(1));
    format!("{}:{}", parts[package..].join("/"), location.line())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_on_any_thread_is_an_error() {
        assert_eq!(catch(|| Ok(5)).unwrap(), 5);
        assert_eq!(catch::<()>(|| anyhow::bail!("an error")).unwrap_err().to_string(), "an error");
        for error in [
            catch::<()>(|| panic!("index {} is out of range", 7)).unwrap_err(),
            catch::<()>(|| rayon::join(|| (), || panic!("index 7 is out of range")).1).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(text.contains("please report it") && text.contains("index 7 is out of range"), "{text}");
        }
    }

    #[test]
    fn locations_do_not_contain_the_build_folder() {
        let here = source_location(Location::caller());
        let here = here.strip_prefix("blinn/").unwrap_or(&here);
        assert!(here.starts_with("src/cli/run/panics.rs:"), "{here}");
    }
}
