//! Escapes names from files for messages.

/// Characters of a name that a message shows.
const MAX_CHARS: usize = 120;

/// Makes a name safe for a line of text: escapes control characters and bidirectional overrides, and cuts
/// long names.
pub(crate) fn printable(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars().take(MAX_CHARS) {
        // Overrides of the writing direction disguise a name as another.
        let is_bidi_control = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if c.is_control() || is_bidi_control {
            text.extend(c.escape_default());
        } else {
            text.push(c);
        }
    }
    if name.chars().count() > MAX_CHARS {
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_long_names_cut() {
        assert_eq!(printable("a\x1b[31m\n\u{202e}b é"), r"a\u{1b}[31m\n\u{202e}b é");
        assert_eq!(printable(&"x".repeat(200)).chars().count(), 121);
    }
}
