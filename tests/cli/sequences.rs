//! Many frames and many files, as their users and farms see them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::program::*;

const SMALL: &str = "--size 32x18 -s 1";

#[test]
fn frames_are_numbered_files() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    runs(&at, &format!("render {figure} {SMALL} --frames 3,1 -q"));
    assert_eq!(names(&at), ["figure_0001.png", "figure_0003.png"]);
    for (out, expected) in [
        ("a/##.png", "a/02.png"),
        ("b/%03d.jpg", "b/002.jpg"),
        ("c/x{frame:05}.webp", "c/x00002.webp"),
        ("d/", "d/figure_0002.png"),
        ("e/x.exr", "e/x_0002.exr"),
        ("{parent}/{model}-{index}.png", "figure/figure-1_0002.png"),
    ] {
        runs(&at, &format!("render {figure} {SMALL} --frames 2 -q -o {out}"));
        assert!(at.join(expected).is_file(), "{out}");
    }
}

#[test]
fn any_share_of_a_clip_is_the_same_pictures_as_the_whole() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    let line = format!("render {figure} {SMALL} --fps 8 --ao 4 --ground plane -q");
    runs(&at, &format!("{line} --frames -o whole/#.png"));
    let whole = files(&at.join("whole"));
    assert!(whole.len() > 4, "{:?}", whole.keys());
    let count = whole.len();
    for i in 1..=3 {
        runs(&at, &format!("{line} --frames --chunk {i}/3 -o parts/#.png"));
    }
    assert!(files(&at.join("parts")) == whole);
    runs(&at, &format!("{line} --frames {count}-1:-1 -o backwards/#.png --threads 1"));
    assert!(files(&at.join("backwards")) == whole);
    // And one alone is that one.
    runs(&at, &format!("{line} --frame 3 -o one.png"));
    assert!(fs::read(at.join("one.png")).unwrap() == whole["3.png"]);
    // It moves, and stands still after its end.
    assert!(whole["1.png"] != whole["3.png"]);
    runs(&at, &format!("{line} --frames 1000,{count} -o end/#.png"));
    let end = files(&at.join("end"));
    // The files say which moment they are of; the pictures are one.
    let picture = |name: &str| image::load_from_memory(&end[name]).unwrap();
    assert!(picture("1000.png") == picture(&format!("{count}.png")));
}

/// What a framed view holds is found once for all its pictures, and `--perf` says how long it took; a view that
/// stands somewhere does not ask for it.
#[test]
fn a_clip_is_looked_through_once_and_told() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    for (flags, times) in [
        ("render --orbit 30,20 --frames 1-4 -o a.png", 1),
        ("turntable --count 3 -o b.png", 1),
        ("turntable --views 3 -o c/", 1),
        ("turntable --views 3 -o d/x.exr", 1),
        ("render --frames 1-4 --ground plane -o e.png", 1),
        ("render --frames 1-4 --view-point 2,1,2 --look-at 0,1,0 -o f.png", 0),
        ("render --orbit 30,20 --animation none -o g.png", 0),
    ] {
        let told = runs(&at, &format!("{flags} {figure} --size 16x12 -s 1 --perf"));
        assert_eq!(told.matches("perf: clip ").count(), times, "{flags}: {told}");
    }
}

#[test]
fn a_clip_of_nothing_is_one_frame() {
    let (_dir, at) = folder();
    runs(&at, &format!("render --frames {} {SMALL} -q", model("cornell/cornell.glb")));
    assert_eq!(names(&at), ["cornell_0001.png"]);
}

#[test]
fn wrong_lists_and_names_are_found_before_anything_is_rendered() {
    let (_dir, at) = folder();
    let (figure, cornell) = (model("figure/figure.glb"), model("cornell/cornell.glb"));
    for (flags, says) in [
        ("--frames 1-x", "'1-x' is no frame"),
        ("--frames 3-1", "leads away"),
        ("--frames 1-9999999", "more than 1000000"),
        ("--frames 1-3 --frame 2", "--frame"),
        ("--frames 1-3 --time 2", "--time"),
        ("--chunk 1/2", "--frames"),
        ("--frames 1-3 --chunk 3/2", "I/N"),
        ("--frames 1-3 -o -", "several frames"),
        ("--frames -o a.png", "would both be written to a_0001.png"),
        ("-o a/{frame}.png", "would both be written to a/1.png"),
        ("--frames 1-20 -o {index}#.png", "would both be written to 111.png"),
    ] {
        // Eleven scenes, so that the 1st and the 11th may meet.
        let scenes = [figure.as_str(); 10].join(" ");
        refused(&at, &format!("render {scenes} {cornell} {flags}"), says);
    }
    refused(&at, "render @missing.txt", "@missing.txt");
}

#[test]
fn lists_name_scenes_and_a_bad_one_does_not_stop_the_rest() {
    let (_dir, at) = folder();
    fs::write(at.join("bad.glb"), b"glTF and nothing").unwrap();
    let list =
        format!("# scenes\n{}\n\nbad.glb\n{}\n", model("lecture/lecture.obj"), model("cornell/cornell.obj"));
    fs::write(at.join("list.txt"), list).unwrap();
    let output = blinn(&at, &format!("render @list.txt missing.obj {SMALL} -o out/{{stem}}.png"));
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert_eq!(names(&at.join("out")), ["cornell.png", "lecture.png"]);
    let last: Vec<&str> = told.lines().rev().take(3).collect();
    assert!(last[2].contains("2 of 4 scenes failed"), "{told}");
    assert!(last[1].contains("bad.glb") && last[0].contains("missing.obj"), "{told}");
}

fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).unwrap().into_rgb8()
}

/// The mean difference of two pictures, of 255.
fn apart(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.as_raw().len() as f64
}

#[test]
fn a_turntable_goes_once_around() {
    let (_dir, at) = folder();
    let scene = model("still-life/still-life.glb");
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 -q"));
    let all = files(&at);
    let expected: Vec<String> = (1..=4).map(|i| format!("still-life_000{i}.png")).collect();
    assert!(all.keys().eq(&expected), "{:?}", all.keys());
    runs(&at, &format!("render {scene} {SMALL} -q -o once.png"));
    let first = pixels(&at.join(&expected[0]));
    assert!(pixels(&at.join("once.png")) == first, "the first frame is the picture itself");
    let distinct: std::collections::BTreeSet<_> = all.values().collect();
    assert_eq!(distinct.len(), 4);
    // Farms render some of the frames; they are the same.
    runs(&at, &format!("turntable --frames 4 {scene} {SMALL} --only 2,4 -q -o only/"));
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --chunk 2/2 -q -o share/"));
    assert_eq!(names(&at.join("only")), [&expected[1][..], &expected[3]]);
    assert_eq!(names(&at.join("share")), [&expected[2][..], &expected[3]]);
    for part in ["only", "share"] {
        assert!(files(&at.join(part)).iter().all(|(name, bytes)| all[name] == *bytes), "{part}");
    }
    // The other way round, and from elsewhere on.
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --direction cw -q -o cw/#.png"));
    assert!(apart(&pixels(&at.join("cw/2.png")), &pixels(&at.join(&expected[3]))) < 0.1);
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --start 90 -q -o on/#.png"));
    assert!(apart(&pixels(&at.join("on/1.png")), &pixels(&at.join(&expected[1]))) < 0.1);
}

/// The scene is turned in the file itself, and the turntable's frame must be what `render` makes of it.
#[test]
fn a_turning_model_is_the_model_turned() {
    let (_dir, at) = folder();
    let quarter = |[x, y, z]: [f64; 3]| [z, y, -x];
    let corners = [[-1., 0., -1.], [2., 0., -1.], [-1., 0., 1.], [-1., 3., -1.]];
    let faces = "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
    let obj = |turned: bool| {
        // Turned about the middle of the bounds, which is (.5, ., 0).
        let place =
            |c: [f64; 3]| if turned { quarter([c[0] - 0.5, c[1], c[2]]) } else { [c[0] - 0.5, c[1], c[2]] };
        corners.map(place).map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat() + faces
    };
    fs::write(at.join("a.obj"), obj(false)).unwrap();
    fs::write(at.join("b.obj"), obj(true)).unwrap();
    let flags = "--size 64x36 -s 4 --view-point 3,5,8 --look-at 0,1,0 --yfov 40 --point-light 4,6,3,40 \
                 --sun -1,-1,-.3,.4 --ambient .1,.1,.1 --ground plane --aov position,normal";
    runs(&at, &format!("turntable a.obj {flags} --count 4 --only 2 -q -o turned_#.exr"));
    runs(&at, &format!("render b.obj {flags} -q -o still.exr"));
    let read = |name: &str| {
        let image = exr::prelude::read_all_flat_layers_from_file(at.join(name)).unwrap();
        let channels = image.layer_data[0].channel_data.list.clone();
        channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect::<Vec<_>>()))
    };
    let mut looked_at = 0;
    for ((name, turned), (_, still)) in read("turned_2.exr").zip(read("still.exr")) {
        // Rounding moves an edge over a sample here and there.
        let off = turned.iter().zip(&still).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
        assert!(off <= turned.len() / 200, "{name}: {off} of {} pixels differ", turned.len());
        looked_at += 1;
    }
    assert_eq!(looked_at, 10);
}

#[test]
fn a_turning_camera_takes_its_lights_along_and_leaves_the_files() {
    let (_dir, at) = folder();
    fs::write(
        at.join("a.obj"),
        "v -1 0 -1\nv 2 0 -1\nv -1 0 1\nv -1 3 -1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
    )
    .unwrap();
    let frame = |flags: &str, out: &str| {
        runs(&at, &format!("turntable a.obj --size 64x36 -s 4 --count 4 --only 2 -q {flags} -o {out}#.png"));
        pixels(&at.join(format!("{out}2.png")))
    };
    let model = frame("--lights three-point", "model");
    // Lights that are fixed to the camera: no matter which of the two moves.
    let camera = frame("--lights three-point --turn camera --direction cw", "camera");
    assert!(apart(&model, &camera) < 0.3, "{}", apart(&model, &camera));
    let sun = "--sun -1,-1,-.3,1";
    let lit = (frame(sun, "sun-model"), frame(&format!("{sun} --turn camera --direction cw"), "sun-camera"));
    assert!(apart(&lit.0, &lit.1) > 3.0, "a sun stands still: {}", apart(&lit.0, &lit.1));
}

#[test]
fn wrong_turntables_are_refused() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    for (flags, says) in [
        ("--count 0", "0"),
        ("--count 4 --only 5", "the frames are 1 to 4"),
        ("--axis 0,0,0", "has a length"),
        ("--axis x --ground plane", "--turn camera"),
        ("--elevation 91", "±90"),
        ("--elevation 9 --orbit 1,2", "--orbit"),
        ("-o -", "several frames"),
        ("--frame 2", "--frame"),
    ] {
        refused(&at, &format!("turntable {scene} {flags}"), says);
    }
}

/// Pictures of every format are kept as long as nothing that they were made of changes.
#[test]
fn finished_pictures_are_kept_until_something_changes() {
    let (_dir, at) = folder();
    for name in [
        "textured.gltf",
        "textured.bin",
        "planks.png",
        "tin base.png",
        "tin_metal_rough.png",
        "tin_normal.png",
    ] {
        fs::copy(model(&format!("textured/{name}")), at.join(name)).unwrap();
    }
    for out in ["o/a#.png", "o/b#.exr", "o/c#.jpg", "o/d#.webp"] {
        let layers = if out.ends_with("exr") { "" } else { "--aov depth,cryptomatte" };
        let line = format!("turntable textured.gltf {SMALL} --count 2 {layers} -o {out} --resume");
        let wrote = |flags: &str| runs(&at, &format!("{line} {flags}")).matches("wrote ").count();
        let each = if layers.is_empty() { 1 } else { 4 };
        assert_eq!(wrote(""), 2 * each, "{out}");
        let whole = files(&at.join("o"));
        assert_eq!(wrote("--threads 1 -v --progress plain"), 0, "{out}");
        assert_eq!(wrote("--only 2"), 0, "{out}");
        // What is missing or broken is made again, and nothing else.
        let first = at.join(out.replace('#', "1"));
        fs::write(&first, &fs::read(&first).unwrap()[..200]).unwrap();
        assert_eq!(wrote(""), each, "{out}");
        if !layers.is_empty() {
            fs::remove_file(first.with_extension("depth.png")).unwrap();
            assert_eq!(wrote(""), each, "{out}");
        }
        assert!(files(&at.join("o")) == whole, "{out}");
        assert_eq!(wrote("--seed 5"), 2 * each, "{out}: another setting");
        assert_eq!(wrote("--start 10"), 2 * each, "{out}: other angles");
    }
    // Another texture, a missing one, and one that is back.
    let line = format!("render textured.gltf {SMALL} -o t.png --resume");
    let wrote = || runs(&at, &line).contains("wrote t.png");
    assert!(wrote() && !wrote());
    let planks = fs::read(at.join("planks.png")).unwrap();
    fs::copy(at.join("tin base.png"), at.join("planks.png")).unwrap();
    assert!(wrote() && !wrote());
    fs::remove_file(at.join("planks.png")).unwrap();
    assert!(wrote() && !wrote());
    fs::write(at.join("planks.png"), planks).unwrap();
    assert!(wrote() && !wrote());
    refused(&at, &format!("{line} --no-overwrite"), "--no-overwrite");
}

/// Pipes in the place of files are told of and never waited for: neither those that a scene names nor those
/// that a picture's stamp does.
#[cfg(unix)]
#[test]
fn pipes_in_the_place_of_files_hold_nobody_up() {
    let (_dir, at) = folder();
    let pipe = |name: &str| {
        assert!(Command::new("mkfifo").arg(at.join(name)).status().unwrap().success());
    };
    pipe("pipe.png");
    pipe("pipe.mtl");
    fs::write(at.join("map.mtl"), "newmtl a\nmap_Kd pipe.png\n").unwrap();
    for (scene, library) in [("a.obj", "pipe.mtl"), ("b.obj", "map.mtl")] {
        let text = format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
        fs::write(at.join(scene), text).unwrap();
    }
    let run = |line: &str| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line.split_whitespace())
            .current_dir(&at)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        for _ in 0..600 {
            if child.try_wait().unwrap().is_some() {
                return String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        child.kill().unwrap();
        panic!("{line}: it waits");
    };
    let line = format!("render a.obj b.obj {SMALL} --resume");
    let told = run(&line);
    assert_eq!(told.matches("not a regular file").count(), 2, "{told}");
    assert_eq!(told.matches("wrote ").count(), 2, "{told}");
    assert!(!run(&line).contains("wrote "), "what cannot be read is still the same");
    // In place of an MTL that was read, and of the picture itself, whose stamp is looked for: it is written into.
    fs::remove_file(at.join("map.mtl")).unwrap();
    pipe("map.mtl");
    fs::remove_file(at.join("a.png")).unwrap();
    pipe("a.png");
    let reader = std::thread::spawn({
        let pipe = at.join("a.png");
        move || fs::read(pipe).unwrap()
    });
    assert!(run(&line).contains("wrote b.png"));
    assert!(reader.join().unwrap().starts_with(b"\x89PNG"));
}

/// Names of any bytes are told apart.
#[cfg(target_os = "linux")]
#[test]
fn resume_knows_scenes_whose_names_are_no_text() {
    use std::os::unix::ffi::OsStrExt;
    let (_dir, at) = folder();
    let name = std::ffi::OsStr::from_bytes(b"m\xff.glb");
    let wrote = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
        let line = format!("{SMALL} --resume -o m.png");
        let output = command.arg("render").arg(name).args(line.split(' ')).current_dir(&at).output().unwrap();
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).contains("wrote m.png")
    };
    fs::copy(model("tests/triangle.glb"), at.join(name)).unwrap();
    assert!(wrote() && !wrote());
    fs::copy(model("tests/quad_nonindexed.glb"), at.join(name)).unwrap();
    assert!(wrote() && !wrote());
}

/// A picture that was made with a warning is none that `--strict` would have made.
#[test]
fn strict_keeps_no_picture_that_was_made_with_a_warning() {
    let (_dir, at) = folder();
    fs::write(at.join("a.obj"), "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let line = format!("render a.obj {SMALL} --resume");
    assert!(runs(&at, &line).contains("warning"));
    let output = blinn(&at, &format!("{line} --strict"));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && told.contains("gone.mtl"), "{told}");
    // What was made without one does for both.
    fs::write(at.join("gone.mtl"), "newmtl a\n").unwrap();
    assert!(runs(&at, &format!("{line} --strict")).contains("wrote"));
    for flag in ["--strict", ""] {
        assert!(!runs(&at, &format!("{line} {flag}")).contains("wrote"), "{flag}");
    }
}

/// Killed again and again, a job ends with the very files of one that nothing happened to.
#[cfg(unix)]
#[test]
fn what_was_killed_is_resumed() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let line =
        |out: &str| format!("turntable {scene} --size 64x36 -s 4 --count 12 --resume -q -o {out}/#.png");
    runs(&at, &line("whole"));
    for i in 0..8 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line("killed").split_whitespace())
            .current_dir(&at)
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(10 + 23 * i));
        let _ = child.kill();
        child.wait().unwrap();
        for name in names(&at).iter().filter(|n| n.starts_with("killed/") && n.ends_with(".png")) {
            image::open(at.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
    runs(&at, &line("killed"));
    let finished: BTreeMap<_, _> =
        files(&at.join("killed")).into_iter().filter(|(name, _)| name.ends_with(".png")).collect();
    assert!(finished == files(&at.join("whole")));
}

#[test]
fn progress_for_farms_is_in_their_words() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let told = runs(&at, &format!("turntable {scene} {SMALL} --count 4 --progress openjd"));
    let told_percent: Vec<u32> =
        told.lines().filter_map(|l| l.strip_prefix("openjd_progress: ")?.parse().ok()).collect();
    assert!(told_percent.is_sorted() && told_percent.last() == Some(&100), "{told}");
    assert!(told_percent.len() >= 4 && told.contains("openjd_status: "), "{told}");
    let output = blinn(&at, &format!("render missing.glb {scene} {SMALL} --progress openjd"));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("openjd_fail: missing.glb") && told.contains("openjd_progress: 100"), "{told}");
    let told = runs(&at, &format!("turntable {scene} {SMALL} --count 4 --progress json"));
    let events: Vec<serde_json::Value> = told.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let last = events.iter().rfind(|e| e["event"] == "progress").unwrap();
    assert_eq!((&last["percent"], &last["frames"]), (&100.into(), &4.into()));
    let wrote: Vec<_> = events.iter().filter(|e| e["event"] == "wrote").collect();
    assert!(wrote.len() == 4 && wrote.iter().all(|e| e["scene"] == scene), "{told}");
    let output = blinn(&at, &format!("render missing.glb {scene} {SMALL} --progress json --perf -v"));
    let told = String::from_utf8(output.stderr).unwrap();
    let events: Vec<serde_json::Value> = told.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    let failed: Vec<_> = events.iter().filter(|e| e["event"] == "failed").collect();
    assert!(failed.len() == 1 && failed[0]["text"].as_str().unwrap().starts_with("missing.glb"), "{told}");
    assert_eq!(failed[0]["scene"], "missing.glb");
    let done = serde_json::json!({
        "event": "done", "scenes": 2, "failed": 1, "left": 0, "wrote": 1, "kept": 0, "exit_code": 1
    });
    assert_eq!(events.last(), Some(&done), "{told}");
    // What is no event is for people.
    let mut others = told.lines().filter(|l| serde_json::from_str::<serde_json::Value>(l).is_err());
    assert!(others.all(|l| l.starts_with("blinn: ")), "{told}");
}

#[test]
fn settings_come_from_a_file_and_the_command_line_wins() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let config = format!(
        "scenes = [{scene:?}]\nsize = \"32x18\"\nsamples = 2\nbackground = \"#ff0000\"\ncamera = 0\n\
         view-point = [0, 1.5, 9]\nno-shadows = true\npoint-light = [\"0,1,0,5\", \"1,1,0,2\"]\nquiet = true\n"
    );
    fs::write(at.join("c.toml"), config).unwrap();
    runs(&at, "render --config c.toml -o a.png");
    let words = "--size 32x18 -s 2 --background #ff0000 --camera 0 --view-point 0,1.5,9 --no-shadows \
                 --point-light 0,1,0,5 --point-light 1,1,0,2 -q";
    runs(&at, &format!("render {scene} {words} -o b.png"));
    let read = |name: &str| fs::read(at.join(name)).unwrap();
    assert!(read("a.png") == read("b.png"));
    // What excludes a setting takes its place too.
    runs(&at, "render --config c.toml --size 16x9 --no-background -o c.png");
    let small = image::open(at.join("c.png")).unwrap();
    assert_eq!((small.width(), small.color().has_alpha()), (16, true));
    // Printed settings are a file again.
    let printed = blinn(&at, "render --config c.toml -s 3 --print-config").stdout;
    fs::write(at.join("d.toml"), &printed).unwrap();
    assert!(String::from_utf8_lossy(&printed).contains("samples = 3"));
    runs(&at, "render --config d.toml -s 2 -o d.png");
    assert!(read("d.png") == read("a.png"));
    for (text, says) in [
        ("sizes = 3", "'sizes' is no setting of render"),
        ("size = \"1\"", "1280x720"),
        ("size = true", "'size' cannot be true"),
        ("a = 1\nb = = 2", "line 2"),
        ("config = \"c.toml\"", "'config' is no setting"),
    ] {
        fs::write(at.join("e.toml"), text).unwrap();
        refused(&at, &format!("render {scene} --config e.toml"), says);
    }
    refused(&at, &format!("render {scene} --config none.toml"), "none.toml");
    // A bad value is told with the place that it stands in.
    fs::write(at.join("e.toml"), "size = \"1\"\nview = \"dark\"").unwrap();
    refused(&at, &format!("render {scene} --config e.toml"), "blinn: --config e.toml: --");
    refused(&at, &format!("render {scene} --config e.toml --view agx --size 2"), "blinn: --size 2: ");
    // A clip's frames, with and without a list.
    fs::write(at.join("f.toml"), "frames = true\nfps = 2\nsize = \"16x9\"").unwrap();
    let figure = model("figure/figure.glb");
    let all = blinn(&at, &format!("render {figure} --config f.toml --dry-run")).stdout;
    assert!(String::from_utf8(all).unwrap().lines().count() > 1);
    let one = blinn(&at, &format!("render {figure} --config f.toml --frames 7 --dry-run")).stdout;
    assert_eq!(String::from_utf8(one).unwrap(), "figure_0007.png\n");
}

#[test]
fn a_report_shows_all_pictures_and_what_went_wrong() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let before = format!("turntable {scene} missing<.glb {SMALL} --count 3 -o out/{{stem}}_#.png");
    let dry = blinn(&at, &format!("{before} --dry-run --report out/r.html"));
    assert_eq!(String::from_utf8(dry.stdout).unwrap().lines().count(), 3);
    assert_eq!(dry.status.code(), Some(1), "a scene is missing");
    assert!(names(&at).is_empty());
    let output = blinn(&at, &format!("{before} --report out/r.html"));
    assert_eq!(output.status.code(), Some(1));
    let page = fs::read_to_string(at.join("out/r.html")).unwrap();
    assert_eq!(page.matches("<figure>").count(), 3);
    for expected in [
        "href=\"cornell_2.png\"",
        "data:image/jpeg;base64,",
        "missing&lt;.glb",
        "3 pictures in",
        "1 scene failed",
    ] {
        assert!(page.contains(expected), "{expected}: {page}");
    }
}

/// `-` is standard output, for whatever is written, and takes one thing.
#[test]
fn a_dash_is_standard_output() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let out = |line: &str| {
        let output = blinn(&at, line);
        assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let page = out(&format!("render {scene} {SMALL} -o a.png --report -"));
    assert!(page.starts_with("<!doctype html>") && page.contains("href=\"a.png\""), "{page}");
    assert_eq!(names(&at), ["a.png"]);
    let job = out(&format!("job slurm -o - render {scene} --frames 1-2 -o out/#.png"));
    assert!(job.starts_with("#!"), "{job}");
    fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let measured = "bench a.obj --size 16x9 --rounds 1 --threads 1";
    let figures = out(&format!("{measured} --json -"));
    assert!(serde_json::from_str::<serde_json::Value>(&figures).is_ok(), "{figures}");
    assert_eq!(names(&at), ["a.obj", "a.png"]);
    fs::write(at.join("old.json"), figures).unwrap();
    assert!(out("bench --from old.json --report -").starts_with("<!doctype html>"));
    assert_eq!(names(&at), ["a.obj", "a.png", "old.json"]);
    refused(&at, &format!("render {scene} -o - --report -"), "both be written to standard output");
    refused(&at, &format!("{measured} --json - --report -"), "both be written to -");
}

/// Whatever is written: pictures, their layers, a moving picture, a page.
#[test]
fn names_that_collide_in_any_of_their_files_are_refused() {
    let (_dir, at) = folder();
    for name in ["t.glb", "t.depth.glb"] {
        fs::copy(model("tests/triangle.glb"), at.join(name)).unwrap();
    }
    for (line, says) in [
        (
            "render t.glb t.depth.glb --aov depth",
            "t.glb and t.depth.glb would both be written to t.depth.png",
        ),
        ("turntable t.glb --count 2 -o z.html --report ./z.html", "t.glb and --report would both"),
        ("render t.glb -o zz.png --report zz.png", "t.glb and --report would both"),
        ("turntable t.glb --views 3 -o v/ --report v/transforms.json", "t.glb and --report would both"),
        ("bench t.glb --json b --report ./b", "--json and --report would both be written to ./b"),
        ("render t.glb --report ./t.glb", "--report ./t.glb: that file is read"),
        ("bench t.glb --json t.glb", "--json t.glb: that file is read"),
        ("job slurm -o t.glb turntable t.glb", "-o t.glb: that file is read"),
    ] {
        refused(&at, line, says);
    }
}

/// How many frames there are only the scenes say.
#[test]
fn names_that_collide_at_a_later_frame_are_refused_too() {
    let (_dir, at) = folder();
    for name in ["figure.glb", "figure1.glb"] {
        fs::copy(model("figure/figure.glb"), at.join(name)).unwrap();
    }
    let line =
        |out: &str| format!("render figure.glb figure1.glb --frames --size 2x2 -s 1 -o {out} --dry-run");
    refused(&at, &line("{stem}{frame}.png"), "would both be written to figure11");
    // Ten thousand frames would collide, and there are not so many.
    runs(&at, &line("{stem}####.png"));
    runs(&at, &line("{stem}_{frame}.png"));
}

#[test]
fn folders_that_are_there_are_meant_as_they_are_called() {
    let (_dir, at) = folder();
    fs::create_dir_all(at.join("C#/t{stem}")).unwrap();
    fs::copy(model("tests/triangle.glb"), at.join("t.glb")).unwrap();
    let named = |flags: &str| {
        let told = blinn(&at, &format!("render t.glb {flags} --dry-run")).stdout;
        String::from_utf8(told).unwrap().trim().to_string()
    };
    assert_eq!(named("-o C#/"), "C#/t.png");
    assert_eq!(named("-o C#"), "C#/t.png");
    assert_eq!(named("-o C#/t{stem}/{stem}.png"), "C#/t{stem}/t.png");
    assert_eq!(named("-o D#/a.png"), "D1/a.png");
    // The folder of a bare name is the current one.
    let here = at.canonicalize().unwrap().file_name().unwrap().to_str().unwrap().to_string();
    assert_eq!(named("-o {parent}/{stem}.png"), format!("{here}/t.png"));
}
