//! Bounds the number of printed warnings: the first few of each kind, then their number.

use std::collections::HashMap;

/// Warnings of a kind that are printed.
const PRINTED: usize = 5;
/// Most kinds. Warnings of further kinds count as one.
const MAX_KINDS: usize = 100;
/// Longest text of a kind in bytes.
const MAX_KIND: usize = 200;

/// Counts warnings by kind. Warnings are of one kind if they differ only in numbers, names in quotes and file names.
#[derive(Debug, Default)]
pub struct WarningFilter {
    kinds: HashMap<String, KindCount>,
}

#[derive(Debug)]
struct KindCount {
    /// Rank of the first warning of the kind.
    order: usize,
    /// The first message.
    example: String,
    printed: usize,
    withheld: usize,
}

impl WarningFilter {
    /// Counts a warning. Returns true if it is one of the first of its kind, which are printed.
    pub fn admit(&mut self, message: &str) -> bool {
        let mut kind = kind(message);
        let order = self.kinds.len();
        if order >= MAX_KINDS && !self.kinds.contains_key(&kind) {
            kind = String::new();
        }
        let new = || KindCount { order, example: message.into(), printed: 0, withheld: 0 };
        let count = self.kinds.entry(kind).or_insert_with(new);
        let is_printed = count.printed < PRINTED;
        if is_printed {
            count.printed += 1;
        } else {
            count.withheld += 1;
        }
        is_printed
    }

    /// Returns a line for each kind of which warnings were withheld since the last call. `remedy` says how to see
    /// all.
    pub fn summary(&mut self, remedy: &str) -> Vec<String> {
        let mut counts: Vec<_> = self.kinds.values_mut().filter(|count| count.withheld > 0).collect();
        counts.sort_unstable_by_key(|count| count.order);
        let line = |count: &mut KindCount| {
            let withheld = std::mem::take(&mut count.withheld);
            let warnings = if withheld == 1 { "warning" } else { "warnings" };
            format!("{withheld} more {warnings} such as: {}; {remedy}", count.example)
        };
        counts.into_iter().map(line).collect()
    }
}

/// Returns what warnings of a kind have in common.
fn kind(message: &str) -> String {
    let mut kind = String::new();
    // The text between quotes is a name. An apostrophe within a word is no quote.
    let mut in_name = false;
    let mut word = String::new();
    let mut last = ' ';
    let mut end_word = |word: &mut String| {
        let is_name = word.contains(|c: char| c.is_ascii_digit() || c == '/' || c == '\\')
            || word.trim_end_matches('.').contains('.');
        kind.push_str(if is_name { "#" } else { word });
        kind.push(' ');
        word.clear();
    };
    let mut chars = message.chars().chain([' ']).peekable();
    while let Some(c) = chars.next() {
        let ends_word = chars.peek().is_none_or(|next| !next.is_alphanumeric());
        match c {
            '\'' if in_name && ends_word => in_name = false,
            '\'' if !last.is_alphanumeric() => in_name = true,
            _ if in_name => {}
            ' ' => end_word(&mut word),
            c => word.push(c),
        }
        last = c;
    }
    kind.truncate(kind.floor_char_boundary(MAX_KIND));
    kind
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_numbers_and_files_do_not_make_kinds() {
        for (a, b) in [
            ("texture 'a b.png' does not exist; used white", "texture 'c' does not exist; used white"),
            ("texture tex/a.png is missing", "texture c.jpg is missing"),
            ("ignored 3 lines", "ignored 12 lines"),
            ("material 'it's' occurs again", "material 'x' occurs again"),
        ] {
            assert_eq!(kind(a), kind(b));
        }
        assert_ne!(kind("ignored 3 lines"), kind("ignored 3 points"));
        assert_ne!(kind("Blender's materials"), kind("Blender's lights"));
    }

    #[test]
    fn the_first_of_each_kind_are_printed_and_the_others_counted() {
        let mut filter = WarningFilter::default();
        let admitted = (0..2000).filter(|i| filter.admit(&format!("texture '{i}.png' is missing"))).count();
        assert_eq!(admitted, PRINTED);
        assert!(filter.admit("the file has no scene"));
        let remedy = "use --verbose";
        assert_eq!(
            filter.summary(remedy),
            ["1995 more warnings such as: texture '0.png' is missing; use --verbose"]
        );
        assert!(filter.summary(remedy).is_empty(), "each is counted once");
        assert!(!filter.admit("texture 'z.png' is missing"));
        assert_eq!(filter.summary(remedy).len(), 1);
    }

    #[test]
    fn many_kinds_are_bounded_too() {
        let mut filter = WarningFilter::default();
        let letters = |i: usize| (0..12).map(|k| char::from(b'a' + (i >> k & 1) as u8)).collect::<String>();
        let admitted = (0..4096).filter(|&i| filter.admit(&format!("odd {}", letters(i)))).count();
        assert_eq!(admitted, MAX_KINDS + PRINTED);
        assert_eq!(filter.summary("").len(), 1);
        assert!(!filter.admit(&"long ".repeat(100_000)));
        assert!(filter.kinds.keys().all(|kind| kind.len() <= MAX_KIND));
    }
}
