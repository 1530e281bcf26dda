//! Detects archives, compressed files and .blend files by their magic numbers.

/// Returns what to do about an archive, a compressed file or a .blend file, judged by its first bytes; `None` for
/// other files.
pub(crate) fn hint(head: &[u8]) -> Option<&'static str> {
    let formats: [(&[u8], &str); 3] = [
        (
            b"BLENDER",
            "the file is a .blend file, which Blender converts; name it by its path, or export it as .glb",
        ),
        (b"\x1f\x8b", "the file is compressed with gzip; decompress it first"),
        (
            b"PK\x03\x04",
            "the file is a ZIP archive (as .usdz files are); extract it and load its .gltf, .glb or .obj file",
        ),
    ];
    formats.into_iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, hint)| hint)
}
