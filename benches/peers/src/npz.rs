//! Reads NumPy archives: ZIP files of arrays in the format NPY 1.0 (`numpy.lib.format`).

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use zip::ZipArchive;

/// Longest text of a header in bytes.
const MAX_HEADER: usize = 4096;

/// The arrays of an archive by name.
pub struct NpzFile(HashMap<String, NpyArray>);

/// An array in C order.
struct NpyArray {
    /// The type of its elements, such as `<f4`.
    descriptor: String,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl NpzFile {
    /// Reads all arrays.
    pub fn open(path: &Path) -> Result<NpzFile, String> {
        let located = |error: String| format!("{}: {error}", path.display());
        let file = File::open(path).map_err(|e| located(e.to_string()))?;
        let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|e| located(e.to_string()))?;
        let mut arrays = HashMap::new();
        for i in 0..archive.len() {
            let mut entry = archive.by_index(i).map_err(|e| located(e.to_string()))?;
            let name = entry.name().trim_end_matches(".npy").to_string();
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).map_err(|e| located(format!("{name}: {e}")))?;
            let array =
                NpyArray::parse(bytes).ok_or_else(|| located(format!("{name} is no array of NPY 1.0")))?;
            arrays.insert(name, array);
        }
        Ok(NpzFile(arrays))
    }

    /// The elements of an array of `descriptor`, which has `width` of them for each row.
    fn elements(&self, name: &str, descriptor: &str, width: usize) -> Result<&[u8], String> {
        let array = self.0.get(name).ok_or_else(|| format!("the archive has no array {name}"))?;
        let columns: usize = array.shape.iter().skip(1).product();
        if array.descriptor != descriptor || columns != width {
            let NpyArray { descriptor, shape, .. } = array;
            return Err(format!("the array {name} has the type {descriptor} and the shape {shape:?}"));
        }
        Ok(&array.data)
    }

    /// Rows of N numbers.
    pub fn floats<const N: usize>(&self, name: &str) -> Result<Vec<[f32; N]>, String> {
        let rows: Vec<[u32; N]> = words(self.elements(name, "<f4", N)?);
        Ok(rows.into_iter().map(|row| row.map(f32::from_bits)).collect())
    }

    /// Rows of N unsigned integers.
    pub fn integers<const N: usize>(&self, name: &str) -> Result<Vec<[u32; N]>, String> {
        Ok(words(self.elements(name, "<u4", N)?))
    }

    /// Small unsigned integers.
    pub fn bytes(&self, name: &str) -> Result<&[u8], String> {
        self.elements(name, "|u1", 1)
    }

    /// Truth values.
    pub fn flags(&self, name: &str) -> Result<Vec<bool>, String> {
        Ok(self.elements(name, "|b1", 1)?.iter().map(|&byte| byte != 0).collect())
    }

    /// Texts.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, String> {
        let array = self.0.get(name).ok_or_else(|| format!("the archive has no array {name}"))?;
        let length = array.descriptor.strip_prefix("|S").and_then(|digits| digits.parse().ok()).unwrap_or(0);
        if length == 0 {
            return Err(format!("the array {name} has no texts"));
        }
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string();
        Ok(array.data.chunks(length).map(text).collect())
    }
}

/// Rows of little-endian words.
fn words<const N: usize>(data: &[u8]) -> Vec<[u32; N]> {
    let (words, _) = data.as_chunks::<4>();
    let (rows, _) = words.as_chunks::<N>();
    rows.iter().map(|row| row.map(u32::from_le_bytes)).collect()
}

impl NpyArray {
    fn parse(mut bytes: Vec<u8>) -> Option<NpyArray> {
        let rest = bytes.strip_prefix(b"\x93NUMPY\x01\x00")?;
        let (length, rest) = rest.split_first_chunk::<2>()?;
        let length = usize::from(u16::from_le_bytes(*length));
        let header = std::str::from_utf8(rest.get(..length.min(MAX_HEADER))?).ok()?;
        let after = |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start());
        let descriptor = after("'descr':")?.strip_prefix('\'')?.split('\'').next()?.to_string();
        if !after("'fortran_order':")?.starts_with("False") {
            return None;
        }
        let axes = after("'shape':")?.strip_prefix('(')?.split(')').next()?;
        let axes = axes.split(',').map(str::trim).filter(|axis| !axis.is_empty());
        let shape = axes.map(|axis| axis.parse().ok()).collect::<Option<Vec<usize>>>()?;
        // Magic, version and length take ten bytes.
        let data = bytes.split_off(bytes.len().min(10 + length));
        let size: usize = descriptor.get(2..)?.parse().ok()?;
        let expected = shape.iter().try_fold(size, |product, &axis| product.checked_mul(axis))?;
        (data.len() == expected).then_some(NpyArray { descriptor, shape, data })
    }
}

#[cfg(test)]
mod tests {
    use blinn_bench::npz::{NpyArray as Written, NpyType, encode_npz};

    use super::*;

    #[test]
    fn arrays_come_back() {
        let floats = [1.5f32, -0.0, f32::INFINITY, 4.0, 5.0, 6.0];
        let data = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
        let array =
            |name, element, shape: &[usize], data| Written { name, element, shape: shape.to_vec(), data };
        let arrays = [
            array("a", NpyType::F32, &[2, 3], data),
            array("b", NpyType::U32, &[1], 7u32.to_le_bytes().to_vec()),
            array("c", NpyType::Bool, &[2], vec![0, 1]),
            array("d", NpyType::Bytes(3), &[2], b"ab\0cde".to_vec()),
            array("e", NpyType::U8, &[2], vec![3, 4]),
        ];
        let file = encode_npz(&arrays).unwrap();
        let path = std::env::temp_dir().join(format!("blinn-peers-{}.npz", std::process::id()));
        std::fs::write(&path, &file).unwrap();
        let read = NpzFile::open(&path);
        std::fs::remove_file(&path).unwrap();
        let read = read.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read.floats::<3>("a").unwrap(), [[1.5, -0.0, f32::INFINITY], [4.0, 5.0, 6.0]]);
        assert_eq!(read.integers::<1>("b").unwrap(), [[7]]);
        assert_eq!(read.flags("c").unwrap(), [false, true]);
        assert_eq!(read.texts("d").unwrap(), ["ab", "cde"]);
        assert_eq!(read.bytes("e").unwrap(), [3, 4]);
        for wrong in
            [read.floats::<2>("a").map(drop), read.integers::<3>("a").map(drop), read.bytes("x").map(drop)]
        {
            assert!(wrong.is_err());
        }
    }
}
