//! Counted things in texts.

/// Returns a count with its noun: `1 image`, `2 images`.
pub fn plural(count: u64, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
