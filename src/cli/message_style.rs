//! Labels of messages on standard error: words and colours on a terminal, fixed prefixes for scripts.

use std::ffi::OsString;
use std::io::{IsTerminal, stderr};
use std::sync::RwLock;

use crate::args::ColorArg;

/// The choice of --color.
static COLOR: RwLock<ColorArg> = RwLock::new(ColorArg::Auto);

/// Sets `--color` for the messages of this process.
pub fn set_color(color: ColorArg) {
    *COLOR.write().unwrap_or_else(|e| e.into_inner()) = color;
}

/// The choice of `--color`.
pub fn color() -> ColorArg {
    *COLOR.read().unwrap_or_else(|e| e.into_inner())
}

/// The kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Error,
    Warning,
    Hint,
}

/// The form of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageStyle {
    /// Prefixes that scripts and logs know: `blinn: `, `warning: ` and `note: `.
    Plain,
    /// Words for people: `error: `, `warning: ` and `hint: `.
    Words,
    /// Words in colour.
    Colors,
}

impl MessageStyle {
    /// The style of standard error.
    pub fn of_stderr() -> MessageStyle {
        MessageStyle::new(color(), stderr().is_terminal(), |name| std::env::var_os(name))
    }

    /// Chooses by --color, else by the conventions of NO_COLOR, CLICOLOR and CLICOLOR_FORCE, in this order. `variable` returns
    /// the value of an environment variable.
    fn new(color: ColorArg, is_terminal: bool, variable: impl Fn(&str) -> Option<OsString>) -> MessageStyle {
        let is_set = |name: &str| variable(name).is_some_and(|value| !value.is_empty() && value != "0");
        let is = |name: &str, expected: &str| variable(name).is_some_and(|value| value == expected);
        let refuses_color = variable("NO_COLOR").is_some_and(|value| !value.is_empty());
        match is_terminal {
            _ if color == ColorArg::Always => MessageStyle::Colors,
            true if color == ColorArg::Never => MessageStyle::Words,
            false if color == ColorArg::Never => MessageStyle::Plain,
            _ if is_set("CLICOLOR_FORCE") && !refuses_color => MessageStyle::Colors,
            false => MessageStyle::Plain,
            true if refuses_color || is("CLICOLOR", "0") || is("TERM", "dumb") => MessageStyle::Words,
            true => MessageStyle::Colors,
        }
    }

    /// A message with its label.
    pub fn label(self, level: Level, text: &str) -> String {
        let (prefix, word, color) = match level {
            Level::Error => ("blinn", "error", 31),
            Level::Warning => ("warning", "warning", 33),
            Level::Hint => ("note", "hint", 36),
        };
        match self {
            MessageStyle::Plain => format!("{prefix}: {text}"),
            MessageStyle::Words => format!("{word}: {text}"),
            MessageStyle::Colors => format!("\x1b[1;{color}m{word}:\x1b[0m {text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_have_colors_unless_the_environment_refuses_them() {
        use MessageStyle::{Colors, Plain, Words};
        for (is_terminal, variables, expected) in [
            (true, "", Colors),
            (false, "", Plain),
            (true, "TERM=xterm", Colors),
            (true, "TERM=dumb", Words),
            (true, "NO_COLOR=1", Words),
            (true, "NO_COLOR=", Colors),
            (true, "CLICOLOR=0", Words),
            (true, "CLICOLOR=1", Colors),
            (false, "CLICOLOR=1", Plain),
            (false, "CLICOLOR_FORCE=1", Colors),
            (false, "CLICOLOR_FORCE=0", Plain),
            (false, "CLICOLOR_FORCE=1 NO_COLOR=1", Plain),
            (true, "CLICOLOR_FORCE=1 CLICOLOR=0", Colors),
        ] {
            let find = |name: &str| {
                let pairs = variables.split(' ').filter_map(|pair| pair.split_once('='));
                pairs.into_iter().find(|(key, _)| *key == name).map(|(_, value)| value.into())
            };
            assert_eq!(
                MessageStyle::new(ColorArg::Auto, is_terminal, find),
                expected,
                "{is_terminal} {variables}"
            );
            assert_eq!(MessageStyle::new(ColorArg::Always, is_terminal, find), Colors, "{variables}");
            let never = if is_terminal { Words } else { Plain };
            assert_eq!(MessageStyle::new(ColorArg::Never, is_terminal, find), never, "{variables}");
        }
    }

    #[test]
    fn labels_name_the_level() {
        let labels = |style: MessageStyle| {
            [Level::Error, Level::Warning, Level::Hint].map(|level| style.label(level, "x"))
        };
        assert_eq!(labels(MessageStyle::Plain), ["blinn: x", "warning: x", "note: x"]);
        assert_eq!(labels(MessageStyle::Words), ["error: x", "warning: x", "hint: x"]);
        assert_eq!(labels(MessageStyle::Colors)[0], "\x1b[1;31merror:\x1b[0m x");
    }
}
