use super::*;
use std::fs;

/// A scene's folder with files whose content is their path.
fn folder(files: &[&str]) -> (tempfile::TempDir, SceneFolder) {
    let dir = tempfile::tempdir().unwrap();
    for file in files {
        let path = dir.path().join("project").join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, file).unwrap();
    }
    fs::create_dir_all(dir.path().join("project")).unwrap();
    let folder = SceneFolder::of(&dir.path().join("project/lamp.gltf"), false);
    (dir, folder)
}

fn read(folder: &SceneFolder, uri: &str) -> Result<String, String> {
    let bytes = folder.read_uri(uri, 100).map_err(|e| e.message().to_string())?;
    Ok(String::from_utf8(bytes).unwrap())
}

#[test]
fn references_from_other_machines_are_found_by_the_end_of_their_path() {
    let (_dir, folder) = folder(&["a.png", "wood/a.png", "mesh.bin", "Fine Wood.PNG"]);
    for (uri, file) in [
        ("C:\\Users\\me\\Documents\\a.png", "a.png"),
        ("C:/Users/me/wood/a.png", "wood/a.png"),
        ("file:///C:/Users/me/a.png", "a.png"),
        ("file:///home/me/wood/a.png", "wood/a.png"),
        ("/home/me/project/a.png", "a.png"),
        ("\\\\server\\share\\wood\\a.png", "wood/a.png"),
        ("../wood/a.png", "wood/a.png"),
        ("../../elsewhere/mesh.bin", "mesh.bin"),
        ("deep/down/A.PNG", "a.png"),
        ("deep/down/Wood/A.PNG", "wood/a.png"),
        ("C:\\my%20files\\fine%20wood.png", "Fine Wood.PNG"),
        ("https://example.com/wood/a.png?v=2", "wood/a.png"),
        ("mesh.bin/", "mesh.bin"),
        (" mesh.bin ", "mesh.bin"),
        ("fine%2520wood.png", "Fine Wood.PNG"),
    ] {
        assert_eq!(read(&folder, uri).as_deref(), Ok(file), "{uri}");
    }
}

#[test]
fn files_are_found_in_the_usual_texture_folders() {
    for folder_name in ["textures", "Textures", "tex", "maps", "IMAGES", "source", "lamp", "lamp.fbm"] {
        let file = format!("{folder_name}/a.png");
        let (_dir, folder) = folder(&[&file]);
        for uri in ["a.png", "A.png", "other/a.png", "C:\\x\\a.png", "../a.png", "/home/me/a.png"] {
            assert_eq!(read(&folder, uri).as_ref(), Ok(&file), "{uri}");
        }
    }
    // Parts of the path that agree have priority.
    let (_dir, folder) = folder(&["textures/a.png", "textures/wood/a.png", "images/a.png"]);
    assert_eq!(read(&folder, "../wood/a.png").as_deref(), Ok("textures/wood/a.png"));
    assert_eq!(read(&folder, "../metal/a.png").as_deref(), Ok("textures/a.png"));
    // A file beside the scene has priority over those in folders, and the path as written over both.
    fs::write(folder_path(&folder).join("a.png"), "a.png").unwrap();
    assert_eq!(read(&folder, "x/a.png").as_deref(), Ok("a.png"));
    assert_eq!(read(&folder, "images/a.png").as_deref(), Ok("images/a.png"));
}

fn folder_path(folder: &SceneFolder) -> std::path::PathBuf {
    folder.resolve(".").unwrap_or_else(|e| panic!("{e:?}"))
}

#[test]
fn files_in_folders_beside_the_scenes_need_permission() {
    let (dir, _) = folder(&["source/lamp.obj", "textures/a.png", "b.png"]);
    let scene = dir.path().join("project/source/lamp.obj");
    let refusing = SceneFolder::of(&scene, false);
    for uri in ["a.png", "../textures/a.png", "../b.png"] {
        let error = read(&refusing, uri).unwrap_err();
        assert_eq!(error.contains("outside the scene's folder"), uri.starts_with(".."), "{error}");
        assert_eq!(error.contains("allow-outside"), uri.starts_with(".."), "{error}");
    }
    let allowing = SceneFolder::of(&scene, true);
    for (uri, file) in [
        ("a.png", "textures/a.png"),
        ("C:\\x\\a.png", "textures/a.png"),
        ("../textures/a.png", "textures/a.png"),
        ("b.png", "b.png"),
    ] {
        assert_eq!(read(&allowing, uri).as_deref(), Ok(file), "{uri}");
    }
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_refused_in_usual_folders_too() {
    let (dir, folder) = folder(&["textures/b.png"]);
    fs::write(dir.path().join("a.png"), "outside").unwrap();
    std::os::unix::fs::symlink(dir.path(), dir.path().join("project/tex")).unwrap();
    std::os::unix::fs::symlink(dir.path().join("a.png"), dir.path().join("project/textures/a.png")).unwrap();
    for uri in ["a.png", "tex/a.png", "textures/a.png", "/x/A.png"] {
        assert!(read(&folder, uri).is_err(), "{uri}");
    }
}

/// A file that appears later changes the scene.
#[test]
fn missing_files_and_folders_are_recorded() {
    let (_dir, folder) = folder(&["textures/b.png", "lamp.gltf"]);
    assert!(read(&folder, "x/a.png").is_err());
    let (_, files) = folder.sources.into_contents();
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    for name in ["x/a.png", "a.png", "textures/a.png", "images/", "tex/"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    assert!(files.iter().all(|file| file.digest == FileDigest::Unread));
}

#[test]
fn paths_of_a_million_parts_are_looked_up_quickly() {
    let (_dir, folder) = folder(&["textures/a.png"]);
    for part in ["../", "x/", "/", "./"] {
        let uri = format!("{}a.png", part.repeat(1 << 20));
        assert_eq!(read(&folder, &uri).as_deref(), Ok("textures/a.png"), "{part}");
    }
    assert!(path_ends(&"a/".repeat(1 << 20)).all(|end| end.len() < 8));
}
