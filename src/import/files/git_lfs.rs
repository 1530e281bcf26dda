//! Pointers that Git LFS leaves in the place of files which were not fetched.

/// What to do about a file that is such a pointer; nothing for any other file. A repository that was cloned
/// without Git LFS, or taken as an archive, has pointers for its scenes, buffers and textures.
pub(crate) fn advice(bytes: &[u8]) -> Option<&'static str> {
    // Git's specification: a pointer is shorter than 1024 bytes and begins with this.
    let pointer = bytes.len() < 1024 && bytes.starts_with(b"version https://git-lfs.github.com/spec/");
    pointer.then_some("a pointer of Git LFS stands in its place: get the file itself with 'git lfs pull'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_are_told_from_files() {
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 30\n";
        assert!(advice(pointer).is_some());
        assert!(
            [&b""[..], b"version 2\n", &pointer[1..], &[&pointer[..], &[b'\n'; 1024]].concat()]
                .iter()
                .all(|bytes| advice(bytes).is_none())
        );
    }

    /// A scene that is a pointer was told to be no glTF file, or to have no vertices.
    #[test]
    fn scenes_and_what_they_name_are_told_of() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            std::fs::write(dir.path().join(name), text).unwrap();
            dir.path().join(name)
        };
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 30\n";
        let load = |path: &std::path::Path| crate::import::load(path, &Default::default());
        for name in ["a.gltf", "a.glb", "a.obj", "a"] {
            let told = load(&write(name, pointer)).unwrap_err().to_string();
            assert!(told.contains("'git lfs pull'"), "{name}: {told}");
        }
        write("t.png", pointer);
        write("m.mtl", "newmtl m\nmap_Kd t.png\n");
        let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n";
        let (_, warnings) = load(&write("b.obj", obj)).unwrap();
        let told: Vec<_> = warnings.iter().map(ToString::to_string).collect();
        assert!(told.iter().any(|w| w.contains("'t.png'") && w.contains("'git lfs pull'")), "{told:?}");
    }
}
