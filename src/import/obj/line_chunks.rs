//! Reads a file in chunks of whole lines, so that it is never in memory as a whole.

use std::io::{self, Read};

/// Bytes of a chunk: small enough for an even distribution over threads and for the cache, large enough
/// to hide the overhead.
pub(super) const CHUNK_BYTES: usize = 1 << 20;

/// Bytes of the start of the file that are kept.
const MAX_HEAD_BYTES: usize = 1000;

/// Splits a file after line ends.
pub(super) struct LineChunks<R> {
    file: R,
    size: usize,
    /// The start of a line whose end is not read yet.
    partial_line: Vec<u8>,
    count: usize,
    /// The start of the file, up to 1000 bytes.
    pub head: Vec<u8>,
}

impl<R: Read> LineChunks<R> {
    pub fn new(file: R, size: usize) -> LineChunks<R> {
        LineChunks { file, size, partial_line: Vec::new(), count: 0, head: Vec::new() }
    }

    /// Reads the next chunk into `buffer` and returns its index; `None` after the last.
    pub fn next(&mut self, buffer: &mut Vec<u8>) -> io::Result<Option<usize>> {
        buffer.clear();
        buffer.append(&mut self.partial_line);
        loop {
            let start = buffer.len();
            let read = (&mut self.file).take(self.size as u64).read_to_end(buffer)?;
            if let Some(end) = buffer[start..].iter().rposition(|b| *b == b'\n') {
                self.partial_line.extend_from_slice(&buffer[start + end + 1..]);
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
            self.head.extend_from_slice(&buffer[..buffer.len().min(MAX_HEAD_BYTES)]);
        }
        self.count += 1;
        Ok(Some(self.count - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_end_at_line_ends() {
        let text = b"v 1 2 3\nv 4 5 6\n\nf 1 2 3\nlast";
        for size in 1..40 {
            let mut chunks = LineChunks::new(&text[..], size);
            let mut all = Vec::new();
            let mut buffer = Vec::new();
            let mut count = 0;
            while let Some(number) = chunks.next(&mut buffer).unwrap() {
                assert_eq!(number, count);
                assert!(buffer.ends_with(b"\n") || buffer.ends_with(b"last"));
                all.extend_from_slice(&buffer);
                count += 1;
            }
            assert_eq!(all, text);
        }
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        let mut buffer = Vec::new();
        assert_eq!(LineChunks::new(&b"\xef\xbb\xbfv"[..], 9).next(&mut buffer).unwrap(), Some(0));
        assert_eq!(buffer, b"v");
    }
}
