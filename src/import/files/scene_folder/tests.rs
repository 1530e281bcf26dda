use super::*;

fn folder() -> (tempfile::TempDir, SceneFolder) {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("canary"), b"outside").unwrap();
    let inside = dir.path().join("scene");
    std::fs::create_dir_all(inside.join("tex")).unwrap();
    std::fs::write(inside.join("tex/a b.png"), b"inside").unwrap();
    let folder = SceneFolder::of(&inside.join("scene.gltf"), false);
    (dir, folder)
}

#[test]
fn files_inside_the_folder_are_read_by_any_spelling_of_their_path() {
    let (_dir, folder) = folder();
    for uri in ["tex/a b.png", "tex/a%20b.png", "tex\\a b.png", "./tex/a b.png", "tex/../tex/a b.png"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
    }
    assert_eq!(folder.read_uri(" DATA:;base64,aGk =", 100).unwrap(), b"hi");
}

#[test]
fn a_path_of_a_million_parent_steps_is_resolved_quickly() {
    let (_dir, folder) = folder();
    assert_eq!(folder.find_similar(&format!("{}a.png", "../".repeat(1 << 20))), None);
}

/// Exporters write absolute paths of textures, which may still be valid.
#[test]
fn absolute_paths_into_the_folder_are_read() {
    let (dir, folder) = folder();
    let absolute = |name: &str| dir.path().join("scene").join(name).to_string_lossy().into_owned();
    assert_eq!(folder.read_file(&absolute("tex/a b.png"), 100).unwrap(), b"inside");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(dir.path().join("scene"), dir.path().join("other")).unwrap();
        let folder = SceneFolder::of(&dir.path().join("other/scene.gltf"), false);
        for path in ["scene/tex/a b.png", "other/tex/a b.png"] {
            let path = dir.path().canonicalize().unwrap().join(path);
            assert_eq!(folder.read_file(&path.to_string_lossy(), 100).unwrap(), b"inside", "{path:?}");
        }
        std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
    }
    for name in ["../canary", "tex/../../canary", "link", ""] {
        assert!(folder.read_file(&absolute(name), 100).is_err(), "{name}");
    }
}

/// URIs are resolved without the file system: a folder followed by `..` need not exist.
#[test]
fn parent_steps_are_resolved_lexically() {
    let (dir, folder) = folder();
    let here = std::path::absolute(dir.path().join("scene/tex/a b.png")).unwrap();
    let here = here.to_str().unwrap().replace(' ', "%20");
    for uri in ["none/../tex/a b.png", "../scene/tex/a b.png", "tex/../../scene/./tex//a b.png"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
    }
    for uri in [format!("file://{here}"), format!("file://localhost{here}")] {
        assert_eq!(folder.read_uri(&uri, 100).unwrap(), b"inside", "{uri}");
    }
    for uri in ["none/../../canary", "../other/tex/c.png", "file://tex/c.png"] {
        assert!(matches!(folder.read_uri(uri, 100), Err(ReferenceError::Refused(_))), "{uri}");
    }
}

#[test]
fn queries_and_fragments_are_ignored_unless_a_file_has_that_name() {
    let (dir, folder) = folder();
    for uri in ["tex/a%20b.png?v=3", "tex/a b.png?v=3#top", "tex/a%20b.png#top"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
    }
    std::fs::write(dir.path().join("scene/tex/a b.png#top"), b"own").unwrap();
    assert_eq!(folder.read_uri("tex/a%20b.png#top", 100).unwrap(), b"own");
    let missing = folder.read_uri("none.png?v=3", 100).unwrap_err();
    assert!(missing.message().starts_with("'none.png' cannot be read: "), "{missing:?}");
}

/// Scenes from case-insensitive file systems may misspell the case.
#[test]
fn missing_files_are_found_in_another_letter_case() {
    let (dir, mut folder) = folder();
    for uri in ["Tex/A%20b.PNG", "TEX\\A B.png", "tex/../Tex/A b.png?v=3", "./tex/a%20B.png"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
    }
    // An exact match has priority, whether percent-decoded or not.
    std::fs::write(dir.path().join("scene/%41.png"), b"as written").unwrap();
    std::fs::write(dir.path().join("scene/A.PNG"), b"other case").unwrap();
    folder = SceneFolder::of(&dir.path().join("scene/scene.gltf"), false);
    assert_eq!(folder.read_uri("%41.png", 100).unwrap(), b"as written");
    std::fs::remove_file(dir.path().join("scene/%41.png")).unwrap();
    assert_eq!(folder.read_uri("%41.png", 100).unwrap(), b"other case");
    assert!(matches!(folder.read_uri("a.png", 5), Err(ReferenceError::TooLarge { bytes: 10, .. })));
    let missing = folder.read_uri("tex/B.png", 100).unwrap_err();
    assert!(missing.message().starts_with("'tex/B.png' cannot be read: "), "{missing:?}");
    // A similar name does not lead outside either.
    #[cfg(unix)]
    std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
    folder = SceneFolder::of(&dir.path().join("scene/scene.gltf"), false);
    for uri in ["../Canary", "Tex/../../Canary", "LINK", "../SCENE/../canary"] {
        assert!(folder.read_uri(uri, 100).is_err(), "{uri}");
    }
}

#[test]
fn a_folder_is_listed_once() {
    let (dir, folder) = folder();
    assert!(folder.find_similar("tex/C.png").is_none());
    std::fs::write(dir.path().join("scene/tex/c.png"), b"added later").unwrap();
    assert!(folder.find_similar("tex/C.png").is_none());
    assert!(SceneFolder::of(&dir.path().join("scene/scene.gltf"), false).find_similar("tex/C.png").is_some());
}

/// HFS+ stored names decomposed, and archives made there keep them so.
#[test]
fn missing_files_are_found_in_another_unicode_normal_form() {
    let (dir, _) = folder();
    let with_file = |name: &str| {
        std::fs::write(dir.path().join("scene/tex").join(name), name).unwrap();
        SceneFolder::of(&dir.path().join("scene/scene.gltf"), false)
    };
    let decomposed = "u\u{308}.png";
    let mut folder = with_file(decomposed);
    for uri in ["tex/%C3%BC.png", "tex/\u{fc}.png", "TEX/\u{dc}.PNG"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), decomposed.as_bytes(), "{uri}");
    }
    // The same case has priority over another case, and the exact name over both.
    folder = with_file("U\u{308}.png");
    assert_eq!(folder.read_uri("tex/\u{fc}.png", 100).unwrap(), decomposed.as_bytes());
    folder = with_file("\u{fc}.png");
    assert_eq!(folder.read_uri("tex/%C3%BC.png", 100).unwrap(), "\u{fc}.png".as_bytes());
    assert!(folder.read_uri("tex/u.png", 100).is_err());
}

#[test]
#[cfg(unix)]
fn a_colon_is_part_of_a_file_name() {
    let (dir, folder) = folder();
    std::fs::write(dir.path().join("scene/c:d.png"), b"inside").unwrap();
    for uri in ["c:d.png", "c%3Ad.png", "./c:d.png"] {
        assert_eq!(folder.read_uri(uri, 100).unwrap(), b"inside", "{uri}");
    }
    let missing = folder.read_uri("c:e.png", 100).unwrap_err();
    assert!(missing.message().starts_with("'c:e.png' cannot be read: "), "{missing:?}");
}

#[test]
fn references_outside_the_folder_are_rejected() {
    let (dir, folder) = folder();
    let absolute = dir.path().join("canary").to_string_lossy().into_owned();
    #[cfg(unix)]
    std::os::unix::fs::symlink(dir.path().join("canary"), dir.path().join("scene/link")).unwrap();
    let file_uri = format!("file://{absolute}");
    for uri in [
        "../canary",
        "%2e%2e/canary",
        "..\\canary",
        "tex/../../canary",
        &absolute,
        &file_uri,
        "http://localhost/canary",
        "C:\\canary",
        "C:canary",
        "\\\\host\\share",
        "link",
        "/proc/self/environ",
        "",
        "canary\0",
        "tex",
    ] {
        assert!(folder.read_uri(uri, 100).is_err(), "{uri}");
    }
    let allowed = SceneFolder { allow_outside: true, ..folder };
    assert_eq!(allowed.read_uri("../canary", 100).unwrap(), b"outside");
}

#[test]
fn file_sizes_are_limited() {
    let (_dir, folder) = folder();
    assert!(folder.read_uri("tex/a b.png", 6).is_ok());
    assert!(folder.read_uri("tex/a b.png", 5).is_err());
}
