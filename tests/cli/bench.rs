//! `blinn bench`: what it counts, writes, reads and compares; no test depends on timings.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::program::{blinn, files, folder, model, names, refused, runs};

/// The smallest useful run.
const MINIMAL: &str = "--size 32x18 --rounds 2 --threads 1 -q";

fn read_json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

/// Checks that it succeeds. Returns its output.
#[track_caller]
fn stdout_of(folder: &Path, line: &str) -> String {
    let output = blinn(folder, line);
    assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_results_file_holds_all_measurements() {
    let (_guard, folder) = folder();
    let line =
        format!("bench {} {MINIMAL} --threads 1,2 --json figures.json", model("still-life/still-life.glb"));
    let messages = stdout_of(&folder, &line.replace("--threads 1 ", ""));
    let figures = read_json(&folder.join("figures.json"));
    assert_eq!(figures["format"], "blinn bench 1");
    assert_eq!(figures["version"], env!("CARGO_PKG_VERSION"));
    for key in ["cpu", "os", "simd"] {
        assert!(!figures["machine"][key].as_str().unwrap().is_empty(), "{key}");
    }
    assert!(figures["machine"]["cores"].as_u64().unwrap() >= 1);
    assert!(figures["machine"]["memory_bytes"].as_u64().unwrap() > 1 << 26);
    let settings = &figures["settings"];
    assert_eq!(
        [&settings["width"], &settings["height"], &settings["samples"], &settings["rounds"]],
        [32, 18, 1, 2].map(|n| json!(n)).each_ref()
    );
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
    let order: Vec<(u64, &str)> =
        stages.iter().map(|s| (s["threads"].as_u64().unwrap(), s["stage"].as_str().unwrap())).collect();
    let once = ["load", "build", "eye", "shadow", "incoherent", "frame", "encode"];
    assert_eq!(order, [1, 2].iter().flat_map(|&n| once.map(|s| (n, s))).collect::<Vec<_>>());
    for s in stages {
        for rounds in ["seconds", "relative"] {
            let rounds = s[rounds].as_array().unwrap();
            assert!(rounds.len() == 2 && rounds.iter().all(|v| v.as_f64().unwrap() > 0.0), "{s}");
        }
        assert!((0.0..=1.0).contains(&s["waited"].as_f64().unwrap()), "{s}");
        // Where the system reports it.
        if cfg!(target_os = "linux") {
            let peaks = s["peak_bytes"].as_array().unwrap();
            assert!(peaks.len() == 2 && peaks.iter().all(|v| v.as_u64().unwrap() > 1 << 20), "{s}");
        }
        let rays = match s["stage"].as_str().unwrap() {
            "eye" => 32 * 18..=32 * 18,
            "shadow" | "incoherent" => 1..=32 * 18,
            _ => {
                assert!(s["rays"].is_null() && s["mrays_per_second"].is_null(), "{s}");
                continue;
            }
        };
        assert!(rays.contains(&s["rays"].as_u64().unwrap()), "{s}");
        let rate = s["rays"].as_f64().unwrap() / s["median_seconds"].as_f64().unwrap() / 1e6;
        assert!((s["mrays_per_second"].as_f64().unwrap() / rate - 1.0).abs() < 1e-9, "{s}");
    }
    let find = |stage: &str| stages.iter().find(|s| s["stage"] == stage).unwrap();
    assert_eq!(find("shadow")["rays"], find("incoherent")["rays"]);
    // The table has all of it, in as many lines.
    assert_eq!(
        messages.lines().filter(|line| once.iter().any(|s| line.starts_with(s))).count(),
        14,
        "{messages}"
    );
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
        .args(["--size", "16x9", "--rounds", "1", "--threads", "1"])
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
    // Base64 images may contain any text.
    let without_pictures: Vec<&str> =
        page.split("data:image/png;base64,").map(|part| &part[part.find('"').unwrap_or(0)..]).collect();
    let numbers = without_pictures.concat();
    assert!(!numbers.contains("NaN") && !numbers.contains("inf\""), "numbers that are not finite");
}

/// Figures of an earlier run.
fn results_json(factor: f64, threads: &[u32]) -> Value {
    let stages = |threads: u32| {
        ["load", "build", "eye", "shadow", "incoherent", "frame", "encode"].map(|stage| {
            let rays = matches!(stage, "eye" | "shadow" | "incoherent").then_some(1000);
            let rounds = [0.99, 1.0, 1.01].map(|v| v * factor);
            json!({"stage": stage, "threads": threads, "rays": rays, "seconds": rounds, "relative": rounds,
                "peak_bytes": [1 << 25, 1 << 25, 1 << 25], "waited": 0.25})
        })
    };
    let stages: Vec<Value> = threads.iter().flat_map(|&n| stages(n)).collect();
    let scene = |name: &str, triangles: u64| {
        json!({"name": name, "triangles": triangles, "stages": stages,
            "tree": {"nodes": 10, "entries": triangles, "bytes": 1000, "bytes_per_triangle": 0.1, "sah_cost": 9.5}})
    };
    json!({"format": "blinn bench 1", "version": "0.1.0", "unix_time": 1_700_000_000,
        "machine": {"cpu": "a processor", "cores": 2, "memory_bytes": 1u64 << 33, "os": "a system"},
        "settings": {"command": ["bench"], "width": 64, "height": 36, "samples": 1, "rounds": 3,
            "threads": threads, "simd": "avx2", "calibration": 1},
        "scenes": [scene("scan 10k", 10_000), scene("scan 70k", 70_000)]})
}

fn write(folder: &Path, name: &str, value: &Value) {
    fs::write(folder.join(name), value.to_string()).unwrap();
}

#[test]
fn significant_changes_are_listed_and_are_errors_with_strict() {
    let (_guard, folder) = folder();
    for (name, factor) in [("old.json", 1.0), ("same.json", 1.02), ("slow.json", 1.5), ("fast.json", 0.5)] {
        write(&folder, name, &results_json(factor, &[1, 2]));
    }
    let same = stdout_of(&folder, "bench --from same.json --compare old.json --strict");
    assert!(same.contains("no change beyond the noise in 62 measurements"), "{same}");
    let fast = stdout_of(&folder, "bench --from fast.json --compare old.json --strict");
    assert!(
        fast.contains("28 of 62 measurements changed")
            && fast.contains("  less: scan 70k: eye, 2 threads 0.500"),
        "{fast}"
    );
    let slow = stdout_of(&folder, "bench --from slow.json --compare old.json");
    assert!(
        slow.contains("28 of 62 measurements changed")
            && slow.contains("  more: scan 10k: eye, 1 thread 1.500"),
        "{slow}"
    );
    let strict = blinn(&folder, "bench --from slow.json --compare old.json --strict");
    let messages = String::from_utf8(strict.stderr).unwrap();
    assert_eq!(strict.status.code(), Some(1), "{messages}");
    assert!(
        messages
            .contains("scan 10k: eye, 1 thread is 1.50× the earlier value (an error because of --strict)"),
        "{messages}"
    );
    // The report has it as well.
    runs(&folder, "bench --from slow.json --compare old.json --report page.html");
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    for part in ["id=\"compared\"", "28 of 62 measurements changed", "id=\"threads\"", "id=\"rays\""] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("id=\"steps\""));
}

#[test]
fn missing_and_invalid_results_are_skipped() {
    let (_guard, folder) = folder();
    write(&folder, "old.json", &results_json(1.0, &[1]));
    let mut sparse = results_json(1.0, &[1, 2]);
    let stages = &mut sparse["scenes"][0]["stages"];
    stages[0] = json!({"stage": "load", "threads": 1});
    stages[1]["relative"] = json!([null, 1e308, -5.0]);
    stages[1]["seconds"] = json!([1e308, 1e308, null]);
    stages[2]["relative"] = json!([1e-308, 0.0]);
    stages[2]["seconds"] = json!([0.0]);
    stages[3]["threads"] = json!(4_000_000_000u32);
    stages[4]["peak_bytes"] = json!([null]);
    stages[5]["unheard"] = json!({"of": []});
    sparse["scenes"][1] = json!({"name": "empty"});
    sparse["machine"] = json!({});
    sparse["unix_time"] = json!(u64::MAX);
    write(&folder, "sparse.json", &sparse);
    for line in ["--from sparse.json --compare old.json", "--from old.json --compare sparse.json"] {
        let messages = stdout_of(&folder, &format!("bench {line} --report page.html --json again.json"));
        assert!(messages.contains("scan 10k: shadow") || messages.contains("scan 10k: frame"), "{messages}");
        let page = fs::read_to_string(folder.join("page.html")).unwrap();
        assert!(!page.contains("NaN") && !page.contains("\"inf"), "{line}");
        assert_eq!(read_json(&folder.join("again.json"))["format"], "blinn bench 1");
    }
    let nothing =
        json!({"format": "blinn bench 1", "version": "0", "machine": {}, "settings": {}, "scenes": []});
    write(&folder, "nothing.json", &nothing);
    stdout_of(&folder, "bench --from nothing.json --compare nothing.json --report page.html");
}

#[test]
fn invalid_results_files_are_errors_before_measuring() {
    let (_guard, folder) = folder();
    let whole = results_json(1.0, &[1]).to_string();
    fs::write(folder.join("cut.json"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("empty.json"), "").unwrap();
    fs::write(folder.join("binary.json"), [0u8, 255, 17]).unwrap();
    write(&folder, "foreign.json", &json!({"benchmarks": [1, 2, 3]}));
    write(&folder, "list.json", &json!([1]));
    write(&folder, "later.json", &json!({"format": "blinn bench 2"}));
    let mut wrong = results_json(1.0, &[1]);
    wrong["scenes"][1]["stages"][3]["seconds"] = json!("fast");
    write(&folder, "wrong.json", &wrong);
    fs::write(folder.join("deep.json"), "[".repeat(100_000)).unwrap();
    for (file, message) in [
        ("cut.json", "damaged"),
        ("empty.json", "damaged"),
        ("binary.json", "damaged"),
        ("deep.json", "not a results file of 'blinn bench'"),
        ("foreign.json", "not a results file of 'blinn bench'"),
        ("list.json", "not a results file of 'blinn bench'"),
        ("later.json", "'blinn bench 2'"),
        ("wrong.json", "scenes[1].stages[3].seconds"),
        ("absent.json", "No such file"),
    ] {
        refused(&folder, &format!("bench scene.glb --compare {file}"), message);
        refused(&folder, &format!("bench --from {file}"), file);
    }
    refused(&folder, "bench", "arguments were not provided: <SCENE>");
    refused(&folder, "bench --suite 70q", "70q");
    refused(&folder, "bench --suite=0", "not a number of triangles");
    refused(&folder, "bench a.glb --rounds 0", "0");
    refused(&folder, "bench a.glb --threads 1,0", "0");
    refused(&folder, "bench a.glb --from cut.json", "cannot be used with");
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
}

#[test]
fn a_heat_map_is_an_aov_layer() {
    let (_guard, folder) = folder();
    let scene = model("cornell/cornell.obj");
    runs(&folder, &format!("render {scene} -o a.png --size 48x27 -s 1 --heatmap steps"));
    runs(
        &folder,
        &format!("render {scene} -o b.png --size 48x27 -s 1 --aov steps --heatmap steps --threads 1"),
    );
    let all = files(&folder);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["a.png", "a.steps.png", "b.png", "b.steps.png"]);
    assert!(all["a.steps.png"] == all["b.steps.png"] && all["a.png"] == all["b.png"]);
    let shown = image::open(folder.join("a.steps.png")).unwrap().to_rgb8();
    let mut colors: Vec<_> = shown.pixels().collect();
    colors.sort_by_key(|p| p.0);
    colors.dedup();
    assert!(colors.len() > 4, "{} colours", colors.len());
    refused(&folder, &format!("render {scene} --heatmap time"), "steps");
}
