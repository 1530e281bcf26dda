//! Options in messages, as users write them: flags, or the words of a program that runs the command line.

use std::sync::RwLock;

use blinn_session::{with_option_names, without_error_codes};

/// Words an option by its name and value.
pub type OptionWord = fn(&str, Option<&str>) -> String;

/// The words of the program that runs the command line; `None` for flags.
static OTHER_WORD: RwLock<Option<OptionWord>> = RwLock::new(None);

/// Sets how messages of this process word options.
pub fn set_option_word(word: OptionWord) {
    *OTHER_WORD.write().unwrap_or_else(|e| e.into_inner()) = Some(word);
}

/// A message with its options as flags, without error codes: `` `clip off` `` becomes `--clip off`. Where another program
/// has set its own words, these, also for the flags that the message names.
pub fn with_flags(text: &str) -> String {
    let other = *OTHER_WORD.read().unwrap_or_else(|e| e.into_inner());
    let text = without_error_codes(text);
    match other {
        None => with_option_names(&text, flag),
        Some(word) => replace_flags(&with_option_names(&text, word), word),
    }
}

fn flag(name: &str, value: Option<&str>) -> String {
    match value {
        Some(value) => format!("--{name} {value}"),
        None => format!("--{name}"),
    }
}

/// Replaces `--name`, `'--name <VALUE>'` and `-o` by words. A flag begins a word: file names with dashes stay.
fn replace_flags(text: &str, word: OptionWord) -> String {
    let mut replaced = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find('-') {
        let (before, flag) = rest.split_at(start);
        replaced.push_str(before);
        let begins_word = replaced.chars().last().is_none_or(|c| c.is_whitespace() || "'(,".contains(c));
        let name = if begins_word { flag_name(flag) } else { None };
        let Some((name, after)) = name else {
            replaced.push('-');
            rest = &flag[1..];
            continue;
        };
        let closing = quoted_end(after).filter(|_| replaced.ends_with('\''));
        if closing.is_some() {
            replaced.pop();
        }
        replaced += &word(name, None);
        rest = closing.unwrap_or(after);
    }
    replaced + rest
}

/// The name of the option of the flag that a text starts with, and the text after it.
fn flag_name(text: &str) -> Option<(&str, &str)> {
    let is_of_name = |c: char| c.is_ascii_lowercase() || c == '-';
    if let Some(long) = text.strip_prefix("--") {
        let end = long.find(|c| !is_of_name(c)).unwrap_or(long.len());
        return (long.starts_with(|c: char| c.is_ascii_lowercase())).then(|| long.split_at(end));
    }
    let after = text.strip_prefix("-o")?;
    (!after.starts_with(|c: char| c.is_alphanumeric() || c == '-')).then_some(("output", after))
}

/// The text after the closing quote of a flag, which may have the name of its value before: `' …` or ` <SIZE>' …`.
fn quoted_end(text: &str) -> Option<&str> {
    let after_value = |open: &str| text.strip_prefix(open)?.split_once('>').map(|(_, rest)| rest);
    let rest = after_value(" <").or_else(|| after_value("=<")).unwrap_or(text);
    rest.strip_prefix('\'')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_become_the_words_of_another_program() {
        let word = |name: &str, _: Option<&str>| format!("<{name}>");
        for (text, expected) in [
            ("--zoom and --look-at, or (--crop)", "<zoom> and <look-at>, or (<crop>)"),
            ("invalid value 'x' for '--size <WxH>': expected", "invalid value 'x' for <size>: expected"),
            (
                "unexpected argument '--sampels': did you mean --samples?",
                "unexpected argument <sampels>: did you mean <samples>?",
            ),
            ("set -o to .png, or -o FOLDER/", "set <output> to .png, or <output> FOLDER/"),
            ("my--file.glb: -1 of a-b -over — --", "my--file.glb: -1 of a-b -over — --"),
            ("'--name' of 'a'", "<name> of 'a'"),
            ("'--name is open", "'<name> is open"),
        ] {
            assert_eq!(replace_flags(text, word), expected);
        }
    }
}
