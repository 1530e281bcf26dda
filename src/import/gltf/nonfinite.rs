//! Replaces NaN and Infinity, which JSON does not allow but Python's `json` module writes.

const WORDS: [&str; 3] = ["NaN", "Infinity", "-Infinity"];

/// Text with its non-finite numbers replaced.
#[derive(Debug, PartialEq)]
pub(super) struct Replaced {
    pub text: String,
    pub count: usize,
    /// Position of the first replaced number.
    pub first: Position,
}

/// Line and column of a character, from 1.
#[derive(Debug, PartialEq)]
pub(super) struct Position {
    pub line: usize,
    pub column: usize,
}

/// Replaces every non-finite number by `null`; `None` if there are none.
pub(super) fn replace_by_null(text: &str) -> Option<Replaced> {
    let bytes = text.as_bytes();
    let mut out = String::with_capacity(text.len());
    let mut count = 0;
    let mut first = None;
    let mut copied = 0;
    let mut at = 0;
    while at < bytes.len() {
        let word = WORDS.iter().find(|word| bytes[at..].starts_with(word.as_bytes()));
        if let Some(word) = word {
            first.get_or_insert(at);
            out.push_str(&text[copied..at]);
            out.push_str("null");
            at += word.len();
            copied = at;
            count += 1;
        } else if bytes[at] == b'"' {
            at = end_of_string(bytes, at + 1);
        } else {
            at += 1;
        }
    }
    out.push_str(&text[copied..]);
    Some(Replaced { text: out, count, first: position(&text[..first?]) })
}

/// Position of the character after `before`.
fn position(before: &str) -> Position {
    let line = before.rsplit('\n').next().unwrap_or(before);
    Position { line: before.matches('\n').count() + 1, column: line.chars().count() + 1 }
}

/// Offset after the closing quotation mark of a string whose first byte is at `at`.
fn end_of_string(bytes: &[u8], mut at: usize) -> usize {
    while at < bytes.len() && bytes[at] != b'"' {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    at + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_outside_of_strings_are_replaced() {
        let text = r#"{"NaN":[NaN,-Infinity , Infinity],"a\"NaN":"NaN \\","é":-1}"#;
        let expected = r#"{"NaN":[null,null , null],"a\"NaN":"NaN \\","é":-1}"#;
        let replaced = replace_by_null(text).unwrap();
        assert_eq!((replaced.text.as_str(), replaced.count), (expected, 3));
        assert_eq!(replaced.first, Position { line: 1, column: 9 });
        assert_eq!(replace_by_null("[\n\"é\", NaN]").unwrap().first, Position { line: 2, column: 6 });
        for broken in ["", "\"", "\"\\", "NaN\"\\é", "-"] {
            assert!(replace_by_null(broken).is_none_or(|replaced| replaced.count == 1), "{broken}");
        }
    }
}
