//! The container: JSON text, or the header and chunks of a GLB.

use crate::import::error::{LoadError, Warnings};

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// The message for other files with the extension `.glb` or `.gltf`.
const NOT_GLTF: &str = "not a glTF file: it starts with neither 'glTF' (.glb) nor '{' (.gltf)";

/// The JSON text and the binary chunk of a file.
#[derive(Debug)]
pub(super) struct Container<'a> {
    /// JSON without byte-order mark.
    pub json: &'a [u8],
    /// The first binary chunk of a GLB.
    pub bin: Option<&'a [u8]>,
}

/// Splits a file into its JSON and binary chunk. Other chunks are ignored, as the GLB specification requires.
pub(super) fn split<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        let json = trim(bytes);
        return match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Container { json, bin: None }),
            _ => Err(LoadError::parse("byte 0", NOT_GLTF)),
        };
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .ok_or_else(|| LoadError::parse(format_args!("byte {at}"), "the GLB header is truncated"))
    };
    match word(4)? {
        2 => {}
        1 => return Err(LoadError::Unsupported(super::version::VERSION_1.into())),
        v => {
            return Err(LoadError::Unsupported(format!(
                "GLB version {v} is not supported; expected version 2"
            )));
        }
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        let message = format!("the file is truncated: it has {} of {length} bytes", bytes.len());
        return Err(LoadError::parse("byte 8", message));
    }
    let mut json = None;
    let mut bin = None;
    let mut at = HEADER;
    while length.saturating_sub(at) >= CHUNK_HEADER {
        let size = word(at)? as usize;
        let kind = word(at + 4)?;
        let body = at + CHUNK_HEADER;
        // A chunk may exceed the length in the header as long as it lies within the file.
        let chunk = body.checked_add(size).and_then(|end| bytes.get(body..end)).ok_or_else(|| {
            let left = bytes.len() - body;
            LoadError::parse(
                format_args!("byte {at}"),
                format_args!("a chunk of {size} bytes exceeds the file, which has {left} bytes left"),
            )
        })?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            _ if json.is_none() => break,
            BIN if bin.is_none() => bin = Some(chunk),
            _ => warnings.add(format_args!("byte {at}"), "ignored an additional GLB chunk"),
        }
        at = body + size;
    }
    if at < bytes.len() {
        let left = bytes.len() - at;
        warnings.add(format_args!("byte {at}"), format_args!("ignored {left} trailing bytes"));
    }
    let json = json.ok_or_else(|| LoadError::parse("byte 12", "the first GLB chunk is not JSON"))?;
    Ok(Container { json: trim(json), bin })
}

/// Removes the byte-order mark, and trailing white space and zeros, which some exporters pad with.
fn trim(text: &[u8]) -> &[u8] {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let end = text.iter().rposition(|b| *b != 0 && !b.is_ascii_whitespace());
    &text[..end.map_or(0, |i| i + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, body) in chunks {
            file.extend((body.len() as u32).to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend(*body);
        }
        let length = file.len() as u32;
        file[8..12].copy_from_slice(&length.to_le_bytes());
        file
    }

    #[test]
    fn unknown_chunks_and_trailing_bytes_are_ignored() {
        let mut file =
            glb(&[(JSON, b"\xef\xbb\xbf{} \0"), (0x1234, b"what"), (BIN, b"data"), (BIN, b"more")]);
        file.extend(b"trailing");
        let mut warnings = Warnings::default();
        let container = split(&file, &mut warnings).unwrap();
        assert_eq!((container.json, container.bin), (&b"{}"[..], Some(&b"data"[..])));
        assert_eq!(warnings.into_vec().len(), 3);
    }

    #[test]
    fn damaged_containers_are_errors_with_their_location() {
        let intact = glb(&[(JSON, b"{}  "), (BIN, b"data")]);
        let error = |bytes: &[u8]| split(bytes, &mut Warnings::default()).unwrap_err().to_string();
        assert_eq!(error(&intact[..9]), "byte 8: the GLB header is truncated");
        assert_eq!(error(&intact[..30]), "byte 8: the file is truncated: it has 30 of 36 bytes");
        let mut long = intact.clone();
        long[12] = 99;
        assert_eq!(error(&long), "byte 12: a chunk of 99 bytes exceeds the file, which has 16 bytes left");
        assert_eq!(error(&glb(&[(BIN, b"data")])), "byte 12: the first GLB chunk is not JSON");
        let mut old = intact;
        old[4] = 1;
        assert!(error(&old).contains("glTF 1.0"));
    }
}
