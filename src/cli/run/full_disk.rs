//! The error of a full disk, which every later scene would meet.

use std::io;

use anyhow::Error;

use blinn_output::SaveError;

/// Returns true for the error of a full disk.
pub fn is_disk_full(error: &Error) -> bool {
    use io::ErrorKind::{QuotaExceeded, StorageFull};
    error.chain().any(|cause| {
        let saved = cause.downcast_ref::<SaveError>().map(|error| &error.cause);
        let cause: Option<&io::Error> = saved.or(cause.downcast_ref());
        cause.is_some_and(|cause| matches!(cause.kind(), StorageFull | QuotaExceeded))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn a_full_disk_is_found_behind_other_errors() {
        let of = |kind: io::ErrorKind| io::Error::from(kind);
        let saved = |kind| SaveError { path: "a.png".into(), cause: of(kind) };
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::QuotaExceeded] {
            assert!(is_disk_full(&Error::new(of(kind)).context("a.png cannot be written")));
            assert!(is_disk_full(&Error::new(saved(kind))));
            assert!(is_disk_full(&Err::<(), _>(saved(kind)).context("scene").unwrap_err()));
        }
        assert!(!is_disk_full(&Error::new(saved(io::ErrorKind::PermissionDenied))));
        assert!(!is_disk_full(&Error::msg("no space left on device")));
    }
}
