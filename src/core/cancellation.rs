//! Cancellation of long work, by a request or at a deadline.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The work was cancelled; there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// A request to end work early, which loops check between their steps. Clones share the request. The default is never
/// cancelled.
#[derive(Clone, Default)]
pub struct CancelToken(Option<Arc<Cancellation>>);

struct Cancellation {
    is_cancelled: AtomicBool,
    deadline: Option<Instant>,
}

impl CancelToken {
    /// A token that [`CancelToken::cancel`] cancels.
    pub fn new() -> CancelToken {
        CancelToken::with_deadline(None)
    }

    /// A token that is cancelled after `timeout`, counted from now.
    pub fn with_timeout(timeout: Duration) -> CancelToken {
        // A timeout beyond the clock's range never ends.
        CancelToken::with_deadline(Instant::now().checked_add(timeout))
    }

    fn with_deadline(deadline: Option<Instant>) -> CancelToken {
        CancelToken(Some(Arc::new(Cancellation { is_cancelled: AtomicBool::new(false), deadline })))
    }

    /// Cancels the work of all clones. Has no effect on the default token.
    pub fn cancel(&self) {
        if let Some(cancellation) = &self.0 {
            cancellation.is_cancelled.store(true, Ordering::Relaxed);
        }
    }

    /// Returns true if the work should end.
    pub fn is_cancelled(&self) -> bool {
        let Some(Cancellation { is_cancelled, deadline }) = self.0.as_deref() else { return false };
        if !is_cancelled.load(Ordering::Relaxed)
            && deadline.is_some_and(|deadline| Instant::now() >= deadline)
        {
            is_cancelled.store(true, Ordering::Relaxed);
        }
        is_cancelled.load(Ordering::Relaxed)
    }

    /// Returns an error if the work should end.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

impl fmt::Debug for CancelToken {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("CancelToken")
    }
}

/// Tokens are equal if one cancels the other.
impl PartialEq for CancelToken {
    fn eq(&self, other: &CancelToken) -> bool {
        match (&self.0, &other.0) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_the_request() {
        let token = CancelToken::new();
        let clone = token.clone();
        assert!(clone.check().is_ok() && clone == token && clone != CancelToken::new());
        token.cancel();
        assert_eq!(clone.check(), Err(Cancelled));
        let never = CancelToken::default();
        never.cancel();
        assert!(never.check().is_ok());
    }

    #[test]
    fn a_token_ends_at_its_deadline_and_stays_cancelled() {
        assert!(CancelToken::with_timeout(Duration::ZERO).is_cancelled());
        assert!(!CancelToken::with_timeout(Duration::MAX).is_cancelled());
        let token = CancelToken::with_timeout(Duration::from_millis(20));
        while !token.is_cancelled() {
            std::thread::yield_now();
        }
        assert!(token.is_cancelled());
    }
}
