//! KTX2 files with Basis Universal textures, as KHR_texture_basisu allows them.

use basisu::{DecodeFlags, TargetFormat, Transcoder};

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";
/// Bytes of the header before the index of levels.
const HEADER: usize = 80;

/// True for a KTX2 file.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&IDENTIFIER)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}

/// Width and height by the header.
pub(crate) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let cut_off = || "its KTX2 header is cut off".to_string();
    let width = word(bytes, 20).ok_or_else(cut_off)?;
    let height = word(bytes, 24).ok_or_else(cut_off)?;
    Ok((width, height))
}

/// The finest level as RGBA, 8 bits a channel. The caller has checked the size against its limits.
///
/// # Errors
/// What is wrong with it, or what it holds that glTF does not allow.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let (width, height) = size(bytes)?;
    let pixels = u64::from(width) * u64::from(height);
    let texture = Transcoder::new(bytes).map_err(|_| "it is no KTX2 file with a Basis Universal texture")?;
    if !texture.supports(TargetFormat::Rgba32) {
        return Err(format!("its format, {:?}, is not one that glTF allows", texture.source_format()));
    }
    let stored = bytes.get(HEADER + 16..HEADER + 24).and_then(|b| b.try_into().ok());
    let stored = stored.map(u64::from_le_bytes).ok_or("its index of levels is cut off")?;
    // A block of 16 bytes holds at least 4x4 texels, and images end within a block.
    if stored > 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) {
        return Err(format!("its finest level would have {stored} bytes, too many for {width}x{height}"));
    }
    let texels = texture.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let texels = texels.map_err(|e| format!("its Basis Universal data are broken ({e:?})"))?;
    if texels.len() as u64 != 4 * pixels {
        return Err(format!("it decodes to {} bytes for {width}x{height}", texels.len()));
    }
    Ok(texels)
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn folder() -> std::path::PathBuf {
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/tests/gltf/ktx2")
    }

    fn file(name: &str) -> Vec<u8> {
        std::fs::read(folder().join(name)).unwrap()
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        !bytes.iter().fold(!0, |crc, b| (0..8).fold(crc ^ u32::from(*b), step))
    }

    /// ETC1S and UASTC, with and without mips, Zstandard, alpha: against Khronos's transcoder.
    #[test]
    fn texels_are_those_of_the_reference_transcoder() {
        let Value::Object(list) = serde_json::from_slice(&file("basis.json")).unwrap() else { panic!() };
        let mut judged = 0;
        let basis = list.iter().filter(|(name, _)| !name.starts_with("plain"));
        for (name, found) in basis {
            let bytes = file(name);
            let side = |key: &str| found[key].as_u64().unwrap() as u32;
            assert_eq!(size(&bytes), Ok((side("width"), side("height"))), "{name}");
            let texels = decode(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
            let crc = format!("{:08x}", crc32(&texels));
            assert_eq!(crc, found["levels"][0]["crc32"].as_str().unwrap(), "{name}");
            judged += 1;
        }
        assert_eq!(judged, 21);
    }

    #[test]
    fn other_formats_are_refused_in_words() {
        let error = decode(&file("plain_rgba8_unorm.ktx2")).unwrap_err();
        assert_eq!(error, "it is no KTX2 file with a Basis Universal texture");
        assert_eq!(decode(&IDENTIFIER).unwrap_err(), "its KTX2 header is cut off");
    }

    /// Whatever is damaged, nothing panics, and no more memory is taken than the image needs.
    #[test]
    fn damaged_files_do_no_harm() {
        for name in ["alpha_etc1s_mips.ktx2", "colour_uastc_zstd.ktx2", "random_uastc.ktx2"] {
            let whole = file(name);
            for end in (0..whole.len()).step_by(7) {
                let _ = decode(&whole[..end]);
            }
            for at in 0..whole.len().min(700) {
                for value in [0, 0xff, whole[at] ^ 0x10, whole[at].wrapping_add(1)] {
                    let mut bad = whole.clone();
                    bad[at] = value;
                    // As `image::decode` does before it decodes.
                    if size(&bad).is_ok_and(|(w, h)| u64::from(w) * u64::from(h) <= 1 << 16) {
                        let _ = decode(&bad);
                    }
                }
            }
        }
    }
}
