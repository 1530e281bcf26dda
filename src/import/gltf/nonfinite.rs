//! NaN and Infinity, which are no JSON, and which Python's writer makes all the same.

const WORDS: [&str; 3] = ["NaN", "Infinity", "-Infinity"];

/// The text with `null` in the place of each, and how many there are.
pub(super) fn as_null(text: &str) -> (String, usize) {
    let bytes = text.as_bytes();
    let (mut out, mut count) = (String::with_capacity(text.len()), 0);
    let (mut copied, mut at) = (0, 0);
    while at < bytes.len() {
        let word = WORDS.iter().find(|word| bytes[at..].starts_with(word.as_bytes()));
        if let Some(word) = word {
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
    (out, count)
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
        assert_eq!(as_null(text), (expected.into(), 3));
        for broken in ["", "\"", "\"\\", "NaN\"\\é", "-"] {
            assert!(as_null(broken).1 <= 1, "{broken}");
        }
    }
}
