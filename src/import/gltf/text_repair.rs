//! Repairs JSON text for the sake of single values that the parser refuses: NaN and numbers beyond f64, half
//! surrogate pairs, deep nesting.

use crate::error::Warnings;

/// Nesting that is kept. No property that is shown lies deeper than about 15 levels, and the parser and all
/// recursive functions behind it accept 127.
const MAX_DEPTH: usize = 100;

/// A kind of defect.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Defect {
    /// NaN, an infinity, or a number that overflows f64. Replaced by null.
    NonFinite,
    /// A value in the spelling of another language, such as `.5`, `+1` or `True`.
    Spelling,
    /// A half surrogate pair, an unknown escape or a control character in a string.
    Text,
    /// An object or array below [`MAX_DEPTH`]. Replaced by null.
    Depth,
}

/// Number of defects of each kind and the position of the first.
const DEFECTS: [Defect; 4] = [Defect::NonFinite, Defect::Spelling, Defect::Text, Defect::Depth];

/// JSON text with its defects repaired.
#[derive(Debug)]
pub(super) struct RepairedText {
    pub text: String,
    found: [Found; DEFECTS.len()],
    edits: Vec<Edit>,
}

/// Defects of one kind.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    count: usize,
    /// Offset of the first in the original text.
    first: usize,
}

/// The ends of a replaced part.
#[derive(Clone, Copy, Debug)]
struct Edit {
    repaired: usize,
    original: usize,
}

/// Line and column of a character, from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Position {
    pub line: usize,
    pub column: usize,
}

/// Repairs all defects of a text; `None` if it has none.
pub(super) fn repair(text: &str) -> Option<RepairedText> {
    let mut scanner = Scanner::new(text);
    scanner.scan();
    let Scanner { mut repaired, copied, .. } = scanner;
    repaired.text.push_str(&text[copied..]);
    (!repaired.edits.is_empty()).then_some(repaired)
}

impl RepairedText {
    /// Returns true if the text has NaN or infinite numbers.
    pub fn has_nonfinite(&self) -> bool {
        self.found[Defect::NonFinite as usize].count > 0
    }

    /// Warns of each kind of defect, at its first position in the original text.
    pub fn warn(&self, original: &str, warnings: &mut Warnings) {
        for (defect, found) in DEFECTS.iter().zip(&self.found).filter(|(_, found)| found.count > 0) {
            let Position { line, column } = position(original, found.first);
            let count = found.count;
            let message = match defect {
                Defect::NonFinite => {
                    format!("ignored {count} invalid numbers (NaN or Infinity) and the arrays with them")
                }
                Defect::Spelling => {
                    format!("read {count} values that are not spelled as in JSON (such as '.5' or 'True')")
                }
                Defect::Text => format!("replaced {count} invalid characters or escapes in strings"),
                Defect::Depth => format!("ignored {count} values nested deeper than {MAX_DEPTH} levels"),
            };
            warnings.add(format_args!("JSON, line {line} column {column}"), message);
        }
    }

    /// The position in the original text for a position in the repaired text.
    pub fn original_position(&self, original: &str, at: Position) -> Position {
        let lines = self.text.split_inclusive('\n').take(at.line.saturating_sub(1));
        let offset = lines.map(str::len).sum::<usize>() + at.column.saturating_sub(1);
        let before = self.edits.partition_point(|edit| edit.repaired <= offset);
        let edit = before.checked_sub(1).map(|i| self.edits[i]);
        position(original, edit.map_or(offset, |edit| edit.original + (offset - edit.repaired)))
    }
}

/// Position of the character at an offset, which is rounded down to a character.
fn position(text: &str, offset: usize) -> Position {
    let before = &text[..text.floor_char_boundary(offset)];
    let line = before.rsplit('\n').next().unwrap_or(before);
    Position { line: before.matches('\n').count() + 1, column: line.chars().count() + 1 }
}

/// Reads the text token by token, without recursion and without checking its grammar.
struct Scanner<'t> {
    text: &'t str,
    bytes: &'t [u8],
    repaired: RepairedText,
    /// Offset up to which the text is copied.
    copied: usize,
    at: usize,
    depth: usize,
}

impl<'t> Scanner<'t> {
    fn new(text: &'t str) -> Scanner<'t> {
        let found = [Found::default(); DEFECTS.len()];
        let repaired = RepairedText { text: String::with_capacity(text.len()), found, edits: Vec::new() };
        Scanner { text, bytes: text.as_bytes(), repaired, copied: 0, at: 0, depth: 0 }
    }

    fn scan(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'"' => self.string(),
                b'{' | b'[' if self.depth == MAX_DEPTH => {
                    let end = end_of_container(self.bytes, self.at).unwrap_or(self.bytes.len());
                    self.replace(end, "null", Defect::Depth);
                }
                b'{' | b'[' => {
                    self.depth += 1;
                    self.at += 1;
                }
                b'}' | b']' => {
                    self.depth = self.depth.saturating_sub(1);
                    self.at += 1;
                }
                _ if is_delimiter(byte) => self.at += 1,
                _ => self.word(),
            }
        }
    }

    /// Replaces the text from the current position to `end`, and moves there.
    fn replace(&mut self, end: usize, with: &str, defect: Defect) {
        let RepairedText { text, found, edits } = &mut self.repaired;
        text.push_str(&self.text[self.copied..self.at]);
        text.push_str(with);
        edits.push(Edit { repaired: text.len(), original: end });
        let found = &mut found[defect as usize];
        if found.count == 0 {
            found.first = self.at;
        }
        found.count += 1;
        self.copied = end;
        self.at = end;
    }

    /// Reads a number or literal.
    fn word(&mut self) {
        let rest = &self.bytes[self.at..];
        let end = self.at + rest.iter().position(|&b| is_delimiter(b)).unwrap_or(rest.len());
        match corrected(&self.text[self.at..end]) {
            Some((value, defect)) => self.replace(end, &value, defect),
            None => self.at = end,
        }
    }

    /// Reads a string.
    fn string(&mut self) {
        self.at += 1;
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'"' => {
                    self.at += 1;
                    return;
                }
                b'\\' => self.escape(),
                0..0x20 => {
                    let escaped = format!("\\u{byte:04x}");
                    self.replace(self.at + 1, &escaped, Defect::Text);
                }
                _ => self.at += 1,
            }
        }
    }

    /// Reads an escape sequence. The backslash of an unknown one stands for itself, as in `C:\Users`.
    fn escape(&mut self) {
        match self.bytes.get(self.at + 1) {
            Some(b'"' | b'\\' | b'/' | b'b' | b'f' | b'n' | b'r' | b't') => self.at += 2,
            Some(b'u') => match (self.code_unit(self.at), self.code_unit(self.at + 6)) {
                (Some(0xD800..0xDC00), Some(0xDC00..0xE000)) => self.at += 12,
                (Some(0xD800..0xE000), _) => self.replace(self.at + 6, "\u{fffd}", Defect::Text),
                (Some(_), _) => self.at += 6,
                (None, _) => self.replace(self.at + 1, "\\\\", Defect::Text),
            },
            Some(_) => self.replace(self.at + 1, "\\\\", Defect::Text),
            None => self.at += 1,
        }
    }

    /// The UTF-16 code unit of an escape sequence `\uXXXX`.
    fn code_unit(&self, at: usize) -> Option<u32> {
        let digits = self.bytes.get(at..at + 6)?.strip_prefix(b"\\u")?;
        digits.iter().try_fold(0, |unit, &digit| Some(unit << 4 | char::from(digit).to_digit(16)?))
    }
}

fn is_delimiter(byte: u8) -> bool {
    matches!(byte, b'{' | b'}' | b'[' | b']' | b',' | b':' | b'"') || byte.is_ascii_whitespace()
}

/// The JSON for a number or literal that is not JSON; `None` for JSON, and for words without a meaning.
fn corrected(word: &str) -> Option<(String, Defect)> {
    if matches!(word, "true" | "false" | "null") || serde_json::from_str::<f64>(word).is_ok() {
        return None;
    }
    let spelled = |json: String| Some((json, Defect::Spelling));
    let lower = word.to_ascii_lowercase();
    match lower.as_str() {
        "true" | "false" => return spelled(lower),
        "null" | "none" | "nil" | "undefined" => return spelled("null".into()),
        _ => {}
    }
    let digits = lower.trim_start_matches(['+', '-']);
    // C prints `nan(ind)`, and in old libraries `1.#IND`.
    let is_nonfinite = digits.starts_with("nan") || digits.starts_with("1.#");
    let number = if is_nonfinite { f64::NAN } else { word.parse::<f64>().ok()? };
    if !number.is_finite() {
        return Some(("null".into(), Defect::NonFinite));
    }
    if let Ok(integer) = word.parse::<i64>() {
        return spelled(integer.to_string());
    }
    spelled(serde_json::Number::from_f64(number)?.to_string())
}

/// Offset after the object or array that starts at `at`; `None` if it has no end.
pub(super) fn end_of_container(bytes: &[u8], mut at: usize) -> Option<usize> {
    let mut depth = 0usize;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            b'"' => at = end_of_string(bytes, at + 1) - 1,
            _ => {}
        }
        at += 1;
        if depth == 0 {
            return Some(at);
        }
    }
    None
}

/// Offset after the closing quotation mark of a string whose first byte is at `at`.
fn end_of_string(bytes: &[u8], mut at: usize) -> usize {
    while at < bytes.len() && bytes[at] != b'"' {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The repaired text, which must be JSON, and the number of defects of each kind.
    fn repaired(text: &str) -> (String, [usize; 4]) {
        let repaired = repair(text).unwrap();
        assert!(serde_json::from_str::<serde_json::Value>(&repaired.text).is_ok(), "{}", repaired.text);
        (repaired.text, repaired.found.map(|found| found.count))
    }

    #[test]
    fn numbers_outside_of_strings_are_replaced() {
        let text = r#"{"NaN":[NaN,-Infinity , Infinity],"a\"NaN":"NaN \\","é":-1}"#;
        let expected = r#"{"NaN":[null,null , null],"a\"NaN":"NaN \\","é":-1}"#;
        assert_eq!(repaired(text), (expected.into(), [3, 0, 0, 0]));
        let text = "[nan,-nan(ind),inf,-INF,1.#QNAN,-1.#IND00,1e400,-1E999]";
        assert_eq!(repaired(text), ("[null,null,null,null,null,null,null,null]".into(), [8, 0, 0, 0]));
        for broken in ["", "\"", "\"\\", "NaN\"\\é", "-", "[[", "\"\\u", "\"\\ud800", "\u{fffd}"] {
            assert!(repair(broken).is_none_or(|repaired| repaired.edits.len() <= 2), "{broken}");
        }
    }

    #[test]
    fn valid_json_is_unchanged() {
        for text in [
            r#"{"a":[0,-1.5e-7,123456789012345678901234567890,true,false,null],"b":{"a":1,"a":2}}"#,
            r#""\u00e9\ud83d\ude00\\ud800\n\/""#,
        ] {
            assert!(repair(text).is_none(), "{text}");
        }
    }

    #[test]
    fn spellings_of_other_languages_are_read() {
        let text = "[True, FALSE,None,undefined,.5,-.5,+1,1.,007,+.25e1]";
        let expected = "[true, false,null,null,0.5,-0.5,1,1.0,7,2.5]";
        assert_eq!(repaired(text), (expected.into(), [0, 10, 0, 0]));
        assert!(repair("[what]").is_none());
    }

    #[test]
    fn half_surrogates_unknown_escapes_and_control_characters_are_replaced() {
        let text = "[\"\\ud800\",\"\\udc00\\ud83d\\ude00\",\"\\ud83dx\",\"C:\\Users\\u12\",\"a\tb\nc\"]";
        let expected = "[\"\u{fffd}\",\"\u{fffd}\\ud83d\\ude00\",\"\u{fffd}x\",\"C:\\\\Users\\\\u12\",\"a\\u0009b\\u000ac\"]";
        assert_eq!(repaired(text), (expected.into(), [0, 0, 7, 0]));
    }

    #[test]
    fn deep_values_are_replaced_without_recursion() {
        let nested = |depth: usize| format!("{}\"]\"{}", "[".repeat(depth), "]".repeat(depth));
        assert!(repair(&nested(MAX_DEPTH)).is_none());
        let (text, counts) = repaired(&nested(1_000_000));
        assert_eq!((text.matches('[').count(), counts), (MAX_DEPTH, [0, 0, 0, 1]));
        let siblings = format!("[{}, 1, {}]", nested(200), nested(150));
        assert_eq!(repaired(&siblings).1, [0, 0, 0, 2]);
    }

    #[test]
    fn positions_refer_to_the_original_text() {
        let text = "[\n\"é\", NaN, -Infinity,\nNaN, what]";
        let repaired = repair(text).unwrap();
        assert_eq!(position(text, repaired.found[0].first), Position { line: 2, column: 6 });
        let error = serde_json::from_str::<serde_json::Value>(&repaired.text).unwrap_err();
        let at = Position { line: error.line(), column: error.column() };
        assert_eq!(repaired.original_position(text, at), Position { line: 3, column: 6 });
    }
}
