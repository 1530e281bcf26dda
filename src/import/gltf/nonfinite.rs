//! NaN and Infinity, which are no JSON, and which Python's writer makes all the same.

const WORDS: [&str; 3] = ["NaN", "Infinity", "-Infinity"];

/// What [`as_null`] makes of a text.
#[derive(Debug, PartialEq)]
pub(super) struct Mended {
    pub text: String,
    pub count: usize,
    /// Line and column, in characters from 1, of the first that was replaced.
    pub first: (usize, usize),
}

/// The text with `null` in the place of each; `None` where there are none.
pub(super) fn as_null(text: &str) -> Option<Mended> {
    let bytes = text.as_bytes();
    let (mut out, mut count, mut first) = (String::with_capacity(text.len()), 0, None);
    let (mut copied, mut at) = (0, 0);
    while at < bytes.len() {
        let word = WORDS.iter().find(|word| bytes[at..].starts_with(word.as_bytes()));
        if let Some(word) = word {
            first.get_or_insert(at);
            out.push_str(&text[copied..at]);
            out.push_str("null");
            at += word.len();
            (copied, count) = (at, count + 1);
        } else if bytes[at] == b'"' {
            at = end_of_string(bytes, at + 1);
        } else {
            at += 1;
        }
    }
    out.push_str(&text[copied..]);
    let before = &text[..first?];
    let line = before.rsplit('\n').next().unwrap_or(before);
    let first = (before.matches('\n').count() + 1, line.chars().count() + 1);
    Some(Mended { text: out, count, first })
}

/// Behind the quotation mark that ends a string, of which the first byte is at `at`.
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
    fn words_alone_are_replaced() {
        let text = r#"{"NaN":[NaN,-Infinity , Infinity],"a\"NaN":"NaN \\","é":-1}"#;
        let expected = r#"{"NaN":[null,null , null],"a\"NaN":"NaN \\","é":-1}"#;
        assert_eq!(as_null(text), Some(Mended { text: expected.into(), count: 3, first: (1, 9) }));
        assert_eq!(as_null("[\n\"é\", NaN]").unwrap().first, (2, 6));
        for broken in ["", "\"", "\"\\", "NaN\"\\é", "-"] {
            assert!(as_null(broken).is_none_or(|mended| mended.count == 1), "{broken}");
        }
    }
}
