//! NumPy archives (.npz): an uncompressed ZIP file of arrays in the format NPY 1.0 (`numpy.lib.format`).

use std::io::{self, Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The type of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NpyType {
    /// 32-bit floating-point numbers.
    F32,
    /// 32-bit unsigned integers.
    U32,
    /// 8-bit unsigned integers.
    U8,
    /// Truth values, a byte each.
    Bool,
    /// Byte strings of this length, padded by zeros.
    Bytes(usize),
}

impl NpyType {
    fn descriptor(self) -> String {
        match self {
            NpyType::F32 => "<f4".into(),
            NpyType::U32 => "<u4".into(),
            NpyType::U8 => "|u1".into(),
            NpyType::Bool => "|b1".into(),
            NpyType::Bytes(length) => format!("|S{length}"),
        }
    }

    fn size(self) -> usize {
        match self {
            NpyType::F32 | NpyType::U32 => 4,
            NpyType::U8 | NpyType::Bool => 1,
            NpyType::Bytes(length) => length,
        }
    }
}

/// An array in C order.
#[derive(Clone, Debug)]
pub struct NpyArray {
    /// Its name in the archive.
    pub name: &'static str,
    /// The type of its elements.
    pub element: NpyType,
    /// Its size along each axis.
    pub shape: Vec<usize>,
    /// Its elements in little-endian order.
    pub data: Vec<u8>,
}

impl NpyArray {
    /// The header of an NPY file, padded so that the data are aligned to 64 bytes.
    fn header(&self) -> Vec<u8> {
        let shape: String = self.shape.iter().map(|n| format!("{n}, ")).collect();
        let shape = if self.shape.len() > 1 { shape.trim_end_matches(", ") } else { shape.trim_end() };
        let descriptor = self.element.descriptor();
        let mut text = format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': ({shape}), }}");
        // Magic, version and length take ten bytes, and a line feed ends the text.
        let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
        text.extend(std::iter::repeat_n(' ', length - 1 - text.len()));
        text.push('\n');
        let mut header = b"\x93NUMPY\x01\x00".to_vec();
        header.extend((length as u16).to_le_bytes());
        header.extend(text.bytes());
        header
    }
}

/// Encodes an archive. The same arrays give the same bytes.
///
/// # Errors
/// The data of an array do not have its shape.
pub fn encode_npz(arrays: &[NpyArray]) -> io::Result<Vec<u8>> {
    // Stored, and dated 1980-01-01.
    let options = SimpleFileOptions::DEFAULT.compression_method(CompressionMethod::Stored);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for array in arrays {
        if array.shape.iter().product::<usize>() * array.element.size() != array.data.len() {
            let text = format!("{}: {} bytes do not have its shape", array.name, array.data.len());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        let is_large = array.data.len() as u64 >= u64::from(u32::MAX) - 1024;
        archive.start_file(format!("{}.npy", array.name), options.large_file(is_large))?;
        archive.write_all(&array.header())?;
        archive.write_all(&array.data)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn headers_are_aligned_and_name_the_shape() {
        let array =
            |shape: &[usize], element| NpyArray { name: "a", element, shape: shape.to_vec(), data: vec![] };
        for (array, expected) in [
            (array(&[5], NpyType::U8), "{'descr': '|u1', 'fortran_order': False, 'shape': (5,), }"),
            (array(&[5, 3], NpyType::F32), "{'descr': '<f4', 'fortran_order': False, 'shape': (5, 3), }"),
            (array(&[2], NpyType::Bytes(10)), "{'descr': '|S10', 'fortran_order': False, 'shape': (2,), }"),
        ] {
            let header = array.header();
            assert_eq!(header.len() % 64, 0);
            assert_eq!(usize::from(u16::from_le_bytes([header[8], header[9]])) + 10, header.len());
            let text = std::str::from_utf8(&header[10..]).unwrap();
            assert!(text.starts_with(expected) && text.ends_with(" \n"), "{text}");
        }
    }

    #[test]
    fn wrong_shapes_are_errors() {
        let array = NpyArray { name: "a", element: NpyType::U32, shape: vec![2], data: vec![0; 7] };
        assert!(encode_npz(&[array]).unwrap_err().to_string().contains("shape"));
    }

    #[test]
    fn every_array_is_stored_and_found() {
        let array =
            |name, n: usize| NpyArray { name, element: NpyType::U8, shape: vec![n], data: vec![7; n] };
        let arrays = [array("first", 3), array("second", 100)];
        let bytes = encode_npz(&arrays).unwrap();
        assert_eq!(encode_npz(&arrays).unwrap(), bytes);
        let mut archive = zip::ZipArchive::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(archive.file_names().collect::<Vec<_>>(), ["first.npy", "second.npy"]);
        for array in &arrays {
            let mut file = archive.by_name(&format!("{}.npy", array.name)).unwrap();
            assert_eq!(file.compression(), CompressionMethod::Stored);
            let mut data = Vec::new();
            file.read_to_end(&mut data).unwrap();
            assert!(data.starts_with(b"\x93NUMPY") && data.ends_with(&array.data));
        }
    }
}
