//! Options in messages: named once, shown as the users of a program write them.

/// Replaces each option that `text` names in backticks, `` `clip` `` or `` `clip off` ``, by what `show` makes of its name
/// and value. Other text in backticks stays.
///
/// ```
/// use blinn_session::with_option_names;
///
/// let keyword = |name: &str, value: Option<&str>| match value {
///     Some(value) => format!("{name}={value}"),
///     None => name.to_string(),
/// };
/// assert_eq!(with_option_names("use `clip off` or `zoom`", keyword), "use clip=off or zoom");
/// ```
pub fn with_option_names(text: &str, show: impl Fn(&str, Option<&str>) -> String) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, quoted)) = rest.split_once('`') {
        shown.push_str(before);
        let Some((inside, after)) = quoted.split_once('`') else {
            shown.push('`');
            rest = quoted;
            continue;
        };
        let (name, value) = match inside.split_once(' ') {
            Some((name, value)) => (name, Some(value)),
            None => (inside, None),
        };
        let is_option = name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.chars().all(|c| c.is_ascii_lowercase() || c == '-');
        if is_option {
            shown.push_str(&show(name, value));
            rest = after;
        } else {
            shown.push('`');
            rest = quoted;
        }
    }
    shown + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_in_backticks_are_shown_and_other_text_stays() {
        let keyword = |name: &str, value: Option<&str>| match value {
            Some(value) => format!("{}={value:?}", name.replace('-', "_")),
            None => name.replace('-', "_"),
        };
        for (text, expected) in [
            ("use `clip off` or `look-at`", "use clip=\"off\" or look_at"),
            ("no options", "no options"),
            ("a ` alone", "a ` alone"),
            ("`Name` and `zoom`", "`Name` and zoom"),
            ("``", "``"),
            ("`background 1,2`", "background=\"1,2\""),
        ] {
            assert_eq!(with_option_names(text, keyword), expected);
        }
    }
}
