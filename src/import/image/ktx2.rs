//! KTX2 files with Basis Universal textures (KHR_texture_basisu).

use basisu::{DecodeFlags, TargetFormat, Transcoder};

use super::foreign::vulkan_format;

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";
/// Bytes of the header before the level index.
const HEADER: usize = 80;

/// Returns true for a KTX2 file.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&IDENTIFIER)
}

fn read_u32(bytes: &[u8], offset: usize) -> Option<u32> {
    bytes.get(offset..offset + 4)?.try_into().ok().map(u32::from_le_bytes)
}

/// Reads width and height in pixels from the header.
pub(crate) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let truncated = || "the KTX2 header is truncated".to_string();
    let width = read_u32(bytes, 20).ok_or_else(truncated)?;
    let height = read_u32(bytes, 24).ok_or_else(truncated)?;
    Ok((width, height))
}

/// Names the texels that a file has instead of Basis Universal.
fn not_basis(bytes: &[u8]) -> String {
    // Basis Universal has the undefined format.
    match read_u32(bytes, IDENTIFIER.len()).filter(|&format| format != 0) {
        Some(format) => {
            let name = vulkan_format(format);
            format!(
                "it is KTX2 with {name}; save it as KTX2 with Basis Universal (ETC1S or UASTC), PNG or JPEG"
            )
        }
        None => "not a KTX2 file with a Basis Universal texture".into(),
    }
}

/// Decodes the finest level to RGBA with 8 bits per channel. The caller has checked the size against its
/// limits.
///
/// # Errors
/// The file is damaged, or has a format that glTF does not allow.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let (width, height) = size(bytes)?;
    let pixels = u64::from(width) * u64::from(height);
    let texture = Transcoder::new(bytes).map_err(|_| not_basis(bytes))?;
    if !texture.supports(TargetFormat::Rgba32) {
        return Err(format!("glTF does not allow the KTX2 format {:?}", texture.source_format()));
    }
    let stored = bytes.get(HEADER + 16..HEADER + 24).and_then(|b| b.try_into().ok());
    let stored = stored.map(u64::from_le_bytes).ok_or("the KTX2 level index is truncated")?;
    // A block of at most 16 bytes holds at least 4 × 4 texels; the last block may be partial.
    if stored > 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) {
        return Err(format!("the finest level has {stored} bytes, too many for {width}x{height} pixels"));
    }
    let texels = texture.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let texels = texels.map_err(|e| format!("corrupt Basis Universal data ({e:?})"))?;
    if texels.len() as u64 != 4 * pixels {
        return Err(format!("decoded to {} bytes instead of {}", texels.len(), 4 * pixels));
    }
    Ok(texels)
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn folder() -> std::path::PathBuf {
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/gltf/ktx2")
    }

    fn file(name: &str) -> Vec<u8> {
        std::fs::read(folder().join(name)).unwrap()
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        !bytes.iter().fold(!0, |crc, b| (0..8).fold(crc ^ u32::from(*b), step))
    }

    /// ETC1S and UASTC, with and without mip maps, Zstandard and alpha, against the Khronos transcoder.
    #[test]
    fn texels_match_the_reference_transcoder() {
        let Value::Object(list) = serde_json::from_slice(&file("basis.json")).unwrap() else { panic!() };
        let mut checked = 0;
        let basis = list.iter().filter(|(name, _)| !name.starts_with("plain"));
        for (name, expected) in basis {
            let bytes = file(name);
            let side = |key: &str| expected[key].as_u64().unwrap() as u32;
            assert_eq!(size(&bytes), Ok((side("width"), side("height"))), "{name}");
            let texels = decode(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
            let crc = format!("{:08x}", crc32(&texels));
            assert_eq!(crc, expected["levels"][0]["crc32"].as_str().unwrap(), "{name}");
            checked += 1;
        }
        assert_eq!(checked, 21);
    }

    #[test]
    fn other_formats_are_errors() {
        let error = decode(&file("plain_rgba8_unorm.ktx2")).unwrap_err();
        let advice = "save it as KTX2 with Basis Universal (ETC1S or UASTC), PNG or JPEG";
        assert_eq!(error, format!("it is KTX2 with uncompressed texels (VkFormat 37); {advice}"));
        let mut astc = file("plain_rgba8_unorm.ktx2");
        astc[12..16].copy_from_slice(&157u32.to_le_bytes());
        assert_eq!(decode(&astc).unwrap_err(), format!("it is KTX2 with ASTC 4x4; {advice}"));
        assert_eq!(decode(&IDENTIFIER).unwrap_err(), "the KTX2 header is truncated");
    }

    /// Damaged files neither panic nor allocate more memory than the image needs.
    #[test]
    fn damaged_files_do_not_panic() {
        for name in ["alpha_etc1s_mips.ktx2", "colour_uastc_zstd.ktx2", "random_uastc.ktx2"] {
            let intact = file(name);
            for end in (0..intact.len()).step_by(7) {
                let _ = decode(&intact[..end]);
            }
            for at in 0..intact.len().min(700) {
                for value in [0, 0xff, intact[at] ^ 0x10, intact[at].wrapping_add(1)] {
                    let mut bad = intact.clone();
                    bad[at] = value;
                    // `image::decode` checks the size first, too.
                    if size(&bad).is_ok_and(|(w, h)| u64::from(w) * u64::from(h) <= 1 << 16) {
                        let _ = decode(&bad);
                    }
                }
            }
        }
    }
}
