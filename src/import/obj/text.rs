//! Bytes to lines, whatever program and system wrote them.

use std::borrow::Cow;

use crate::import::files::escape::printable;

/// Text of a file: UTF-8, UTF-16 with or without a byte-order mark, else Windows-1252. True where
/// the last was a guess, of whole lines: a comment of another program's leaves the names as they are.
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

/// UTF-16 without a mark: every second byte of what is mostly ASCII is zero.
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

/// Where a stretch of a line's text comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Origin {
    /// Where it begins in the line's text.
    offset: usize,
    /// Line and column in the file, from 1.
    line: usize,
    column: usize,
}

/// A line with its place in the file. Lines joined by a backslash have the first's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: Cow<'a, str>,
    first: Origin,
    joined: Vec<Origin>,
}

impl Line<'_> {
    /// Line and column of a part of `text`, and the part itself.
    pub fn place(&self, part: &str) -> String {
        let within = (part.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize);
        let origin = self.joined.iter().rev().find(|o| o.offset <= within).unwrap_or(&self.first);
        let before = self.text.get(origin.offset..within).unwrap_or("");
        let column = origin.column + before.chars().count();
        format!("line {}, column {column}, at '{}'", origin.line, printable(part))
    }
}

/// What ZBrush's comments with vertex colours begin with.
pub(super) const POLYPAINT: &str = "#MRGB";

/// Keywords that a name follows: there a backslash is a path's, and `#` part of the name.
const NAMED: [&str; 11] =
    ["o", "g", "usemtl", "mtllib", "newmtl", "usemap", "bump", "norm", "disp", "decal", "refl"];

/// Number signs of a name that are looked at.
const COMMENTS: usize = 16;

/// A name up to its last number sign, if it has one.
pub(super) fn without_comment(name: &str) -> Option<&str> {
    name.rsplit_once('#').map(|(front, _)| front.trim_end())
}

/// What may be meant where a name stands: all of it, or as much as is no comment.
pub(super) fn readings(name: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(name), |name| without_comment(name)).take(COMMENTS)
}

fn takes_name(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or("");
    NAMED.iter().any(|name| word.eq_ignore_ascii_case(name))
        || word.get(..4).is_some_and(|front| front.eq_ignore_ascii_case("map_"))
}

/// The lines that say something: CR, LF or both end them, a backslash at the end joins the next,
/// comments and blank lines are left out.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut raw = raw_lines(text);
    std::iter::from_fn(move || {
        loop {
            let (number, untrimmed) = raw.next()?;
            let start = |line: usize, text: &str, offset: usize| {
                let blanks = text.len() - text.trim_start_matches(blank).len();
                Origin { offset, line, column: 1 + text[..blanks].chars().count() }
            };
            let first = start(number, untrimmed, 0);
            let mut line = Cow::Borrowed(trim(untrimmed));
            let mut joined = Vec::new();
            if line.ends_with('\\') && !takes_name(&line) && !line.starts_with('#') {
                let mut whole = line.into_owned();
                while whole.ends_with('\\') {
                    whole.pop();
                    let Some((number, next)) = raw.next() else { break };
                    whole.push(' ');
                    joined.push(start(number, next, whole.len()));
                    whole.push_str(trim(next));
                }
                line = Cow::Owned(whole);
            }
            if !takes_name(&line)
                && !line.starts_with(POLYPAINT)
                && let Some(at) = comment(&line)
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

/// Lines with their numbers, whatever ends them.
fn raw_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
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

/// Where a comment begins. `1.#QNAN` is none, but what C libraries write for no number.
fn comment(line: &str) -> Option<usize> {
    let odd = |at: usize| {
        line[..at].ends_with('.') && line[at + 1..].starts_with(['I', 'N', 'Q', 'S', 'i', 'n', 'q', 's'])
    };
    line.match_indices('#').map(|(at, _)| at).find(|&at| !odd(at))
}

/// Programs of DOS end a file with the character 1A.
fn blank(c: char) -> bool {
    c.is_whitespace() || matches!(c, '\0' | '\u{1a}' | '\u{feff}')
}

/// A line without what surrounds it.
pub(super) fn trim(line: &str) -> &str {
    line.trim_matches(blank)
}

/// The keyword of a line and what follows it, trimmed.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    match line.split_once(char::is_whitespace) {
        Some((word, rest)) => (word, rest.trim()),
        None => (line, ""),
    }
}

/// Statements that say nothing of how faces look here: how edges and curves are drawn, which parts stand for others
/// in the distance, in shadows and in mirrors, and textures by another way than a material's.
const IDLE: [&str; 11] = [
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

/// True of a statement's keyword that changes no picture.
pub(super) fn is_idle(keyword: &str) -> bool {
    IDLE.contains(&keyword)
}

/// What is said of curves and surfaces, beside that they are there.
const OF_FREE_FORMS: [&str; 14] = [
    "bmat", "con", "cstype", "curv2", "deg", "end", "hole", "parm", "res", "scrv", "sp", "step", "trim", "vp",
];

/// True of a statement's keyword that says something of a curve or surface.
pub(super) fn is_of_free_forms(keyword: &str) -> bool {
    OF_FREE_FORMS.contains(&keyword)
}

/// A number as forty years of programs wrote them: `1.5`, `.5`, `+3`, `1e-3`, Fortran's `1D-3`, C's `1.5f`,
/// and what C libraries write for none. Always rounded to the nearest `f32` at once.
pub(super) fn number(word: &str) -> Option<f32> {
    if let Ok(v) = word.parse::<f32>() {
        return Some(v);
    }
    // As in the text of programs.
    if let Some(v) = word.strip_suffix(['f', 'F']).and_then(|word| word.parse().ok()) {
        return Some(v);
    }
    let bare = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    if let Some((_, kind)) = bare.split_once(".#") {
        let infinite = kind.starts_with("inf");
        let known =
            infinite || kind.starts_with("qnan") || kind.starts_with("snan") || kind.starts_with("ind");
        return known.then_some(if infinite { f32::INFINITY } else { f32::NAN });
    }
    if bare.starts_with("nan(") {
        return Some(f32::NAN);
    }
    let fortran =
        word.contains(['d', 'D']) && word.bytes().all(|b| b.is_ascii_digit() || b"+-.dD".contains(&b));
    fortran.then(|| word.replace(['d', 'D'], "e").parse().ok()).flatten()
}

/// A number whose exponent is none, as in `3.1+e2`: what stands before it.
pub(super) fn mantissa(word: &str) -> Option<f32> {
    let at = word.char_indices().skip(1).find(|(_, c)| "+-eE".contains(*c))?.0;
    let exponent = word[at..].bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
    exponent.then(|| number(&word[..at])).flatten()
}

/// What an `s` line turns on; 0 is off, as is whatever is no number.
pub(super) fn smoothing(rest: &str) -> u32 {
    match rest {
        "on" | "On" | "ON" => 1,
        other => other.parse().ok().or_else(|| number(other).map(|v| v.max(0.0) as u32)).unwrap_or(0),
    }
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
        // Ends of all kinds in one file.
        assert_eq!(
            all("v 1\rf 2\nv 3\r\nf 4"),
            [(1, "v 1".into()), (2, "f 2".into()), (3, "v 3".into()), (4, "f 4".into())]
        );
    }

    /// Pitfall 24.
    #[test]
    fn backslashes_join_but_not_inside_names() {
        assert_eq!(all("f 1 2\\\n 3\nf 4"), [(1, "f 1 2 3".into()), (3, "f 4".into())]);
        assert_eq!(all("mtllib a\\\nf 1"), [(1, "mtllib a\\".into()), (2, "f 1".into())]);
        assert_eq!(all("f 1 \\"), [(1, "f 1 ".into())]);
    }

    #[test]
    fn places_are_those_of_the_file() {
        let line = lines("\n \tf 1 2\\\n  3 é x\n").next().unwrap();
        let place = |word: &str| line.place(&line.text[line.text.find(word).unwrap()..][..word.len()]);
        assert_eq!(place("2"), "line 2, column 7, at '2'");
        assert_eq!(place("3"), "line 3, column 3, at '3'");
        assert_eq!(place("x"), "line 3, column 7, at 'x'");
    }

    #[test]
    fn comments_end_data_but_belong_to_names() {
        assert_eq!(all("# c\nv 1 # x\n\nusemtl red #2"), [(2, "v 1".into()), (4, "usemtl red #2".into())]);
        // MTLs' keywords count in any case.
        for line in ["Map_Kd tex#1.png", "NEWMTL a#1", "Bump a#1", "Refl a#1"] {
            assert_eq!(all(line), [(1, line.into())]);
        }
    }

    #[test]
    fn encodings() {
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
    fn numbers_of_all_ages() {
        for (word, v) in
            [("1.5", 1.5), (".5", 0.5), ("5.", 5.0), ("+3", 3.0), ("1e+05", 1e5), ("-1.5D-3", -1.5e-3)]
                .into_iter()
                .chain([("1.5f", 1.5), ("1.F", 1.0), ("-2e1f", -20.0)])
        {
            assert_eq!(number(word), Some(v));
        }
        for word in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND00"] {
            assert!(number(word).unwrap().is_nan(), "{word}");
        }
        assert_eq!(number("1.#INF"), Some(f32::INFINITY));
        assert_eq!(all("v 1.#QNAN 0 0 # x"), [(1, "v 1.#QNAN 0 0".into())]);
        for word in ["", "x", "1.2.3", "d", "0x10", "0x1f", "--1", "f", "-f", "1ff", "1.5m"] {
            assert_eq!(number(word), None, "{word}");
        }
    }
}
