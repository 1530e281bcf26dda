//! The program as its users and their scripts see it: exit codes, one clear line, whole files.

use std::fs;
#[cfg(unix)]
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

#[cfg(unix)]
use crate::common::program::heeds;

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}

fn blinn(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_blinn")).args(args).current_dir(folder).output().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// It failed with `code` and one line that says `says`, and left the folder as it was.
#[track_caller]
fn fails(folder: &Path, args: &[&str], code: i32, says: &str) {
    let before = names(folder);
    let output = blinn(folder, args);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {errors}");
    if code == 1 {
        assert_eq!(errors.lines().count(), 1, "{args:?} told: {errors}");
        assert!(errors.starts_with("blinn: "), "{errors}");
    }
    assert!(errors.contains(says), "{args:?} told: {errors}");
    assert!(!errors.contains("panicked") && !errors.contains("backtrace"), "{errors}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder), before, "{args:?} left something behind");
}

#[test]
fn a_scene_becomes_a_picture_under_its_own_name() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let output = blinn(dir.path(), &["render", scene.to_str().unwrap(), "--size", "48x27"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert_eq!(errors.trim(), "wrote cornell.png");
    assert_eq!(names(dir.path()), ["cornell.png"]);
    let image = image::open(dir.path().join("cornell.png")).unwrap();
    assert_eq!((image.width(), image.height()), (48, 27));
}

#[test]
fn smooth_makes_normals_of_any_format_by_the_angle() {
    let dir = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -1\nv 0 1 -1\nf 1 2 3 4\nf 5 1 4 6\n";
    fs::write(dir.path().join("a.obj"), obj).unwrap();
    let glb = model("cornell/cornell.glb");
    let picture = |scene: &str, smooth: &[&str], out: &str| {
        let fixed = ["render", scene, "-s", "1", "--size", "48x27", "-o", out];
        let output = blinn(dir.path(), &[&fixed, smooth].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        image::open(dir.path().join(out)).unwrap().into_rgba8()
    };
    let file = picture("a.obj", &[], "file.png");
    assert!(file == picture("a.obj", &["--smooth", "off"], "off.png"));
    assert!(file == picture("a.obj", &["--smooth", "90"], "sharp.png"));
    assert!(file != picture("a.obj", &["--smooth", "91"], "smooth.png"));
    let glb = glb.to_str().unwrap();
    assert!(picture(glb, &["--smooth", "180"], "g.png") != picture(glb, &["--smooth", "off"], "h.png"));
    for wrong in ["181", "-1", "on"] {
        let asked = format!("--smooth={wrong}");
        fails(dir.path(), &["render", "a.obj", &asked], 2, "expected off, or an angle from 0 to 180 degrees");
    }
}

#[test]
fn vertices_that_are_no_numbers_cost_their_triangles() {
    let dir = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv nan -nan(ind) 1.#QNAN\nf 1 2 3 4\nf 1 2 5\n";
    fs::write(dir.path().join("a.obj"), obj).unwrap();
    let output = blinn(dir.path(), &["render", "a.obj", "-s", "1", "--size", "48x27"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(errors.contains("left out: 1 with vertices that are not finite"), "{errors}");
    let picture = image::open(dir.path().join("a.png")).unwrap().into_rgb8();
    assert!(picture.get_pixel(24, 13).0[0] > 60, "{:?}", picture.get_pixel(24, 13));
}

#[test]
fn an_obj_becomes_a_picture_too() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.obj");
    let output =
        blinn(dir.path(), &["render", scene.to_str().unwrap(), "--size", "48x27", "-o", "deep/er/a.exr"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(&dir.path().join("deep/er")), ["a.exr"]);
}

#[test]
fn standard_output_takes_a_png() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let output = blinn(dir.path(), &["render", scene.to_str().unwrap(), "--size", "16x9", "-o", "-", "-q"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stdout.starts_with(b"\x89PNG") && output.stderr.is_empty());
    assert!(names(dir.path()).is_empty());
}

#[test]
fn a_missing_file_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let told = String::from_utf8(blinn(dir.path(), &["info", "missing.obj"]).stderr).unwrap();
    assert_eq!(told.matches("No such file").count(), 1, "said once: {told}");
    fails(dir.path(), &["render", "missing.glb"], 1, "missing.glb");
    fails(dir.path(), &["info", "missing.obj"], 1, "missing.obj");
}

#[test]
fn a_corrupt_glb_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let mut bytes = fs::read(model("cornell/cornell.glb")).unwrap();
    bytes.truncate(bytes.len() / 2);
    fs::write(dir.path().join("half.glb"), &bytes).unwrap();
    fails(dir.path(), &["render", "half.glb", "-o", "a.png"], 1, "half.glb");
    fs::write(dir.path().join("noise.glb"), [7u8; 300]).unwrap();
    fails(dir.path(), &["render", "noise.glb", "-o", "a.png"], 1, "noise.glb");
}

#[test]
fn an_empty_obj_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("empty.obj"), "# nothing\n").unwrap();
    fails(dir.path(), &["render", "empty.obj", "-o", "a.png"], 1, "empty.obj");
}

#[test]
fn an_output_that_cannot_be_written_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.to_str().unwrap();
    fs::create_dir(dir.path().join("folder.png")).unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    fails(dir.path(), &["render", scene, "--size", "8x8", "-o", "file/a.png"], 1, "file");
    // A folder of that name takes the picture's default name; a folder in the picture's place does not.
    fs::create_dir_all(dir.path().join("out/cornell.png")).unwrap();
    fails(dir.path(), &["render", scene, "--size", "8x8", "-o", "out/"], 1, "cornell.png");
    assert!(names(&dir.path().join("out/cornell.png")).is_empty());
}

#[test]
fn wrong_command_lines_are_exit_2() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.to_str().unwrap();
    for (args, says) in [
        (vec!["render"], "SCENE"),
        (vec!["render", scene, "--not-a-flag"], "--not-a-flag"),
        (vec!["render", scene, "--siz", "8x8"], "--siz"),
        (vec!["render", scene, "--size", "8"], "1280x720"),
        (vec!["render", scene, "-s", "0"], "0"),
        (vec!["render", scene, "-o", "{name}.png"], "{name} stands for nothing: there are {stem}"),
        (vec!["render", scene, "-o", "a.tiff"], ".png, .exr, .jpg, .webp, .gif"),
        (vec!["render", scene, "-o", "a.jpg", "--no-background"], "a JPEG has no transparency"),
        (vec!["render", scene, "-o", "a.jpg", "--depth", "16"], "a JPEG has 8 bits"),
        (vec!["render", scene, "-o", "a.webp", "--depth", "16"], "a WebP has 8 bits"),
        (vec!["render", scene, "-o", "a.webp", "--quality", "50"], "of .jpg, .mp4 and .html alone"),
        (vec!["render", scene, "-o", "a.jpg", "--quality", "0"], "1..=100"),
        (vec!["render", scene, "-o", "-", "--aov", "depth"], "standard output takes one picture"),
        (vec!["render", scene, scene, "-o", "a.png"], "{stem}"),
        (vec!["render", scene, "--aov", "depht"], "depht"),
        (vec!["render", scene, "--view-up", "1,2"], "X,Y,Z"),
        (vec!["render", scene, "--view-up", "0,0,0"], "a direction has a length"),
        (vec!["render", scene, "--view-dir=-0,0,0"], "a direction has a length"),
        (vec!["render", scene, "-o", "a.jpg", "--size", "65536x1"], "a JPEG has at most 65535 pixels"),
        (vec!["render", scene, "-o", "a.webp", "--size", "1x16385"], "a WebP has at most 16384 pixels"),
        (vec!["render", scene, "--orbit", "10"], "AZIMUTH,ELEVATION"),
        (vec!["render", scene, "--orbit", "10,91"], "±90"),
        (vec!["render", scene, "--orbit", "10,20", "--view-dir", "0,0,1"], "--view-dir"),
        (vec!["render", scene, "--zoom", "0"], "greater than zero"),
        (vec!["render", scene, "--hide", "[a"], "pattern"),
        (vec!["frobnicate"], "frobnicate"),
    ] {
        fails(dir.path(), &args, 2, says);
    }
}

#[test]
fn the_rest_is_done_when_one_scene_fails() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let args = ["render", "missing.glb", scene.to_str().unwrap(), "--size", "8x8", "-q"];
    let output = blinn(dir.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.contains("missing.glb") && errors.contains("1 of 2 scenes failed"), "{errors}");
    assert_eq!(names(dir.path()), ["cornell.png"]);
}

#[test]
fn what_the_file_lacks_is_exit_1_and_names_what_there_is() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.to_str().unwrap();
    fails(dir.path(), &["render", scene, "--camera", "Nobody"], 1, "it has: 0 'Camera'");
    fails(
        dir.path(),
        &["render", scene, "--hide", "Nobody*"],
        1,
        "nothing is called 'Nobody*'; the file has: '",
    );
    fails(
        dir.path(),
        &["render", scene, "--only-objects", "a/b"],
        1,
        "nothing is called 'a/b'; the file has: '",
    );
    fails(dir.path(), &["render", scene, "--scene", "Nobody"], 1, "Nobody");
    fails(dir.path(), &["render", scene, "--animation", "Nobody"], 1, "Nobody");
    fails(
        dir.path(),
        &["render", scene, "--variant", "Nobody"],
        1,
        "there is no variant 'Nobody'; the file has: none",
    );
    let obj = model("cornell/cornell.obj");
    fails(
        dir.path(),
        &["render", obj.to_str().unwrap(), "--variant", "Nobody"],
        1,
        "there is no variant 'Nobody'",
    );
    let shoe = model("tests/gltf/variants.glb");
    fails(dir.path(), &["info", shoe.to_str().unwrap(), "--variant", "Nobody"], 1, "'Day', 'Dusk', 'Night'");
}

/// Without a choice the first of clips that drive the same plays, and -v says so.
#[test]
fn animations_that_do_not_play_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(model("tests/triangle.gltf")).unwrap();
    let mut scene: serde_json::Value = serde_json::from_str(&text).unwrap();
    let accessors = scene["accessors"].as_array_mut().unwrap();
    // Accessors without bytes are zeros: one key.
    let zeros = ["SCALAR", "VEC3"].map(|kind| {
        accessors.push(serde_json::json!({"componentType": 5126, "count": 1, "type": kind}));
        accessors.len() - 1
    });
    let clip = |name: &str| {
        serde_json::json!({"name": name, "samplers": [{"input": zeros[0], "output": zeros[1]}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]})
    };
    scene["animations"] = ["Idle", "Walk", "Run"].map(clip).into();
    fs::write(dir.path().join("clips.gltf"), scene.to_string()).unwrap();
    let told = |flags: &[&str]| {
        let fixed = ["render", "clips.gltf", "--size", "8x8", "-v", "-o", "a.png"];
        String::from_utf8(blinn(dir.path(), &[&fixed[..], flags].concat()).stderr).unwrap()
    };
    let usual = told(&[]);
    assert!(usual.contains("animation: 'Idle'; left out: 'Walk', 'Run'"), "{usual}");
    for chosen in ["Walk", "all", "none"] {
        let told = told(&["--animation", chosen]);
        assert!(told.contains("wrote a.png") && !told.contains("left out"), "{chosen}: {told}");
    }
}

#[test]
fn a_variant_changes_the_picture() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/gltf/variants.glb");
    let picture = |variant: &str| {
        let args =
            ["render", scene.to_str().unwrap(), "--size", "32x18", "-o", "-", "-q", "--variant", variant];
        let output = blinn(dir.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    assert_ne!(picture("Day"), picture("Night"));
    assert_ne!(picture("none"), picture("Night"));
}

/// AgX for Blender's glTF, sRGB for its OBJ, and what was asked for always.
#[test]
fn the_view_transform_follows_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let picture = |scene: &str, flags: &[&str]| {
        let scene = model(scene);
        let mut args = vec!["render", scene.to_str().unwrap(), "--size", "32x18", "-o", "-", "-q"];
        args.extend(flags);
        blinn(dir.path(), &args).stdout
    };
    let gltf = |flags: &[&str]| picture("cornell/cornell.glb", flags);
    assert_eq!(gltf(&[]), gltf(&["--view", "agx"]));
    assert_ne!(gltf(&[]), gltf(&["--view", "standard"]));
    assert_ne!(gltf(&["--view", "pbr-neutral"]), gltf(&["--view", "standard"]));
    let obj = |flags: &[&str]| picture("cornell/cornell.obj", flags);
    assert_eq!(obj(&[]), obj(&["--view", "standard"]));
}

#[test]
fn an_existing_file_can_be_kept() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    fs::write(dir.path().join("a.png"), "mine").unwrap();
    let args = ["render", scene.to_str().unwrap(), "--size", "8x8", "-o", "a.png", "--no-overwrite"];
    fails(dir.path(), &args, 1, "no-overwrite");
    fails(dir.path(), &[&args[..], &["--dry-run"]].concat(), 1, "no-overwrite");
    assert_eq!(fs::read(dir.path().join("a.png")).unwrap(), b"mine");
}

#[test]
fn info_tells_what_is_there_in_text_and_json() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let text = blinn(dir.path(), &["info", scene.to_str().unwrap()]);
    assert!(String::from_utf8(text.stdout).unwrap().contains("triangles: "));
    let output = blinn(dir.path(), &["info", scene.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["format"], "glTF");
    assert!(json["triangles"].as_u64().unwrap() > 10);
    assert_eq!(json["cameras"].as_array().unwrap().len(), 1);
    assert_eq!(json["lights"][0]["kind"], "point");
    let ids = json["object_ids"].as_array().unwrap();
    assert_eq!((ids.len() as u64, &ids[0]["id"]), (json["objects"].as_u64().unwrap(), &1.into()));
    for (i, material) in json["materials"].as_array().unwrap().iter().enumerate() {
        assert_eq!(json["material_ids"][i], serde_json::json!({"id": i + 1, "name": material["name"]}));
    }
}

/// Whoever asks for JSON gets it of scenes that fail, too: an object for one, a list for several.
#[test]
fn info_in_json_tells_of_scenes_that_fail() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    fs::write(dir.path().join("broken.glb"), "glTF").unwrap();
    let info = |scenes: &[&str]| -> serde_json::Value {
        let output = blinn(dir.path(), &[&["info", "--json"], scenes].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8(output.stderr).unwrap().starts_with("blinn: broken.glb"));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let alone = info(&["broken.glb"]);
    assert_eq!(alone["file"], "broken.glb");
    assert!(alone["error"].as_str().unwrap().starts_with("broken.glb: "), "{alone}");
    let both = info(&["broken.glb", scene.to_str().unwrap()]);
    assert_eq!((both.as_array().unwrap().len(), &both[0]), (2, &alone));
    assert!(both[1]["error"].is_null() && both[1]["triangles"].is_u64(), "{both}");
}

#[test]
fn a_scene_without_anything_to_draw_is_told_of() {
    let dir = tempfile::tempdir().unwrap();
    let text = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{}]}"#;
    fs::write(dir.path().join("a.gltf"), text).unwrap();
    let output = blinn(dir.path(), &["render", "a.gltf", "--size", "8x8"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && errors.contains("a.gltf: it has nothing to draw"), "{errors}");
    fails(dir.path(), &["render", "a.gltf", "--size", "8x8", "--strict"], 1, "nothing to draw");
}

/// What `render` warns of when it builds trees is in the file already.
#[test]
fn info_tells_of_triangles_that_cannot_be_seen() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n";
    fs::write(dir.path().join("a.obj"), text).unwrap();
    let output = blinn(dir.path(), &["info", "a.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let said = "triangles left out: 1 with vertices that are not finite numbers";
    assert_eq!(json["warnings"], serde_json::json!([said]));
    fails(dir.path(), &["info", "a.obj", "--strict"], 1, said);
    fails(dir.path(), &["render", "a.obj", "--size", "8x8", "--strict"], 1, said);
}

/// Poles of spheres, and nearly every file of a CAD program: no picture lacks them.
#[test]
fn triangles_without_area_are_counted_and_no_warning() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 3 4\n";
    fs::write(dir.path().join("a.obj"), text).unwrap();
    let output = blinn(dir.path(), &["info", "a.obj", "--json", "--strict"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["warnings"], &json["triangles_without_area"]), (&serde_json::json!([]), &1.into()));
    let output = blinn(dir.path(), &["render", "a.obj", "--size", "8x8", "--strict", "--perf"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && told.contains("  1 triangles without area"), "{told}");
}

#[test]
fn every_flag_is_taken() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let xml = model("lecture/view-1.xml");
    let (scene, xml) = (scene.to_str().unwrap(), xml.to_str().unwrap());
    for flags in [
        "-s 2 --filter box --background #102030 --exposure auto --view standard --seed 7",
        "--filter tent --no-background --exposure -1.5 --view raw --depth 16",
        "--view agx --depth 16",
        "--view pbr-neutral",
        "--view auto --exposure 0",
        "--filter gaussian --background transparent --crop 2,3,4,5 --aov depth,normal,uv",
        "--camera 0 --yfov 30 --view-up 0,1,0 --clip 0.1,100 --fit auto",
        "--camera Camera --clip off --fit horizontal --projection orthographic",
        "--view-point -1,2.5,-3e0 --view-dir 0,-.1,1 --view-width 2 --view-height 1.5 --proj-distance 1.2",
        "--view-point 0,1,9 --look-at 0,1,0 --camera-orthographic --view-width 3",
        "--camera-position 0,1,9 --camera-focal-point 0,1,0 --camera-view-up 0,1,0 --camera-view-angle 30",
        "--orbit -30,20 --zoom 1.5 --camera-azimuth-angle -10 --camera-elevation-angle 5",
        "--orbit 30,90,4 --look-at 0,1,0 --camera-zoom-factor 2 --camera-orthographic",
        "--camera-direction 0,0,-1 --camera-index 0 --hide Camera --only-objects *",
        "--lights file,headlight --point-light 0,1,0,5,#ffcc88 --sun 0,-1,0,.5,1,.5,.2 --light-scale .5",
        "--lights none --ambient .2,.2,.2 --light-units raw --no-shadows",
        "--lights three-point --light-units unitless",
        "--integrator shadow --kd 1,1,1 --ks 0,0,0 --shininess 10 --cull off --light-units standard",
        "--integrator color --up z --scene 0 --animation none --time 0 --variant none",
        "--integrator diffuse --frame 12 --fps 24 --animation all",
        "--animation 0 --threads 2 --progress json --perf -v",
        "--resolution 12,8 --progress plain --allow-outside --strict --progress plain",
    ] {
        let mut args = vec!["render", scene, "-o", "a.png"];
        args.extend(flags.split(' '));
        if !flags.contains("--resolution") {
            args.extend(["--size", "16x12"]);
        } else {
            args.truncate(args.len() - 2);
        }
        let output = blinn(dir.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{flags}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let output = blinn(dir.path(), &["render", scene, "-o", "b.exr", "--size", "16x9", "--camera-xml", xml]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(names(dir.path()).contains(&"a.depth.png".to_string()));
}

/// A render that takes some seconds, begun by a shell's `line`, where `$BLINN` stands for it.
#[cfg(unix)]
fn long_render(folder: &Path, line: &str) -> std::process::Child {
    let scene = model("still-life/still-life.glb");
    let look = "--size 160x90 -s 2048 -o a.png --progress plain";
    let render = format!("'{}' render '{}' {look}", env!("CARGO_BIN_EXE_blinn"), scene.display());
    Command::new("sh")
        .args(["-c", &line.replace("$BLINN", &render)])
        .current_dir(folder)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until a render tells how far it is.
#[cfg(unix)]
fn is_rendering(child: &mut std::process::Child) {
    let told = std::io::BufReader::new(child.stderr.as_mut().unwrap());
    assert!(told.lines().any(|line| line.unwrap().contains('%')), "it ended");
}

#[cfg(unix)]
fn send(signal: &str, child: &std::process::Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// Interrupted in the middle of a long render: the exit code says how, and nothing is left.
#[cfg(unix)]
#[test]
fn an_interrupted_render_leaves_nothing() {
    let signals = [("-HUP", 129), ("-INT", 130), ("-TERM", 143)];
    for (signal, code) in signals.into_iter().filter(|(signal, _)| heeds(signal)) {
        let dir = tempfile::tempdir().unwrap();
        let mut child = long_render(dir.path(), "exec $BLINN");
        is_rendering(&mut child);
        send(signal, &child);
        let told = std::io::read_to_string(child.stderr.as_mut().unwrap()).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert!(told.lines().all(|line| !line.is_empty()) && told.contains("blinn: "), "{told:?}");
        assert!(names(dir.path()).is_empty());
    }
}

/// What `nohup` begins goes on when the terminal is gone, and what a script puts into the background when its
/// terminal is interrupted.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_was_ignored_stays_ignored() {
    let dir = tempfile::tempdir().unwrap();
    let signals = [("-HUP", "-TERM", 143), ("-INT", "-TERM", 143), ("-TERM", "-INT", 130)];
    for (ignored, ends, code) in signals.into_iter().filter(|(_, ends, _)| heeds(ends)) {
        let mut child = long_render(dir.path(), &format!("trap '' {}; exec $BLINN", &ignored[1..]));
        is_rendering(&mut child);
        send(ignored, &child);
        std::thread::sleep(std::time::Duration::from_millis(500));
        assert!(child.try_wait().unwrap().is_none(), "it is still rendering");
        send(ends, &child);
        assert_eq!(child.wait().unwrap().code(), Some(code));
    }
}

/// A signal is heeded whenever it comes: while the process begins once more with advice for its allocator,
/// too.
#[cfg(unix)]
#[test]
fn a_signal_in_the_first_moments_is_not_lost() {
    let dir = tempfile::tempdir().unwrap();
    for i in 0..60 {
        let mut child = long_render(dir.path(), "exec $BLINN");
        std::thread::sleep(std::time::Duration::from_micros(500 + 100 * i));
        send("-TERM", &child);
        let ended = (0..100).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            child.try_wait().unwrap().is_some()
        });
        let _ = child.kill();
        child.wait().unwrap();
        assert!(ended, "run {i}");
    }
}

/// Threads that a user may not have: one line.
#[cfg(target_os = "linux")]
#[test]
fn a_process_without_threads_says_so() {
    // The system holds everyone to their limits but root.
    let shell = |line: &str| {
        let id = Command::new("id").arg("-u").output().unwrap().stdout;
        let mut command = match id.as_slice() {
            b"0\n" => {
                let mut command = Command::new("setpriv");
                command.args(["--reuid=65534", "--regid=65534", "--clear-groups", "bash"]);
                command
            }
            _ => Command::new("bash"),
        };
        command.args(["-c", line]).current_dir("/").output()
    };
    let (program, scene) = (env!("CARGO_BIN_EXE_blinn"), model("cornell/cornell.glb"));
    let may = format!("test -x '{program}' && test -r '{}'", scene.display());
    if !shell(&may).is_ok_and(|output| output.status.success()) {
        return;
    }
    for command in ["render --dry-run", "info"] {
        for most in [1, 2] {
            let line = format!("ulimit -u {most}; exec '{program}' {command} '{}' -q", scene.display());
            let output = shell(&line).unwrap();
            let told = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{line}: {told}");
            assert!(told.starts_with("blinn: no thread could be started: "), "{line}: {told}");
            assert_eq!(told.lines().count(), 1, "{told}");
        }
    }
}

/// A disk that fills up: one line, and no part of the file.
#[cfg(unix)]
#[test]
fn a_full_disk_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let line = format!(
        "ulimit -f 1; exec '{}' render '{}' --size 320x180 -s 1 -o a.png",
        env!("CARGO_BIN_EXE_blinn"),
        scene.display()
    );
    let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.lines().count() == 1 && told.contains("a.png cannot be written"), "{told}");
    assert!(names(dir.path()).is_empty());
}

/// Metering looks through the file's camera in its own shape, so a thumbnail, a strip and a crop
/// are exposed alike.
#[test]
fn the_exposure_does_not_depend_on_the_pictures_size() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/lights.glb");
    let told = |size: &str| {
        let args = [
            "render",
            scene.to_str().unwrap(),
            "-o",
            "a.png",
            "-v",
            "-s",
            "1",
            "--exposure",
            "auto",
            "--size",
            size,
        ];
        let output = blinn(dir.path(), &args);
        let errors = String::from_utf8(output.stderr).unwrap();
        errors.lines().find(|l| l.starts_with("exposure: ")).unwrap_or_else(|| panic!("{errors}")).to_string()
    };
    let usual = told("64x36");
    assert_eq!(told("16x64"), usual);
    assert_eq!(told("96x8"), usual);
}

#[test]
fn a_radius_of_zero_is_no_radius_and_any_other_softens() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("lecture/lecture.obj");
    let fixed = ["render", scene.to_str().unwrap(), "--size", "64x36", "-q", "-o"];
    let picture = |out: &str, more: &[&str]| {
        let output = blinn(dir.path(), &[&fixed[..], &[out], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read(dir.path().join(out)).unwrap()
    };
    for lights in [&["--point-light", "4,6,1,40"][..], &["--lights", "three-point"], &["--sun", "0,-1,0,1"]] {
        let with = |r: &str, out: &str| picture(out, &[lights, &["--light-radius", r]].concat());
        let sharp = picture("a.png", lights);
        assert!(with("0", "b.png") == sharp && with(".5", "c.png") != sharp, "{lights:?}");
    }
}

#[test]
fn occlusion_shows_whatever_the_light() {
    let dir = tempfile::tempdir().unwrap();
    let lights = [
        &[][..],
        &["--lights", "headlight"],
        &["--lights", "none"],
        &["--point-light", "0,3,0,1000"],
        &["--no-shadows"],
        &["--light-radius", ".1"],
        &["--ground", "shadow"],
    ];
    let close = model("lecture/view-1.xml");
    let close = ["--camera-xml", close.to_str().unwrap()];
    for (name, camera) in [("lecture/lecture.obj", &close[..]), ("cornell/cornell.glb", &[])] {
        let scene = model(name);
        for light in lights {
            let levels = |more: &[&str]| {
                let fixed = ["render", scene.to_str().unwrap(), "--size", "48x27", "-q", "-o", "a.png"];
                let output = blinn(dir.path(), &[&fixed, camera, light, more].concat());
                assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
                image::open(dir.path().join("a.png")).unwrap().into_luma8().into_vec()
            };
            // A distance that nothing is within leaves the ambient term whole.
            let (occluded, open) = (levels(&["--ao", "16"]), levels(&["--ao", "16,1e-9"]));
            let darker = occluded.iter().zip(&open).filter(|(a, b)| a.saturating_add(5) < **b).count();
            let lighter = occluded.iter().zip(&open).filter(|(a, b)| **a > b.saturating_add(1)).count();
            assert!(darker > 100 && lighter == 0, "{name} {light:?}: {darker} darker, {lighter} lighter");
        }
    }
}

#[test]
fn flags_of_light_that_would_do_nothing_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.to_str().unwrap();
    for (args, says) in [
        (&["--light-radius", ".1", "--integrator", "diffuse"][..], "--light-radius softens shadows"),
        (&["--light-radius", ".1", "--no-shadows"], "--no-shadows has none"),
        (&["--light-radius", ".1", "--lights", "none"], "--lights none has none"),
        (&["--ao", "16", "--integrator", "shadow"], "only --integrator phong has"),
        (&["--ao", "16", "--ambient", "0,0,0"], "--ambient 0,0,0 is none"),
        (&["--ground", "shadow", "--integrator", "color"], "take --ground plane"),
        (&["--ground", "shadow", "--no-shadows"], "take --ground plane"),
        (&["--ao", "0"], "from 1 to 65536"),
        (&["--ao", "16,-2"], "expected metres, or 'inf'"),
        (&["--light-radius", "-1"], "from 0 to 1000000 metres"),
        (&["--ground", "grass"], "possible values"),
    ] {
        fails(dir.path(), &[&["render", scene], args].concat(), 2, says);
    }
}

#[test]
fn a_ground_moves_neither_camera_nor_exposure_and_shows_in_alpha() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let lights = model("tests/lights.glb");
    let picture = |scene: &Path, more: &[&str]| {
        let fixed = ["render", scene.to_str().unwrap(), "--size", "64x48", "-v", "-s", "1", "-o", "a.png"];
        let output = blinn(dir.path(), &[&fixed, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let told = String::from_utf8(output.stderr).unwrap();
        (image::open(dir.path().join("a.png")).unwrap().into_rgba8(), told)
    };
    let clear = ["--background", "transparent"];
    let (bare, _) = picture(&scene, &clear);
    let (caught, _) = picture(&scene, &[&clear[..], &["--ground", "shadow"]].concat());
    let (mut same, mut shadow) = (0, 0);
    for (a, b) in bare.pixels().zip(caught.pixels()) {
        if a[3] > 0 {
            assert_eq!(a, b);
            same += 1;
        } else if b[3] > 0 {
            assert_eq!(b.0[..3], [0, 0, 0]);
            shadow += 1;
        }
    }
    assert!(same > 200 && shadow > 100, "{same} {shadow}");
    let told = |more: &[&str]| picture(&lights, &[&["--exposure", "auto"], more].concat()).1;
    assert_eq!(told(&["--ground", "plane"]), told(&[]));
}

#[test]
fn a_picture_of_light_lights_by_direction() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let light = dir.path().join("light.hdr");
    let from_above = |_, y| image::Rgb(if y < 8 { [0.0, 0.0, 0.8f32] } else { [0.0, 0.0, 0.0] });
    let light_picture: image::DynamicImage = image::ImageBuffer::from_fn(32, 16, from_above).into();
    light_picture.save(&light).unwrap();
    let picture = |more: &[&str]| {
        let fixed = [
            "render",
            scene.to_str().unwrap(),
            "--size",
            "64x48",
            "-v",
            "--hdri",
            "light.hdr",
            "-o",
            "a.png",
        ];
        let output = blinn(dir.path(), &[&fixed, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let told = String::from_utf8(output.stderr).unwrap();
        (image::open(dir.path().join("a.png")).unwrap().into_rgba8(), told)
    };
    let clear = ["--background", "transparent"];
    let (seen, told) = picture(&clear);
    assert!(told.contains("lights: none; ambient by a picture"), "{told}");
    let blue: Vec<u8> = seen.pixels().filter(|p| p[3] == 255).map(|p| p[2]).collect();
    // The top sees all of the light, the sides half of it, encoded.
    assert!(blue.iter().max().unwrap() > &225 && (150..190).contains(blue.iter().min().unwrap()));
    assert!(seen.pixels().all(|p| p[0] == 0 && p[1] == 0));
    let (occluded, _) = picture(&["--background", "transparent", "--ao", "16", "--ground", "shadow"]);
    assert!(occluded.pixels().any(|p| p[3] > 5 && p[3] < 250 && p[2] == 0));
    assert!(picture(&["--ground", "shadow"]).1.contains("shows nothing"));
    let render = ["render", scene.to_str().unwrap()];
    for (args, says) in [
        (&["--hdri", "missing.hdr"][..], "--hdri: missing.hdr"),
        (&["--hdri", "light.hdr", "--ambient", "1,1,1"], "cannot be used with"),
        (&["--hdri", "light.hdr", "--integrator", "shadow"], "only --integrator phong has"),
    ] {
        fails(dir.path(), &[&render, args].concat(), 2, says);
    }
    fs::write(dir.path().join("text.exr"), "text").unwrap();
    fails(
        dir.path(),
        &[&render[..], &["--hdri", "text.exr"]].concat(),
        2,
        "neither Radiance HDR nor OpenEXR",
    );
}

/// `--max-memory` holds for it too, and before it is decoded.
#[test]
fn a_picture_of_light_stays_within_the_memory_allowed() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    // A header alone: 512 MiB and its text.
    let text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2896 +X 5792\n";
    fs::write(dir.path().join("light.hdr"), text).unwrap();
    let needed = 2896 * 5792 * 32 + text.len();
    let with = |allowed: usize, says: &str| {
        let (scene, allowed) = (scene.to_str().unwrap(), allowed.to_string());
        let args = ["render", scene, "--hdri", "light.hdr", "--max-memory", &allowed];
        fails(dir.path(), &args, 2, says);
    };
    with(needed - 1, &format!("bytes of memory: {needed} exceeds the limit of {}", needed - 1));
    with(needed, "the picture cannot be decoded");
}

/// What a decoder panics at, on whichever thread, costs its scene and no other.
#[cfg(debug_assertions)]
#[test]
fn a_decoder_that_panics_costs_its_scene_alone() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = ["textured/textured.obj", "tests/cube.obj"].map(model);
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    command.arg("render").args(&scenes).args(["--size", "16x16", "-s", "1"]).current_dir(dir.path());
    let output = command.env("BLINN_TEST_PANIC", "planks.png").output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert_eq!(names(dir.path()), ["cube.png"], "{told}");
    let of: Vec<&str> = told.lines().filter(|line| line.contains("textured.obj")).collect();
    assert!(!of.is_empty() && told.contains("wrote cube.png"), "{told}");
    for line in of {
        assert!(
            line.contains("please report it with the file: left: 1  right: 2 (src/import/image.rs:"),
            "{told}"
        );
    }
    assert!(!told.contains("panicked") && !told.contains("backtrace") && told.lines().count() <= 4, "{told}");
}

/// `BLINN_SIMD` picks the instructions, never the picture.
#[test]
fn every_tier_renders_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/models/still-life/still-life.glb");
    let render = |tier: &str| {
        let out = format!("{tier}.png");
        let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(["render", scene, "-o", &out, "--size", "96x54", "-s", "2", "-q"])
            .env("BLINN_SIMD", tier)
            .current_dir(folder.path())
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let bytes = |tier: &str| std::fs::read(folder.path().join(format!("{tier}.png"))).unwrap();
    assert_eq!(render("portable"), (Some(0), String::new()));
    for tier in blinn::accel::Tier::ALL {
        if tier.available() {
            assert_eq!(render(tier.name()).0, Some(0));
            assert!(bytes(tier.name()) == bytes("portable"), "{tier:?}");
        } else {
            assert_eq!(render(tier.name()).0, Some(2));
        }
    }
    let (code, error) = render("sse9");
    assert_eq!(code, Some(2));
    assert!(error.contains("'sse9' is none of portable, avx2, avx512"), "{error}");
}

/// What is read but once is not lost where the process begins once more, whoever names it.
#[test]
fn scenes_of_a_config_may_come_from_standard_input() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("c.toml"), "scenes = [\"@-\"]\nsize = \"32x18\"\nsamples = 1\n").unwrap();
    let scene = model("tests/triangle.glb");
    fs::write(dir.path().join("list"), scene.to_str().unwrap()).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(["render", "--config", "c.toml"])
        .current_dir(dir.path())
        .stdin(fs::File::open(dir.path().join("list")).unwrap())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(names(dir.path()).contains(&"triangle.png".to_string()));
}

#[test]
fn lists_name_scenes_for_every_command() {
    let dir = tempfile::tempdir().unwrap();
    let (one, two) = (model("tests/triangle.glb"), model("tests/cube.obj"));
    fs::write(dir.path().join("list"), format!("{}\n{}\n", one.display(), two.display())).unwrap();
    let output = blinn(dir.path(), &["info", "@list", "--json"]);
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(facts.as_array().map(Vec::len), Some(2));
    let bench =
        ["bench", "@list", "--size", "8x8", "--rounds", "1", "--threads", "1", "--json", "b.json", "-q"];
    let output = blinn(dir.path(), &bench);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("triangle") && table.contains("cube"), "{table}");
    fails(dir.path(), &["info", "@gone"], 2, "@gone: the list cannot be read");
}

#[test]
fn a_file_of_another_kind_is_told_to_be_none() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in [("a.glb", &b"\x89PNG\r\n\x1a\n"[..]), ("b.gltf", b"hello"), ("c.glb", b"")] {
        fs::write(dir.path().join(name), bytes).unwrap();
        fails(dir.path(), &["render", name], 1, "this is no glTF file");
    }
    fails(dir.path(), &["render", "gone.glb", "--dry-run"], 1, "gone.glb: ");
}

/// Addresses that a process may not have are memory that there is not.
#[cfg(target_os = "linux")]
#[test]
fn a_bound_on_addresses_refuses_a_scene_and_not_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let (one, two) = (model("tests/triangle.glb"), model("cornell/cornell.glb"));
    let line = format!(
        "ulimit -v 3000000; exec '{}' render '{}' '{}' --size 16384x16384 -s 1",
        env!("CARGO_BIN_EXE_blinn"),
        one.display(),
        two.display()
    );
    let output = Command::new("sh").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    // Each at once, and both again at the end.
    assert_eq!(told.matches("without --max-memory there are 2.9 GiB").count(), 4, "{told}");
}
