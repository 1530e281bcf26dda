//! Accents of the stroke font: marks above and below a letter.

/// Where a mark stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Over the letter.
    Above,
    /// Under its baseline.
    Below,
}

/// Returns the strokes of a combining character, in the format of glyphs: x from 0 to 4, with 2 at the letter's middle,
/// y from 0 to 2.
pub fn mark(c: char) -> Option<(Place, &'static str)> {
    use Place::{Above, Below};
    Some(match c {
        '\u{300}' => (Above, "L1220"),
        '\u{301}' => (Above, "L2032"),
        '\u{302}' => (Above, "L102230"),
        '\u{303}' => (Above, "O0002224042"),
        '\u{304}' => (Above, "L0141"),
        '\u{306}' => (Above, "O12103032"),
        '\u{307}' => (Above, "L2121"),
        '\u{308}' => (Above, "L1111 L3131"),
        '\u{309}' => (Above, "O12322120"),
        '\u{30a}' => (Above, "C12323010"),
        '\u{30b}' => (Above, "L1022 L3042"),
        '\u{30c}' => (Above, "L122032"),
        '\u{323}' => (Below, "L2020"),
        '\u{326}' => (Below, "L2110"),
        '\u{327}' => (Below, "L2221 O21312010"),
        '\u{328}' => (Below, "O22111030"),
        '\u{331}' => (Below, "L0040"),
        _ => return None,
    })
}
