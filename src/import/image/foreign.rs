//! Names of image formats that are not decoded, for errors that say what a file is.

/// Formats by the bytes at a position of their files.
const MAGICS: [(usize, &[u8], &str); 16] = [
    (4, b"ftypavif", "AVIF"),
    (4, b"ftypavis", "AVIF"),
    (4, b"ftyphei", "HEIF"),
    (4, b"ftyphev", "HEIF"),
    (4, b"ftypmif1", "HEIF"),
    (0, b"DDS ", "DDS"),
    (0, b"\x13\xab\xa1\x5c", "ASTC"),
    (0, b"\xabKTX 11\xbb\r\n\x1a\n", "KTX 1"),
    (0, b"PVR\x03", "PVR"),
    (0, b"sB\x10\x00", "basis"),
    (0, b"\0\0\0\x0cJXL \r\n\x87\n", "JPEG XL"),
    (0, b"\xff\x0a", "JPEG XL"),
    (0, b"\0\0\0\x0cjP  \r\n\x87\n", "JPEG 2000"),
    (0, b"\xff\x4f\xff\x51", "JPEG 2000"),
    (0, b"8BPS", "PSD"),
    (0, b"gimp xcf", "XCF"),
];

/// Bytes at the start of a text that are searched for its root element.
const TEXT_HEAD: usize = 1024;

/// Returns what a file is that no decoder knows; `None` if that is unknown.
pub(super) fn describe(bytes: &[u8]) -> Option<&'static str> {
    if bytes.is_empty() {
        return Some("the file is empty");
    }
    let head = bytes[..bytes.len().min(TEXT_HEAD)].to_ascii_lowercase();
    let has = |text: &[u8]| head.windows(text.len()).any(|window| window == text);
    if head.trim_ascii_start().starts_with(b"<") && (has(b"<html") || has(b"<!doctype html")) {
        return Some("it is a web page, not an image; download the image itself");
    }
    None
}

/// Returns the name of the format of an image that no decoder knows.
pub(super) fn format_name(bytes: &[u8]) -> Option<&'static str> {
    let matches =
        |(at, magic, _): &&(usize, &[u8], &str)| bytes.get(*at..).is_some_and(|b| b.starts_with(magic));
    let by_magic = MAGICS.iter().find(matches).map(|(_, _, name)| *name);
    by_magic.or_else(|| {
        let head = &bytes[..bytes.len().min(TEXT_HEAD)];
        let is_svg = head.trim_ascii_start().starts_with(b"<") && head.windows(4).any(|w| w == b"<svg");
        is_svg.then_some("SVG")
    })
}

/// Returns the name of a format of Vulkan's texels, as KTX2 files have it.
pub(super) fn vulkan_format(format: u32) -> String {
    const ASTC: [&str; 14] = [
        "4x4", "5x4", "5x5", "6x5", "6x6", "8x5", "8x6", "8x8", "10x5", "10x6", "10x8", "10x10", "12x10",
        "12x12",
    ];
    const BLOCKS: [&str; 16] = [
        "BC1", "BC1", "BC1", "BC1", "BC2", "BC2", "BC3", "BC3", "BC4", "BC4", "BC5", "BC5", "BC6H", "BC6H",
        "BC7", "BC7",
    ];
    match format {
        0 => "an unknown format".into(),
        1..=130 => format!("uncompressed texels (VkFormat {format})"),
        131..=146 => BLOCKS[format as usize - 131].into(),
        147..=156 => "ETC2".into(),
        157..=184 => format!("ASTC {}", ASTC[(format as usize - 157) / 2]),
        // VK_EXT_texture_compression_astc_hdr.
        1_000_066_000..=1_000_066_013 => format!("ASTC {} HDR", ASTC[(format - 1_000_066_000) as usize]),
        1_000_054_000..=1_000_054_007 => "PVRTC".into(),
        _ => format!("VkFormat {format}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_named_by_their_first_bytes() {
        for (bytes, name) in [
            (&b"\0\0\0\x20ftypavif\0\0\0\0"[..], Some("AVIF")),
            (b"\0\0\0\x18ftypheic", Some("HEIF")),
            (b"DDS |\0\0\0", Some("DDS")),
            (b"\x13\xab\xa1\x5c\x04\x04\x01", Some("ASTC")),
            (b"\n<?xml version='1.0'?>\n<svg xmlns=''/>", Some("SVG")),
            (b"what", None),
            (b"", None),
            (b"\0\0", None),
        ] {
            assert_eq!(format_name(bytes), name);
        }
        assert_eq!(describe(b""), Some("the file is empty"));
        assert!(describe(b" <!DOCTYPE html><html>").is_some() && describe(b"<svg/>").is_none());
    }

    #[test]
    fn texels_of_ktx2_are_named() {
        for (format, name) in [
            (37, "uncompressed texels (VkFormat 37)"),
            (131, "BC1"),
            (146, "BC7"),
            (147, "ETC2"),
            (157, "ASTC 4x4"),
            (184, "ASTC 12x12"),
            (1_000_066_001, "ASTC 5x4 HDR"),
            (4_000_000_000, "VkFormat 4000000000"),
        ] {
            assert_eq!(vulkan_format(format), name);
        }
    }
}
