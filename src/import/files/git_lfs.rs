//! Detects Git LFS pointers: short texts in place of files that were not downloaded.

/// Returns what to do about a Git LFS pointer; `None` for any other file. A repository that was cloned
/// without Git LFS or downloaded as an archive has pointers instead of scenes, buffers and textures.
pub(crate) fn pointer_hint(bytes: &[u8]) -> Option<&'static str> {
    // By the Git LFS specification a pointer is shorter than 1024 bytes and starts with its version.
    let pointer = bytes.len() < 1024 && bytes.starts_with(b"version https://git-lfs.github.com/spec/");
    pointer.then_some("the file is a Git LFS pointer; download the content with 'git lfs pull'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_are_distinguished_from_files() {
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 30\n";
        assert!(pointer_hint(pointer).is_some());
        assert!(
            [&b""[..], b"version 2\n", &pointer[1..], &[&pointer[..], &[b'\n'; 1024]].concat()]
                .iter()
                .all(|bytes| pointer_hint(bytes).is_none())
        );
    }

    #[test]
    fn pointers_are_reported_for_scenes_and_their_textures() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            std::fs::write(dir.path().join(name), text).unwrap();
            dir.path().join(name)
        };
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 30\n";
        let load = |path: &std::path::Path| crate::load(path, &Default::default());
        for name in ["a.gltf", "a.glb", "a.obj", "a"] {
            let error = load(&write(name, pointer)).unwrap_err().to_string();
            assert!(error.contains("'git lfs pull'"), "{name}: {error}");
        }
        write("t.png", pointer);
        write("m.mtl", "newmtl m\nmap_Kd t.png\n");
        let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n";
        let (_, warnings) = load(&write("b.obj", obj)).unwrap();
        let lines: Vec<_> = warnings.iter().map(ToString::to_string).collect();
        assert!(lines.iter().any(|w| w.contains("'t.png'") && w.contains("'git lfs pull'")), "{lines:?}");
    }
}
