//! Lines of a text file with their positions.

use std::io::{self, BufRead, Read};

const BYTE_ORDER_MARK: &str = "\u{feff}";
/// Longest line in bytes.
pub(super) const MAX_LINE: usize = 1 << 20;
/// Most bytes of a character.
const MAX_UTF8: usize = 4;

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
    /// False if this is only the start of a long line.
    pub is_whole: bool,
}

impl<R: BufRead> Lines<R> {
    pub fn new(reader: R) -> Lines<R> {
        Lines { reader, offset: 0, number: 0 }
    }

    /// Reads the next line; `None` at the end of the file.
    ///
    /// # Errors
    /// The line is longer than [`MAX_LINE`].
    pub fn next_line(&mut self) -> io::Result<Option<Line>> {
        let line = self.next_line_or_start()?;
        match &line {
            Some(Line { number, is_whole: false, .. }) => {
                Err(invalid(*number, &format!("is longer than {MAX_LINE} bytes")))
            }
            _ => Ok(line),
        }
    }

    /// Reads the next line, and of a longer line the first [`MAX_LINE`] bytes; `None` at the end of the file.
    pub fn next_line_or_start(&mut self) -> io::Result<Option<Line>> {
        let offset = self.offset;
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(MAX_LINE as u64 + 1).read_until(b'\n', &mut bytes)?;
        if read == 0 {
            return Ok(None);
        }
        self.offset += read as u64;
        self.number += 1;
        let is_whole = read <= MAX_LINE;
        if !is_whole {
            if bytes.last() != Some(&b'\n') {
                self.skip_rest()?;
            }
            bytes.truncate(MAX_LINE);
            // A character may be cut.
            let valid = std::str::from_utf8(&bytes).map_or_else(|e| e.valid_up_to(), str::len);
            if bytes.len() - valid < MAX_UTF8 {
                bytes.truncate(valid);
            }
        }
        let mut text = String::from_utf8(bytes).map_err(|_| invalid(self.number, "is not UTF-8"))?;
        text.truncate(text.trim_end_matches(['\n', '\r']).len());
        if text.starts_with(BYTE_ORDER_MARK) {
            text.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(Some(Line { text, offset, number: self.number, is_whole }))
    }

    /// Skips the rest of a line of any length.
    fn skip_rest(&mut self) -> io::Result<()> {
        loop {
            let buffer = self.reader.fill_buf()?;
            let end = buffer.iter().position(|b| *b == b'\n');
            let used = end.map_or(buffer.len(), |end| end + 1);
            self.reader.consume(used);
            self.offset += used as u64;
            if end.is_some() || used == 0 {
                return Ok(());
            }
        }
    }
}

fn invalid(number: u64, text: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("line {number} {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_know_their_numbers_and_offsets() {
        let text = "\u{feff}a b\r\n\n1 2  3 \nlast";
        let mut lines = Lines::new(io::BufReader::with_capacity(2, text.as_bytes()));
        let mut next = || lines.next_line().unwrap();
        let first = next().unwrap();
        assert_eq!((first.text.as_str(), first.offset, first.number), ("a b", 0, 1));
        assert_eq!(next().unwrap().text, "");
        assert_eq!(next().unwrap().text, "1 2  3 ");
        let last = next().unwrap();
        assert_eq!((last.text.as_str(), last.number), ("last", 4));
        assert_eq!(&text[last.offset as usize..], "last");
        assert!(next().is_none());
    }

    #[test]
    fn long_and_binary_lines_are_errors() {
        let long = "x".repeat(MAX_LINE + 1);
        assert!(Lines::new(long.as_bytes()).next_line().is_err());
        assert!(Lines::new(&b"\xff\n"[..]).next_line().is_err());
    }

    #[test]
    fn the_start_of_a_long_line_is_read() {
        for rest in ["", "x", "yyy\u{e9}"] {
            let text = format!("{}\u{e9}{rest}\nnext", "x".repeat(MAX_LINE - 1));
            let mut lines = Lines::new(io::BufReader::with_capacity(64, text.as_bytes()));
            let start = lines.next_line_or_start().unwrap().unwrap();
            assert_eq!((start.text.len(), start.is_whole), (MAX_LINE - 1, false), "{rest}");
            let next = lines.next_line_or_start().unwrap().unwrap();
            assert_eq!((next.text.as_str(), next.number, next.is_whole), ("next", 2, true));
            assert_eq!(&text[next.offset as usize..], "next");
        }
    }
}
