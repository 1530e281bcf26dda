//! Parser of sizes of archives.

use blinn_session::values::bytes;

/// The most that an archive holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShardSize {
    /// Number of images.
    Images(u32),
    Bytes(u64),
}

/// Most images of an archive.
const MAX_IMAGES: u32 = 100_000_000;

/// A number of images, or of bytes with a unit.
pub fn shard_size(text: &str) -> Result<ShardSize, String> {
    let text = text.trim();
    let expected = || format!("expected 1 to {MAX_IMAGES} images, or bytes such as 512MB");
    if text.ends_with(|c: char| c.is_ascii_alphabetic()) {
        return bytes(text).map(ShardSize::Bytes).map_err(|_| expected());
    }
    let count = text.parse().ok().filter(|count| (1..=MAX_IMAGES).contains(count));
    count.map(ShardSize::Images).ok_or_else(expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_makes_bytes() {
        assert_eq!(shard_size("100"), Ok(ShardSize::Images(100)));
        assert_eq!(shard_size("512MB"), Ok(ShardSize::Bytes(512_000_000)));
        assert_eq!(shard_size("1 GiB"), Ok(ShardSize::Bytes(1 << 30)));
        assert_eq!(shard_size("700B"), Ok(ShardSize::Bytes(700)));
        for wrong in ["0", "", "-5", "99999999999", "x", "1.5", "0MB"] {
            assert!(shard_size(wrong).is_err(), "{wrong}");
        }
    }
}
