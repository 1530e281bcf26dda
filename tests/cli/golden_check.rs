//! `render --check` and `--bless`: golden images; `--max-size` for thumbnails.

use std::fs;

use crate::common::program::*;

#[test]
fn blessed_images_pass_and_changed_ones_fail_with_a_page() {
    let (_dir, dir) = folder();
    let scene = model("tests/cube.obj");
    let render = format!("render {scene} --size 48x32 -s 1 -o out/cube.png --check golden");
    fails(
        &dir,
        &[
            "render",
            &scene,
            "--size",
            "8x8",
            "-o",
            "o/c.png",
            "--check",
            "golden",
            "--dry-run",
            "--bless",
            "--flip",
        ],
        2,
        "--flip",
    );
    runs(&dir, &format!("{render} --bless"));
    assert_eq!(names(&dir), ["golden/cube.png", "out/cube.png"]);
    assert_eq!(fs::read(dir.join("golden/cube.png")).unwrap(), fs::read(dir.join("out/cube.png")).unwrap());
    runs(&dir, &render);
    // Pixels count, not the bytes of the file, which hold the settings.
    let same = image::open(dir.join("out/cube.png")).unwrap();
    same.save(dir.join("golden/cube.png")).unwrap();
    runs(&dir, &render);

    let output = blinn(&dir, &format!("{render} --kd 1,0,0"));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(
        errors.contains("1 of 1 images fail --check") && errors.contains("out/cube.diff.html"),
        "{errors}"
    );
    let page = fs::read_to_string(dir.join("out/cube.diff.html")).unwrap();
    assert_eq!(page.matches("data:image/png;base64,").count(), 3);
    // --resume compares what it keeps.
    let output = blinn(&dir, &format!("{render} --kd 1,0,0 --resume"));
    assert_eq!(output.status.code(), Some(1));
    runs(&dir, &format!("{render} --kd 1,0,0 --tolerance 1"));
    // The page of a picture that passes is gone, another one stays.
    assert!(!dir.join("out/cube.diff.html").exists());
    fs::write(dir.join("out/cube.diff.html"), "my notes").unwrap();
    runs(&dir, &render);
    assert_eq!(fs::read_to_string(dir.join("out/cube.diff.html")).unwrap(), "my notes");
}

#[test]
fn pictures_of_other_sizes_are_shown_and_the_page_is_among_the_written_files() {
    let (_dir, dir) = folder();
    let scene = model("tests/cube.obj");
    let render = |size: &str| format!("render {scene} --size {size} -s 1 -o out/cube.png --check golden");
    runs(&dir, &format!("{} --bless", render("48x32")));
    let output = blinn(&dir, &format!("{} --print-paths", render("24x16")));
    let paths = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(paths.lines().collect::<Vec<_>>(), ["out/cube.png", "out/cube.diff.html"]);
    let page = fs::read_to_string(dir.join("out/cube.diff.html")).unwrap();
    assert_eq!(page.matches("data:image/png;base64,").count(), 2);
    assert!(page.contains("48 × 32") && page.contains("24 × 16"), "{page}");
}

#[test]
fn frames_and_previews_are_checked_and_missing_ones_are_named() {
    let (_dir, dir) = folder();
    let scene = model("tests/cube.obj");
    let render = |frames: &str, more: &str| {
        format!(
            "render {scene} --size 16x16 -s 1 --frames={frames} --aov mask -o out/f_####.png --check golden {more}"
        )
    };
    runs(&dir, &render("1-2", "--bless"));
    assert_eq!(names(&dir).iter().filter(|name| name.starts_with("golden/")).count(), 4);
    runs(&dir, &render("1-2", ""));
    let output = blinn(&dir, &render("1-3", ""));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        errors.contains("2 of 6 images fail") && errors.contains("golden/f_0003.png is missing"),
        "{errors}"
    );
}

#[test]
fn only_image_files_in_another_folder_can_be_checked() {
    let (_dir, dir) = folder();
    let scene = model("tests/cube.obj");
    refused(&dir, &format!("render {scene} -o - --check golden"), "--check compares image files");
    refused(
        &dir,
        &format!("render {scene} --frames=1-2 -o a.gif --check golden"),
        "--check compares image files",
    );
    refused(&dir, &format!("render {scene} -o a.png --check ."), "written to this folder");
    refused(&dir, &format!("render {scene} -o a.png --bless"), "--check");
    refused(&dir, &format!("render {scene} -o a.png --tolerance 0.1"), "--check");
    refused(&dir, &format!("job slurm render {scene} --frames=1-4 -o f/####.png --check golden"), "--check");
    refused(&dir, &format!("turntable {scene} --check golden"), "--check");
}

#[test]
fn thumbnails_have_the_aspect_ratio_of_the_camera_or_are_square() {
    let (_dir, dir) = folder();
    let size = |name: &str| image::image_dimensions(dir.join(name)).unwrap();
    runs(&dir, &format!("render {} --max-size 48 -s 1 -o framed.png", model("tests/cube.obj")));
    assert_eq!(size("framed.png"), (48, 48));
    let still_life = model("still-life/still-life.glb");
    runs(&dir, &format!("render {still_life} --max-size 48 -s 1 -o camera.png"));
    let (width, height) = size("camera.png");
    assert!(width == 48 && (20..48).contains(&height), "{width} {height}");
    runs(&dir, &format!("render {still_life} --orbit 10,20 --max-size 48 -s 1 -o orbit.png"));
    assert_eq!(size("orbit.png"), (48, 48));
    refused(&dir, &format!("render {still_life} --max-size 48 --size 8x8"), "--size");
    refused(&dir, &format!("render {still_life} --max-size 0"), "--max-size");
}

/// A golden image whose scene was deleted is named, but not by a run for a part of the scenes.
#[test]
fn golden_images_without_a_scene_are_named() {
    let (_dir, dir) = folder();
    let cube = fs::read(model("tests/cube.obj")).unwrap();
    fs::create_dir(dir.join("scenes")).unwrap();
    for name in ["a", "b", "c"] {
        fs::write(dir.join(format!("scenes/{name}.obj")), &cube).unwrap();
    }
    let render = "render scenes --size 8x8 -s 1 -o out/{stem}.png --check golden";
    runs(&dir, &format!("{render} --bless"));
    fs::write(dir.join("golden/notes.txt"), "").unwrap();
    assert!(!runs(&dir, render).contains("golden picture"));
    fs::remove_file(dir.join("scenes/b.obj")).unwrap();
    let messages = runs(&dir, render);
    assert!(
        messages.contains("warning: golden/b.png: no scene of this run has this golden picture"),
        "{messages}"
    );
    assert_eq!(messages.matches("golden picture").count(), 1, "{messages}");
    for part in ["render scenes --chunk 1/2", "render scenes/a.obj"] {
        let messages = runs(&dir, &render.replace("render scenes", part));
        assert!(!messages.contains("golden picture"), "{messages}");
    }
}
