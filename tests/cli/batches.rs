//! Many scenes: folders, shares of scenes, `--timeout`, and runs that are killed.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::program::*;

const SMALL: &str = "--size 16x12 -s 1 -q";

/// Writes a triangle of its own shape.
pub fn write_triangle(file: &Path, i: usize) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, format!("v 0 0 0\nv {} 0 0\nv 0 {} 0\nf 1 2 3\n", 1 + i % 5, 1 + i % 7)).unwrap();
}

/// Folders of objects, one of which is broken: `objects/0/00.obj` and so on.
pub fn write_objects(at: &Path, count: usize) {
    for i in 0..count {
        write_triangle(&at.join(format!("objects/{}/{i:02}.obj", i % 3)), i);
    }
    fs::write(at.join("objects/1/broken.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
}

pub fn ledger(at: &Path, name: &str) -> Vec<Value> {
    let text = fs::read_to_string(at.join(name)).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{line}: {e}"))).collect()
}

/// A folder is all scenes in it and below, in the order of their names.
#[test]
fn a_folder_is_a_batch() {
    let (_dir, at) = folder();
    write_objects(&at, 7);
    fs::remove_file(at.join("objects/1/broken.obj")).unwrap();
    fs::write(at.join("objects/readme.txt"), "no scene").unwrap();
    runs(&at, &format!("render objects {SMALL} -o out/{{index}}-{{parent}}-{{stem}}.png"));
    let names = names(&at.join("out"));
    let expected = ["1-0-00", "2-0-03", "3-0-06", "4-1-01", "5-1-04", "6-2-02", "7-2-05"]
        .map(|name| format!("{name}.png"));
    assert_eq!(names, expected);
    runs(&at, &format!("render objects/ {SMALL} --dry-run -o {{parent}}/{{stem}}.png"));
    fs::create_dir(at.join("empty")).unwrap();
    refused(&at, "render empty", "empty: a folder without .gltf, .glb, .obj, .stl, .ply or .blend files");
    refused(&at, "render objects missing/ -o a.png", "would both be written to a.png");
}

/// CAD programs export a part in several formats beside each other.
#[test]
fn scenes_of_one_stem_have_images_by_their_extensions() {
    let (_dir, at) = folder();
    write_triangle(&at.join("parts/p.obj"), 0);
    write_triangle(&at.join("parts/q.obj"), 1);
    fs::copy(model("tests/triangle.glb"), at.join("parts/p.glb")).unwrap();
    let help = "would both be written to out/p.png; use {stem}.{ext} in -o";
    refused(&at, &format!("render parts {SMALL} -o out/"), help);
    runs(&at, &format!("render parts {SMALL} -o out/{{stem}}.{{ext}}.png"));
    assert_eq!(names(&at.join("out")), ["p.glb.png", "p.obj.png", "q.obj.png"]);
    let line = format!("turntable parts {SMALL} --views 2 -o ");
    refused(&at, &(line.clone() + "sets/{parent}/"), "-o '{stem}.{ext}/####.png'");
    runs(&at, &(line + "sets/{stem}.{ext}/####.png --dry-run"));
}

/// With several threads, scenes are rendered side by side. Images, messages and the order of both are those of a single
/// thread, which renders each scene in its turn.
#[test]
fn scenes_are_reported_in_their_turn() {
    let (_dir, at) = folder();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (name, text) in [
        ("0.obj", format!("{triangle}f 1 2 3\n")),
        ("1.obj", format!("mtllib missing.mtl\n{triangle}f 1 2 3\n")),
        ("2.obj", format!("{triangle}f 1 2 9\n")),
        ("3.gltf", "{".into()),
        ("4.obj", format!("mtllib 4.mtl\n{triangle}f 1 3 2\n")),
        ("5.obj", triangle.into()),
        ("6.glb", String::new()),
    ] {
        fs::create_dir_all(at.join("scenes")).unwrap();
        fs::write(at.join("scenes").join(name), text).unwrap();
    }
    fs::write(at.join("list"), "scenes/0.obj\nscenes/none.obj\nscenes/1.obj\nscenes/1.obj\n").unwrap();
    for flags in ["scenes", "scenes --strict", "@list", "scenes --count 3"] {
        let run = |threads: usize| {
            let verb = if flags.contains("--count") { "turntable" } else { "render" };
            let out = "out/{index}/#.png --ledger out.jsonl";
            let output =
                blinn(&at, &format!("{verb} {flags} --size 16x12 -s 1 --threads {threads} -o {out}"));
            let messages = String::from_utf8(output.stderr).unwrap();
            let messages: Vec<String> =
                messages.lines().filter(|line| !line.starts_with("scenes: ")).map(String::from).collect();
            let images = files(&at.join("out"));
            let _ = fs::remove_dir_all(at.join("out"));
            let mut scenes = ledger(&at, "out.jsonl");
            for line in &mut scenes {
                line["seconds"] = Value::Null;
                line["files_version"] = Value::Null;
            }
            (messages, output.status.code(), images, scenes)
        };
        let one = run(1);
        assert!(one.0.iter().any(|line| line.contains("wrote")) && one.1 == Some(1), "{one:?}");
        for threads in [2, 3, 7, 64] {
            assert_eq!(run(threads), one, "{flags}");
        }
    }
}

/// `--chunk` divides the scenes of a batch: the shares together are the whole, with the same numbers.
#[test]
fn chunks_of_a_batch_divide_its_scenes() {
    let (_dir, at) = folder();
    write_objects(&at, 7);
    fs::remove_file(at.join("objects/1/broken.obj")).unwrap();
    for (line, each) in [
        ("render objects -o X/{index}.png", 1),
        ("turntable objects --views 3 -o X/{stem}/#.png", 13),
        ("turntable objects --count 2 -o X/{stem}.gif", 1),
    ] {
        let run = |out: &str, flags: &str| runs(&at, &format!("{} {SMALL} {flags}", line.replace('X', out)));
        run("whole", "");
        let mut sizes = Vec::new();
        for i in 1..=9 {
            let before = if at.join("parts").exists() { files(&at.join("parts")).len() } else { 0 };
            run("parts", &format!("--chunk {i}/9"));
            sizes.push(if at.join("parts").exists() { files(&at.join("parts")).len() - before } else { 0 });
        }
        assert!(files(&at.join("parts")) == files(&at.join("whole")), "{line}");
        assert_eq!(sizes.iter().filter(|&&size| size == each).count(), 7, "{line}: {sizes:?}");
        assert_eq!(sizes.iter().filter(|&&size| size == 0).count(), 2, "{line}: {sizes:?}");
        fs::remove_dir_all(at.join("whole")).unwrap();
        fs::remove_dir_all(at.join("parts")).unwrap();
    }
    // A list of one scene is a batch, too.
    fs::write(at.join("list"), "objects/0/00.obj\n").unwrap();
    runs(&at, &format!("render @list {SMALL} --chunk 1/2 -o one.png"));
    assert!(!at.join("one.png").exists(), "the scene is in the second share");
    refused(
        &at,
        &format!("render objects/0/00.obj {SMALL} --chunk 1/2"),
        "there is only one image; add --frames",
    );
}

/// A share without scenes or frames says so.
#[test]
fn an_empty_share_is_one_line() {
    let (_dir, at) = folder();
    write_triangle(&at.join("objects/1.obj"), 1);
    write_triangle(&at.join("objects/2.obj"), 2);
    let size = "--size 8x8 -s 1 -o out/{stem}-#.png";
    let line = |line: &str| runs(&at, &format!("{line} {size}"));
    let scenes = line("render objects --chunk 1/3");
    assert!(scenes.contains("nothing to render: share 1/3 of 2 scenes is empty"), "{scenes}");
    for frames in
        ["render objects/1.obj --frames 1-2 --chunk 1/3", "turntable objects/1.obj --count 2 --chunk 1/3"]
    {
        let messages = line(frames);
        assert_eq!(messages.matches("share 1/3 is empty").count(), 1, "{frames}: {messages}");
    }
    assert!(!line("render objects/1.obj --frames 1-3 --chunk 1/3").contains("is empty"));
}

/// A scene that takes too long fails, and the batch goes on.
#[test]
fn a_scene_that_takes_too_long_is_given_up() {
    let (_dir, at) = folder();
    write_triangle(&at.join("scenes/1.obj"), 1);
    write_triangle(&at.join("scenes/3.obj"), 3);
    // Thousands of large triangles behind each other, through which many rays look for light.
    let mut text = String::new();
    for i in 0..4000 {
        let z = f64::from(i) / 1000.0;
        text += &format!("v 0 0 {z}\nv 9 0 {z}\nv 0 9 {z}\nf -3 -2 -1\n");
    }
    fs::write(at.join("scenes/2.obj"), text).unwrap();
    let line = "render scenes --size 2000x2000 -s 256 -q -o {stem}.png --crop 0,0,1,1";
    runs(&at, line);
    fs::remove_file(at.join("2.png")).unwrap();
    let line = line.replace("--crop 0,0,1,1", "--timeout 0.4 --ao 64 --ledger ledger");
    let since = std::time::Instant::now();
    let output = blinn(&at, &line);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("2.obj: gave up after 0.4 s; raise --timeout"), "{messages}");
    assert!(since.elapsed().as_secs() < 60, "{:?}", since.elapsed());
    assert!(!at.join("2.png").exists());
    let lines = ledger(&at, "ledger");
    assert_eq!(lines[1]["status"], "failed");
    assert!(lines[1]["error"].as_str().unwrap().contains("gave up after 0.4 s"));
    assert_eq!(lines.len(), 3, "the others were tried");
}

/// A batch that is killed several times ends with the same files as an undisturbed one, with and without ledger. A view
/// that shows nothing keeps its mark in transforms.json.
#[cfg(unix)]
#[test]
fn a_killed_batch_is_resumed() {
    let (_dir, at) = folder();
    write_objects(&at, 10);
    for (flags, name) in [("", "plain"), ("--ledger X.jsonl", "ledger")] {
        // From behind, views show nothing.
        let line = |out: &str| {
            format!(
                "turntable objects --views 4 --size 64x48 -s 16 -q --cull back --resume -o {out}/{{stem}}/#.png {}",
                flags.replace('X', out)
            )
        };
        let (whole, killed) = (format!("{name}-whole"), format!("{name}-killed"));
        assert_eq!(blinn(&at, &line(&whole)).status.code(), Some(1), "one object is broken");
        assert!(kill_repeatedly(&at, &line(&killed)) > 0, "no run was killed");
        assert_eq!(blinn(&at, &line(&killed)).status.code(), Some(1));
        let whole = files(&at.join(whole));
        assert!(whole.keys().filter(|file| file.ends_with("transforms.json")).count() == 10);
        let marked = |bytes: &Vec<u8>| String::from_utf8_lossy(bytes).contains("\"empty\": true");
        assert!(whole.values().any(marked), "no view is empty");
        let killed = files(&at.join(killed));
        assert_eq!(killed.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
        assert!(killed == whole);
    }
}

/// Scenes in a tar file look as they do in a folder, with their materials and textures, and are kept by `--resume`.
#[test]
fn a_tar_file_is_a_batch() {
    let (_dir, at) = folder();
    let write = |name: &str, bytes: &[u8]| {
        let file = at.join("objects").join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, bytes).unwrap();
    };
    let quad = |library: &str| {
        format!(
            "mtllib {library}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
        )
    };
    let image = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([(x * 80) as u8, (y * 80) as u8, 40]));
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    // The second texture is in a usual folder, under a name in another case; the third is outside.
    for (scene, texture) in [("a", "wood.png"), ("b", "Wood.PNG"), ("c", "../../wood.png")] {
        write(&format!("{scene}/{scene}.obj"), quad(&format!("{scene}.mtl")).as_bytes());
        write(&format!("{scene}/{scene}.mtl"), format!("newmtl m\nmap_Kd {texture}\n").as_bytes());
    }
    write("a/wood.png", png.get_ref());
    write("b/textures/wood.png", png.get_ref());
    fs::write(at.join("wood.png"), png.get_ref()).unwrap();
    write("readme.txt", b"no scene");
    fs::copy(model("tests/triangle.glb"), at.join("objects/t.glb")).unwrap();
    let path = at.join("objects.tar");
    let mut objects = blinn::output::ShardPart::new(&path).unwrap();
    for (name, bytes) in files(&at.join("objects")) {
        objects.add(&name, &bytes).unwrap();
    }
    let mut archive = blinn::output::ShardWriter::new(&path).unwrap();
    archive.append(objects).unwrap();
    archive.finish(blinn::output::Overwrite::No).unwrap();

    let line = |scenes: &str, out: &str| {
        format!("render {scenes} --size 24x24 -s 4 --lights headlight -o {out}/{{index}}-{{stem}}.png")
    };
    let from_folder = runs(&at, &line("objects", "folder"));
    let from_tar = runs(&at, &line("objects.tar", "tar"));
    assert!(files(&at.join("folder")) == files(&at.join("tar")));
    assert_eq!(names(&at.join("tar")), ["1-a.png", "2-b.png", "3-c.png", "4-t.png"]);
    for messages in [&from_folder, &from_tar] {
        assert_eq!(messages.matches("warning").count(), 1, "{messages}");
        assert!(messages.contains("../../wood.png"), "{messages}");
    }
    // Colours of the texture, in two pictures alike.
    let pixels = |name: &str| image::open(at.join("tar").join(name)).unwrap().into_rgb8();
    assert!(pixels("1-a.png") == pixels("2-b.png") && pixels("1-a.png") != pixels("3-c.png"));
    let wrote =
        |flags: &str| runs(&at, &format!("{} {flags}", line("objects.tar", "tar"))).matches("wrote ").count();
    assert_eq!(wrote("--resume"), 0);
    assert_eq!(wrote("--resume --allow-outside"), 4, "another setting");
    assert_eq!(wrote("--resume --ledger l --chunk 2/2"), 2);
    assert_eq!(wrote("--resume --ledger l --chunk 2/2"), 0);
    fs::write(at.join("list"), "objects.tar\n").unwrap();
    runs(&at, &format!("{} -q", line("@list", "from-list")));
    assert!(files(&at.join("from-list")) == files(&at.join("folder")));
    runs(&at, "info objects.tar/a/a.obj");
    fails(&at, &["render", "objects.tar/gone.obj"], 1, "no such file in the archive");
    fs::write(at.join("broken.tar"), "no archive").unwrap();
    refused(&at, "render broken.tar", "broken.tar: the tar file is malformed");
    let empty = blinn::output::ShardWriter::new(&at.join("empty.tar")).unwrap();
    empty.finish(blinn::output::Overwrite::No).unwrap();
    refused(&at, "render empty.tar", "empty.tar: a tar file without .gltf, .glb, .obj, .stl or .ply files");
}

/// 120 scenes, a fifth of them broken, large or slow, end alike on any number of threads, also after kills.
#[cfg(unix)]
#[test]
fn a_batch_of_all_kinds_of_scenes_ends_alike_on_any_number_of_threads() {
    let (_dir, at) = folder();
    for i in 0..120 {
        let file = at.join(format!("scenes/{i:03}.obj"));
        match i % 20 {
            3 => fs::write(&file, "v 0 0 0\nf 1 2 3\n").unwrap(),
            7 => fs::write(&file, [0xff; 100]).unwrap(),
            // Many triangles.
            11 => {
                let triangle = |k: usize| format!("v {k} 0 0\nv {k} 1 {}\nv 0 {k} 1\nf -3 -2 -1\n", k % 7);
                fs::write(&file, (0..5000).map(triangle).collect::<String>()).unwrap();
            }
            15 => fs::write(&file, "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap(),
            _ => write_triangle(&file, i),
        }
    }
    let line = |out: &str, threads: usize| {
        format!(
            "turntable scenes --views 2 --size 24x16 -s 4 --progress json --threads {threads} --resume \
             -o {out}/{{stem}}/#.png --ledger {out}.jsonl"
        )
    };
    let run = |out: &str, threads: usize| {
        let output = blinn(&at, &line(out, threads));
        let messages = String::from_utf8(output.stderr).unwrap().replace(out, "out");
        let is_fixed = |text: &&str| !text.contains("\"progress\"") && !text.contains("scenes: ");
        let messages: Vec<String> = messages.lines().filter(is_fixed).map(String::from).collect();
        (output.status.code(), messages)
    };
    let facts = |out: &str| {
        let mut lines = ledger(&at, &format!("{out}.jsonl"));
        for line in &mut lines {
            for field in ["seconds", "key", "files_version"] {
                line[field] = Value::Null;
            }
        }
        lines
    };
    let one = run("threads1", 1);
    assert_eq!((one.0, facts("threads1").len()), (Some(1), 120));
    for threads in [2, 7, 64] {
        let out = format!("threads{threads}");
        assert!(run(&out, threads) == one, "{threads} threads");
        assert!(files(&at.join(&out)) == files(&at.join("threads1")), "{threads} threads");
        assert!(facts(&out) == facts("threads1"), "{threads} threads");
        let out = format!("killed{threads}");
        kill_repeatedly(&at, &line(&out, threads));
        run(&out, threads);
        let (found, expected) = (files(&at.join(&out)), files(&at.join("threads1")));
        let names = found.keys().chain(expected.keys());
        let different: Vec<&String> = names.filter(|name| found.get(*name) != expected.get(*name)).collect();
        assert!(different.is_empty(), "{threads} threads, killed: {different:?}");
    }
}

/// A trace has the stages of all scenes, each within the time of its scene and on the thread that worked on it.
#[test]
fn a_trace_shows_the_stages_of_all_scenes() {
    let (_dir, at) = folder();
    write_objects(&at, 5);
    fs::remove_file(at.join("objects/1/broken.obj")).unwrap();
    let line =
        format!("turntable objects {SMALL} --views 2 -o out/{{stem}}/#.png --threads 2 --trace t/trace.json");
    runs(&at, &line);
    let trace: Value = serde_json::from_slice(&fs::read(at.join("t/trace.json")).unwrap()).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let end = |event: &Value| event["ts"].as_f64().unwrap() + event["dur"].as_f64().unwrap();
    for index in 1..=5 {
        let of_scene: Vec<&Value> = events.iter().filter(|event| event["args"]["index"] == index).collect();
        let named = |name: &str| of_scene.iter().filter(|event| event["name"] == name).count();
        assert_eq!((named("scene"), named("load"), named("render"), named("save")), (1, 1, 2, 2), "{trace}");
        let scene = of_scene.iter().find(|event| event["name"] == "scene").unwrap();
        for event in &of_scene {
            assert!(
                event["ts"].as_f64() >= scene["ts"].as_f64() && end(event) <= end(scene) + 1.0,
                "{event}"
            );
        }
    }
    refused(&at, &format!("{line} --report t/trace.json"), "would both be written to");
    refused(&at, "render objects/0/00.obj --watch --trace t.json", "--trace");
}

/// A line for each scene reports many files, and standard output has all paths if it is asked for.
#[test]
fn many_files_are_reported_by_scene() {
    let (_dir, at) = folder();
    let (cube, tower) = (model("tests/cube.obj"), model("tower/tower.glb"));
    let line = format!("turntable {cube} {tower} --count 26 --size 8x8 -s 1 -o out/{{stem}}/#.png");
    let output = blinn(&at, &format!("{line} --print-paths"));
    let (paths, messages) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    let lines: Vec<&str> = messages.lines().collect();
    assert_eq!(lines[..2], ["wrote 26 files to out/cube/", "wrote 26 files to out/tower/"], "{messages}");
    assert!(lines.len() == 3 && lines[2].starts_with("wrote 52 files in all, "), "{messages}");
    let mut printed: Vec<&str> = paths.lines().collect();
    printed.sort_unstable();
    assert_eq!(printed, names(&at));
    assert_eq!(runs(&at, &format!("{line} --verbose")).matches("wrote out/").count(), 52);
    let output = blinn(&at, &format!("{line} --only 3 --quiet --print-paths"));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "out/cube/3.png\nout/tower/3.png\n");
    assert!(output.stderr.is_empty());
    let output = blinn(&at, &format!("{line} --only 3 --quiet --print-paths=null"));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "out/cube/3.png\0out/tower/3.png\0");
    for out in ["-o -", "-o a.png --report -"] {
        refused(&at, &format!("render {cube} {out} --print-paths"), "--print-paths: standard output has");
    }
}

/// For several images a new name without an extension is a folder; for one it is a mistake.
#[test]
fn a_name_without_extension_is_a_folder_of_several_images() {
    let (_dir, at) = folder();
    let (cube, tower) = (model("tests/cube.obj"), model("tower/tower.glb"));
    runs(&at, &format!("render {cube} {tower} --size 8x8 -s 1 -o out"));
    runs(&at, &format!("turntable {cube} --count 2 --size 8x8 -s 1 -o turn/cube"));
    runs(&at, &format!("render {cube} {tower} --size 8x8 -s 1 -o by/{{index:03}}.png"));
    let expected = [
        "by/001.png",
        "by/002.png",
        "out/cube.png",
        "out/tower.png",
        "turn/cube/cube_0001.png",
        "turn/cube/cube_0002.png",
    ];
    assert_eq!(names(&at), expected);
    fs::write(at.join("file"), "text").unwrap();
    for line in [
        format!("render {cube} -o out2"),
        format!("render {cube} {tower} -o file"),
        format!("render {cube} {tower} -o {{stem}}"),
        format!("render {cube} {tower} -o out.pgn"),
    ] {
        refused(&at, &line, "unknown format");
    }
}
