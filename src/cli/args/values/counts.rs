//! Parsers of counts and tolerances.

use blinn_bench::scenes;
use blinn_core::worded;
use blinn_session::FrameList;
use blinn_session::values::number;

/// A number that is not negative, as the largest difference that counts as equal.
pub fn tolerance(text: &str) -> Result<f32, String> {
    Ok(distance_tolerance(text)? as f32)
}

/// A distance that is not negative.
pub fn distance_tolerance(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v >= 0.0 { Ok(v) } else { Err("must not be negative".into()) }
}

/// Triangle counts such as `70k,1.1m`.
pub fn triangle_counts(text: &str) -> Result<Vec<usize>, String> {
    text.split(',').map(|part| scenes::parse_triangle_count(part.trim())).collect()
}

/// The number of frames in a turn. A list of frames, as `blinn render --frames` takes it, is an error that points to
/// --only.
pub fn frame_count(text: &str) -> Result<u32, String> {
    let count = text.parse().ok().filter(|count| (1..=1_000_000).contains(count));
    count.ok_or_else(|| {
        let is_list = text.parse::<u64>().is_err() && FrameList::parse(text).is_ok();
        let list = if is_list { text } else { "LIST" };
        worded!(
            "expected the number of frames in a turn, 1 to 1000000; to render some of them, use `only` {}",
            list
        )
    })
}
