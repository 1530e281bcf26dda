//! The values after the header of a PLY file, one after the other.

use super::header::{Encoding, Type};
use crate::files::escape::printable;

/// The reason why a value cannot be read.
#[derive(Debug, PartialEq)]
pub(super) enum Stop {
    /// The file ends.
    End,
    /// The text is not a number.
    NoNumber(String),
}

/// A reader of values. All types fit in `f64`.
pub(super) struct Values<'b> {
    encoding: Encoding,
    bytes: &'b [u8],
    /// Bytes that were left at the first number with a decimal comma.
    decimal_comma: Option<usize>,
}

impl<'b> Values<'b> {
    pub fn new(encoding: Encoding, bytes: &'b [u8]) -> Values<'b> {
        Values { encoding, bytes, decimal_comma: None }
    }

    /// Returns the number of bytes that were left at the first number with a decimal comma, which programs write under many
    /// locales.
    pub fn decimal_comma(&self) -> Option<usize> {
        self.decimal_comma
    }

    /// Returns the number of bytes that are left.
    pub fn remaining(&self) -> usize {
        self.bytes.len()
    }

    /// Reads the next value.
    #[inline]
    pub fn read(&mut self, kind: Type) -> Result<f64, Stop> {
        match self.encoding {
            Encoding::Ascii => self.read_text(),
            Encoding::LittleEndian => self.read_binary(kind, false),
            Encoding::BigEndian => self.read_binary(kind, true),
        }
    }

    /// Ends a row: text has one on each line.
    pub fn end_row(&mut self) {
        if self.encoding == Encoding::Ascii {
            let end = self.bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            self.bytes = &self.bytes[end.unwrap_or(self.bytes.len())..];
        }
    }

    fn read_text(&mut self) -> Result<f64, Stop> {
        let rest = self.bytes.trim_ascii_start();
        if rest.is_empty() {
            self.bytes = rest;
            return Err(Stop::End);
        }
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        self.bytes = after;
        let text = std::str::from_utf8(word).ok();
        if let Some(number) = text.and_then(|text| text.parse().ok()) {
            return Ok(number);
        }
        if let Some(number) = text.and_then(parse_decimal_comma) {
            self.decimal_comma.get_or_insert(rest.len());
            return Ok(number);
        }
        Err(Stop::NoNumber(printable(&String::from_utf8_lossy(&word[..word.len().min(40)]))))
    }

    #[inline]
    fn read_binary(&mut self, kind: Type, swap: bool) -> Result<f64, Stop> {
        Ok(match kind {
            Type::I8 => f64::from(i8::from_le_bytes(self.take(swap)?)),
            Type::U8 => f64::from(u8::from_le_bytes(self.take(swap)?)),
            Type::I16 => f64::from(i16::from_le_bytes(self.take(swap)?)),
            Type::U16 => f64::from(u16::from_le_bytes(self.take(swap)?)),
            Type::I32 => f64::from(i32::from_le_bytes(self.take(swap)?)),
            Type::U32 => f64::from(u32::from_le_bytes(self.take(swap)?)),
            Type::F32 => f64::from(f32::from_le_bytes(self.take(swap)?)),
            Type::F64 => f64::from_le_bytes(self.take(swap)?),
        })
    }

    /// Takes the bytes of a value, in little-endian order.
    #[inline]
    fn take<const N: usize>(&mut self, swap: bool) -> Result<[u8; N], Stop> {
        let (value, rest) = self.bytes.split_first_chunk::<N>().ok_or(Stop::End)?;
        self.bytes = rest;
        let mut value = *value;
        if swap {
            value.reverse();
        }
        Ok(value)
    }
}

/// Parses a number with a comma in place of the decimal point.
fn parse_decimal_comma(word: &str) -> Option<f64> {
    let (whole, fraction) = word.split_once(',')?;
    let is_number = fraction.starts_with(|c: char| c.is_ascii_digit()) && !whole.contains('.');
    format!("{whole}.{fraction}").parse().ok().filter(|_| is_number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_either_byte_order() {
        let little = [0xfe, 0xfe, 0xff, 0x00, 0x00, 0x80, 0xbf];
        let mut values = Values::new(Encoding::LittleEndian, &little);
        let read = [Type::I8, Type::U16, Type::F32].map(|kind| values.read(kind).unwrap());
        assert_eq!(read, [-2.0, 65_534.0, -1.0]);
        assert_eq!(values.read(Type::U8), Err(Stop::End));
        let mut values = Values::new(Encoding::BigEndian, &[0xff, 0xfe, 0xbf, 0xf0, 0, 0, 0, 0, 0, 0]);
        assert_eq!([Type::I16, Type::F64].map(|kind| values.read(kind).unwrap()), [-2.0, -1.0]);
    }

    #[test]
    fn text_has_a_row_on_each_line() {
        let mut values = Values::new(Encoding::Ascii, b"1 2e1 extra\r\n\n -3\tx");
        assert_eq!([values.read(Type::U8), values.read(Type::U8)], [Ok(1.0), Ok(20.0)]);
        values.end_row();
        assert_eq!(values.read(Type::U8), Ok(-3.0));
        assert_eq!(values.read(Type::U8), Err(Stop::NoNumber("x".into())));
        assert_eq!(values.read(Type::U8), Err(Stop::End));
    }

    #[test]
    fn numbers_may_have_a_decimal_comma() {
        let mut values = Values::new(Encoding::Ascii, b"1 -0,5e1 ,25 1,2,3 1.0,5 1, ,");
        assert_eq!(values.read(Type::F32), Ok(1.0));
        assert_eq!(values.decimal_comma(), None);
        assert_eq!([values.read(Type::F32), values.read(Type::F32)], [Ok(-5.0), Ok(0.25)]);
        assert_eq!(values.decimal_comma(), Some(27));
        for word in ["1,2,3", "1.0,5", "1,", ","] {
            assert_eq!(values.read(Type::F32), Err(Stop::NoNumber(word.into())));
        }
    }
}
