//! Numbers with units, as tables and plots show them.

/// Formats seconds as µs, ms or s.
pub fn format_duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "–".into(),
        s if s < 0.9995e-3 => format!("{:.1} µs", s * 1e6),
        s if s < 0.9995 => format!("{:.1} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// Formats a number of threads.
pub(super) fn format_threads(threads: u32) -> String {
    counted(threads, "thread")
}

/// A count with its noun: `1 round`, `2 rounds`.
pub(super) fn counted(count: u32, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Formats a count as `5`, `20k` or `1m`.
pub(super) fn format_count(n: f64) -> String {
    match n {
        n if n >= 1e6 => format!("{}m", n / 1e6),
        n if n >= 1e3 => format!("{}k", n / 1e3),
        n => format!("{n}"),
    }
}
