//! The image data of PNG files: filtered rows, compressed in blocks on all threads.
//!
//! `fdeflate` has one Huffman code for all images, and finds no repetitions beyond a row. The codes of one block of rows
//! behind those of another are therefore what it writes for both, and the bytes depend neither on the size of blocks
//! nor on the number of threads.

use std::io::{self, Cursor};

use fdeflate::{Compressor, StoredOnlyCompressor};
use rayon::prelude::*;

use super::bit_string::{Bits, common_length, join, length_to_last_one};
use super::png_filter::RowFilter;

/// Bytes of rows that are worth a task of their own.
const BLOCK_BYTES: usize = 1 << 17;

/// Bytes of Adler-32 at the end of a stream.
const ADLER_BYTES: usize = 4;

/// Rows of an image without padding.
#[derive(Clone, Copy)]
pub(super) struct Rows<'r> {
    pub bytes: &'r [u8],
    /// Bytes of a row, and of a pixel. Not zero.
    pub row_bytes: usize,
    pub pixel_bytes: usize,
}

impl Rows<'_> {
    /// Returns the zlib stream of all rows.
    ///
    /// # Errors
    /// The encoder fails.
    pub fn compress(self) -> io::Result<Vec<u8>> {
        let compressed = self.compress_blocks(BLOCK_BYTES)?;
        let row_count = self.bytes.len() / self.row_bytes;
        let stored = StoredOnlyCompressor::<()>::compressed_size(self.bytes.len() + row_count);
        if compressed.len() > stored { self.store() } else { Ok(compressed) }
    }

    /// Compresses blocks of about as many bytes side by side. Returns the same bytes for any size of blocks.
    fn compress_blocks(self, block_bytes: usize) -> io::Result<Vec<u8>> {
        let rows_per_block = (block_bytes / self.row_bytes).max(1);
        let block_length = rows_per_block * self.row_bytes;
        // Thumbnails are one block.
        if self.bytes.len() > 2 * block_length {
            let block = |i: usize| Block::compress(self, i * block_length, block_length);
            let count = self.bytes.len().div_ceil(block_length);
            let blocks: Vec<Block> = (0..count).into_par_iter().map(block).collect::<io::Result<_>>()?;
            if let Some(stream) = join_blocks(&blocks)? {
                return Ok(stream);
            }
        }
        let Block { mut stream, adler, .. } = Block::compress(self, 0, self.bytes.len())?;
        stream.extend(adler.to_be_bytes());
        Ok(stream)
    }

    /// Returns a stream of unfiltered rows without compression.
    fn store(self) -> io::Result<Vec<u8>> {
        let mut compressor = StoredOnlyCompressor::new(Cursor::new(Vec::new()))?;
        for row in self.bytes.chunks(self.row_bytes) {
            compressor.write_data(&[0])?;
            compressor.write_data(row)?;
        }
        Ok(compressor.finish()?.into_inner())
    }
}

/// A compressed block of rows.
struct Block {
    /// Its zlib stream without Adler-32.
    stream: Vec<u8>,
    adler: u32,
    /// Bytes of its filtered rows.
    length: usize,
}

impl Block {
    /// Compresses the rows of an image from an offset on, at most `length` bytes.
    fn compress(image: Rows, start: usize, length: usize) -> io::Result<Block> {
        let Rows { bytes, row_bytes, pixel_bytes } = image;
        let end = bytes.len().min(start + length);
        let top = vec![0; row_bytes];
        let above = start.checked_sub(row_bytes).map_or(&top[..], |above| &bytes[above..start]);
        let mut filter = RowFilter::new(pixel_bytes, above);
        let rows = bytes[start..end].chunks_exact(row_bytes);
        let length = rows.len() * (row_bytes + 1);
        let mut compressor = Compressor::new(Vec::new())?;
        for row in rows {
            compressor.write_data(filter.filter(row))?;
        }
        Block::finish(compressor, length)
    }

    fn finish(compressor: Compressor<Vec<u8>>, length: usize) -> io::Result<Block> {
        let mut stream = compressor.finish()?;
        let adler = stream.split_off(stream.len() - ADLER_BYTES);
        let adler = adler.into_iter().fold(0, |sum, byte| (sum << 8) | u32::from(byte));
        Ok(Block { stream, adler, length })
    }

    /// A block of these bytes, which are no rows.
    fn of_bytes(bytes: &[u8]) -> io::Result<Block> {
        let mut compressor = Compressor::new(Vec::new())?;
        compressor.write_data(bytes)?;
        Block::finish(compressor, bytes.len())
    }
}

/// Joins the codes of blocks to one stream. `None` if their streams do not begin with the same table of codes, which no
/// version of `fdeflate` writes today.
fn join_blocks(blocks: &[Block]) -> io::Result<Option<Vec<u8>>> {
    // The stream of no bytes is a header and the code of its end. That of a zero has another code behind the header.
    let empty = Block::of_bytes(&[])?;
    let header_length = common_length(&empty.stream, &Block::of_bytes(&[0])?.stream);
    let end_length = length_to_last_one(&empty.stream).saturating_sub(header_length);
    if blocks.iter().any(|block| common_length(&block.stream, &empty.stream) < header_length) {
        return Ok(None);
    }
    let codes =
        |block: &'_ Block| header_length..length_to_last_one(&block.stream).saturating_sub(end_length);
    let header = Bits { bytes: &empty.stream, range: 0..header_length };
    let end = Bits { bytes: &empty.stream, range: header_length..header_length + end_length };
    let parts = blocks.iter().map(|block| Bits { bytes: &block.stream, range: codes(block) });
    let parts: Vec<Bits> = std::iter::once(header).chain(parts).chain([end]).collect();
    let mut stream = join(&parts);
    let adler = blocks.iter().fold(empty.adler, |adler, block| join_adler(adler, block.adler, block.length));
    stream.extend(adler.to_be_bytes());
    Ok(Some(stream))
}

/// Adler-32 (RFC 1950, section 8.2) of some bytes and `length` bytes behind them, from those of both parts.
fn join_adler(first: u32, second: u32, length: usize) -> u32 {
    const MODULUS: u64 = 65_521;
    // The sum of the bytes and 1, and the sum of these sums.
    let sums = |adler: u32| [u64::from(adler & 0xffff), u64::from(adler >> 16)];
    let ([a, b], [other_a, other_b]) = (sums(first), sums(second));
    let offset = (a + MODULUS - 1) % MODULUS;
    let sum = (offset + other_a) % MODULUS;
    let sum_of_sums = (b + other_b + offset * (length as u64 % MODULUS)) % MODULUS;
    ((sum_of_sums << 16) | sum) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of which some rows are flat, some smooth and some noise.
    fn picture(row_bytes: usize, rows: usize) -> Vec<u8> {
        let mut seed = 1u32;
        let byte = |i: usize| {
            let (x, y) = (i % row_bytes, i / row_bytes);
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            match y % 16 {
                0..7 => 200,
                7..14 => (x / 5 + y) as u8,
                _ => (seed >> 24) as u8,
            }
        };
        (0..row_bytes * rows).map(byte).collect()
    }

    #[test]
    fn blocks_are_joined_to_the_stream_of_one_block() {
        for (pixel_bytes, width, height) in [(3, 101, 90), (4, 64, 64), (1, 7, 33), (6, 500, 5), (3, 1, 40)] {
            let row_bytes = pixel_bytes * width;
            let bytes = picture(row_bytes, height);
            let rows = Rows { bytes: &bytes, row_bytes, pixel_bytes };
            let whole = rows.compress_blocks(usize::MAX / 4).unwrap();
            for rows_per_block in [1, 2, 5, 16] {
                let blocks = rows.compress_blocks(rows_per_block * row_bytes + row_bytes / 2).unwrap();
                assert!(blocks == whole, "{width}x{height}, {rows_per_block} rows");
            }
        }
    }

    #[test]
    fn a_version_of_fdeflate_with_other_codes_is_not_joined() {
        let mut blocks = [Block::of_bytes(&[3; 100]).unwrap(), Block::of_bytes(&[5; 100]).unwrap()];
        assert!(join_blocks(&blocks).unwrap().is_some());
        blocks[1].stream[20] ^= 1;
        assert!(join_blocks(&blocks).unwrap().is_none());
    }

    /// Noise becomes longer when it is compressed.
    #[test]
    fn noise_is_stored() {
        let mut seed = 7u32;
        let noise = std::iter::repeat_with(|| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        });
        let bytes: Vec<u8> = noise.take(300 * 1000).collect();
        let rows = Rows { bytes: &bytes, row_bytes: 300, pixel_bytes: 3 };
        let stream = rows.compress().unwrap();
        assert_eq!(stream.len(), StoredOnlyCompressor::<()>::compressed_size(301 * 1000));
        assert!(stream.len() < rows.compress_blocks(BLOCK_BYTES).unwrap().len());
    }
}
