//! `blinn bench --trace-bound`: bounds of the speed-up from files of `--trace`.

use std::fs;

use serde_json::{Value, json};

use crate::bench::{read_json, stdout_of};
use crate::common::html::assert_even_tables;
use crate::common::program::{folder, model, refused, runs};

/// Traces of one and of two threads give bounds of the speed-up, as text, JSON, Markdown and a page.
#[test]
fn traces_bound_the_speed_up() {
    let (_guard, folder) = folder();
    let cube = model("tests/cube.obj");
    for threads in [1, 2] {
        let line = format!("turntable {cube} --count 4 --size 8x8 -o out/#.png --threads {threads}");
        runs(&folder, &format!("{line} --trace {threads}.json"));
    }
    let line = "bench --trace-bound 1.json 2.json --json b.json --markdown b.md --report b.html -q";
    let text = stdout_of(&folder, line);
    assert!(text.contains("Work and critical path") && text.contains("at least"), "{text}");
    let bound = read_json(&folder.join("b.json"));
    assert_eq!((&bound["format"], &bound["threads"]), (&json!("blinn trace bound 1"), &json!([1, 2])));
    assert_eq!(bound["longest_scene"], json!(cube));
    let cores: Vec<&Value> = bound["speed_ups"].as_array().unwrap().iter().map(|s| &s["cores"]).collect();
    assert_eq!(cores, [2, 4, 8, 16, 32]);
    assert!(fs::read_to_string(folder.join("b.md")).unwrap().contains("| cores | at least | at most |"));
    assert!(assert_even_tables(&fs::read_to_string(folder.join("b.html")).unwrap()) >= 17);
    runs(&folder, "bench --trace-bound 1.json 2.json --csv b.csv -q");
    let csv = fs::read_to_string(folder.join("b.csv")).unwrap();
    assert!(csv.starts_with("quantity,stage,cores,least,most\r\nwork_seconds,,,"), "{csv}");
    let stages = bound["stages"].as_array().unwrap().len();
    assert_eq!(csv.lines().count(), 1 + 3 + 3 * stages + 5, "{csv}");
    let last: Vec<&str> = csv.lines().last().unwrap().split(',').collect();
    assert_eq!(last[..3], ["speed_up", "", "32"]);
    for (cell, key) in last[3..].iter().zip(["at_least", "at_most"]) {
        assert_eq!(cell.parse().ok(), bound["speed_ups"][4][key].as_f64(), "{key}");
    }
    refused(&folder, "bench --trace-bound 2.json", "--threads 1");
    refused(&folder, "bench --trace-bound b.json", "not a trace of this version of blinn");
    refused(&folder, "bench --trace-bound 1.json --json 1.json", "1.json");
    refused(&folder, "bench --trace-bound 1.json --rounds 2", "cannot be used with");
    runs(&folder, &format!("turntable {cube} --count 3 --size 8x8 -o out/#.png --threads 2 --trace 3.json"));
    refused(&folder, "bench --trace-bound 1.json 3.json", "different scenes, frames or stages");
}
