//! .blend files, converted by programs that stand for Blender.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::common::program::*;

const BLEND: &[u8] = b"BLENDER-v405 and more";

/// The part of a program that reads its arguments, notes the run, and knows `$input`, `$output` and `$report`.
const ARGUMENTS: &str = r#"
printf '%s\n' "$*" >> "$HERE/runs"
while [ $# -gt 0 ]; do
    case $1 in
        --input) input=$2 ;;
        --output) output=$2 ;;
        --report) report=$2 ;;
        --end-with-input) printf '%s\n' "$2" > "$HERE/work" ;;
    esac
    shift
done
"#;

/// A folder with a .blend file, programs, a cache and a folder for temporary files.
struct Bench {
    _dir: tempfile::TempDir,
    path: PathBuf,
}

impl Bench {
    fn new() -> Bench {
        let (dir, path) = folder();
        for name in ["bin", "tmp"] {
            fs::create_dir(path.join(name)).unwrap();
        }
        fs::write(path.join("scene.blend"), BLEND).unwrap();
        fs::copy(model("cornell/cornell.glb"), path.join("bin/converted")).unwrap();
        Bench { _dir: dir, path }
    }

    /// Writes a program that prints `version` for `--version`, and else runs `script`.
    fn program(&self, name: &str, version: &str, script: &str) -> PathBuf {
        let path = self.path.join("bin").join(name);
        let text = format!(
            "#!/bin/sh\nPATH=/usr/bin:/bin HERE='{}'\nif [ \"$1\" = --version ]; then echo '{version}'; exit; fi\n{script}\n",
            self.path.display()
        );
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    /// Writes a Blender that converts each file to the same scene, and adds `more`.
    fn converter(&self, version: &str, more: &str) -> PathBuf {
        let convert = format!("{ARGUMENTS}cp \"$HERE/bin/converted\" \"$output\"\n{more}");
        self.program("blender", version, &convert)
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
        command.args(line.split_whitespace()).current_dir(&self.path);
        command.env("PATH", self.path.join("bin")).env_remove("BLINN_BLENDER");
        command.env("BLINN_CACHE", self.path.join("cache")).env("TMPDIR", self.path.join("tmp"));
        command
    }

    fn run(&self, line: &str) -> Output {
        self.command(line).output().unwrap()
    }

    /// Runs without error. Returns the messages.
    #[track_caller]
    fn runs(&self, line: &str) -> String {
        let output = self.run(line);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{line}: {messages}");
        messages
    }

    /// Fails with one line that contains `message`, and leaves nothing in the cache and in the folder for temporary files.
    #[track_caller]
    fn fails(&self, line: &str, message: &str) {
        let output = self.run(line);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{line}: {messages}");
        assert!(messages.lines().count() == 1 && messages.contains(message), "{messages}");
        self.assert_nothing_left();
    }

    #[track_caller]
    fn assert_nothing_left(&self) {
        let left = |name: &str| fs::read_dir(self.path.join(name)).map_or(0, Iterator::count);
        assert_eq!((left("tmp"), left("cache/blend")), (0, 0));
    }

    /// The command lines of conversions.
    fn conversions(&self) -> Vec<String> {
        let runs = fs::read_to_string(self.path.join("runs")).unwrap_or_default();
        runs.lines().map(String::from).collect()
    }
}

const RENDER: &str = "render scene.blend -o a.png --size 32x18 -s 1 --progress none";

#[test]
fn a_blend_file_renders_as_the_file_that_it_converts_to() {
    let bench = Bench::new();
    bench.converter("Blender 4.5.3 LTS", "");
    bench.runs(RENDER);
    fs::copy(bench.path.join("bin/converted"), bench.path.join("scene.glb")).unwrap();
    bench.runs("render scene.glb -o b.png --size 32x18 -s 1 --progress none");
    // Files also hold the name of the scene.
    let pixels = |name: &str| image::open(bench.path.join(name)).unwrap().to_rgba8();
    assert!(pixels("a.png") == pixels("b.png"));
    let line = &bench.conversions()[0];
    for argument in ["--background", "--factory-startup", "--disable-autoexec", "scene.blend --output"] {
        assert!(line.contains(argument), "{line}");
    }
    assert_eq!(fs::read_dir(bench.path.join("tmp")).unwrap().count(), 0);
}

#[test]
fn every_command_takes_blend_files() {
    let bench = Bench::new();
    bench.converter("Blender 4.5.3", "");
    let output = bench.run("info scene.blend --json");
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(info["file"] == "scene.blend" && info["triangles"].as_u64() > Some(0), "{info}");
    bench.runs("turntable scene.blend -o turn/ --count 2 --size 16x16 -s 1 --progress none");
    bench.runs("sheet scene.blend -o sheet.png --size 128x128 -s 1");
    bench.runs("diff scene.blend scene.blend");
    bench.runs("bench scene.blend --size 16x16 --rounds 1 --min-time 0.01 --threads 1 --json times.json");
    bench.runs("rays scene.blend --dump rays.npz --size 16x16");
    assert_eq!(bench.conversions().len(), 1, "the others are from the cache");
}

#[test]
fn conversions_are_made_again_when_something_changes() {
    let bench = Bench::new();
    let linked = bench.path.join("linked.png");
    fs::write(&linked, "1").unwrap();
    let report = format!("printf 'file {}\\nwarning it lost a sky\\n' > \"$report\"", linked.display());
    bench.converter("Blender 4.5.3", &report);
    let mut expected = 0;
    let mut check = |line: &str, is_new: bool| {
        let messages = bench.runs(line);
        assert!(messages.contains("it lost a sky"), "{messages}");
        expected += usize::from(is_new);
        assert_eq!(bench.conversions().len(), expected, "{line}");
    };
    check(RENDER, true);
    check(RENDER, false);
    fs::write(&linked, "2").unwrap();
    check(RENDER, true);
    check(RENDER, false);
    check(&format!("{RENDER} --scene other"), true);
    check(&format!("{RENDER} --bake auto"), true);
    check(&format!("{RENDER} --bake auto --bake-size 256"), true);
    check(&format!("{RENDER} --bake auto --bake-size 256"), false);
    fs::write(bench.path.join("scene.blend"), [BLEND, b"!"].concat()).unwrap();
    check(RENDER, true);
    bench.converter("Blender 4.5.4", &report);
    check(RENDER, true);
    let off = bench.command(RENDER).env("BLINN_CACHE", "off").output().unwrap();
    assert!(off.status.success());
    let lines = bench.conversions();
    assert_eq!(lines.len(), expected + 1);
    assert_eq!(lines.iter().filter(|line| line.contains("--bake auto")).count(), 2);
    assert_eq!(lines.iter().filter(|line| line.contains("--bake-size 256")).count(), 1);
}

#[test]
fn resumed_batches_follow_the_blend_file_and_what_it_links() {
    let bench = Bench::new();
    fs::write(bench.path.join("linked.png"), "1").unwrap();
    let linked = format!("printf 'file %s\\n' \"{}/linked.png\" > \"$report\"", bench.path.display());
    bench.converter("Blender 4.5.3", &linked);
    let resume = format!("{RENDER} --resume");
    let time = || fs::metadata(bench.path.join("a.png")).unwrap().modified().unwrap();
    bench.runs(&resume);
    let first = time();
    bench.runs(&resume);
    assert_eq!(time(), first);
    fs::write(bench.path.join("linked.png"), "2").unwrap();
    bench.runs(&resume);
    assert!(time() > first);
}

#[test]
fn the_newest_blender_is_preferred_and_a_named_one_wins() {
    let bench = Bench::new();
    bench.converter("Blender 4.5.3", "");
    let convert = |name: &str| {
        format!("{ARGUMENTS}cp \"$HERE/bin/converted\" \"$output\"; echo {name} >> \"$HERE/used\"")
    };
    let python = |version: &str, name: &str| {
        let asked = format!("if [ \"$1\" = -c ]; then echo Module {version}; exit; fi\n{}", convert(name));
        bench.program(name, "Python 3.11.2", &asked)
    };
    python("5.0.1", "python3");
    let old = python("4.2.0", "old-python");
    bench.runs(RENDER);
    assert!(bench.conversions().last().is_some_and(|line| line.contains("convert.py --input")));
    bench.runs(&format!("{RENDER} --blender {}", old.display()));
    let variable =
        bench.command(RENDER).env("BLINN_BLENDER", &old).env("BLINN_CACHE", "off").output().unwrap();
    assert!(variable.status.success());
    assert_eq!(fs::read_to_string(bench.path.join("used")).unwrap(), "python3\nold-python\nold-python\n");
}

#[test]
fn without_blender_one_line_says_what_to_do() {
    let bench = Bench::new();
    let empty = |line: &str| {
        let output = bench.command(line).env("PATH", bench.path.join("tmp")).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for line in [RENDER, "info scene.blend"] {
        let (code, messages) = empty(line);
        assert!(code == Some(1) && messages.lines().count() == 1, "{messages}");
        assert!(
            messages.contains("needs Blender 4.2 or later") && messages.contains("export the file as .glb")
        );
    }
    let plain = bench.program("plain", "Python 3.11.2", "");
    let other = bench.program("other", "GNU bash", "");
    let old = bench.program("old", "Blender 3.6.1", "");
    for (program, message) in [
        (plain.as_path(), "has no module bpy"),
        (&other, "neither Blender nor a Python"),
        (&old, "it is Blender 3.6.1; name Blender 4.2 or later"),
        (Path::new("gone"), "there is no such program"),
        (&bench.path.join("tmp"), "it cannot be started"),
    ] {
        bench.fails(&format!("{RENDER} --blender {}", program.display()), message);
    }
    bench.program("blender", "Blender 3.6.1", "");
    bench.fails(RENDER, "the newest on PATH is 3.6.1");
}

#[test]
fn failures_of_blender_are_one_line_and_leave_nothing() {
    let bench = Bench::new();
    for (script, message) in [
        ("echo 'error it is truncated' > \"$report\"; exit 1", "it is truncated"),
        ("echo partial > \"$output\"; echo Traceback; echo 'KeyError: x' >&2; exit 1", "KeyError: x"),
        ("echo 'no module numpy'; echo; echo 'Blender quit'; exit 1", "exit status: 1: no module numpy"),
        ("exit 0", "ended with exit status: 0"),
        ("kill -SEGV $$", "signal: 11"),
        ("kill -SEGV $$", "scene.blend: Blender 4.5.3 crashed"),
    ] {
        bench.program("blender", "Blender 4.5.3", &format!("{ARGUMENTS}{script}"));
        bench.fails(RENDER, message);
    }
    // What Blender writes is as little trusted as any file.
    bench.program("blender", "Blender 4.5.3", &format!("{ARGUMENTS}echo glTF > \"$output\""));
    let output = bench.run(RENDER);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn conversions_without_enough_memory_name_the_option() {
    let bench = Bench::new();
    for text in ["Malloc returns null: len=16 in array, total 5", "terminate called: std::bad_alloc"] {
        bench.program("blender", "Blender 4.5.3", &format!("{ARGUMENTS}echo '{text}' >&2; kill -ABRT $$"));
        let line = format!("{RENDER} --max-memory 500");
        bench.fails(&line, "MiB of memory that it may have for the conversion; allow more with --max-memory");
    }
}

/// Blender leaves its folder for temporary files where it is killed, or ends without the shutdown of its interpreter.
#[test]
fn temporary_files_of_blender_go_with_the_conversion() {
    let bench = Bench::new();
    for end in ["exit 0", "exit 1", "kill -KILL $$"] {
        for variable in ["TMPDIR", "TEMP", "TMP"] {
            let left = format!(
                "mkdir -p \"${variable}/blender_a1b2c3\"; echo \"${variable}\" >> \"$HERE/places\"\n{end}"
            );
            bench.converter("Blender 4.5.3", &left);
            let status = bench.command(RENDER).env("BLINN_CACHE", "off").output().unwrap().status;
            assert_eq!(status.success(), end == "exit 0");
            bench.assert_nothing_left();
        }
    }
    let places = fs::read_to_string(bench.path.join("places")).unwrap();
    assert_eq!(places.lines().count(), 9);
    let tmp = bench.path.join("tmp");
    assert!(places.lines().all(|place| Path::new(place).starts_with(&tmp)), "{places}");
}

#[test]
fn other_files_with_the_name_are_one_line_and_never_reach_blender() {
    let bench = Bench::new();
    bench.converter("Blender 4.5.3", "");
    let blend = bench.path.join("scene.blend");
    for content in [&b""[..], b"BLEND", b"v 1 2 3"] {
        fs::write(&blend, content).unwrap();
        bench.fails(RENDER, "the file is not a .blend file");
    }
    fs::File::create(&blend).unwrap().set_len(2 << 30).unwrap();
    bench.fails(RENDER, "the file is not a .blend file");
    fs::write(&blend, BLEND).unwrap();
    bench.fails(&format!("{RENDER} --max-memory 20"), "exceeds the limit");
    fs::remove_file(&blend).unwrap();
    bench.fails(RENDER, "No such file");
    assert!(bench.conversions().is_empty());
}

#[test]
fn blend_files_are_recognised_by_content_and_by_name() {
    let bench = Bench::new();
    bench.converter("Blender 4.5.3", "");
    for (name, content) in [
        ("a.dat", BLEND),
        ("b.blend1", BLEND),
        ("c.BLEND", b"\x28\xb5\x2f\xfd..."),
        ("d.blend", b"\x1f\x8b..."),
    ] {
        fs::write(bench.path.join(name), content).unwrap();
        bench.runs(&format!("info {name}"));
    }
    fs::create_dir(bench.path.join("folder")).unwrap();
    for name in ["x.blend", "y.blend", "y.blend1"] {
        fs::write(bench.path.join("folder").join(name), BLEND).unwrap();
    }
    fs::copy(bench.path.join("bin/converted"), bench.path.join("folder/y.glb")).unwrap();
    let output = bench.run("render folder --dry-run");
    let listed = String::from_utf8(output.stdout).unwrap();
    assert_eq!(listed.lines().count(), 2, "an export stands for its .blend file: {listed}");
}

#[test]
fn a_time_limit_ends_blender_and_its_children() {
    let bench = Bench::new();
    let script = format!("{ARGUMENTS}(sleep 3; touch \"$HERE/late\") &\necho part > \"$output\"; sleep 60");
    bench.program("blender", "Blender 4.5.3", &script);
    let start = Instant::now();
    bench.fails(&format!("{RENDER} --timeout 1"), "gave up after 1 s");
    assert!(start.elapsed() < Duration::from_secs(30));
    std::thread::sleep(Duration::from_secs(3));
    assert!(!bench.path.join("late").exists());
}

/// Blender ends with the program, however that ends: its standard input does.
#[test]
fn a_killed_program_ends_blender() {
    let bench = Bench::new();
    let script = format!("{ARGUMENTS}cat; touch \"$HERE/ended\"");
    bench.program("blender", "Blender 4.5.3", &script);
    let mut child = bench.command(RENDER).spawn().unwrap();
    let waits = |name: &str| {
        let start = Instant::now();
        while !bench.path.join(name).exists() && start.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(20));
        }
        bench.path.join(name).exists()
    };
    assert!(waits("work"));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(waits("ended"));
    let cache = fs::read_dir(bench.path.join("cache/blend")).map_or(0, Iterator::count);
    assert_eq!(cache, 0);
}
