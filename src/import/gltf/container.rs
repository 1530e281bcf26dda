//! The outer layer: plain JSON, or GLB's header and chunks.

use crate::import::error::{LoadError, Warnings};

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// What is wrong with a file of another kind that is called `.glb` or `.gltf`.
const NEITHER: &str =
    "this is no glTF file: it begins neither with 'glTF', as a .glb, nor with '{', as a .gltf";

/// The JSON text and the binary chunk of a file.
#[derive(Debug)]
pub(super) struct Container<'a> {
    /// JSON, without byte-order mark.
    pub json: &'a [u8],
    /// GLB's first binary chunk.
    pub bin: Option<&'a [u8]>,
}

/// Takes a file apart. Chunks beyond the two that glTF defines are passed over, as the format asks.
pub(super) fn split<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        let json = without_mark(bytes);
        return match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Container { json, bin: None }),
            _ => Err(LoadError::parse("byte 0", NEITHER)),
        };
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .ok_or_else(|| LoadError::parse(format_args!("byte {at}"), "the GLB header is cut off"))
    };
    match word(4)? {
        2 => {}
        1 => return Err(LoadError::Unsupported(super::repair::VERSION_1.into())),
        v => return Err(LoadError::Unsupported(format!("GLB version {v} is not known; 2 is read"))),
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        let what = format!("the file is cut off: it has {} of {length} bytes", bytes.len());
        return Err(LoadError::parse("byte 8", what));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = HEADER;
    while length.saturating_sub(at) >= CHUNK_HEADER {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let body = at + CHUNK_HEADER;
        // A chunk may end past the stated length as long as the file goes on.
        let chunk = body.checked_add(size).and_then(|end| bytes.get(body..end)).ok_or_else(|| {
            let left = bytes.len() - body;
            LoadError::parse(format_args!("byte {at}"), format_args!("a chunk of {size} bytes has {left}"))
        })?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            _ if json.is_none() => break,
            BIN if bin.is_none() => bin = Some(chunk),
            _ => warnings.add(format_args!("byte {at}"), "a further GLB chunk was passed over"),
        }
        at = body + size;
    }
    if at < bytes.len() {
        let left = bytes.len() - at;
        warnings.add(format_args!("byte {at}"), format_args!("{left} trailing bytes were passed over"));
    }
    let json = json.ok_or_else(|| LoadError::parse("byte 12", "GLB's first chunk is not JSON"))?;
    Ok(Container { json: without_mark(json), bin })
}

/// The text without byte-order mark, and without the zeros that some exporters pad with.
fn without_mark(text: &[u8]) -> &[u8] {
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
    fn chunks_are_found_whatever_else_there_is() {
        let mut file =
            glb(&[(JSON, b"\xef\xbb\xbf{} \0"), (0x1234, b"what"), (BIN, b"data"), (BIN, b"more")]);
        file.extend(b"trailing");
        let mut warnings = Warnings::default();
        let container = split(&file, &mut warnings).unwrap();
        assert_eq!((container.json, container.bin), (&b"{}"[..], Some(&b"data"[..])));
        assert_eq!(warnings.into_vec().len(), 3);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let whole = glb(&[(JSON, b"{}  "), (BIN, b"data")]);
        let error = |bytes: &[u8]| split(bytes, &mut Warnings::default()).unwrap_err().to_string();
        assert_eq!(error(&whole[..9]), "byte 8: the GLB header is cut off");
        assert_eq!(error(&whole[..30]), "byte 8: the file is cut off: it has 30 of 36 bytes");
        let mut long = whole.clone();
        long[12] = 99;
        assert_eq!(error(&long), "byte 12: a chunk of 99 bytes has 16");
        assert_eq!(error(&glb(&[(BIN, b"data")])), "byte 12: GLB's first chunk is not JSON");
        let mut old = whole;
        old[4] = 1;
        assert!(error(&old).contains("glTF 1.0"));
    }
}
