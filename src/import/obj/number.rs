//! Number notations of exporters.

use std::borrow::Cow;

/// Parses a number in any notation that exporters write: `1.5`, `.5`, `+3`, `1e-3`, Fortran's `1D-3`, C's `1.5f`,
/// and the NaN and infinity of C libraries. Rounds once, to the nearest `f32`.
pub(super) fn parse_number(word: &str) -> Option<f32> {
    plain_number(word)?.parse().ok()
}

/// Rewrites a number in a notation that `str::parse` accepts, with the same digits.
pub(super) fn plain_number(word: &str) -> Option<Cow<'_, str>> {
    if is_plain(word) {
        return Some(word.into());
    }
    // Swedish and other locales have the typographic minus sign.
    if word.contains('\u{2212}') {
        return plain_number(&word.replace('\u{2212}', "-")).map(|number| number.into_owned().into());
    }
    // A C literal.
    if let Some(number) = word.strip_suffix(['f', 'F']).filter(|word| is_plain(word)) {
        return Some(number.into());
    }
    let bare = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    if let Some((_, kind)) = bare.split_once(".#") {
        let is_nan = ["qnan", "snan", "ind"].iter().any(|name| kind.starts_with(name));
        return if kind.starts_with("inf") { Some("inf".into()) } else { is_nan.then_some("nan".into()) };
    }
    if bare.starts_with("nan(") {
        return Some("nan".into());
    }
    let fortran =
        word.contains(['d', 'D']) && word.bytes().all(|b| b.is_ascii_digit() || b"+-.dD".contains(&b));
    let number = fortran.then(|| word.replace(['d', 'D'], "e"))?;
    is_plain(&number).then_some(number.into())
}

/// Returns the mantissa of a number with a malformed exponent, such as `3.1+e2`, as [`plain_number`] does.
pub(super) fn plain_mantissa(word: &str) -> Option<Cow<'_, str>> {
    let at = word.char_indices().skip(1).find(|(_, c)| "+-eE".contains(*c))?.0;
    let exponent = word[at..].bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
    exponent.then(|| plain_number(&word[..at])).flatten()
}

/// Returns true for the numbers that `str::parse::<f32>` accepts.
fn is_plain(word: &str) -> bool {
    let word = word.strip_prefix(['-', '+']).unwrap_or(word);
    let after_digits =
        |text: &'_ str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let whole = after_digits(word);
    let mut rest = &word[whole..];
    let mut digits = whole;
    if let Some(fraction) = rest.strip_prefix('.') {
        let count = after_digits(fraction);
        digits += count;
        rest = &fraction[count..];
    }
    if digits == 0 {
        return ["inf", "infinity", "nan"].iter().any(|name| word.eq_ignore_ascii_case(name));
    }
    rest.strip_prefix(['e', 'E']).map_or(rest.is_empty(), |exponent| {
        let exponent = exponent.strip_prefix(['-', '+']).unwrap_or(exponent);
        !exponent.is_empty() && after_digits(exponent) == exponent.len()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_notations_of_many_exporters_are_read() {
        for (word, v) in
            [("1.5", 1.5), (".5", 0.5), ("5.", 5.0), ("+3", 3.0), ("1e+05", 1e5), ("-1.5D-3", -1.5e-3)]
                .into_iter()
                .chain([("1.5f", 1.5), ("1.F", 1.0), ("-2e1f", -20.0), ("\u{2212}1.5e\u{2212}1", -0.15)])
        {
            assert_eq!(parse_number(word), Some(v));
        }
        for word in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND00"] {
            assert!(parse_number(word).unwrap().is_nan(), "{word}");
        }
        assert_eq!(parse_number("1.#INF"), Some(f32::INFINITY));
        for word in " x 1.2.3 d 0x10 0x1f --1 f -f 1ff 1.5m".split(' ') {
            assert_eq!(parse_number(word), None, "{word}");
        }
    }

    #[test]
    fn plain_numbers_are_those_of_the_standard_library() {
        let alphabet = ["", "1", "0", ".", "-", "+", "e", "E", "inf", "NaN", "infinity", " ", "_", "é"];
        let mut plain = 0;
        for code in 0..alphabet.len().pow(5) {
            let letters = (0..5).map(|place| alphabet[code / alphabet.len().pow(place) % alphabet.len()]);
            let word: String = letters.collect();
            assert_eq!(is_plain(&word), word.parse::<f32>().is_ok(), "{word:?}");
            plain += u32::from(is_plain(&word));
        }
        assert!(plain > 1000, "{plain}");
    }
}
