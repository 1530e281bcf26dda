//! Decodes OBJ and MTL text and splits it into logical lines: encodings, line ends, continuations, comments.

use std::borrow::Cow;

use super::number::parse_number;
use crate::files::escape::printable;

/// Decodes a file as UTF-8, or as UTF-16 with or without a byte-order mark. Lines that are neither are decoded as
/// Windows-1252 one by one, so that a comment in another encoding does not affect names; then the second value is
/// true.
pub(super) fn decode(bytes: &[u8]) -> (Cow<'_, str>, bool) {
    use encoding_rs::{Encoding, WINDOWS_1252};
    if let Some((encoding, mark)) = Encoding::for_bom(bytes) {
        return (encoding.decode_without_bom_handling(&bytes[mark..]).0, false);
    }
    if let Some(encoding) = unmarked_utf16(bytes) {
        return (encoding.decode_without_bom_handling(bytes).0, false);
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return (Cow::Borrowed(text), false);
    }
    let lines = bytes.split_inclusive(|b| matches!(b, b'\n' | b'\r'));
    let text = lines.map(|line| match std::str::from_utf8(line) {
        Ok(line) => Cow::Borrowed(line),
        Err(_) => WINDOWS_1252.decode_without_bom_handling(line).0,
    });
    (text.collect::<String>().into(), true)
}

/// Detects UTF-16 without a byte-order mark: every second byte of mostly ASCII text is zero.
fn unmarked_utf16(bytes: &[u8]) -> Option<&'static encoding_rs::Encoding> {
    let pairs = &bytes.get(..bytes.len().min(4096))?.as_chunks::<2>().0;
    let zeros = |k: usize| pairs.iter().filter(|p| p[k] == 0 && p[1 - k] != 0).count();
    let most = pairs.len() * 3 / 4;
    match (zeros(0), zeros(1)) {
        _ if pairs.is_empty() => None,
        (0, high) if high > most => Some(encoding_rs::UTF_16LE),
        (high, 0) if high > most => Some(encoding_rs::UTF_16BE),
        _ => None,
    }
}

/// Position in the file of a part of a logical line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Origin {
    /// Byte offset of the part in the logical line.
    offset: usize,
    /// Line and column in the file, one-based.
    line: usize,
    column: usize,
}

/// A logical line: a line of the file with its continuation lines. `number` is that of the first one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: Cow<'a, str>,
    first: Origin,
    joined: Vec<Origin>,
}

impl Line<'_> {
    /// Describes where `part`, a slice of `text`, is in the file.
    pub fn location(&self, part: &str) -> String {
        let offset = (part.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize);
        let origin = self.joined.iter().rev().find(|o| o.offset <= offset).unwrap_or(&self.first);
        let before = self.text.get(origin.offset..offset).unwrap_or("");
        let column = origin.column + before.chars().count();
        format!("line {}, column {column}, at '{}'", origin.line, printable(part))
    }

    /// Returns the text before this line if it is the last line of `text` and has no line end, as in a file that is
    /// cut off.
    pub fn before_cut<'t>(&self, text: &'t str) -> Option<&'t str> {
        if text.ends_with(['\n', '\r']) {
            return None;
        }
        let last_number = self.joined.last().map_or(self.number, |part| part.line);
        let mut lines = numbered_lines(text).skip_while(|(number, _)| *number < self.number);
        let start = lines.next()?.1.as_ptr() as usize - text.as_ptr() as usize;
        let count = self.number + lines.count();
        (count == last_number).then(|| &text[..start])
    }
}

/// Prefix of the comments in which ZBrush stores vertex colours (polypaint).
pub(super) const POLYPAINT: &str = "#MRGB";

/// Keywords followed by a name: in names a backslash separates folders and `#` is an ordinary character.
const NAME_KEYWORDS: [&str; 11] =
    ["o", "g", "usemtl", "mtllib", "newmtl", "usemap", "bump", "norm", "disp", "decal", "refl"];

/// Number of `#` in a name that are tried as the start of a comment.
const MAX_COMMENT_STARTS: usize = 16;

/// Returns a name up to its last `#`, if it has one.
pub(super) fn strip_comment(name: &str) -> Option<&str> {
    name.rsplit_once('#').map(|(front, _)| front.trim_end())
}

/// Returns the possible readings of a name: all of it, then with one more trailing comment removed each time.
pub(super) fn name_candidates(name: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(name), |name| strip_comment(name)).take(MAX_COMMENT_STARTS)
}

fn has_name_keyword(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or("");
    NAME_KEYWORDS.iter().any(|name| word.eq_ignore_ascii_case(name))
        || word.get(..4).is_some_and(|front| front.eq_ignore_ascii_case("map_"))
}

/// Returns the logical lines. CR, LF or CR LF end a line, a backslash at the end continues it; comments and blank
/// lines are skipped.
pub(super) fn logical_lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut raw = numbered_lines(text);
    std::iter::from_fn(move || {
        loop {
            let (number, untrimmed) = raw.next()?;
            let start = |line: usize, text: &str, offset: usize| {
                let blanks = text.len() - text.trim_start_matches(is_blank).len();
                Origin { offset, line, column: 1 + text[..blanks].chars().count() }
            };
            let first = start(number, untrimmed, 0);
            let mut line = Cow::Borrowed(trim(untrimmed));
            let mut joined = Vec::new();
            if line.ends_with('\\') && !has_name_keyword(&line) && !line.starts_with('#') {
                let mut text = line.into_owned();
                while text.ends_with('\\') {
                    text.pop();
                    let Some((number, next)) = raw.next() else { break };
                    text.push(' ');
                    joined.push(start(number, next, text.len()));
                    text.push_str(trim(next));
                }
                line = Cow::Owned(text);
            }
            if !has_name_keyword(&line)
                && !line.starts_with(POLYPAINT)
                && let Some(at) = comment_start(&line)
            {
                let end = line[..at].trim_end().len();
                match &mut line {
                    Cow::Borrowed(line) => *line = &line[..end],
                    Cow::Owned(line) => line.truncate(end),
                }
            }
            if !line.is_empty() {
                return Some(Line { number, text: line, first, joined });
            }
        }
    })
}

/// Returns the lines of the file with their one-based numbers.
fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    let mut number = 0;
    std::iter::from_fn(move || {
        let text = rest?;
        number += 1;
        let end = text.bytes().position(|b| b == b'\n' || b == b'\r');
        rest = end.map(|end| text[end..].strip_prefix("\r\n").unwrap_or(&text[end + 1..]));
        Some((number, end.map_or(text, |end| &text[..end])))
    })
}

/// Returns the start of a comment. `1.#QNAN` is no comment: C libraries write it for NaN.
fn comment_start(line: &str) -> Option<usize> {
    let is_nan_or_inf = |at: usize| {
        line[..at].ends_with('.') && line[at + 1..].starts_with(['I', 'N', 'Q', 'S', 'i', 'n', 'q', 's'])
    };
    line.match_indices('#').map(|(at, _)| at).find(|&at| !is_nan_or_inf(at))
}

/// White space, NUL, a byte-order mark, or 0x1A, which ends DOS text files.
fn is_blank(c: char) -> bool {
    c.is_whitespace() || matches!(c, '\0' | '\u{1a}' | '\u{feff}')
}

/// Trims blanks from both ends of a line.
pub(super) fn trim(line: &str) -> &str {
    line.trim_matches(is_blank)
}

/// Splits a line into its keyword and the trimmed rest.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    match line.split_once(char::is_whitespace) {
        Some((word, rest)) => (word, rest.trim()),
        None => (line, ""),
    }
}

/// Statements without effect on rendered faces: edge and curve display, levels of detail, shadow and reflection
/// proxies, texture libraries.
const IGNORED: [&str; 11] = [
    "bevel",
    "c_interp",
    "ctech",
    "d_interp",
    "lod",
    "maplib",
    "mg",
    "shadow_obj",
    "stech",
    "trace_obj",
    "usemap",
];

/// Returns true for the keyword of a statement without effect on the picture.
pub(super) fn is_ignored(keyword: &str) -> bool {
    IGNORED.contains(&keyword)
}

/// Keywords of free-form geometry besides those that define a curve or surface.
const FREE_FORM: [&str; 14] = [
    "bmat", "con", "cstype", "curv2", "deg", "end", "hole", "parm", "res", "scrv", "sp", "step", "trim", "vp",
];

/// Returns true for a keyword that describes a free-form curve or surface.
pub(super) fn is_free_form(keyword: &str) -> bool {
    FREE_FORM.contains(&keyword)
}

/// Returns the smoothing group of an `s` statement; 0, off, for anything but a number.
pub(super) fn smoothing_group(rest: &str) -> u32 {
    match rest {
        "on" | "On" | "ON" => 1,
        other => other.parse().ok().or_else(|| parse_number(other).map(|v| v.max(0.0) as u32)).unwrap_or(0),
    }
}

/// Returns the texts of the vertices of a `p` or `l`, without texture coordinates, which points and lines do not use.
pub(super) fn round_vertices(rest: &str) -> impl Iterator<Item = &str> {
    let joined = joined_vertices(rest).unwrap_or_default();
    let words = if joined.is_empty() { rest } else { "" };
    joined.into_iter().chain(words.split_whitespace().map(|word| word.split('/').next().unwrap_or("")))
}

/// Returns the vertices of a line in the form that VTK's exporter writes if there are texture coordinates, whose indices are
/// those of the vertices: `21/2122/22` for `21/21 22/22`.
fn joined_vertices(rest: &str) -> Option<Vec<&str>> {
    let rest = rest.trim();
    if rest.contains(char::is_whitespace) || !rest.contains('/') {
        return None;
    }
    let mut vertices: Vec<&str> = Vec::new();
    for part in rest.split('/') {
        vertices.push(part.strip_prefix(*vertices.last().unwrap_or(&""))?);
    }
    let is_complete = vertices.pop()?.is_empty() && !vertices.contains(&"");
    (is_complete && vertices.len() > 1).then_some(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(usize, String)> {
        logical_lines(text).map(|l| (l.number, l.text.into_owned())).collect()
    }

    #[test]
    fn cr_lf_and_crlf_end_lines() {
        for text in ["v 1\nf 2", "v 1\r\nf 2\r\n", "v 1\rf 2\r", "  v 1 \t\n\tf 2"] {
            assert_eq!(all(text), [(1, "v 1".into()), (2, "f 2".into())], "{text:?}");
        }
        // Mixed line ends in one file.
        assert_eq!(
            all("v 1\rf 2\nv 3\r\nf 4"),
            [(1, "v 1".into()), (2, "f 2".into()), (3, "v 3".into()), (4, "f 4".into())]
        );
    }

    #[test]
    fn backslashes_continue_lines_except_in_names() {
        assert_eq!(all("f 1 2\\\n 3\nf 4"), [(1, "f 1 2 3".into()), (3, "f 4".into())]);
        assert_eq!(all("mtllib a\\\nf 1"), [(1, "mtllib a\\".into()), (2, "f 1".into())]);
        assert_eq!(all("f 1 \\"), [(1, "f 1 ".into())]);
    }

    #[test]
    fn locations_are_lines_and_columns_of_the_file() {
        let line = logical_lines("\n \tf 1 2\\\n  3 é x\n").next().unwrap();
        let location = |word: &str| line.location(&line.text[line.text.find(word).unwrap()..][..word.len()]);
        assert_eq!(location("2"), "line 2, column 7, at '2'");
        assert_eq!(location("3"), "line 3, column 3, at '3'");
        assert_eq!(location("x"), "line 3, column 7, at 'x'");
    }

    #[test]
    fn lines_without_blanks_between_vertices_are_those_of_vtk() {
        for (rest, expected) in [
            ("21/2122/22", &["21", "22"][..]),
            (" 9/910/1011/11 ", &["9", "10", "11"]),
            ("1/12/2", &["1", "2"]),
            ("1/1", &["1"]),
            ("7", &["7"]),
            ("1/1 2/2", &["1", "2"]),
            ("1/12/2 3/3", &["1", "3"]),
            ("1/1/1", &["1"]),
            ("1/2/3", &["1"]),
            ("1//3", &["1"]),
            ("/", &[""]),
            ("", &[]),
        ] {
            assert_eq!(round_vertices(rest).collect::<Vec<_>>(), expected, "{rest}");
        }
    }

    #[test]
    fn comments_end_data_but_are_part_of_names() {
        assert_eq!(all("# c\nv 1 # x\n\nusemtl red #2"), [(2, "v 1".into()), (4, "usemtl red #2".into())]);
        // MTL keywords are case-insensitive.
        for line in ["Map_Kd tex#1.png", "NEWMTL a#1", "Bump a#1", "Refl a#1"] {
            assert_eq!(all(line), [(1, line.into())]);
        }
    }

    #[test]
    fn encodings_are_detected() {
        let (text, guessed) = decode(b"\xef\xbb\xbfv 1");
        assert_eq!((text.as_ref(), guessed), ("v 1", false));
        let utf16: Vec<u8> =
            [0xfeffu16].into_iter().chain("v 1".encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert_eq!(decode(&utf16).0, "v 1");
        for unmarked in [u16::to_le_bytes, u16::to_be_bytes] {
            let utf16: Vec<u8> = "v 1 2 3\no é\n".encode_utf16().flat_map(unmarked).collect();
            assert_eq!(decode(&utf16), ("v 1 2 3\no é\n".into(), false));
        }
        assert_eq!(decode(b"o caf\xe9"), ("o café".into(), true));
        let mixed = [&b"# caf\xe9\r\nusemtl "[..], "Küche\n".as_bytes()].concat();
        assert_eq!(decode(&mixed), ("# café\r\nusemtl Küche\n".into(), true));
    }

    #[test]
    fn nan_of_c_libraries_is_no_comment() {
        assert_eq!(all("v 1.#QNAN 0 0 # x"), [(1, "v 1.#QNAN 0 0".into())]);
    }
}
