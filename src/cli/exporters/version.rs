//! The version in a generator.

/// Returns the first word of a generator that is a version: digits and dots, behind a `v` or `r` or not.
pub fn version_of(generator: &str) -> Option<&str> {
    generator.split(|c: char| c.is_whitespace() || matches!(c, '/' | '@')).find_map(|word| {
        let word = word.trim_matches(|c: char| !c.is_ascii_alphanumeric());
        let number = word.strip_prefix(['v', 'r']).unwrap_or(word);
        let is_version = number.starts_with(|c: char| c.is_ascii_digit())
            && (number.contains('.') || number.len() < word.len());
        is_version.then_some(word.strip_prefix('v').unwrap_or(word))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_found() {
        for (generator, expected) in [
            ("Khronos glTF Blender I/O v5.0.21", Some("5.0.21")),
            ("THREE.GLTFExporter r187", Some("r187")),
            ("Babylon.js v9.28.0", Some("9.28.0")),
            ("Created by meshio v5.3.5, 2026-11-28T10:47:03", Some("5.3.5")),
            ("Open Asset Import Library (assimp v5.2.cf7d3637)", Some("5.2.cf7d3637")),
            ("gltfpack 1.3", Some("1.3")),
            ("https://github.com/mikedh/trimesh", None),
            ("boxglb/0.1.0", Some("0.1.0")),
            ("pygltflib@v1.16.5", Some("1.16.5")),
            ("VTK", None),
            ("", None),
        ] {
            assert_eq!(version_of(generator), expected, "{generator}");
        }
    }
}
