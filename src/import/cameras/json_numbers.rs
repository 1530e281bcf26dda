//! NaN and infinities in JSON, as Python writes them: numbers that are an error only where their value is needed.

use std::borrow::Cow;
use std::io::{self, BufRead, BufReader, Read};

/// A number of JSON's syntax that no type of numbers holds.
const OUT_OF_RANGE: &[u8] = b"1e999";
/// The longest of the names.
const MAX_WORD: usize = b"Infinity".len();

/// A reader of JSON text that replaces `NaN` and `Infinity` outside strings by numbers out of range.
pub(super) struct FiniteTokens<R> {
    reader: R,
    is_in_string: bool,
    is_escaped: bool,
    /// Bytes that were read and not yet returned.
    ready: Vec<u8>,
    /// Number of bytes of `ready` that were returned.
    returned: usize,
}

impl<R: BufRead> FiniteTokens<R> {
    pub fn new(reader: R) -> FiniteTokens<R> {
        FiniteTokens { reader, is_in_string: false, is_escaped: false, ready: Vec::new(), returned: 0 }
    }

    fn peek(&mut self) -> io::Result<Option<u8>> {
        Ok(self.reader.fill_buf()?.first().copied())
    }

    /// Reads at least one byte, unless the text ends.
    fn read_token(&mut self) -> io::Result<()> {
        self.ready.clear();
        self.returned = 0;
        let Some(first) = self.peek()? else { return Ok(()) };
        if self.is_in_string || !first.is_ascii_alphabetic() {
            self.reader.consume(1);
            self.ready.push(first);
            match first {
                _ if self.is_escaped => self.is_escaped = false,
                b'\\' => self.is_escaped = self.is_in_string,
                b'"' => self.is_in_string = !self.is_in_string,
                _ => {}
            }
            return Ok(());
        }
        while let Some(byte) = self.peek()?.filter(u8::is_ascii_alphabetic) {
            if self.ready.len() > MAX_WORD {
                break;
            }
            self.reader.consume(1);
            self.ready.push(byte);
        }
        if self.ready == b"NaN" || self.ready == b"Infinity" {
            self.ready = OUT_OF_RANGE.to_vec();
        }
        Ok(())
    }
}

impl<R: BufRead> Read for FiniteTokens<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut count = 0;
        while count < buffer.len() {
            if self.returned == self.ready.len() {
                self.read_token()?;
                if self.ready.is_empty() {
                    break;
                }
            }
            let part = (self.ready.len() - self.returned).min(buffer.len() - count);
            buffer[count..count + part].copy_from_slice(&self.ready[self.returned..self.returned + part]);
            self.returned += part;
            count += part;
        }
        Ok(count)
    }
}

/// Replaces NaN and infinities of a text in memory.
pub(super) fn replace_non_finite(text: &[u8]) -> Cow<'_, [u8]> {
    let contains = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
    if !contains(b"NaN") && !contains(b"Infinity") {
        return Cow::Borrowed(text);
    }
    let mut replaced = Vec::with_capacity(text.len());
    // Reading from memory does not fail.
    let _ = FiniteTokens::new(BufReader::new(text)).read_to_end(&mut replaced);
    Cow::Owned(replaced)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_numbers_are_replaced_outside_strings() {
        for (text, expected) in [
            ("[NaN, -Infinity,Infinity]", "[1e999, -1e999,1e999]"),
            (r#"{"NaN": "\\\"NaN", "a": NaN}"#, r#"{"NaN": "\\\"NaN", "a": 1e999}"#),
            ("[true, 1e5, NaNNaN, Infinityx, nan]", "[true, 1e5, NaNNaN, Infinityx, nan]"),
            ("\"NaN", "\"NaN"),
            ("", ""),
        ] {
            for capacity in [1, 3, 64] {
                let reader = BufReader::with_capacity(capacity, text.as_bytes());
                let mut read = String::new();
                FiniteTokens::new(reader).read_to_string(&mut read).unwrap();
                assert_eq!(read, expected);
            }
            assert_eq!(&*replace_non_finite(text.as_bytes()), expected.as_bytes());
        }
        let long = "x".repeat(100);
        assert_eq!(
            &*replace_non_finite(format!("NaN {long}").as_bytes()),
            format!("1e999 {long}").as_bytes()
        );
    }
}
