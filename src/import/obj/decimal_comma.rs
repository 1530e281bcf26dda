//! Commas in lists of numbers: decimal commas, which programs write under many locales, and commas between numbers.

use std::borrow::Cow;

use super::number::parse_number;

/// Amounts of numbers that a statement may have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counts {
    /// With blanks between the numbers.
    blanks: &'static [usize],
    /// With commas between the numbers.
    commas: &'static [usize],
}

impl Counts {
    /// `v`: a position, which w or a colour may follow.
    pub const VERTEX: Counts = Counts { blanks: &[3, 4, 6, 7], commas: &[3, 6] };
    /// `vn`
    pub const NORMAL: Counts = Counts { blanks: &[3], commas: &[3] };
    /// `vt`
    pub const TEXTURE_COORDINATE: Counts = Counts { blanks: &[1, 2, 3], commas: &[2, 3] };
    /// A colour of an MTL file: grey, RGB or RGBA.
    pub const COLOR: Counts = Counts { blanks: &[1, 3, 4], commas: &[3] };
}

/// The meaning of the commas of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Commas {
    None,
    Decimal,
    Separator,
}

/// The numbers of a list, with decimal points.
#[derive(Debug, PartialEq)]
pub(super) struct NumberList<'t> {
    pub words: Vec<Cow<'t, str>>,
    pub commas: Commas,
}

/// Splits a list at blanks, semicolons and commas. Commas are decimal if blanks separate a suitable amount of
/// numbers; else they separate numbers, or every second one does. Returns `None` if both or neither is possible.
pub(super) fn split_numbers(list: &str, counts: Counts) -> Option<NumberList<'_>> {
    let is_blank = |c: char| c.is_whitespace() || c == ';';
    if !list.contains(',') {
        let words = list.split(is_blank).filter(|word| !word.is_empty()).map(Cow::Borrowed).collect();
        return Some(NumberList { words, commas: Commas::None });
    }
    // A comma before the first number separates nothing: it is decimal, as in `,5`.
    let leads = list.trim_start_matches(is_blank).starts_with(',');
    let trim = |word| if leads { str::trim_end_matches(word, ',') } else { str::trim_matches(word, ',') };
    let words: Vec<&str> = list.split(is_blank).map(trim).filter(|word| !word.is_empty()).collect();
    if words.iter().all(|word| !word.contains(',')) {
        let words = words.into_iter().map(Cow::Borrowed).collect();
        return Some(NumberList { words, commas: Commas::Separator });
    }
    if counts.blanks.contains(&words.len())
        && let Some(words) = words.iter().map(|word| with_decimal_point(word)).collect()
    {
        return Some(NumberList { words, commas: Commas::Decimal });
    }
    // Blanks already separate the numbers, but their notation is another: `1.234,5` with thousands separators.
    if words.len() > 1 && counts.blanks.contains(&words.len()) {
        return None;
    }
    let parts: Vec<&str> = words.iter().flat_map(|word| word.split(',')).filter(|p| !p.is_empty()).collect();
    let in_pairs = words.iter().all(|word| word.matches(',').count() % 2 == 1 && !word.contains('.'));
    let is_list = counts.commas.contains(&parts.len());
    let is_pairs = in_pairs && counts.commas.contains(&(parts.len() / 2));
    match (is_list, is_pairs) {
        (true, false) => {
            let words = parts.into_iter().map(Cow::Borrowed).collect();
            Some(NumberList { words, commas: Commas::Separator })
        }
        (false, true) => {
            let pairs = parts.as_chunks::<2>().0.iter();
            let words = pairs.map(|[whole, fraction]| format!("{whole}.{fraction}").into()).collect();
            Some(NumberList { words, commas: Commas::Decimal })
        }
        _ => None,
    }
}

/// Replaces the comma of a number by a decimal point. Returns `None` for a word with several commas or a point.
fn with_decimal_point(word: &str) -> Option<Cow<'_, str>> {
    match word.matches(',').count() {
        0 => Some(Cow::Borrowed(word)),
        1 if !word.contains('.') => Some(Cow::Owned(word.replace(',', "."))),
        _ => None,
    }
}

/// Describes a list that [`split_numbers`] does not split.
pub(super) const AMBIGUOUS: &str =
    "has commas that may be decimal or between numbers; write decimal points and separate numbers by blanks";

/// Reads numbers of an MTL file and notes decimal commas.
#[derive(Debug, Default)]
pub(super) struct DecimalCommas {
    pub found: bool,
}

impl DecimalCommas {
    /// Parses one number.
    pub fn parse(&mut self, word: &str) -> Option<f32> {
        let word = word.trim_end_matches([',', ';']);
        parse_number(word).or_else(|| {
            let value = parse_number(&with_decimal_point(word).filter(|_| word.contains(','))?)?;
            self.found = true;
            Some(value)
        })
    }

    /// Parses the numbers of a colour. The error is the reason why they are none.
    pub fn parse_color(&mut self, list: &str) -> Result<Vec<f32>, &'static str> {
        let numbers = split_numbers(list, Counts::COLOR).ok_or(AMBIGUOUS)?;
        let values: Option<Vec<f32>> = numbers.words.iter().map(|word| parse_number(word)).collect();
        self.found |= values.is_some() && numbers.commas == Commas::Decimal;
        values.ok_or("is not a colour")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(list: &str, counts: Counts) -> Option<(String, Commas)> {
        split_numbers(list, counts).map(|numbers| (numbers.words.join(" "), numbers.commas))
    }

    #[test]
    fn decimal_commas_are_distinguished_from_commas_between_numbers() {
        use Commas::{Decimal, None, Separator};
        for (list, words, commas) in [
            ("0.5 1 2", "0.5 1 2", None),
            ("0,588 0,2 0,1", "0.588 0.2 0.1", Decimal),
            ("1 0,5 -1,5e-3", "1 0.5 -1.5e-3", Decimal),
            ("0,5 0.25 1,0", "0.5 0.25 1.0", Decimal),
            ("0,588, 0,2, 0,1", "0.588 0.2 0.1", Decimal),
            ("0,588 ,0,2 ,0,1", "0.588 0.2 0.1", Decimal),
            ("0,588;0,2;0,1", "0.588 0.2 0.1", Decimal),
            (",5 ,25 ,125", ".5 .25 .125", Decimal),
            ("0,5,0,2,0,1", "0.5 0.2 0.1", Decimal),
            ("0,5", "0.5", Decimal),
            ("1,0,0.5", "1 0 0.5", Separator),
            ("1, 0.5,0", "1 0.5 0", Separator),
            ("1, 0, 0", "1 0 0", Separator),
            ("1 ,0 ,0", "1 0 0", Separator),
            ("255,128 0", "255 128 0", Separator),
            ("1,,0,0", "1 0 0", Separator),
        ] {
            assert_eq!(split(list, Counts::COLOR), Some((words.into(), commas)), "{list}");
        }
        for (list, counts, words, commas) in [
            ("0,5 1,0 2,5", Counts::VERTEX, "0.5 1.0 2.5", Decimal),
            ("0,5 1,0 2,5 1,0 0,5 0,0", Counts::VERTEX, "0.5 1.0 2.5 1.0 0.5 0.0", Decimal),
            ("0.5,1,2,1,0,0", Counts::VERTEX, "0.5 1 2 1 0 0", Separator),
            ("0,0 0,0 1,0", Counts::NORMAL, "0.0 0.0 1.0", Decimal),
            ("0,5 0,25", Counts::TEXTURE_COORDINATE, "0.5 0.25", Decimal),
            ("0.5,0.25", Counts::TEXTURE_COORDINATE, "0.5 0.25", Separator),
            ("0,5,0,25", Counts::TEXTURE_COORDINATE, "0.5 0.25", Decimal),
        ] {
            assert_eq!(split(list, counts), Some((words.into(), commas)), "{list}");
        }
    }

    #[test]
    fn lists_with_two_possible_readings_are_ambiguous() {
        for (list, counts) in [
            ("0,5,0,2", Counts::COLOR),
            ("0,5 0,2", Counts::COLOR),
            ("1,2,3,4,5", Counts::COLOR),
            ("0,5 1,0", Counts::VERTEX),
            ("0,5,1,0,2,5", Counts::VERTEX),
            ("1.234,5 2.000,5 3,5", Counts::VERTEX),
        ] {
            assert_eq!(split(list, counts), None, "{list}");
        }
    }

    #[test]
    fn single_numbers_may_have_a_decimal_comma() {
        let parse = |word: &str| {
            let mut commas = DecimalCommas::default();
            (commas.parse(word), commas.found)
        };
        assert_eq!(parse("96,078"), (Some(96.078), true));
        assert_eq!(parse("-1,5e2"), (Some(-150.0), true));
        for (word, value) in [("1.5", Some(1.5)), ("10,", Some(10.0)), ("1,000.5", None), ("1,2,3", None)] {
            assert_eq!(parse(word), (value, false), "{word}");
        }
        for word in ["x,y", ",", ""] {
            assert_eq!(parse(word), (None, false), "{word}");
        }
    }
}
