//! Scenes in archives and compressed files.

/// What to do about a file that another program packed, by its first bytes; nothing for any other file.
pub(crate) fn advice(head: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 2] = [
        (b"\x1f\x8b", "the file is compressed by gzip: unpack it first"),
        (
            b"PK\x03\x04",
            "the file is a ZIP archive, as .usdz is too: unpack it first; .gltf, .glb and .obj are read",
        ),
    ];
    kinds.into_iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, advice)| advice)
}
