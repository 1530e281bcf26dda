//! Many frames and many files: `--frames`, lists of scenes, names, configuration files, reports and progress.

use std::fs;

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
        ("{parent}/{stem}-{index}.png", "figure/figure-1_0002.png"),
    ] {
        runs(&at, &format!("render {figure} {SMALL} --frames 2 -q -o {out}"));
        assert!(at.join(expected).is_file(), "{out}");
    }
}

#[test]
fn chunks_of_a_clip_equal_the_complete_clip() {
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
    // A single frame is that frame.
    runs(&at, &format!("{line} --frame 3 -o one.png"));
    assert!(fs::read(at.join("one.png")).unwrap() == whole["3.png"]);
    // The figure moves, and holds its pose after the clip's end.
    assert!(whole["1.png"] != whole["3.png"]);
    runs(&at, &format!("{line} --frames 1000,{count} -o end/#.png"));
    let end = files(&at.join("end"));
    // Files record their time; the pixels of these two are equal.
    let picture = |name: &str| image::load_from_memory(&end[name]).unwrap();
    assert!(picture("1000.png") == picture(&format!("{count}.png")));
}

/// The bounds of the clip are computed once for all pictures, and `--perf` prints the time; a view with a
/// fixed position does not need them.
#[test]
fn clip_bounds_are_computed_once() {
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
        let messages = runs(&at, &format!("{flags} {figure} --size 16x12 -s 1 --perf"));
        assert_eq!(messages.matches("perf: clip ").count(), times, "{flags}: {messages}");
    }
}

#[test]
fn a_scene_without_animation_is_one_frame() {
    let (_dir, at) = folder();
    runs(&at, &format!("render --frames {} {SMALL} -q", model("cornell/cornell.glb")));
    assert_eq!(names(&at), ["cornell_0001.png"]);
}

#[test]
fn invalid_lists_and_names_are_refused_before_rendering() {
    let (_dir, at) = folder();
    let (figure, cornell) = (model("figure/figure.glb"), model("cornell/cornell.glb"));
    for (flags, message) in [
        ("--frames 1-x", "'1-x' is not a frame"),
        ("--frames 3-1", "leads away"),
        ("--frames 1-9999999", "more than 1000000"),
        ("--frames 1-3 --frame 2", "--frame"),
        ("--frames 1-3 --time 2", "--time"),
        ("--frames 1-3 --chunk 3/2", "I/N"),
        ("--frames 1-3 -o -", "several frames"),
        ("--frames -o a.png", "would both be written to a_0001.png"),
        ("-o a/{frame}.png", "would both be written to a/1.png"),
        ("--frames 1-20 -o {index}#.png", "would both be written to 111.png"),
    ] {
        // Eleven scenes: names of the 1st and the 11th may collide.
        let scenes = [figure.as_str(); 10].join(" ");
        refused(&at, &format!("render {scenes} {cornell} {flags}"), message);
    }
    refused(&at, "render @missing.txt", "@missing.txt");
}

#[test]
fn a_bad_scene_in_a_list_does_not_stop_the_others() {
    let (_dir, at) = folder();
    fs::write(at.join("bad.glb"), b"glTF and nothing").unwrap();
    let list =
        format!("# scenes\n{}\n\nbad.glb\n{}\n", model("lecture/lecture.obj"), model("cornell/cornell.obj"));
    fs::write(at.join("list.txt"), list).unwrap();
    let output = blinn(&at, &format!("render @list.txt missing.obj {SMALL} -o out/{{stem}}.png"));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(names(&at.join("out")), ["cornell.png", "lecture.png"]);
    let last: Vec<&str> = messages.lines().rev().take(3).collect();
    assert!(last[2].contains("2 of 4 scenes failed"), "{messages}");
    assert!(last[1].contains("bad.glb") && last[0].contains("missing.obj"), "{messages}");
}

#[test]
fn progress_is_reported_as_openjd_and_json() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    let messages = runs(&at, &format!("turntable {scene} {SMALL} --count 4 --progress openjd"));
    let told_percent: Vec<u32> =
        messages.lines().filter_map(|l| l.strip_prefix("openjd_progress: ")?.parse().ok()).collect();
    assert!(told_percent.is_sorted() && told_percent.last() == Some(&100), "{messages}");
    assert!(told_percent.len() >= 4 && messages.contains("openjd_status: "), "{messages}");
    let output = blinn(&at, &format!("render missing.glb {scene} {SMALL} --progress openjd"));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(
        messages.contains("openjd_fail: missing.glb") && messages.contains("openjd_progress: 100"),
        "{messages}"
    );
    let messages = runs(&at, &format!("turntable {scene} {SMALL} --count 4 --progress json"));
    let is_event = |line: &&str| !line.starts_with("blinn: ");
    let events: Vec<serde_json::Value> =
        messages.lines().filter(is_event).map(|line| serde_json::from_str(line).unwrap()).collect();
    let last = events.iter().rfind(|e| e["event"] == "progress").unwrap();
    assert_eq!((&last["percent"], &last["frames"]), (&100.into(), &4.into()));
    let wrote: Vec<_> = events.iter().filter(|e| e["event"] == "wrote").collect();
    assert!(wrote.len() == 4 && wrote.iter().all(|e| e["scene"] == scene), "{messages}");
    let output = blinn(&at, &format!("render missing.glb {scene} {SMALL} --progress json --perf -v"));
    let messages = String::from_utf8(output.stderr).unwrap();
    let events: Vec<serde_json::Value> =
        messages.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    let failed: Vec<_> = events.iter().filter(|e| e["event"] == "failed").collect();
    assert!(
        failed.len() == 1 && failed[0]["text"].as_str().unwrap().starts_with("missing.glb"),
        "{messages}"
    );
    assert_eq!(failed[0]["scene"], "missing.glb");
    let done = serde_json::json!({
        "event": "done", "scenes": 2, "failed": 1, "left": 0, "wrote": 1, "kept": 0, "exit_code": 1
    });
    assert_eq!(events.last(), Some(&done), "{messages}");
    // Messages that are no events go to standard error as text.
    let mut others = messages.lines().filter(|l| serde_json::from_str::<serde_json::Value>(l).is_err());
    assert!(others.all(|l| l.starts_with("blinn: ")), "{messages}");
}

#[test]
fn the_command_line_overrides_a_config_file() {
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
    // A flag also overrides the settings that it excludes.
    runs(&at, "render --config c.toml --size 16x9 --no-background -o c.png");
    let small = image::open(at.join("c.png")).unwrap();
    assert_eq!((small.width(), small.color().has_alpha()), (16, true));
    // Printed settings are a valid configuration file.
    let printed = blinn(&at, "render --config c.toml -s 3 --print-config").stdout;
    fs::write(at.join("d.toml"), &printed).unwrap();
    assert!(String::from_utf8_lossy(&printed).contains("samples = 3"));
    runs(&at, "render --config d.toml -s 2 -o d.png");
    assert!(read("d.png") == read("a.png"));
    for (text, message) in [
        ("sizes = 3", "'sizes' is not an option of render"),
        ("size = \"1x\"", "1280x720"),
        ("size = true", "'size' cannot be true; expected a number or a text in quotes"),
        ("strict = \"yes\"", "'strict' cannot be \"yes\"; expected true or false"),
        ("a = 1\nb = = 2", "line 2"),
        ("config = \"c.toml\"", "'config' is not an option"),
    ] {
        fs::write(at.join("e.toml"), text).unwrap();
        refused(&at, &format!("render {scene} --config e.toml"), message);
    }
    refused(&at, &format!("render {scene} --config none.toml"), "none.toml");
    // A bad value is reported with its place in the file.
    fs::write(at.join("e.toml"), "size = \"1x\"\nview = \"dark\"").unwrap();
    refused(&at, &format!("render {scene} --config e.toml"), "blinn: --config e.toml: invalid value");
    refused(
        &at,
        &format!("render {scene} --config e.toml --view agx --size 2x"),
        "blinn: invalid value '2x' for '--size <WxH>': ",
    );
    // All frames of a clip, with and without a list.
    fs::write(at.join("f.toml"), "frames = true\nfps = 2\nsize = \"16x9\"").unwrap();
    let figure = model("figure/figure.glb");
    let all = blinn(&at, &format!("render {figure} --config f.toml --dry-run")).stdout;
    assert!(String::from_utf8(all).unwrap().lines().count() > 1);
    let one = blinn(&at, &format!("render {figure} --config f.toml --frames 7 --dry-run")).stdout;
    assert_eq!(String::from_utf8(one).unwrap(), "figure_0007.png\n");
}

#[test]
fn a_report_shows_all_images_and_failures() {
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
        "href=\"./cornell_2.png\"",
        "data:image/jpeg;base64,",
        "missing&lt;.glb",
        "3 images in",
        "1 scene failed",
        "<section class=\"card scene whole\">",
        "<section class=\"card scene failed\">",
        "<span>All 2</span>",
        "<span>Failed 1</span>",
        "prefers-color-scheme: dark",
    ] {
        assert!(page.contains(expected), "{expected}: {page}");
    }
    assert!(!page.contains("{{"), "a placeholder is left");
}

/// `-` writes any format to standard output, one file only.
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
    assert!(page.starts_with("<!doctype html>") && page.contains("href=\"./a.png\""), "{page}");
    assert_eq!(names(&at), ["a.png"]);
    let job = out(&format!("job slurm -o - render {scene} --frames 1-2 -o out/#.png"));
    assert!(job.starts_with("#!"), "{job}");
    fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let measured = "bench a.obj --size 16x9 --rounds 1 --min-time 0.001 --threads 1";
    let figures = out(&format!("{measured} --json -"));
    assert!(serde_json::from_str::<serde_json::Value>(&figures).is_ok(), "{figures}");
    assert_eq!(names(&at), ["a.obj", "a.png"]);
    fs::write(at.join("old.json"), figures).unwrap();
    assert!(out("bench --from old.json --report -").starts_with("<!doctype html>"));
    assert_eq!(names(&at), ["a.obj", "a.png", "old.json"]);
    refused(&at, &format!("render {scene} -o - --report -"), "both be written to standard output");
    refused(&at, &format!("{measured} --json - --report -"), "both be written to -");
}

/// Pictures, their layers, animations and reports.
#[test]
fn colliding_names_are_refused() {
    let (_dir, at) = folder();
    for name in ["t.glb", "t.depth.glb"] {
        fs::copy(model("tests/triangle.glb"), at.join(name)).unwrap();
    }
    for (line, message) in [
        (
            "render t.glb t.depth.glb --aov depth",
            "t.glb and t.depth.glb would both be written to t.depth.png",
        ),
        ("turntable t.glb --count 2 -o z.html --report ./z.html", "t.glb and --report would both"),
        ("render t.glb -o zz.png --report zz.png", "t.glb and --report would both"),
        ("turntable t.glb --views 3 -o v/ --report v/transforms.json", "t.glb and --report would both"),
        ("bench t.glb --json b --report ./b", "--json and --report would both be written to ./b"),
        ("render t.glb --report ./t.glb", "--report ./t.glb would overwrite an input file"),
        ("bench t.glb --json t.glb", "--json t.glb would overwrite an input file"),
        ("job slurm -o t.glb turntable t.glb", "-o t.glb would overwrite an input file"),
    ] {
        refused(&at, line, message);
    }
}

/// The number of frames depends on the scene.
#[test]
fn colliding_names_at_later_frames_are_refused() {
    let (_dir, at) = folder();
    for name in ["figure.glb", "figure1.glb"] {
        fs::copy(model("figure/figure.glb"), at.join(name)).unwrap();
    }
    let line =
        |out: &str| format!("render figure.glb figure1.glb --frames --size 2x2 -s 1 -o {out} --dry-run");
    refused(&at, &line("{stem}{frame}.png"), "would both be written to figure11");
    // Ten thousand frames would collide; there are fewer.
    runs(&at, &line("{stem}####.png"));
    runs(&at, &line("{stem}_{frame}.png"));
}

#[test]
fn placeholders_in_existing_folders_are_literal() {
    let (_dir, at) = folder();
    fs::create_dir_all(at.join("C#/t{stem}")).unwrap();
    fs::copy(model("tests/triangle.glb"), at.join("t.glb")).unwrap();
    let named = |flags: &str| {
        let messages = blinn(&at, &format!("render t.glb {flags} --dry-run")).stdout;
        String::from_utf8(messages).unwrap().trim().to_string()
    };
    assert_eq!(named("-o C#/"), "C#/t.png");
    assert_eq!(named("-o C#"), "C#/t.png");
    assert_eq!(named("-o C#/t{stem}/{stem}.png"), "C#/t{stem}/t.png");
    assert_eq!(named("-o D#/a.png"), "D1/a.png");
    // The folder of a bare file name is the current one.
    let here = at.canonicalize().unwrap().file_name().unwrap().to_str().unwrap().to_string();
    assert_eq!(named("-o {parent}/{stem}.png"), format!("{here}/t.png"));
}
