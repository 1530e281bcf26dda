//! Compares file names regardless of letter case and Unicode normal form.
//!
//! A letter with an accent is one character in Unicode's normal form C (NFC) and two in form D (NFD). macOS
//! stored file names as NFD, and archives that were made there still contain them.

use unicode_normalization::UnicodeNormalization;

/// Converts a name to normal form D.
pub(crate) fn decompose(name: &str) -> String {
    // ASCII is already in form D.
    if name.is_ascii() { name.into() } else { name.nfd().collect() }
}

/// Converts a name to lower case in normal form D.
pub(crate) fn fold_case(name: &str) -> String {
    // Lower-case letters may decompose where upper-case ones do not.
    decompose(&decompose(name).to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_equal_in_any_normal_form_and_case() {
        let composed = "K\u{fc}che";
        let decomposed = "Ku\u{308}che";
        assert_eq!(decompose(composed), decompose(decomposed));
        assert_ne!(decompose(composed), decompose("K\u{dc}che"));
        for other in [decomposed, "k\u{fc}che", "KU\u{308}CHE", "K\u{dc}CHE"] {
            assert_eq!(fold_case(composed), fold_case(other), "{other}");
        }
        // A letter with two marks, in every order and composition.
        for other in ["\u{1e69}", "s\u{323}\u{307}", "s\u{307}\u{323}", "\u{1e68}", "\u{1e63}\u{307}"] {
            assert_eq!(fold_case("\u{1e69}"), fold_case(other), "{other}");
        }
        assert_ne!(fold_case("Kuche"), fold_case(composed));
        // Compatibility equivalents (NFKD) are different names.
        assert_ne!(fold_case("\u{fb01}"), fold_case("fi"));
    }
}
