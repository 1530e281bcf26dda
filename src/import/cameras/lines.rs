//! Lines of a text file with their positions.

use std::io::{self, BufRead, Read};

const BYTE_ORDER_MARK: &str = "\u{feff}";
/// Longest line in bytes.
pub(super) const MAX_LINE: usize = 1 << 20;

/// Reads the line of a record, without its end and without a byte order mark.
pub(super) fn read_record_line(reader: &mut dyn BufRead) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(MAX_LINE as u64 + 1).read_until(b'\n', &mut bytes)?;
    while bytes.last().is_some_and(|byte| matches!(byte, b'\n' | b'\r')) {
        bytes.pop();
    }
    if bytes.starts_with(BYTE_ORDER_MARK.as_bytes()) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    Ok(bytes)
}

/// A reader that knows where lines begin.
pub(super) struct Lines<R> {
    reader: R,
    /// Byte offset of the next line.
    offset: u64,
    /// Number of lines read.
    number: u64,
}

/// A line without its end.
pub(super) struct Line {
    pub text: String,
    /// Byte offset of its beginning.
    pub offset: u64,
    /// From 1.
    pub number: u64,
}

impl<R: BufRead> Lines<R> {
    pub fn new(reader: R) -> Lines<R> {
        Lines { reader, offset: 0, number: 0 }
    }

    /// Reads the next line; `None` at the end of the file.
    pub fn next_line(&mut self) -> io::Result<Option<Line>> {
        let offset = self.offset;
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(MAX_LINE as u64 + 1).read_until(b'\n', &mut bytes)?;
        if read == 0 {
            return Ok(None);
        }
        self.offset += read as u64;
        self.number += 1;
        let number = self.number;
        let invalid =
            |text: String| io::Error::new(io::ErrorKind::InvalidData, format!("line {number} {text}"));
        if read > MAX_LINE {
            return Err(invalid(format!("is longer than {MAX_LINE} bytes")));
        }
        let mut text = String::from_utf8(bytes).map_err(|_| invalid("is not UTF-8".into()))?;
        text.truncate(text.trim_end_matches(['\n', '\r']).len());
        if text.starts_with(BYTE_ORDER_MARK) {
            text.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(Some(Line { text, offset, number }))
    }

    /// Skips a line of any length, and returns the number of its words; `None` at the end of the file.
    pub fn skip_line(&mut self) -> io::Result<Option<u64>> {
        let mut words = 0;
        let mut in_word = false;
        let mut is_empty = true;
        loop {
            let buffer = self.reader.fill_buf()?;
            if buffer.is_empty() {
                self.number += u64::from(!is_empty);
                return Ok((!is_empty).then_some(words));
            }
            is_empty = false;
            let end = buffer.iter().position(|b| *b == b'\n');
            let used = end.map_or(buffer.len(), |end| end + 1);
            for byte in &buffer[..used] {
                let is_space = byte.is_ascii_whitespace();
                words += u64::from(!is_space && !in_word);
                in_word = !is_space;
            }
            self.reader.consume(used);
            self.offset += used as u64;
            if end.is_some() {
                self.number += 1;
                return Ok(Some(words));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_know_their_numbers_and_offsets() {
        let text = "\u{feff}a b\r\n\n1 2  3 \nlast";
        let mut lines = Lines::new(io::BufReader::with_capacity(2, text.as_bytes()));
        let first = lines.next_line().unwrap().unwrap();
        assert_eq!((first.text.as_str(), first.offset, first.number), ("a b", 0, 1));
        assert_eq!(lines.skip_line().unwrap(), Some(0));
        assert_eq!(lines.skip_line().unwrap(), Some(3));
        let last = lines.next_line().unwrap().unwrap();
        assert_eq!((last.text.as_str(), last.number), ("last", 4));
        assert_eq!(&text[last.offset as usize..], "last");
        assert!(lines.next_line().unwrap().is_none() && lines.skip_line().unwrap().is_none());
    }

    #[test]
    fn long_and_binary_lines_are_errors() {
        let long = "x".repeat(MAX_LINE + 1);
        assert!(Lines::new(long.as_bytes()).next_line().is_err());
        assert!(Lines::new(&b"\xff\n"[..]).next_line().is_err());
        assert_eq!(Lines::new(long.as_bytes()).skip_line().unwrap(), Some(1));
    }
}
