//! The tokens of Rust source, as far as names need them.

/// Words, numbers, `::` and other characters one by one. Comments and literals in quotes are left out.
pub fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let (length, is_token) = if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), false)
        } else if rest.starts_with("/*") {
            (block_comment(rest), false)
        } else if let Some(length) = string(rest) {
            (length, false)
        } else if first == '\'' {
            (quote(rest), false)
        } else if is_in_word(first) {
            (rest.find(|c| !is_in_word(c)).unwrap_or(rest.len()), true)
        } else if rest.starts_with("::") {
            (2, true)
        } else {
            (first.len_utf8(), !first.is_whitespace())
        };
        if is_token {
            tokens.push(&rest[..length]);
        }
        rest = &rest[length..];
    }
    tokens
}

fn is_in_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Identifiers and keywords.
pub fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The length of a comment that may hold others.
fn block_comment(text: &str) -> usize {
    let (mut at, mut depth) = (0, 0);
    loop {
        let rest = &text[at..];
        if rest.starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += rest.chars().next().expect("block comments are closed").len_utf8();
        }
    }
}

/// The length of a string literal of any kind, if one stands here.
fn string(text: &str) -> Option<usize> {
    let prefix = ["br", "cr", "b", "c", "r", ""].into_iter().find(|prefix| {
        text.strip_prefix(prefix).is_some_and(|rest| {
            let rest = if prefix.ends_with('r') { rest.trim_start_matches('#') } else { rest };
            rest.starts_with('"')
        })
    })?;
    let rest = &text[prefix.len()..];
    if prefix.ends_with('r') {
        let hashes = rest.len() - rest.trim_start_matches('#').len();
        let end = format!("\"{}", "#".repeat(hashes));
        let body = hashes + 1;
        return Some(prefix.len() + body + rest[body..].find(&end)? + end.len());
    }
    let mut at = 1;
    loop {
        match rest.as_bytes()[at] {
            b'\\' => at += 2,
            b'"' => return Some(prefix.len() + at + 1),
            _ => at += 1,
        }
    }
}

/// The length of a character literal, or of a lifetime.
fn quote(text: &str) -> usize {
    let mut chars = text.char_indices().skip(1);
    let (_, first) = chars.next().expect("something is quoted");
    if first == '\\' {
        let escaped = chars.next().expect("something is escaped").0 + 1;
        return escaped + text[escaped..].find('\'').expect("character literals are closed") + 1;
    }
    match chars.next() {
        Some((at, '\'')) => at + 1,
        _ => 1 + text[1..].find(|c| !is_in_word(c)).unwrap_or(text.len() - 1),
    }
}

/// Returns true if `#[cfg(test)]`, `#![cfg(test)]` or a `cfg(all(…))` that contains `test` starts at `i`.
pub fn is_test_attribute(tokens: &[&str], i: usize) -> bool {
    if tokens.get(i) != Some(&"#") {
        return false;
    }
    let i = i + 1 + usize::from(tokens.get(i + 1) == Some(&"!"));
    match tokens.get(i..) {
        Some(["[", "cfg", "(", "test", ")", ..]) => true,
        Some(["[", "cfg", "(", "all", "(", rest @ ..]) => {
            rest.iter().take_while(|t| !matches!(**t, "(" | ")")).any(|t| *t == "test")
        }
        _ => false,
    }
}

/// Where the attribute at `i` ends.
pub fn end_of_attribute(tokens: &[&str], i: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(i) {
        match *token {
            "[" => depth += 1,
            "]" if depth == 1 => return at + 1,
            "]" => depth -= 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Words that begin items, after their visibility.
const ITEMS: [&str; 12] =
    ["const", "enum", "extern", "fn", "impl", "mod", "static", "struct", "trait", "type", "union", "use"];

/// Where the item, field, variant or arm at `i` ends, with its attributes before it.
pub fn end_of_item(tokens: &[&str], mut i: usize) -> usize {
    while tokens.get(i) == Some(&"#") {
        i = end_of_attribute(tokens, i);
    }
    let keyword =
        tokens[i..].iter().copied().find(|t| ITEMS.contains(t) || matches!(*t, "," | ";" | "{" | "="));
    let is_item = keyword.is_some_and(|t| ITEMS.contains(&t));
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(i) {
        match *token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" if depth == 0 => return at,
            "}" if depth == 1 && keyword != Some("use") => return at + 1,
            ")" | "]" | "}" => depth -= 1,
            ";" if depth == 0 => return at + 1,
            "," if depth == 0 && !is_item => return at + 1,
            _ => {}
        }
    }
    tokens.len()
}
