//! Bytes to lines, whatever program and system wrote them.

use std::borrow::Cow;

/// Text of a file: UTF-8, UTF-16 by its byte-order mark, else Windows-1252. True where the last
/// was a guess.
pub(super) fn decode(bytes: &[u8]) -> (Cow<'_, str>, bool) {
    use encoding_rs::{Encoding, WINDOWS_1252};
    if let Some((encoding, mark)) = Encoding::for_bom(bytes) {
        return (encoding.decode_without_bom_handling(&bytes[mark..]).0, false);
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => (Cow::Borrowed(text), false),
        Err(_) => (WINDOWS_1252.decode_without_bom_handling(bytes).0, true),
    }
}

/// A line with its number in the file, from 1. Lines joined by a backslash have the first's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: Cow<'a, str>,
}

/// Keywords that a name follows: there a backslash is a path's, and `#` part of the name.
const NAMED: [&str; 6] = ["o", "g", "usemtl", "mtllib", "newmtl", "usemap"];

fn takes_name(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or("");
    NAMED.contains(&word)
        || word.starts_with("map_")
        || matches!(word, "bump" | "norm" | "disp" | "decal" | "refl")
}

/// The lines that say something: CR, LF or both end them, a backslash at the end joins the next,
/// comments and blank lines are left out.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    // "\r\n" gives an empty line between, which counts for nothing: numbers come from LFs, or from
    // CRs where the file has no LF.
    let lone_cr = !text.contains('\n');
    let end = if lone_cr { '\r' } else { '\n' };
    let mut raw = text.split(end).enumerate();
    std::iter::from_fn(move || {
        loop {
            let (index, first) = raw.next()?;
            let mut line = Cow::Borrowed(trim(first));
            while line.ends_with('\\') && !takes_name(&line) && !line.starts_with('#') {
                let joined = line[..line.len() - 1].to_string();
                let Some((_, next)) = raw.next() else {
                    line = Cow::Owned(joined);
                    break;
                };
                line = Cow::Owned(format!("{joined} {}", trim(next)));
            }
            if !takes_name(&line)
                && let Some(at) = line.find('#')
            {
                line = Cow::Owned(line[..at].trim_end().to_string());
            }
            if !line.is_empty() && !line.starts_with('#') {
                return Some(Line { number: index + 1, text: line });
            }
        }
    })
}

fn trim(line: &str) -> &str {
    line.trim_matches(|c: char| c.is_whitespace() || c == '\0' || c == '\u{feff}')
}

/// The keyword of a line and what follows it, trimmed.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    match line.split_once(char::is_whitespace) {
        Some((word, rest)) => (word, rest.trim()),
        None => (line, ""),
    }
}

/// A number as forty years of programs wrote them: `1.5`, `.5`, `+3`, `1e-3`, Fortran's `1D-3`.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(v) = word.parse::<f64>() {
        return Some(v);
    }
    let fortran =
        word.contains(['d', 'D']) && word.bytes().all(|b| b.is_ascii_digit() || b"+-.dD".contains(&b));
    fortran.then(|| word.replace(['d', 'D'], "e").parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(usize, String)> {
        lines(text).map(|l| (l.number, l.text.into_owned())).collect()
    }

    #[test]
    fn every_line_end_ends_a_line() {
        for text in ["v 1\nf 2", "v 1\r\nf 2\r\n", "v 1\rf 2\r", "  v 1 \t\n\tf 2"] {
            assert_eq!(all(text), [(1, "v 1".into()), (2, "f 2".into())], "{text:?}");
        }
    }

    #[test]
    fn backslashes_join_but_not_inside_names() {
        assert_eq!(all("f 1 2\\\n 3\nf 4"), [(1, "f 1 2 3".into()), (3, "f 4".into())]);
        assert_eq!(all("mtllib a\\\nf 1"), [(1, "mtllib a\\".into()), (2, "f 1".into())]);
        assert_eq!(all("f 1 \\"), [(1, "f 1 ".into())]);
    }

    #[test]
    fn comments_end_data_but_belong_to_names() {
        assert_eq!(all("# c\nv 1 # x\n\nusemtl red #2"), [(2, "v 1".into()), (4, "usemtl red #2".into())]);
    }

    #[test]
    fn encodings() {
        let (text, guessed) = decode(b"\xef\xbb\xbfv 1");
        assert_eq!((text.as_ref(), guessed), ("v 1", false));
        let utf16: Vec<u8> =
            [0xfeffu16].into_iter().chain("v 1".encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert_eq!(decode(&utf16).0, "v 1");
        assert_eq!(decode(b"o caf\xe9"), ("o café".into(), true));
    }

    #[test]
    fn numbers_of_all_ages() {
        for (word, v) in
            [("1.5", 1.5), (".5", 0.5), ("5.", 5.0), ("+3", 3.0), ("1e+05", 1e5), ("-1.5D-3", -1.5e-3)]
        {
            assert_eq!(number(word), Some(v));
        }
        for word in ["", "x", "1.2.3", "d", "0x10", "--1"] {
            assert_eq!(number(word), None, "{word}");
        }
    }
}
