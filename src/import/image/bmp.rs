//! The alpha of BMP files, which the decoder ignores.

/// Returns the fourth byte of each pixel of an uncompressed file of 32 bits, row-major from the top: padding in the format's
/// definition, alpha for Blender. `None` for other files.
pub(crate) fn fourth_bytes(bytes: &[u8]) -> Option<Vec<u8>> {
    let four = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes);
    let is_uncompressed = bytes.starts_with(b"BM") && bytes.get(28..30)? == [32, 0] && four(30)? == 0;
    if !is_uncompressed || four(14)? < 40 {
        return None;
    }
    let width = usize::try_from(four(18)? as i32).ok().filter(|&width| width > 0)?;
    let height = four(22)? as i32;
    let row_bytes = width.checked_mul(4)?;
    let size = row_bytes.checked_mul(usize::try_from(height.unsigned_abs()).ok()?)?;
    let start = usize::try_from(four(10)?).ok()?;
    let pixels = bytes.get(start..start.checked_add(size)?)?;
    let rows = pixels.chunks_exact(row_bytes);
    let alpha = |row: &[u8]| row.as_chunks::<4>().0.iter().map(|&[.., a]| a).collect::<Vec<u8>>();
    // Positive heights start at the bottom.
    let rows: Vec<Vec<u8>> =
        if height > 0 { rows.rev().map(alpha).collect() } else { rows.map(alpha).collect() };
    Some(rows.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one pixel wide rows, whose alpha is given in the order of the file.
    fn file(height: i32, alpha: &[u8]) -> Vec<u8> {
        let mut out = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0".to_vec();
        out.extend(height.to_le_bytes());
        out.extend([1, 0, 32, 0]);
        out.resize(54, 0);
        alpha.iter().for_each(|a| out.extend([10, 20, 30, *a]));
        out
    }

    #[test]
    fn alpha_is_read_from_the_top() {
        assert_eq!(fourth_bytes(&file(2, &[1, 2])), Some(vec![2, 1]));
        assert_eq!(fourth_bytes(&file(-2, &[1, 2])), Some(vec![1, 2]));
    }

    #[test]
    fn other_and_damaged_files_have_none() {
        let good = file(2, &[1, 2]);
        assert!((0..good.len()).all(|end| fourth_bytes(&good[..end]).is_none()));
        for (at, value) in
            [(0, b'C'), (28, 24), (30, 3), (14, 12), (21, 0xff), (18, 0), (13, 0xff), (25, 0x7f)]
        {
            let mut bad = good.clone();
            bad[at] = value;
            assert_eq!(fourth_bytes(&bad), None, "{at}");
        }
    }
}
