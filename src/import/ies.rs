//! IES files: photometric profiles of luminaires, as ANSI/IES LM-63 defines them (1986, 1991, 1995, 2002, 2019).
//!
//! A file is text: a line with its version, keyword lines, a line `TILT=…`, then numbers, free over lines. The tilt
//! of lamps is skipped, as are the luminaire's size and watts.

use blinn_scene::{LightProfile, Photometry};

/// Intensities of a file, at most.
const MAX_INTENSITIES: usize = 1 << 24;

/// A profile, and what was repaired in it.
#[derive(Debug)]
pub(crate) struct IesFile {
    pub profile: LightProfile,
    /// Intensities below 0, which were read as 0.
    pub negative: usize,
}

/// Reads a profile in candela.
///
/// # Errors
/// The line and the reason why the text is no profile.
pub(crate) fn parse(bytes: &[u8]) -> Result<IesFile, String> {
    let mut lines = Lines::new(bytes);
    let version = Version::of(lines.clone().next().map_or(&b""[..], |line| line.text));
    let tilt = loop {
        let Some(line) = lines.next() else {
            return Err("no IES file: it has no line TILT=".into());
        };
        if let Some(tilt) = value_of(line.text, b"TILT=") {
            break tilt;
        }
    };
    let mut numbers = Numbers { lines, rest: &[], line: 0 };
    if tilt.eq_ignore_ascii_case(b"INCLUDE") {
        numbers.next("the lamp-to-luminaire geometry")?;
        let count = numbers.count("the number of tilt angles")?;
        for _ in 0..count.saturating_mul(2) {
            numbers.next("a tilt angle or factor")?;
        }
    }
    numbers.next("the number of lamps")?;
    numbers.next("the lumens per lamp")?;
    let multiplier = numbers.positive("the candela multiplier")?;
    let vertical_count = numbers.count("the number of vertical angles")?;
    let horizontal_count = numbers.count("the number of horizontal angles")?;
    let photometry = match numbers.next("the photometric type")? {
        1.0 => Photometry::TypeC,
        2.0 => Photometry::TypeB,
        3.0 => Photometry::TypeA,
        other => {
            return Err(
                numbers.error(format_args!("the photometric type {other} is not 1 (C), 2 (B) or 3 (A)"))
            );
        }
    };
    for name in ["the units", "the width", "the length", "the height"] {
        numbers.next(name)?;
    }
    let ballast = numbers.positive("the ballast factor")?;
    let lamp_factor = numbers.positive("the ballast lamp factor")?;
    // Later versions reserve the number, or describe with it how the file was made.
    let lamp_factor = if version.has_lamp_factor() { lamp_factor } else { 1.0 };
    numbers.next("the input watts")?;

    let total = vertical_count.checked_mul(horizontal_count).filter(|&total| total <= MAX_INTENSITIES);
    // Each number has a digit and a separator.
    let fits = |total: &usize| *total <= numbers.bytes_left() / 2 + 1;
    let Some(total) = total.filter(fits) else {
        return Err(numbers.error(format_args!(
            "{horizontal_count} × {vertical_count} angles are more than the file has numbers for"
        )));
    };
    let vertical = numbers.take(vertical_count, "a vertical angle")?;
    let horizontal = numbers.take(horizontal_count, "a horizontal angle")?;
    let factor = multiplier * ballast * lamp_factor;
    let mut candela = Vec::with_capacity(total);
    let mut negative = 0;
    for _ in 0..total {
        let value = numbers.next("an intensity")?;
        let intensity = (value * factor) as f32;
        if !intensity.is_finite() {
            return Err(numbers.error(format_args!("the intensity {value} × {factor} cd is too large")));
        }
        negative += usize::from(intensity < 0.0);
        candela.push(intensity.max(0.0));
    }
    let profile = LightProfile::new(photometry, vertical, horizontal, &candela)?;
    Ok(IesFile { profile, negative })
}

/// The standard that a file names in its first line.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    /// 1986, which names none, to 1995.
    UpTo1995,
    From2002,
}

impl Version {
    fn of(line: &[u8]) -> Version {
        let is_later = |version: &[u8]| value_of(line, version).is_some();
        let later: [&[u8]; 3] = [b"IESNA:LM-63-2002", b"IES:LM-63-2019", b"IESNA:LM-63-2019"];
        if later.into_iter().any(is_later) { Version::From2002 } else { Version::UpTo1995 }
    }

    fn has_lamp_factor(self) -> bool {
        self == Version::UpTo1995
    }
}

/// Returns the rest of a line that begins with `key`, without spaces around.
fn value_of<'a>(line: &'a [u8], key: &[u8]) -> Option<&'a [u8]> {
    let (start, value) = line.split_at_checked(key.len())?;
    start.eq_ignore_ascii_case(key).then(|| value.trim_ascii())
}

/// A line of text, without its end and spaces around.
struct Line<'a> {
    text: &'a [u8],
    number: usize,
}

/// The lines of a file, which end with CR, LF or both.
#[derive(Clone)]
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Lines<'a> {
        Lines { rest: bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), number: 0 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|b| matches!(b, b'\r' | b'\n')).unwrap_or(self.rest.len());
        let (text, rest) = self.rest.split_at(end);
        self.rest = rest.strip_prefix(b"\r\n").or_else(|| rest.get(1..)).unwrap_or_default();
        self.number += 1;
        Some(Line { text: text.trim_ascii(), number: self.number })
    }
}

/// The numbers after the line TILT=, separated by spaces, commas or the ends of lines.
struct Numbers<'a> {
    lines: Lines<'a>,
    /// Rest of the current line.
    rest: &'a [u8],
    line: usize,
}

impl Numbers<'_> {
    /// Reads the next number. `name` says which one it is, for errors.
    fn next(&mut self, name: &str) -> Result<f64, String> {
        let is_separator = |b: &u8| b.is_ascii_whitespace() || *b == b',';
        loop {
            let start = self.rest.iter().position(|b| !is_separator(b));
            if let Some(start) = start {
                let word = &self.rest[start..];
                let (word, rest) = word.split_at(word.iter().position(is_separator).unwrap_or(word.len()));
                self.rest = rest;
                let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
                return number.filter(|number| number.is_finite()).ok_or_else(|| {
                    let shown: String = String::from_utf8_lossy(word).chars().take(40).collect();
                    let shown = crate::files::escape::printable(&shown);
                    self.error(format_args!("'{shown}' is no number; expected {name}"))
                });
            }
            let Some(line) = self.lines.next() else {
                return Err(format!("the file ends before {name}"));
            };
            (self.rest, self.line) = (line.text, line.number);
        }
    }

    fn positive(&mut self, name: &str) -> Result<f64, String> {
        let number = self.next(name)?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(self.error(format_args!("{name} is {number}, not above 0")))
        }
    }

    fn count(&mut self, name: &str) -> Result<usize, String> {
        let number = self.next(name)?;
        let is_count = number >= 1.0 && number <= MAX_INTENSITIES as f64 && number.fract() == 0.0;
        match is_count {
            true => Ok(number as usize),
            false => Err(self
                .error(format_args!("{name} is {number}, not a whole number from 1 to {MAX_INTENSITIES}"))),
        }
    }

    fn take(&mut self, count: usize, name: &str) -> Result<Vec<f64>, String> {
        (0..count).map(|_| self.next(name)).collect()
    }

    fn bytes_left(&self) -> usize {
        self.rest.len() + self.lines.rest.len()
    }

    fn error(&self, message: std::fmt::Arguments<'_>) -> String {
        format!("line {}: {message}", self.line)
    }
}

#[cfg(test)]
mod tests;
