//! Render farm jobs without a farm: the printed job, and its tasks run by a stand-in for the engine.
//! `.ci/farm.py` runs the real engines.

mod engines;

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::program::*;
use engines::*;

const SMALL: &str = "--size 32x18 -s 1";

/// The printed job, byte for byte. `GOLDEN=update` rewrites it; read the diff.
#[test]
fn a_small_job_matches_its_golden_file() {
    let (_dir, at) = folder();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    let work = format!("turntable cube.obj {SMALL} --count 12 --elevation 20 -o out/{{stem}}_##.png");
    for (name, line) in [
        ("turntable.json", format!("job openjd --chunk-size 5 {work}")),
        (
            "turntable.sh",
            format!("job slurm --chunk-size 5 --at-once 2 {work} --threads 2 --max-memory 1GiB"),
        ),
    ] {
        let output = blinn(&at, &line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/farm").join(name);
        if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
            fs::write(&golden, &output.stdout).unwrap();
        }
        let expected =
            fs::read_to_string(&golden).unwrap_or_else(|e| panic!("{name}: {e}; GOLDEN=update writes it"));
        assert_eq!(String::from_utf8(output.stdout).unwrap(), expected, "{name}");
    }
    assert_eq!(names(&at), ["cube.obj"], "nothing was rendered");
}

/// Tasks render the same pixels as one process: flags resolved for the whole job hold for each chunk.
#[test]
fn tasks_render_the_pixels_of_one_process() {
    let (_dir, at) = folder();
    for name in ["lecture/lecture.obj", "lecture/lecture.mtl", "lecture/view-1.xml", "figure/figure.glb"] {
        fs::copy(model(name), at.join(Path::new(name).file_name().unwrap())).unwrap();
    }
    fs::copy(model("tests/lights.glb"), at.join("lights.glb")).unwrap();
    fs::copy(model("tests/light-units/point_COMPAT.glb"), at.join("unitless.glb")).unwrap();
    fs::copy(model("cornell/cornell.glb"), at.join("cornell.glb")).unwrap();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    for (i, work) in [
        "turntable cube.obj --count 4",
        "turntable cube.obj --count 5 --only 2-4 --elevation -30 --zoom 1.7 --turn camera",
        "turntable cube.obj --count 3 --orbit 40,25 --projection orthographic --zoom 2",
        "turntable cube.obj --count 3 --camera-azimuth-angle 30 --yfov 20 --ground plane",
        "turntable lecture.obj --count 3 --camera-xml view-1.xml --light-radius .1",
        "turntable cornell.glb --count 3 --aov depth --view-point 0,1,3",
        "turntable lights.glb --count 3 --exposure auto",
        "turntable lights.glb --views 3",
        "turntable cube.obj --count 3 --hdri studio --background hdri --background-blur .4 --hdri-rotate 30",
        "render figure.glb --frames --fps 3",
        "render figure.glb --frames 7,1-5:2 --fps 6 --orbit 10,5",
        "render lights.glb --frames 1-3 --light-scale 300",
        "turntable unitless.glb --count 3 --ao 4 --light-scale .5",
    ]
    .iter()
    .enumerate()
    {
        runs(&at, &format!("{work} {SMALL} -q -o plain{i}/#.png"));
        let template =
            template(&at, &format!("job openjd --chunk-size 2 {work} {SMALL} -q -o farm{i}/#.png"));
        run_template(&at, &template);
        let (expected, made) = (pixels(&at.join(format!("plain{i}"))), pixels(&at.join(format!("farm{i}"))));
        assert!(expected.len() >= 3 && expected == made, "{work}: {expected:?} and {made:?}");
    }
}

/// Tasks select the cameras of a list by their numbers. The list, or the folder of a COLMAP model, is an input of the job.
#[test]
fn tasks_render_the_cameras_of_a_list() {
    let (_dir, at) = folder();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    runs(
        &at,
        "turntable cube.obj --views 5 --size 32x18 -s 1 --dataset nerf,colmap-bin -q -o set/images/#.png",
    );
    for (list, inputs) in [("set/images/transforms.json", "FILE"), ("set/sparse/0", "DIRECTORY")] {
        let name = |kind: &str| format!("{kind}-{inputs}");
        let work = format!("render cube.obj --cameras {list} -s 1 --only 1-3,5");
        runs(&at, &format!("{work} -q -o {}/{{camera}}.png", name("plain")));
        let job = format!("job openjd --chunk-size 2 {work} -q -o {}/{{camera}}.png", name("farm"));
        let template = template(&at, &job);
        let parameters = template["parameterDefinitions"].as_array().unwrap();
        let cameras = parameters.iter().find(|parameter| parameter["name"] == "Cameras").unwrap();
        assert_eq!((&cameras["objectType"], &cameras["default"]), (&inputs.into(), &list.into()));
        run_template(&at, &template);
        let (expected, made) = (pixels(&at.join(name("plain"))), pixels(&at.join(name("farm"))));
        assert!(expected.len() == 4 && expected == made, "{list}: {expected:?} and {made:?}");
        runs(
            &at,
            &format!("job slurm --chunk-size 2 -o job.sh {work} -q -o {}/{{camera}}.png", name("slurm")),
        );
        run_script(&at, "job.sh");
        assert!(pixels(&at.join(name("slurm"))) == expected, "{list}");
    }
    refused(&at, "render cube.obj --cameras set/sparse/0 --only 6", "--only 6: the cameras are 1 to 5");
    refused(&at, "render cube.obj --only 2", "--cameras");
}

/// File and folder names with characters that shells and templates treat specially.
#[test]
fn special_characters_in_names_are_quoted() {
    let (_dir, at) = folder();
    let odd = "it's $(touch x) `y` \"&\" {stem} ä%d\\;.glb";
    let folder = "a b's $HOME";
    fs::copy(model("tests/triangle.glb"), at.join(odd)).unwrap();
    let job = |engine: &str, out: &str, file: &str| {
        let out = format!("{out}/{folder}/{{stem}}.gif");
        let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
        command.args(["job", engine, "--chunk-size", "2", "-o", file, "turntable", "--count", "5"]);
        let output = command.args(SMALL.split(' ')).arg(odd).args(["-o", &out]).current_dir(&at).output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    job("openjd", "openjd", "job.json");
    let text = fs::read_to_string(at.join("job.json")).unwrap();
    run_template(&at, &serde_json::from_str(&text).unwrap());
    job("slurm", "slurm", "job.sh");
    let messages = run_script(&at, "job.sh");
    let made = odd.replace(".glb", ".gif");
    let mut whole = Command::new(env!("CARGO_BIN_EXE_blinn"));
    whole.args(["turntable", "--count", "5", "-q", "-o", "{stem}.gif"]).args(SMALL.split(' ')).arg(odd);
    assert!(whole.current_dir(&at).status().unwrap().success());
    let whole = fs::read(at.join(&made)).unwrap();
    for engine in ["openjd", "slurm"] {
        let file = at.join(engine).join(folder).join(&made);
        assert!(
            fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}: {messages}", file.display())) == whole,
            "{engine}"
        );
    }
    assert!(!at.join("x").exists(), "a shell read the name");
}

/// Calls of sbatch: the array job, then the dependent job, both with the user's own options.
#[cfg(unix)]
#[test]
fn a_script_submits_itself_and_its_assembly() {
    let (_dir, at) = folder();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    let work =
        format!("turntable cube.obj {SMALL} --count 7 -o spin.mp4 --fps 12 --encoder-quality 80 --loop once");
    runs(&at, &format!("job slurm --chunk-size 3 -o jobs/job.sh {work}"));
    let script = fs::read_to_string(at.join("jobs/job.sh")).unwrap();
    assert!(script.contains("\n#SBATCH --array=1-3%100\n#SBATCH --requeue\n"), "{script}");
    let asked = submit(&at, "jobs/job.sh", &["--partition=a b"]);
    let [frames, assembly] = &asked[..] else { panic!("{asked:?}") };
    assert_eq!(frames.words, ["--parsable", "--partition=a b", "./job.sh"]);
    let waits = ["--parsable", "--dependency=afterok:1", "--kill-on-invalid-dep=yes", "--partition=a b"];
    assert_eq!(assembly.words, waits);
    let text = assembly.script.replace('\'', "");
    assert!(text.contains("--fps=12 --loop=once --encoder-quality=80 --strict"), "{text}");
    // A job of frames without an animation needs no dependent job.
    runs(&at, &format!("job slurm -o frames.sh turntable cube.obj {SMALL} --count 7"));
    assert_eq!(submit(&at, "frames.sh", &[]).len(), 1);
}

#[test]
fn invalid_jobs_are_refused() {
    let (_dir, at) = folder();
    for name in ["cube.obj", "triangle.glb"] {
        fs::copy(model(&format!("tests/{name}")), at.join(name)).unwrap();
    }
    for (work, message) in [
        ("render cube.obj", "add --frames"),
        ("turntable cube.obj triangle.glb -o {stem}/#.png", "a job renders one scene, not 2"),
        ("turntable cube.obj --chunk 1/2", "--chunk: the farm distributes the frames"),
        ("turntable cube.obj --no-overwrite", "--no-overwrite: a task that runs again"),
        ("turntable cube.obj --report r.html", "--report: every task would write it"),
        ("turntable cube.obj --dry-run", "--dry-run: a job is only printed"),
        ("turntable cube.obj -o -", "standard output takes one image"),
        ("turntable cube.obj --count 0", "--count"),
        ("turntable cube.obj --nonsense", "--nonsense"),
        ("assemble cube.obj", "assemble"),
    ] {
        for engine in ["openjd", "slurm"] {
            refused(&at, &format!("job {engine} {work}"), message);
        }
    }
    refused(&at, "job openjd --at-once 3 turntable cube.obj", "--at-once");
    refused(&at, "job slurm --target-seconds 3 turntable cube.obj", "--target-seconds");
    refused(&at, "job slurm --chunk-size 0 turntable cube.obj", "--chunk-size");
    // Errors that depend on the scene.
    for (line, message) in [
        ("job openjd turntable missing.glb", "missing.glb"),
        ("job openjd turntable cube.obj -o {{stem}}#.png", "cannot contain double braces"),
        ("job slurm render cube.obj --frames 4-1:-1 -o a.gif", "in the order of frame numbers"),
    ] {
        let output = blinn(&at, line);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{line}: {messages}");
        assert!(messages.lines().last().is_some_and(|last| last.contains(message)), "{line}: {messages}");
    }
    let frames: Vec<String> = (0..400i64).map(|i| (i * i).to_string()).collect();
    let output = blinn(&at, &format!("job openjd render cube.obj --frames {}", frames.join(",")));
    assert!(String::from_utf8_lossy(&output.stderr).contains("split the job"));
}

/// A template refers to files beside it, and has parameters for the others.
#[test]
fn paths_outside_the_job_folder_have_no_default() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("jobs")).unwrap();
    for name in ["lecture.obj", "lecture.mtl"] {
        fs::copy(model(&format!("lecture/{name}")), at.join(name)).unwrap();
    }
    let line = format!("turntable lecture.obj {SMALL} --count 3 -o jobs/out/#.png");
    let messages = runs(&at, &format!("job openjd -o jobs/job.json {line}"));
    let scene = at.join("lecture.obj");
    assert!(
        messages.contains(&format!("submit the job with the parameter Scene={}", scene.display())),
        "{messages}"
    );
    let text = fs::read_to_string(at.join("jobs/job.json")).unwrap();
    let template: serde_json::Value = serde_json::from_str(&text).unwrap();
    let default = |name: &str| {
        let all = template["parameterDefinitions"].as_array().unwrap();
        let found = all.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{name}: {text}"));
        found.get("default").cloned()
    };
    assert_eq!((default("Scene"), default("SceneFolder")), (None, None));
    assert_eq!(default("Output"), Some("out".into()));
    // A scene of one file needs no folder parameter.
    fs::copy(model("tests/triangle.glb"), at.join("triangle.glb")).unwrap();
    let template = blinn(&at, &format!("job openjd turntable triangle.glb {SMALL}"));
    let text = String::from_utf8(template.stdout).unwrap();
    assert!(text.contains("\"triangle.glb\"") && !text.contains("SceneFolder"), "{text}");
}

/// Settings from a configuration file become flags of the tasks; aliases by their full names.
#[test]
fn options_of_a_config_file_reach_the_tasks() {
    let (_dir, at) = folder();
    fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    fs::write(at.join("c.toml"), "count = 4\nsamples = 2\nno-shadows = true\nexposure = 1\n").unwrap();
    let messages = |flags: &str| {
        let output = blinn(&at, &format!("job openjd turntable cube.obj --config c.toml {flags}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let text = messages("--resolution 16x9 -s 3");
    for expected in ["--count=4", "--samples=3", "--no-shadows", "--exposure=1", "--size=16x9", "\"1-4\""] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(!text.contains("--config") && !text.contains("--samples=2"), "{text}");
    assert!(messages("--print-config").contains("no-shadows = true"));
}

/// Several processes can write the same frames to one folder.
#[test]
fn several_processes_share_a_folder() {
    let (_dir, at) = folder();
    fs::copy(model("cornell/cornell.glb"), at.join("cornell.glb")).unwrap();
    let line = |out: &str| format!("turntable cornell.glb {SMALL} --count 6 --resume -q -o {out}/####.png");
    runs(&at, &line("whole"));
    let writers: Vec<_> = (0..4)
        .map(|_| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
            command.args(line("shared").split(' ')).current_dir(&at).spawn().unwrap()
        })
        .collect();
    for mut writer in writers {
        assert!(writer.wait().unwrap().success());
    }
    assert!(files(&at.join("shared")) == files(&at.join("whole")));
    // Empty chunks succeed.
    runs(&at, "turntable cornell.glb --count 3 --chunk 1/5 -q -o none/#.png");
    assert!(!at.join("none").exists());
}
