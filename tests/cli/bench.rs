//! `blinn bench`: what it counts, writes, reads and compares; no test depends on timings.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::html::assert_even_tables;
use crate::common::program::{blinn, folder, model, names, refused, runs};

/// The smallest useful run.
const MINIMAL: &str = "--size 32x18 --rounds 2 --min-time 0.001 --threads 1 -q";

pub fn write(folder: &Path, name: &str, value: &Value) {
    fs::write(folder.join(name), value.to_string()).unwrap();
}

pub fn read_json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

/// Checks that it succeeds. Returns its output.
#[track_caller]
pub fn stdout_of(folder: &Path, line: &str) -> String {
    let output = blinn(folder, line);
    assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_results_file_holds_all_measurements() {
    let (_guard, folder) = folder();
    let line = format!(
        "bench {} {MINIMAL} --size 32x18,16x16 --threads 1,2 --json figures.json",
        model("still-life/still-life.glb")
    );
    let messages = stdout_of(&folder, &line.replace("--threads 1 ", "").replace("--size 32x18 ", ""));
    let figures = read_json(&folder.join("figures.json"));
    assert_eq!(figures["format"], "blinn bench 2");
    assert_eq!(figures["version"], env!("CARGO_PKG_VERSION"));
    let program = &figures["program"];
    assert_eq!(program["sha256"].as_str().unwrap().len(), 64);
    assert!(program["target"].as_str().unwrap().contains('-'), "{program}");
    assert!(program["rustc"].as_str().unwrap().starts_with("rustc 1."), "{program}");
    assert!(program["commit"].is_null() || program["commit"].as_str().unwrap().len() >= 7, "{program}");
    for key in ["cpu", "os", "simd"] {
        assert!(!figures["machine"][key].as_str().unwrap().is_empty(), "{key}");
    }
    assert!(figures["machine"]["cores"].as_u64().unwrap() >= 1);
    assert!(figures["machine"]["memory_bytes"].as_u64().unwrap() > 1 << 26);
    let settings = &figures["settings"];
    assert_eq!(settings["sizes"], json!([[32, 18], [16, 16]]));
    assert_eq!((&settings["samples"], &settings["rounds"]), (&json!(1), &json!(2)));
    assert_eq!(settings["threads"], json!([1, 2]));
    assert_eq!(settings["command"][0], "bench");
    let scene = &figures["scenes"][0];
    let info: Value = serde_json::from_str(&stdout_of(
        &folder,
        &format!("info --json {}", model("still-life/still-life.glb")),
    ))
    .unwrap();
    assert_eq!(scene["triangles"], info["triangles"]);
    let tree = &scene["tree"];
    assert!(tree["nodes"].as_u64().unwrap() > 10 && tree["entries"].as_u64().unwrap() > 100);
    assert!(tree["sah_cost"].as_f64().unwrap() > 1.0);
    let per_triangle = tree["bytes"].as_f64().unwrap() / tree["entries"].as_f64().unwrap();
    assert!((tree["bytes_per_triangle"].as_f64().unwrap() - per_triangle).abs() < 1e-9);
    let stages = scene["stages"].as_array().unwrap();
    let order: Vec<(u64, Value, &str)> = stages
        .iter()
        .map(|s| (s["threads"].as_u64().unwrap(), s["width"].clone(), s["stage"].as_str().unwrap()))
        .collect();
    let mut expected = Vec::new();
    for n in [1, 2] {
        expected.extend(["load", "build"].map(|stage| (n, Value::Null, stage)));
        for width in [16, 32] {
            expected.extend(
                RAYS.iter().chain(&["frame", "denoise", "encode"]).map(|stage| (n, json!(width), *stage)),
            );
        }
    }
    assert_eq!(order, expected);
    for s in stages {
        for rounds in ["seconds", "relative", "wall_seconds"] {
            let rounds = s[rounds].as_array().unwrap();
            assert!(rounds.len() == 2 && rounds.iter().all(|v| v.as_f64().unwrap() > 0.0), "{s}");
        }
        assert!((0.0..=1.0).contains(&s["waited"].as_f64().unwrap()), "{s}");
        // Waiting is subtracted, so the time by the clock is no less.
        let [walls, nets] = ["wall_seconds", "seconds"].map(|key| s[key].as_array().unwrap());
        let is_no_less = |(wall, net): (&Value, &Value)| wall.as_f64() >= net.as_f64();
        assert!(walls.iter().zip(nets).all(is_no_less), "{s}");
        assert_eq!(s["joules"].as_array().unwrap().len(), 2);
        // Where the system reports it.
        if cfg!(target_os = "linux") {
            let peaks = s["peak_bytes"].as_array().unwrap();
            assert!(peaks.len() == 2 && peaks.iter().all(|v| v.as_u64().unwrap() > 1 << 20), "{s}");
        }
        let stage = s["stage"].as_str().unwrap();
        assert_eq!(
            s["hash"].is_string(),
            RAYS.contains(&stage) || matches!(stage, "frame" | "denoise"),
            "{s}"
        );
        if !RAYS.contains(&stage) {
            assert!(s["rays"].is_null() && s["mrays_per_second"].is_null(), "{s}");
            continue;
        }
        let pixels = s["width"].as_u64().unwrap() * s["height"].as_u64().unwrap();
        let rays = if stage == "eye" { pixels..=pixels } else { 1..=pixels };
        assert!(rays.contains(&s["rays"].as_u64().unwrap()), "{s}");
        let rate = s["rays"].as_f64().unwrap() / s["median_seconds"].as_f64().unwrap() / 1e6;
        assert!((s["mrays_per_second"].as_f64().unwrap() / rate - 1.0).abs() < 1e-9, "{s}");
        let [nodes, blocks, triangles] =
            ["nodes", "blocks", "triangles"].map(|what| s[format!("{what}_per_ray")].as_f64().unwrap());
        assert!(nodes > 0.0 && blocks <= triangles && triangles <= 4.0 * blocks, "{s}");
    }
    // Hashes do not depend on the number of threads.
    let hashes = |threads: u64| -> Vec<&Value> {
        stages.iter().filter(|s| s["threads"] == threads).map(|s| &s["hash"]).collect()
    };
    assert_eq!(hashes(1), hashes(2));
    let find = |stage: &str| stages.iter().find(|s| s["stage"] == stage).unwrap();
    for stage in ["sun", "ao", "reflection", "bounce1"] {
        assert_eq!(find("shadow")["rays"], find(stage)["rays"], "{stage}");
    }
    // The table has all of it, in as many lines.
    let names = ["load ", "build ", "frame ", "denoise ", "encode "].into_iter().chain(RAYS);
    let names: Vec<&str> = names.collect();
    assert_eq!(
        messages.lines().filter(|line| names.iter().any(|s| line.starts_with(s))).count(),
        2 * (2 + 2 * 12),
        "{messages}"
    );
}

/// The stages that trace rays.
const RAYS: [&str; 9] =
    ["eye", "shadow", "sun", "ao", "reflection", "bounce1", "bounce2", "bounce3", "bounce4"];

/// Runs at different SIMD levels did the same work; a run of another scene under the same name did not.
#[test]
fn hashes_agree_across_simd_levels_and_differ_between_scenes() {
    let (_guard, folder) = folder();
    let scene = folder.join("scene.glb");
    let bench = |level: &str, file: &str, compare: &str| {
        let line = format!(
            "bench scene.glb --size 40x24 --rounds 1 --min-time 0.001 --threads 2 -q --json {file} {compare}"
        );
        std::process::Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line.split_whitespace())
            .current_dir(&folder)
            .env("BLINN_SIMD", level)
            .output()
            .unwrap()
    };
    fs::copy(model("still-life/still-life.glb"), &scene).unwrap();
    let first = bench("portable", "a.json", "");
    assert_eq!(first.status.code(), Some(0), "{}", String::from_utf8_lossy(&first.stderr));
    let same = bench("", "b.json", "--compare a.json");
    let messages = String::from_utf8_lossy(&same.stderr);
    assert_eq!(same.status.code(), Some(0), "{messages}");
    let [a, b] = ["a.json", "b.json"].map(|file| read_json(&folder.join(file)));
    let hashes = |results: &Value| -> Vec<Value> {
        results["scenes"][0]["stages"].as_array().unwrap().iter().map(|s| s["hash"].clone()).collect()
    };
    assert_eq!(hashes(&a), hashes(&b));
    // One hit differs.
    let mut other = a.clone();
    let stage = other["scenes"][0]["stages"].as_array_mut().unwrap();
    let stage = stage.iter_mut().find(|s| s["stage"] == "bounce2").unwrap();
    stage["hash"] = json!("00000000000000000000000000000000");
    write(&folder, "other.json", &other);
    let output = blinn(&folder, "bench --from b.json --compare other.json");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(
        messages.contains("scene.glb: bounce2, 40x24, 2 threads: hash 0000")
            && messages.contains("did different work"),
        "{messages}"
    );
}

#[test]
fn frames_show_points_and_lines() {
    let (_guard, folder) = folder();
    fs::write(folder.join("points.obj"), "v 0 0 0\nv 1 1 1\np 1 2\n").unwrap();
    fs::write(folder.join("line.obj"), "v 0 0 0\nv 1 1 1\nl 1 2\n").unwrap();
    stdout_of(&folder, &format!("bench points.obj line.obj {MINIMAL} --stages frame --json a.json"));
    let results = read_json(&folder.join("a.json"));
    let hash = |scene: usize| &results["scenes"][scene]["stages"][0]["hash"];
    assert!(hash(0).is_string() && hash(1).is_string() && hash(0) != hash(1), "{results}");
}

/// The measured memory of a small scene does not depend on a large one before it.
#[test]
#[cfg(target_os = "linux")]
fn peak_memory_does_not_depend_on_earlier_scenes() {
    let (_guard, folder) = folder();
    let (large, small) = (model("assembly/assembly.glb"), model("cornell/cornell.obj"));
    let encode = |scenes: &str| {
        stdout_of(&folder, &format!("bench {scenes} {MINIMAL} --json figures.json"));
        let figures = read_json(&folder.join("figures.json"));
        let scene = figures["scenes"].as_array().unwrap().last().unwrap();
        let stage = scene["stages"].as_array().unwrap().last().unwrap();
        stage["peak_bytes"][0].as_f64().unwrap()
    };
    let (alone, after) = (encode(&small), encode(&format!("{large} {small}")));
    assert!((after / alone - 1.0).abs() < 0.1, "{alone} alone, {after} after another");
}

#[test]
fn the_suite_measures_every_kind_and_removes_its_files() {
    let (_guard, folder) = folder();
    let temporary = folder.join("tmp");
    fs::create_dir(&temporary).unwrap();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(["bench", "--suite", "100", "--json", "a.json"])
        .args(["--size", "16x9", "--rounds", "1", "--min-time", "0.001", "--threads", "1"])
        .current_dir(&folder)
        .env("TMPDIR", &temporary)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let figures = read_json(&folder.join("a.json"));
    let names: Vec<&str> =
        figures["scenes"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    let kinds: Vec<&str> = names.iter().map(|name| name.split(' ').next().unwrap()).collect();
    assert_eq!(kinds, ["scan", "interior", "stadium", "forest", "slivers", "soup", "layers"]);
    // Kinds with a minimum size use it.
    assert_eq!(names[1], "interior 50k");
    assert!(fs::read_dir(&temporary).unwrap().next().is_none(), "scenes were left behind");
}

#[test]
fn the_report_is_self_contained() {
    let (_guard, folder) = folder();
    let cornell = model("cornell/cornell.obj");
    fs::write(folder.join("<b>&.obj"), fs::read(&cornell).unwrap()).unwrap();
    runs(&folder, &format!("bench <b>&.obj {MINIMAL} --report page/report.html --json a.json"));
    let page = fs::read_to_string(folder.join("page/report.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    for outside in ["http:", "https:", "src=\"/", "url(", "<script", "<link", "@import", "<b>&"] {
        let page = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("default-src 'none'") && page.contains("&lt;b&gt;&amp;.obj"));
    for part in
        ["id=\"stages\"", "id=\"rays\"", "id=\"steps\"", "id=\"figures\"", "data:image/png;base64,iVBOR"]
    {
        assert!(page.contains(part), "{part}");
    }
    // One thread count gives no scaling plot.
    assert!(!page.contains("id=\"threads\""));
    for shape in ["<svg", "<figure", "<table", "<text"] {
        let closing = shape.replace('<', "</");
        assert_eq!(page.matches(shape).count(), page.matches(&closing).count(), "{shape}");
    }
    assert!(assert_even_tables(&page) > 6);
    // Base64 images may contain any text.
    let without_pictures: Vec<&str> =
        page.split("data:image/png;base64,").map(|part| &part[part.find('"').unwrap_or(0)..]).collect();
    let numbers = without_pictures.concat();
    assert!(!numbers.contains("NaN") && !numbers.contains("inf\""), "numbers that are not finite");
}

#[test]
fn a_failing_scene_does_not_affect_the_others() {
    let (_guard, folder) = folder();
    fs::write(folder.join("bad.glb"), "no scene").unwrap();
    fs::write(folder.join("none.obj"), "v 0 0 0\n").unwrap();
    let triangle = model("tests/triangle.gltf");
    let output = blinn(&folder, &format!("bench bad.glb {triangle} none.obj {MINIMAL} --json a.json"));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(messages.matches("blinn: bad.glb").count(), 1, "{messages}");
    let figures = read_json(&folder.join("a.json"));
    let scenes = figures["scenes"].as_array().unwrap();
    assert!(scenes.iter().any(|s| s["name"] == triangle.as_str()), "{messages}");
    assert!(scenes.iter().all(|s| s["name"] != "bad.glb"));
    let alone = blinn(&folder, &format!("bench bad.glb {MINIMAL} --json b.json"));
    assert_eq!(alone.status.code(), Some(1));
    assert_eq!(names(&folder), ["a.json", "bad.glb", "none.obj"]);
    // A file that does not exist is known before anything is measured.
    let output =
        blinn(&folder, &format!("bench {triangle} absent.glb {MINIMAL} --json c.json").replace(" -q", ""));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("absent.glb") && !messages.contains("round 1"), "{messages}");
    assert!(!names(&folder).contains(&"c.json".to_string()));
}

/// Stages whose results are needed by others run, and are not measured.
#[test]
fn chosen_stages_alone_are_measured() {
    let (_guard, folder) = folder();
    let scene = model("tests/cube.obj");
    stdout_of(&folder, &format!("bench {scene} {MINIMAL} --stages ao,encode,bounce1 --json a.json"));
    stdout_of(&folder, &format!("bench {scene} {MINIMAL} --json b.json"));
    let stages =
        |file: &str| read_json(&folder.join(file))["scenes"][0]["stages"].as_array().unwrap().clone();
    let (few, all) = (stages("a.json"), stages("b.json"));
    let names: Vec<&Value> = few.iter().map(|stage| &stage["stage"]).collect();
    assert_eq!(names, ["ao", "bounce1", "encode"]);
    for stage in few {
        let same = all.iter().find(|other| other["stage"] == stage["stage"]).unwrap();
        assert_eq!((&stage["hash"], &stage["rays"]), (&same["hash"], &same["rays"]));
        assert!(!stage["peak_bytes"].as_array().unwrap().is_empty());
    }
    refused(&folder, &format!("bench {scene} --stages eye,rays"), "bounce4");
    // Names of other programs are aliases.
    stdout_of(&folder, &format!("bench {scene} {MINIMAL} --stages primary,ambient-occlusion --json c.json"));
    let names: Vec<Value> = stages("c.json").iter().map(|stage| stage["stage"].clone()).collect();
    assert_eq!(names, ["eye", "ao"]);
}
