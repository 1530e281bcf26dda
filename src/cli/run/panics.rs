//! Panics end the file that they happened at, not the program.
//!
//! Nothing here panics on purpose, but files are read by libraries too. What they panic at is that
//! file's error, in one line.

use std::panic::{AssertUnwindSafe, Location, catch_unwind, set_hook};
use std::path::Path;
use std::sync::Mutex;

use anyhow::{Result, anyhow};

/// Where the last panic happened, which is not part of what is caught.
static PLACE: Mutex<Option<String>> = Mutex::new(None);

/// From now on panics are not told where they happen, but by [`caught`].
pub(crate) fn keep_quiet() {
    set_hook(Box::new(|info| {
        *PLACE.lock().unwrap_or_else(|e| e.into_inner()) = info.location().map(place);
    }));
}

/// What `work` returns; where it panics, on whichever thread, an error that says so.
pub(crate) fn caught<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    // Whatever it was at is not looked at again.
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        let place = PLACE.lock().unwrap_or_else(|e| e.into_inner()).take();
        let place = place.map(|p| format!(" ({p})")).unwrap_or_default();
        Err(anyhow!("this is a defect of blinn, please report it with the file: {text}{place}"))
    })
}

/// A place in our sources, or in a library's, without the folders of the machine it was built on.
fn place(location: &Location) -> String {
    let file = Path::new(location.file());
    let parts: Vec<_> = file.components().map(|c| c.as_os_str().to_string_lossy()).collect();
    let source = parts.iter().rposition(|p| p == "src").map_or(0, |i| i.saturating_sub(1));
    format!("{}:{}", parts[source..].join("/"), location.line())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_on_any_thread_is_an_error() {
        assert_eq!(caught(|| Ok(5)).unwrap(), 5);
        assert_eq!(caught::<()>(|| anyhow::bail!("as ever")).unwrap_err().to_string(), "as ever");
        for error in [
            caught::<()>(|| panic!("index {} is out of range", 7)).unwrap_err(),
            caught::<()>(|| rayon::join(|| (), || panic!("index 7 is out of range")).1).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(text.contains("please report it") && text.contains("index 7 is out of range"), "{text}");
        }
    }

    #[test]
    fn places_do_not_tell_where_it_was_built() {
        let here = place(Location::caller());
        assert!(
            here.starts_with("src/cli/panics.rs:") || here.starts_with("blinn/src/cli/panics.rs:"),
            "{here}"
        );
    }
}
