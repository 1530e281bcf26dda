//! A file in stretches of whole lines, one after the other: it is never in memory as a whole.

use std::io::{self, Read};

/// Bytes of a stretch: few enough to share out evenly, and to stay near the processor; enough to
/// make no fuss.
pub(crate) const STRETCH: usize = 1 << 20;

/// How much of a file's first line is kept.
const HEAD: usize = 1000;

/// Cuts what it reads behind line ends.
pub(crate) struct Stretches<R> {
    file: R,
    size: usize,
    /// The beginning of a line whose end was not read yet.
    rest: Vec<u8>,
    count: usize,
    /// How the file begins.
    pub head: Vec<u8>,
}

impl<R: Read> Stretches<R> {
    pub fn new(file: R, size: usize) -> Stretches<R> {
        Stretches { file, size, rest: Vec::new(), count: 0, head: Vec::new() }
    }

    /// Puts the next stretch into `buffer` and gives its number; `None` behind the last.
    pub fn next(&mut self, buffer: &mut Vec<u8>) -> io::Result<Option<usize>> {
        buffer.clear();
        buffer.append(&mut self.rest);
        loop {
            let start = buffer.len();
            let read = (&mut self.file).take(self.size as u64).read_to_end(buffer)?;
            if let Some(end) = buffer[start..].iter().rposition(|b| *b == b'\n') {
                self.rest.extend_from_slice(&buffer[start + end + 1..]);
                buffer.truncate(start + end + 1);
                break;
            }
            if read == 0 {
                break;
            }
        }
        if buffer.is_empty() {
            return Ok(None);
        }
        if self.count == 0 {
            if buffer.starts_with(b"\xef\xbb\xbf") {
                buffer.drain(..3);
            }
            self.head.extend_from_slice(&buffer[..buffer.len().min(HEAD)]);
        }
        self.count += 1;
        Ok(Some(self.count - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_end_where_lines_do() {
        let text = b"v 1 2 3\nv 4 5 6\n\nf 1 2 3\nlast";
        for size in 1..40 {
            let mut stretches = Stretches::new(&text[..], size);
            let (mut all, mut buffer, mut parts) = (Vec::new(), Vec::new(), 0);
            while let Some(number) = stretches.next(&mut buffer).unwrap() {
                assert_eq!(number, parts);
                assert!(buffer.ends_with(b"\n") || buffer.ends_with(b"last"));
                all.extend_from_slice(&buffer);
                parts += 1;
            }
            assert_eq!(all, text);
        }
    }

    #[test]
    fn a_mark_is_no_part_of_the_text() {
        let mut buffer = Vec::new();
        assert_eq!(Stretches::new(&b"\xef\xbb\xbfv"[..], 9).next(&mut buffer).unwrap(), Some(0));
        assert_eq!(buffer, b"v");
    }
}
