//! NumPy archives (.npz): an uncompressed ZIP file of arrays in the format NPY 1.0
//! (`numpy.lib.format`, PKWARE's APPNOTE 6.3).

use std::io::{self, Write};

/// The size limit of the ZIP format without its 64-bit extension.
const MAX_BYTES: u64 = u32::MAX as u64;

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

/// The numbers of a file that both of its ZIP headers hold.
struct ZipEntry {
    name: String,
    crc: u32,
    size: u32,
    offset: u32,
}

impl ZipEntry {
    /// Version needed, flags, method (stored), time and date (1980-01-01), CRC, sizes, and the length of the name.
    fn fields(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for word in [20u16, 0, 0, 0, 0x21] {
            out.extend(word.to_le_bytes());
        }
        for number in [self.crc, self.size, self.size] {
            out.extend(number.to_le_bytes());
        }
        out.extend((self.name.len() as u16).to_le_bytes());
        out.extend(0u16.to_le_bytes());
        out
    }
}

/// Writes an archive. The same arrays give the same bytes.
///
/// # Errors
/// Writing fails, the archive would have 4 GiB or more, or the data of an array do not have its shape.
pub fn write_npz(out: &mut dyn Write, arrays: &[NpyArray]) -> io::Result<()> {
    let invalid = |message: String| io::Error::new(io::ErrorKind::InvalidInput, message);
    let total: u64 = arrays.iter().map(|array| array.data.len() as u64 + 512).sum();
    if total >= MAX_BYTES {
        return Err(invalid(format!("{total} bytes are too many for an .npz file of at most 4 GiB")));
    }
    let mut entries: Vec<ZipEntry> = Vec::new();
    let mut offset = 0;
    for array in arrays {
        if array.shape.iter().product::<usize>() * array.element.size() != array.data.len() {
            return Err(invalid(format!("{}: {} bytes do not have its shape", array.name, array.data.len())));
        }
        let header = array.header();
        let mut crc = crc32fast::Hasher::new();
        crc.update(&header);
        crc.update(&array.data);
        let entry = ZipEntry {
            name: format!("{}.npy", array.name),
            crc: crc.finalize(),
            size: (header.len() + array.data.len()) as u32,
            offset,
        };
        let mut local = b"PK\x03\x04".to_vec();
        local.extend(entry.fields());
        local.extend(entry.name.bytes());
        out.write_all(&local)?;
        out.write_all(&header)?;
        out.write_all(&array.data)?;
        offset += local.len() as u32 + entry.size;
        entries.push(entry);
    }
    let mut directory = Vec::new();
    for entry in &entries {
        directory.extend(b"PK\x01\x02");
        directory.extend(20u16.to_le_bytes());
        directory.extend(entry.fields());
        // No comment, the first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(entry.offset.to_le_bytes());
        directory.extend(entry.name.bytes());
    }
    out.write_all(&directory)?;
    let count = (entries.len() as u16).to_le_bytes();
    let mut end = b"PK\x05\x06\0\0\0\0".to_vec();
    end.extend(count);
    end.extend(count);
    end.extend((directory.len() as u32).to_le_bytes());
    end.extend(offset.to_le_bytes());
    end.extend([0; 2]);
    out.write_all(&end)
}

#[cfg(test)]
mod tests {
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
        assert!(write_npz(&mut Vec::new(), &[array]).unwrap_err().to_string().contains("shape"));
    }

    /// The central directory points at the local headers, whose sizes lead from one to the next.
    #[test]
    fn the_directory_lists_every_array() {
        let array =
            |name, n: usize| NpyArray { name, element: NpyType::U8, shape: vec![n], data: vec![7; n] };
        let mut file = Vec::new();
        write_npz(&mut file, &[array("first", 3), array("second", 100)]).unwrap();
        let u32_at = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let end = file.len() - 22;
        assert_eq!(&file[end..end + 4], b"PK\x05\x06");
        let mut at = u32_at(end + 16);
        assert_eq!(at + u32_at(end + 12), end);
        for (name, n) in [("first.npy", 3), ("second.npy", 100)] {
            let (size, offset) = (u32_at(at + 24), u32_at(at + 42));
            assert_eq!(&file[at + 46..at + 46 + name.len()], name.as_bytes());
            assert_eq!(&file[offset..offset + 4], b"PK\x03\x04");
            let data = &file[offset + 30 + name.len()..][..size];
            assert!(data.starts_with(b"\x93NUMPY") && data[size - n..].iter().all(|&b| b == 7));
            assert_eq!(crc32fast::hash(data) as usize, u32_at(at + 16));
            at += 46 + name.len();
        }
        assert_eq!(at, end);
    }
}
