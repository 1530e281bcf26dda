//! Results files of `blinn bench`: what is compared, reported and refused.

use std::fs;

use serde_json::{Value, json};

use super::bench::{read_json, stdout_of, write};
use crate::common::html::assert_even_tables;
use crate::common::program::{blinn, folder, names, refused, runs};

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

#[test]
fn significant_changes_are_listed_and_are_errors_with_strict() {
    let (_guard, folder) = folder();
    for (name, factor) in [("old.json", 1.0), ("same.json", 1.02), ("slow.json", 1.5), ("fast.json", 0.5)] {
        write(&folder, name, &results_json(factor, &[1, 2]));
    }
    let same = stdout_of(&folder, "bench --from same.json --compare old.json --strict");
    assert!(same.contains("no change beyond the noise in 62 measurements"), "{same}");
    // The programs and the columns are explained.
    assert!(same.contains("blinn 0.1.0 in both runs\n") && same.contains("noise: the change that"), "{same}");
    let fast = stdout_of(&folder, "bench --from fast.json --compare old.json --strict");
    assert!(
        fast.contains("28 of 62 measurements changed")
            && fast.contains("  less: scan 70k: eye, 64x36, 2 threads 0.500"),
        "{fast}"
    );
    let slow = stdout_of(&folder, "bench --from slow.json --compare old.json");
    assert!(
        slow.contains("28 of 62 measurements changed")
            && slow.contains("  more: scan 10k: eye, 64x36, 1 thread 1.500"),
        "{slow}"
    );
    let strict = blinn(&folder, "bench --from slow.json --compare old.json --strict");
    let messages = String::from_utf8(strict.stderr).unwrap();
    assert_eq!(strict.status.code(), Some(1), "{messages}");
    assert!(
        messages.contains(
            "scan 10k: eye, 64x36, 1 thread is 1.50× the earlier value (an error because of --strict)"
        ),
        "{messages}"
    );
    // The report has it as well.
    runs(&folder, "bench --from slow.json --compare old.json --report page.html");
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    assert_even_tables(&page);
    for part in ["id=\"compared\"", "28 of 62 measurements changed", "id=\"threads\"", "id=\"rays\""] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("id=\"steps\""));
}

/// Results of several machines become one page and tables, with ratios to the first.
#[test]
fn several_machines_are_compared_in_one_report() {
    let (_guard, folder) = folder();
    for (name, factor) in [("desk.json", 1.0), ("laptop.json", 2.0), ("other.json", 0.5)] {
        let mut results = results_json(factor, &[1]);
        results["format"] = json!("blinn bench 2");
        for stage in results["scenes"][0]["stages"].as_array_mut().unwrap() {
            stage["hash"] = json!("0123456789abcdef0123456789abcdef");
        }
        write(&folder, name, &results);
    }
    let line = "bench --from desk.json laptop.json other.json";
    let text = stdout_of(&folder, &format!("{line} --report page.html --markdown tables.md"));
    assert!(text.contains("time / desk") && text.contains("2.00 [1.96, 2.04]"), "{text}");
    let [page, markdown] =
        ["page.html", "tables.md"].map(|file| fs::read_to_string(folder.join(file)).unwrap());
    assert_even_tables(&page);
    assert!(page.contains("they did the same work") && !page.contains("http:"), "{page}");
    assert!(
        markdown.contains("| stage | pixels | threads | desk | laptop | time / desk | other |"),
        "{markdown}"
    );
    for label in ["desk", "laptop", "other"] {
        assert!(page.contains(label) && markdown.contains(label), "{label}");
    }
    // A machine with another hit.
    let mut wrong = read_json(&folder.join("other.json"));
    wrong["scenes"][0]["stages"][2]["hash"] = json!("ffffffffffffffffffffffffffffffff");
    write(&folder, "other.json", &wrong);
    let output = blinn(&folder, line);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(messages.matches("did different work").count(), 1, "{messages}");
    assert!(
        messages.contains("scan 10k: eye, 1 thread: hash 0123") && messages.contains("of other"),
        "{messages}"
    );
    refused(&folder, &format!("{line} --compare desk.json"), "--compare takes the results of one run");
    refused(&folder, &format!("{line} --json a.json"), "--json takes the results of one run");
    refused(&folder, &format!("{line} --csv a.csv"), "--csv takes the results of one run");
    // One run has tables, too.
    runs(&folder, "bench --from desk.json --markdown one.md --csv one.csv");
    let csv = fs::read_to_string(folder.join("one.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 7);
    assert!(csv.lines().all(|line| line.matches(',').count() == 19), "{csv}");
    let one = fs::read_to_string(folder.join("one.md")).unwrap();
    assert!(
        one.contains("## scan 10k, 10000 triangles") && one.contains("| load | – | 1 | 1.00 s |"),
        "{one}"
    );
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
        assert!(
            messages.contains("scan 10k: shadow, 64x36") || messages.contains("scan 10k: frame, 64x36"),
            "{messages}"
        );
        let page = fs::read_to_string(folder.join("page.html")).unwrap();
        assert!(!page.contains("NaN") && !page.contains("\"inf"), "{line}");
        // Version 1 becomes version 2.
        let again = read_json(&folder.join("again.json"));
        assert_eq!(
            (&again["format"], &again["settings"]["sizes"]),
            (&json!("blinn bench 2"), &json!([[64, 36]]))
        );
        let stages = again["scenes"][0]["stages"].as_array().unwrap();
        let stage = |name: &str| stages.iter().find(|s| s["stage"] == name && s["threads"] == 1).unwrap();
        assert_eq!((&stage("bounce1")["width"], &stage("load")["width"]), (&json!(64), &Value::Null));
    }
    let nothing =
        json!({"format": "blinn bench 1", "version": "0", "machine": {}, "settings": {}, "scenes": []});
    write(&folder, "nothing.json", &nothing);
    stdout_of(&folder, "bench --from nothing.json --report page.html");
    let output = blinn(&folder, "bench --from nothing.json --compare nothing.json --report page.html");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && messages.contains("no measurement in common"), "{messages}");
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
    write(&folder, "later.json", &json!({"format": "blinn bench 3"}));
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
        ("later.json", "'blinn bench 3'"),
        ("wrong.json", "scenes[1].stages[3].seconds"),
        ("absent.json", "No such file"),
    ] {
        refused(&folder, &format!("bench scene.glb --compare {file}"), message);
        refused(&folder, &format!("bench --from {file}"), file);
    }
    refused(&folder, "bench", "name scene files, or --suite");
    refused(&folder, "bench --suite 70q", "70q");
    refused(&folder, "bench --suite=0", "not a number of triangles");
    refused(&folder, "bench a.glb --rounds 0", "0");
    refused(&folder, "bench a.glb --min-time 0", "0");
    refused(&folder, "bench a.glb --threads 1,0", "0");
    refused(&folder, "bench a.glb --from cut.json", "cannot be used with");
}

/// A flag with the extension of another one's format is a mistake.
#[test]
fn extensions_of_other_formats_are_refused() {
    let (_guard, folder) = folder();
    write(&folder, "old.json", &results_json(1.0, &[1]));
    for (flag, file, right) in [
        ("--json", "a.csv", "--csv"),
        ("--csv", "a.json", "--json"),
        ("--report", "a.md", "--markdown"),
        ("--markdown", "a.HTML", "--report"),
    ] {
        let message = format!("{flag}: {file} has the extension of {right}; use {right}");
        refused(&folder, &format!("bench --from old.json {flag} {file}"), &message);
    }
    assert_eq!(names(&folder), ["old.json"]);
    runs(&folder, "bench --from old.json --json a.txt --csv b.txt -q");
}

/// Results come from pipes as well: `--compare <(ssh desk cat old.json)`.
#[test]
#[cfg(unix)]
fn results_are_read_from_pipes() {
    let (_guard, folder) = folder();
    write(&folder, "old.json", &results_json(1.0, &[1]));
    let program = env!("CARGO_BIN_EXE_blinn");
    let line = format!("{program} bench --from <(cat old.json) --compare <(cat old.json)");
    let output =
        std::process::Command::new("bash").args(["-c", &line]).current_dir(&folder).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("no change beyond the noise"), "{text}");
}
