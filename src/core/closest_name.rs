//! Suggestions for misspelt names.

/// Longest name in characters that is compared, as the comparison takes time with the square of the length.
const MAX_CHARS: usize = 64;

/// Returns the name that a misspelt one was probably meant to be: the one with the fewest insertions, deletions,
/// replacements and swaps of neighbours, of which one is allowed for each three characters, or a name that differs in
/// case only. Equal distances go to the first.
pub fn closest_name<N: AsRef<str>>(misspelt: &str, names: impl IntoIterator<Item = N>) -> Option<N> {
    let word = folded(misspelt)?;
    let allowed = (word.len() / 3).max(1);
    let mut best: Option<(usize, N)> = None;
    for name in names {
        let Some(other) = folded(name.as_ref()) else { continue };
        // A name of one or two characters would match nearly any other.
        let limit = allowed.min(other.len() / 2);
        if word.len().abs_diff(other.len()) > limit {
            continue;
        }
        let distance = edit_distance(&word, &other);
        if distance <= limit && best.as_ref().is_none_or(|(least, _)| distance < *least) {
            best = Some((distance, name));
        }
    }
    best.map(|(_, name)| name)
}

/// Returns `; did you mean 'NAME'?` for the end of a message, or nothing if no name is close.
pub fn did_you_mean<N: AsRef<str>>(misspelt: &str, names: impl IntoIterator<Item = N>) -> String {
    closest_name(misspelt, names)
        .map(|name| format!("; did you mean '{}'?", name.as_ref()))
        .unwrap_or_default()
}

/// Returns the characters in lower case, with separators alike. `None` if they are none or too many.
fn folded(name: &str) -> Option<Vec<char>> {
    let alike = |c: char| if matches!(c, '_' | ' ' | '.') { '-' } else { c };
    let chars: Vec<char> = name.chars().take(MAX_CHARS + 1).flat_map(char::to_lowercase).map(alike).collect();
    (1..=MAX_CHARS).contains(&chars.len()).then_some(chars)
}

/// Returns the edit distance of Damerau and Levenshtein, in which no part is edited twice.
fn edit_distance(a: &[char], b: &[char]) -> usize {
    let width = b.len() + 1;
    let mut before: Vec<usize> = vec![0; width];
    let mut above: Vec<usize> = (0..width).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; width];
        for j in 1..width {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_name_has_the_fewest_edits() {
        let names = ["headlight", "three-point", "file", "none"];
        assert_eq!(closest_name("headligth", names), Some("headlight"));
        assert_eq!(closest_name("Three_Point", names), Some("three-point"));
        assert_eq!(closest_name("fiel", names), Some("file"));
        assert_eq!(closest_name("sun", names), None);
        assert_eq!(closest_name("", names), None);
        assert_eq!(closest_name("ab", ["x", "a", "abc"]), Some("abc"));
        assert_eq!(closest_name(&"a".repeat(100_000), [&"a".repeat(99_999)]), None);
        assert_eq!(did_you_mean("normals", ["normal", "mask"]), "; did you mean 'normal'?");
    }

    #[test]
    fn distances_count_edits() {
        let distance =
            |a: &str, b: &str| edit_distance(&a.chars().collect::<Vec<_>>(), &b.chars().collect::<Vec<_>>());
        assert_eq!((distance("kitten", "sitting"), distance("abc", "acb"), distance("", "abc")), (3, 1, 3));
    }
}
