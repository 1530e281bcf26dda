//! The container: JSON text, or the header and chunks of a GLB.

use super::text_repair;
use crate::error::{LoadError, Warnings};

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
    /// True if the end of the binary chunk is missing.
    pub is_truncated: bool,
}

/// Splits a file into its JSON and binary chunk. Other chunks are ignored, as the GLB specification requires.
/// Wrong lengths in the headers, which programs leave that write to a pipe, are warnings: the JSON ends where its
/// braces close, and the binary chunk at the end of the file.
pub(super) fn split<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        let json = trim(bytes);
        return match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'{') => Ok(Container { json, bin: None, is_truncated: false }),
            _ => Err(LoadError::parse("byte 0", NOT_GLTF)),
        };
    }
    let header = |at: usize| {
        let error = || LoadError::parse(format_args!("byte {at}"), "the GLB header is truncated");
        word(bytes, at).ok_or_else(error)
    };
    match header(4)? {
        2 => {}
        1 => return Err(LoadError::Unsupported(super::version::VERSION_1.into())),
        v => {
            return Err(LoadError::Unsupported(format!(
                "GLB version {v} is not supported; expected version 2"
            )));
        }
    }
    let length = header(8)? as usize;
    let without_json = || {
        if length <= bytes.len() {
            return LoadError::parse("byte 12", "the JSON chunk has no end");
        }
        let message = format!("the file is truncated: it has {} of {length} bytes", bytes.len());
        LoadError::parse("byte 8", message)
    };
    let mut chunks = Chunks { bytes, length, at: HEADER, is_truncated: false };
    match word(bytes, HEADER + 4) {
        Some(JSON) => {}
        None if length > bytes.len() => return Err(without_json()),
        _ => return Err(LoadError::parse("byte 12", "the first GLB chunk is not JSON")),
    }
    let json = chunks.json(warnings).ok_or_else(without_json)?;
    let mut bin = None;
    while chunks.has_next(bin.is_none()) {
        let at = chunks.at;
        match word(bytes, at + 4) {
            Some(BIN) if bin.is_none() => bin = Some(chunks.binary(warnings)),
            Some(kind @ (BIN | JSON)) => {
                let name = if kind == BIN { "binary" } else { "JSON" };
                warnings.add(format_args!("byte {at}"), format_args!("ignored another {name} chunk"));
                chunks.skip();
            }
            // Ignores chunks of extensions, as glTF requires.
            _ => chunks.skip(),
        }
    }
    chunks.check_end(warnings);
    Ok(Container { json: trim(json), bin, is_truncated: chunks.is_truncated })
}

/// The number at an offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|word| u32::from_le_bytes(*word))
}

/// Reads the chunks of a GLB.
struct Chunks<'a> {
    bytes: &'a [u8],
    /// Length of the file by its header.
    length: usize,
    /// Offset of the next chunk.
    at: usize,
    is_truncated: bool,
}

impl<'a> Chunks<'a> {
    /// Moves past the header of a chunk. Returns the chunk's length and what follows the header in the file.
    fn enter(&mut self) -> (usize, &'a [u8]) {
        let size = word(self.bytes, self.at).unwrap_or(0) as usize;
        self.at += CHUNK_HEADER;
        (size, self.bytes.get(self.at..).unwrap_or_default())
    }

    /// Reads the JSON chunk. If its length is wrong, it ends with the last brace. `None` if that is missing.
    fn json(&mut self, warnings: &mut Warnings) -> Option<&'a [u8]> {
        let (size, rest) = self.enter();
        if size != 0 && size <= rest.len() {
            self.at += size;
            return Some(&rest[..size]);
        }
        let start = rest.iter().position(|&b| b == b'{')?;
        let end = text_repair::end_of_container(rest, start)?;
        let message = format!("the JSON chunk has a length of {size}; read {end} bytes up to its last brace");
        warnings.add(format_args!("byte {HEADER}"), message);
        let end_of_json = self.at + end;
        let is_binary = |&at: &usize| word(self.bytes, at + 4) == Some(BIN);
        let next = (end_of_json..end_of_json + 4).find(is_binary);
        self.at = next.unwrap_or(end_of_json.next_multiple_of(4)).min(self.bytes.len());
        Some(&rest[..end])
    }

    /// Reads the binary chunk. If its length is 0 or beyond the file, it ends with the file.
    fn binary(&mut self, warnings: &mut Warnings) -> &'a [u8] {
        let at = self.at;
        let (size, rest) = self.enter();
        if size > rest.len() {
            let message =
                format!("the file is truncated: it has {} of {size} bytes of the chunk", rest.len());
            warnings.add(format_args!("byte {at}"), message);
            self.is_truncated = true;
        } else if size != 0 || rest.is_empty() || self.at == self.length {
            self.at += size;
            return &rest[..size];
        } else {
            let message =
                format!("the binary chunk has a length of 0; read the {} bytes that follow", rest.len());
            warnings.add(format_args!("byte {at}"), message);
        }
        self.at = self.bytes.len();
        rest
    }

    fn skip(&mut self) {
        let (size, rest) = self.enter();
        self.at += size.min(rest.len());
    }

    /// Returns true if another chunk follows: within the length of the header, or the missing binary chunk.
    fn has_next(&self, wants_binary: bool) -> bool {
        let has_header = self.bytes.len() - self.at >= CHUNK_HEADER;
        let is_within = self.at + CHUNK_HEADER <= self.length;
        has_header && (is_within || wants_binary && word(self.bytes, self.at + 4) == Some(BIN))
    }

    /// Warns of trailing bytes or a wrong length in the header.
    fn check_end(&self, warnings: &mut Warnings) {
        let (end, total) = (self.at, self.bytes.len());
        if self.length < end {
            let message = format!("the header has a length of {}; read {end} bytes", self.length);
            warnings.add("byte 8", message);
        } else if self.length > total && !self.is_truncated {
            let message = format!("the file is truncated: it has {total} of {} bytes", self.length);
            warnings.add("byte 8", message);
        }
        if end < total {
            warnings.add(format_args!("byte {end}"), format_args!("ignored {} trailing bytes", total - end));
        }
    }
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
        assert_eq!(warnings.into_vec().len(), 2);
    }

    #[test]
    fn damaged_containers_are_errors_with_their_location() {
        let intact = glb(&[(JSON, b"{}  "), (BIN, b"data")]);
        let error = |bytes: &[u8]| split(bytes, &mut Warnings::default()).unwrap_err().to_string();
        assert_eq!(error(&intact[..9]), "byte 8: the GLB header is truncated");
        for end in [12, 19, 20, 21] {
            let message = format!("byte 8: the file is truncated: it has {end} of 36 bytes");
            assert_eq!(error(&intact[..end]), message);
        }
        assert_eq!(error(&glb(&[(BIN, b"data")])), "byte 12: the first GLB chunk is not JSON");
        let mut old = intact;
        old[4] = 1;
        assert!(error(&old).contains("glTF 1.0"));
    }

    #[test]
    fn wrong_lengths_are_warnings() {
        let json = b"{\"a\":\"}\"}   ";
        let intact = glb(&[(JSON, json), (BIN, b"data1234")]);
        let bin = HEADER + CHUNK_HEADER + json.len();
        let read = |edit: &dyn Fn(&mut Vec<u8>)| {
            let mut file = intact.clone();
            edit(&mut file);
            let mut warnings = Warnings::default();
            let container = split(&file, &mut warnings).unwrap();
            assert_eq!(container.json, json.trim_ascii());
            (container.bin.map(<[u8]>::to_vec), container.is_truncated, warnings.into_lines())
        };
        let set =
            |file: &mut Vec<u8>, at: usize, word: u32| file[at..at + 4].copy_from_slice(&word.to_le_bytes());
        let data = Some(b"data1234".to_vec());
        assert_eq!(read(&|_| {}), (data.clone(), false, vec![]));
        for length in [0, 12, 20, u32::MAX] {
            let (found, is_truncated, warnings) = read(&|file| set(file, 8, length));
            assert_eq!(
                (found, is_truncated, warnings.len()),
                (data.clone(), false, 1),
                "{length}: {warnings:?}"
            );
        }
        for length in [0, u32::MAX] {
            let (found, is_truncated, warnings) = read(&|file| set(file, HEADER, length));
            assert_eq!(
                (found, is_truncated, warnings.len()),
                (data.clone(), false, 1),
                "{length}: {warnings:?}"
            );
        }
        let (found, is_truncated, warnings) = read(&|file| set(file, bin, 0));
        assert_eq!((found, is_truncated, warnings.len()), (data.clone(), false, 1), "{warnings:?}");
        // All lengths at once, as a program writes them that cannot seek.
        let (found, _, warnings) = read(&|file| [8, HEADER, bin].iter().for_each(|&at| set(file, at, 0)));
        assert_eq!((found, warnings.len()), (data, 3), "{warnings:?}");
        let (found, is_truncated, warnings) = read(&|file| file.truncate(bin + CHUNK_HEADER + 5));
        assert_eq!(
            (found.unwrap(), is_truncated, warnings.len()),
            (b"data1".to_vec(), true, 1),
            "{warnings:?}"
        );
        let (found, _, warnings) = read(&|file| file.truncate(bin));
        assert_eq!((found, warnings.len()), (None, 1), "{warnings:?}");
    }
}
