//! Options in messages: named once, worded as the users of a program write them.
//!
//! A message is a template, in which options stand in backticks, `` `clip` `` or `` `clip off` ``, and values as `{}`.
//! [`worded!`](crate::worded) makes `--clip off` of it for the command line, and `clip='off'` for Python. Values stay as
//! they are: names in files may have backticks.

use std::fmt::{Display, Write};
use std::slice::Iter;
use std::sync::RwLock;

/// Words an option by its name and value.
pub type OptionWord = fn(&str, Option<&str>) -> String;

static WORD: RwLock<OptionWord> = RwLock::new(in_backticks);

/// Sets how messages of this process word options. Until then they stand in backticks.
pub fn set_option_word(word: OptionWord) {
    *WORD.write().unwrap_or_else(|e| e.into_inner()) = word;
}

/// Returns an option as messages of this process word it.
pub fn option_word(name: &str, value: Option<&str>) -> String {
    current_word()(name, value)
}

fn current_word() -> OptionWord {
    *WORD.read().unwrap_or_else(|e| e.into_inner())
}

fn in_backticks(name: &str, value: Option<&str>) -> String {
    match value {
        Some(value) => format!("`{name} {value}`"),
        None => format!("`{name}`"),
    }
}

/// Returns a text of the program, such as the documentation of an option, with words for the options in backticks.
pub fn word_options(text: &str) -> String {
    word_quoted(text, current_word(), str::to_string)
}

/// Formats a message as `format!` does, with words for the options in backticks. Values are `{}`, without names and
/// formats.
#[macro_export]
macro_rules! worded {
    ($template:expr $(, $value:expr)* $(,)?) => {{
        const { $crate::option_words::check($template, <[&str]>::len(&[$(stringify!($value)),*])) };
        $crate::option_words::format($template, &[$(&$value),*])
    }};
}

/// Formats the message of [`worded!`](crate::worded).
pub fn format(template: &'static str, values: &[&dyn Display]) -> String {
    let mut values = values.iter();
    word_quoted(template, current_word(), |part| fill(part, &mut values))
}

/// Fails to compile a template with another number of values, or with an open backtick.
pub const fn check(template: &str, values: usize) {
    let text = template.as_bytes();
    let (mut found, mut backticks, mut i) = (0, 0, 0);
    while i < text.len() {
        let next = if i + 1 < text.len() { text[i + 1] } else { 0 };
        match (text[i], next) {
            (b'{', b'}') => found += 1,
            (b'{', b'{') | (b'}', b'}') => {}
            (b'{' | b'}', _) => panic!("a value is an empty pair of braces, a brace is doubled"),
            (b'`', _) => backticks += 1,
            _ => {}
        }
        i += if text[i] == b'{' || text[i] == b'}' { 2 } else { 1 };
    }
    assert!(found == values, "as many values as pairs of braces");
    assert!(backticks % 2 == 0, "a backtick is open");
}

/// Words the options between backticks; other text in backticks stays. `fill` puts values into a part.
fn word_quoted(text: &str, word: OptionWord, mut fill: impl FnMut(&str) -> String) -> String {
    let mut worded = String::with_capacity(text.len());
    let mut parts = text.split('`');
    worded.extend(parts.next().map(&mut fill));
    while let Some(quoted) = parts.next() {
        let quoted = fill(quoted);
        let after = parts.next();
        let (name, value) = match quoted.split_once(' ') {
            Some((name, value)) => (name, Some(value)),
            None => (&*quoted, None),
        };
        match after {
            Some(_) if is_option_name(name) => worded += &word(name, value),
            Some(_) => worded.extend(["`", &quoted, "`"]),
            None => worded.extend(["`", &quoted]),
        }
        worded.extend(after.map(&mut fill));
    }
    worded
}

fn is_option_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_lowercase())
        && text.chars().all(|c| c.is_ascii_lowercase() || c == '-')
}

/// Puts values into a part of a template.
fn fill(part: &str, values: &mut Iter<&dyn Display>) -> String {
    let mut filled = String::with_capacity(part.len());
    let mut chars = part.chars().peekable();
    while let Some(c) = chars.next() {
        match (c, chars.peek()) {
            ('{', Some('}')) => {
                chars.next();
                // A String takes all.
                let _ = values.next().map(|value| write!(filled, "{value}"));
            }
            ('{', Some('{')) | ('}', Some('}')) => filled.extend(chars.next()),
            _ => filled.push(c),
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_a_template_are_worded_and_values_stay() {
        assert_eq!(worded!("no options"), "no options");
        assert_eq!(worded!("use `clip off` or `look-at`"), "use `clip off` or `look-at`");
        assert_eq!(worded!("`{}`: {{x}} {} of {}", "fps", "a`b` {}", 7), "`fps`: {x} a`b` {} of 7");
        assert_eq!(worded!("`exposure {}`", format_args!("{:.1}", 0.25)), "`exposure 0.2`");
        assert_eq!(word_options("Name {frame} with `output`"), "Name {frame} with `output`");
    }

    #[test]
    fn each_program_has_its_own_words() {
        let keyword: OptionWord = |name, value| match value {
            Some(value) => format!("{}={value:?}", name.replace('-', "_")),
            None => name.replace('-', "_"),
        };
        for (text, expected) in [
            ("use `clip off` or `look-at`", "use clip=\"off\" or look_at"),
            ("`background 1,2`", "background=\"1,2\""),
            ("no options", "no options"),
            ("a ` alone", "a ` alone"),
            ("`Name` and `zoom`", "`Name` and zoom"),
            ("``", "``"),
        ] {
            assert_eq!(word_quoted(text, keyword, str::to_string), expected);
        }
    }
}
