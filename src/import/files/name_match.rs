//! Names that are meant to be the same, and are other bytes: in another case, or with letters put together in
//! another way.
//!
//! A letter with an accent is one character or two, and looks the same: Unicode's normal forms C and D. Disks of a
//! Mac gave names back in the second, and files that were packed there have them still.

use unicode_normalization::UnicodeNormalization;

/// The name with its letters taken apart: the same for all ways to put them together.
pub(crate) fn apart(name: &str) -> String {
    // Most names have nothing to take apart.
    if name.is_ascii() { name.into() } else { name.nfd().collect() }
}

/// The name with its letters taken apart, in lower case: the same for all cases too.
pub(crate) fn caseless(name: &str) -> String {
    // A small letter may have parts that its capital has not.
    apart(&apart(name).to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_alike_in_any_form_and_case() {
        let (composed, decomposed) = ("K\u{fc}che", "Ku\u{308}che");
        assert_eq!(apart(composed), apart(decomposed));
        assert_ne!(apart(composed), apart("K\u{dc}che"));
        for other in [decomposed, "k\u{fc}che", "KU\u{308}CHE", "K\u{dc}CHE"] {
            assert_eq!(caseless(composed), caseless(other), "{other}");
        }
        // Three letters with the same two marks, which are put in order.
        for other in ["\u{1e69}", "s\u{323}\u{307}", "s\u{307}\u{323}", "\u{1e68}", "\u{1e63}\u{307}"] {
            assert_eq!(caseless("\u{1e69}"), caseless(other), "{other}");
        }
        assert_ne!(caseless("Kuche"), caseless(composed));
        // Other characters that are compatible are other names.
        assert_ne!(caseless("\u{fb01}"), caseless("fi"));
    }
}
