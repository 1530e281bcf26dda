//! Full disks, folders without write access, inputs that vanish, closed pipes, processes that share a folder:
//! one clear error line, and no partial files.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::program::{blinn, model};

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    command.args(line.split_whitespace()).current_dir(folder);
    command
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.filter(|p| p.is_file()).map(|p| (p.file_name().unwrap().into(), fs::read(&p).unwrap())).collect()
}

/// Checks that the program failed with one line on standard error, and returns the line.
fn failed(output: &Output) -> String {
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(messages.lines().count(), 1, "{messages}");
    assert!(messages.starts_with("blinn: ") && !messages.contains("panicked"), "{messages}");
    messages
}

/// Images of each format, layers, reports and animations.
#[test]
fn a_full_disk_leaves_no_partial_file() {
    let scene = model("still-life/still-life.glb");
    for (out, flags) in [
        ("a.png", ""),
        ("a.exr", ""),
        ("a.jpg", "--encoder-quality 100"),
        ("a.webp", ""),
        ("a.exr", "--aov depth,normal"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        // The limit is one block of 1024 bytes. SIGXFSZ, which exceeding it raises, is not fatal.
        let line = format!(
            "ulimit -f 1; exec '{}' render '{scene}' --size 160x90 -s 1 {flags} -o {out}",
            env!("CARGO_BIN_EXE_blinn")
        );
        let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
        let messages = failed(&output);
        assert!(messages.contains(&format!("{out} cannot be written")), "{messages}");
        assert!(files(dir.path()).is_empty(), "{out} {flags}");
    }
}

#[test]
fn animations_are_complete_or_missing() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let made = blinn(dir.path(), &format!("turntable {scene} --size 128x128 -s 1 --count 3 -q -o f/#.png"));
    assert!(made.status.success());
    for out in ["a.gif", "a.apng", "a.webp", "a.mp4", "a.html"] {
        let line = format!("ulimit -f 1; exec '{}' assemble f -o {out} -q", env!("CARGO_BIN_EXE_blinn"));
        let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
        let messages = failed(&output);
        assert!(messages.contains(out), "{messages}");
        assert!(files(dir.path()).is_empty(), "{out}");
    }
}

/// Not even root can write to `/proc`.
#[cfg(target_os = "linux")]
#[test]
fn unwritable_folders_are_found_before_rendering() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("still-life/still-life.glb");
    let start = Instant::now();
    let messages = failed(&blinn(dir.path(), &format!("render {scene} -s 4096 -o /proc/a.png")));
    assert!(messages.contains("/proc/a.png"), "{messages}");
    let messages = failed(&blinn(dir.path(), &format!("render {scene} -s 4096 -o /proc/new/a.png")));
    assert!(messages.contains("/proc/new"), "{messages}");
    // Rendering them would take minutes.
    assert!(start.elapsed() < Duration::from_secs(30));
}

fn wait_for(what: &Path, child: &mut Child) {
    let start = Instant::now();
    while !what.exists() {
        assert!(child.try_wait().unwrap().is_none() || what.exists(), "it ended without {}", what.display());
        assert!(start.elapsed() < Duration::from_secs(100));
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Scenes are read once: frames continue after the file is deleted.
#[test]
fn inputs_may_be_deleted_once_they_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let inputs = dir.path().join("inputs");
    fs::create_dir(&inputs).unwrap();
    for name in ["textured.obj", "textured.mtl", "planks.png", "tin base.png"] {
        fs::copy(model(&format!("textured/{name}")), inputs.join(name)).unwrap();
    }
    let line = "turntable inputs/textured.obj --size 96x54 -s 4 --count 12 -q -o out/#.png";
    let mut child = command(dir.path(), line).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&dir.path().join("out/1.png"), &mut child);
    fs::remove_dir_all(&inputs).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    assert_eq!(files(&dir.path().join("out")).len(), 12);
    // A second run reports the missing file and keeps the pictures.
    let messages = failed(&blinn(dir.path(), line));
    assert!(messages.contains("inputs/textured.obj"), "{messages}");
    assert_eq!(files(&dir.path().join("out")).len(), 12);
}

/// `--resume` renders again after an export during the first frame, whatever the file's date.
#[test]
fn fingerprints_are_of_the_files_that_were_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let made = || {
        fs::copy(model("textured/textured.obj"), at("a.obj")).unwrap();
        for name in ["textured.mtl", "planks.png", "tin base.png"] {
            fs::copy(model(&format!("textured/{name}")), at(name)).unwrap();
        }
    };
    let long_ago = std::time::SystemTime::now() - Duration::from_secs(3600);
    let replace = |name: &str, bytes: &[u8]| {
        fs::write(at("passing"), bytes).unwrap();
        fs::File::options().write(true).open(at("passing")).unwrap().set_modified(long_ago).unwrap();
        fs::rename(at("passing"), at(name)).unwrap();
    };
    let scene = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec();
    let planks = fs::read(model("textured/tin base.png")).unwrap();
    for (name, bytes) in [("a.obj", &scene), ("planks.png", &planks)] {
        made();
        let line = "turntable a.obj --views 2 --size 160x90 -s 256 --resume --progress plain -o out/#.png";
        let mut child = command(dir.path(), line).stderr(Stdio::piped()).spawn().unwrap();
        let messages = std::io::BufReader::new(child.stderr.take().unwrap());
        let mut messages = messages.lines().map(Result::unwrap);
        assert!(messages.any(|line| line.contains('%')), "it ended");
        assert!(!at("out/1.png").exists());
        replace(name, bytes);
        let rest: Vec<String> = messages.collect();
        assert!(child.wait().unwrap().success(), "{rest:?}");
        let whole = files(&at("out"));
        // The same settings as for the existing pictures.
        assert!(blinn(dir.path(), &line.replace("--progress plain", "-q")).status.success());
        let again = files(&at("out"));
        assert!(again[Path::new("1.png")] != whole[Path::new("1.png")], "{name}");
        assert!(blinn(dir.path(), &line.replace("out/", "new/").replace("--resume", "")).status.success());
        assert!(again == files(&at("new")), "{name}: what is there is of one scene");
        fs::remove_dir_all(at("out")).unwrap();
    }
}

/// Another program may still be writing the file. The complete meshes are drawn with a warning.
#[test]
fn a_truncated_input_is_reported_and_an_error_with_strict() {
    let dir = tempfile::tempdir().unwrap();
    let whole = fs::read(model("cornell/cornell.glb")).unwrap();
    for share in [0, 1, 2, 3] {
        fs::write(dir.path().join("a.glb"), &whole[..whole.len() * share / 4]).unwrap();
        let output = blinn(dir.path(), "render a.glb --size 8x8 -o a.png --strict");
        assert_ne!(output.status.code(), Some(0));
        assert_eq!(files(dir.path()).len(), 1);
        let output = blinn(dir.path(), "render a.glb --size 8x8 -o b.png");
        let messages = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(share == 0 || messages.contains("the file is truncated"), "{messages}");
        if output.status.success() {
            fs::remove_file(dir.path().join("b.png")).unwrap();
        } else {
            failed(&output);
        }
    }
}

/// A closed pipe is not an error, as for any program in a pipeline.
#[test]
fn a_closed_pipe_is_no_error() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    for line in [
        format!("render {scene} --size 320x180 -s 1 -q -o -"),
        format!("render {scene} --dry-run --frames=1-100000"),
        format!("info {scene} --json"),
        "render --help".to_string(),
        format!("render {scene} --print-config"),
    ] {
        let mut child =
            command(dir.path(), &line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let messages = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && messages.is_empty(), "{line}: {:?} {messages}", output.status);
    }
}

/// Processes that render the same frames: each file is complete at any time, and equal to that of one
/// process.
#[test]
fn processes_may_share_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let line = |out: &str| {
        format!("turntable {scene} --size 48x27 -s 1 --count 8 --threads 1 -q --resume -o {out}/#.png")
    };
    assert!(blinn(dir.path(), &line("alone")).status.success());
    let children: Vec<Child> =
        (0..3).map(|_| command(dir.path(), &line("shared")).spawn().unwrap()).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    assert_eq!(files(&dir.path().join("shared")), files(&dir.path().join("alone")));
}

/// Output to standard output is complete, or the program fails.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/triangle.glb");
    for line in [
        format!("render {scene} --size 8x8 -o -"),
        format!("render {scene} --dry-run"),
        format!("render {scene} --print-config"),
        format!("info {scene}"),
        format!("info {scene} --json"),
        format!("job slurm turntable {scene}"),
        "completions bash".to_string(),
        "man".to_string(),
        "--help".to_string(),
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let messages = failed(&command(dir.path(), &line).stdout(full).output().unwrap());
        assert!(messages.contains("standard output cannot be written"), "{line}: {messages}");
    }
    // A few bytes fit; the rest does not.
    let line = format!(
        "head -c 1016 /dev/zero > cut; ulimit -f 1; exec '{}' render {scene} --size 30x20 -o - >> cut",
        env!("CARGO_BIN_EXE_blinn")
    );
    let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    assert!(failed(&output).contains("standard output cannot be written"));
}

/// Without standard error the work continues, and the exit code reports its result.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_error_is_ignored() {
    let dir = tempfile::tempdir().unwrap();
    let (one, two) = (model("tests/triangle.glb"), model("cornell/cornell.glb"));
    let size = "--size 8x8 -s 1";
    for (line, code) in [
        (format!("render {one} {two} {size} --progress plain -v --perf -o {{stem}}.png"), 0),
        (format!("render missing.glb {one} {two} {size} --progress json -o {{stem}}.png"), 1),
        (format!("info missing.glb {one}"), 1),
        (format!("render {one} --size 8x"), 2),
        ("render --progress openjd --size 8x".to_string(), 2),
        (format!("bench {one} --size 8x8 --rounds 1 --threads 1"), 0),
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = command(dir.path(), &line).stderr(full).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}");
        if line.starts_with("render") && code < 2 {
            assert_eq!(files(dir.path()).len(), 2, "{line}");
            files(dir.path()).keys().for_each(|name| fs::remove_file(dir.path().join(name)).unwrap());
        }
    }
}

/// A link's target is replaced; devices and pipes are written into.
#[test]
fn links_and_devices_are_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let scene = model("tests/triangle.glb");
    fs::create_dir(at("there")).unwrap();
    for (link, to) in [("a.png", "there/a.png"), ("null.html", "/dev/null"), ("out.json", "/dev/stdout")] {
        std::os::unix::fs::symlink(to, at(link)).unwrap();
    }
    let run = |line: String| {
        let output = blinn(dir.path(), &line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        output
    };
    for _ in 0..2 {
        run(format!("render {scene} --size 8x8 -o a.png --report null.html"));
        assert!(image::open(at("there/a.png")).is_ok() && at("a.png").is_symlink());
        assert!(at("null.html").is_symlink() && files(&at("there")).len() == 1);
    }
    let messages = run(format!("bench {scene} --size 8x8 --rounds 1 --threads 1 -q --json out.json")).stdout;
    assert!(String::from_utf8_lossy(&messages).trim_end().ends_with('}') && at("out.json").is_symlink());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_a_batch() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.glb", "b.glb", "c.glb", "d.glb"] {
        fs::copy(model("tests/triangle.glb"), dir.path().join(name)).unwrap();
    }
    std::os::unix::fs::symlink("/dev/full", dir.path().join("b.png")).unwrap();
    let output = blinn(dir.path(), "render a.glb b.glb c.glb d.glb --size 8x8 -q --threads 1");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(
        messages.contains("blinn: 1 of 4 scenes failed, 2 not started:\nblinn:   b.glb: b.png cannot be"),
        "{messages}"
    );
    assert!(dir.path().join("a.png").exists() && !dir.path().join("c.png").exists());
}

/// Where scenes are rendered side by side, later ones may be finished before the disk is full. Each is reported, or has no
/// picture.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_scene_unreported() {
    const SCENES: usize = 40;
    for threads in [2, 7] {
        let dir = tempfile::tempdir().unwrap();
        let names: Vec<String> = (0..SCENES).map(|i| format!("{i:02}")).collect();
        for name in &names {
            fs::copy(model("tests/triangle.glb"), dir.path().join(name).with_extension("glb")).unwrap();
        }
        std::os::unix::fs::symlink("/dev/full", dir.path().join("09.png")).unwrap();
        let list: String = names.iter().map(|name| format!(" {name}.glb")).collect();
        let line = format!("render{list} --size 8x8 --threads {threads} --ledger ledger.jsonl");
        let output = blinn(dir.path(), &line);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{messages}");
        assert_eq!(messages.matches("cannot be written").count(), 2, "reported and listed: {messages}");
        let ledger = fs::read_to_string(dir.path().join("ledger.jsonl")).unwrap();
        for name in names.iter().filter(|name| *name != "09") {
            let is_there = dir.path().join(name).with_extension("png").exists();
            assert_eq!(messages.contains(&format!("wrote {name}.png")), is_there, "{name}: {messages}");
            assert_eq!(ledger.contains(&format!("{name}.glb")), is_there, "{name}: {ledger}");
        }
        let done = ledger.lines().filter(|line| line.contains(".glb")).count();
        assert!(
            messages.contains(&format!("1 of {SCENES} scenes failed, {} not started", SCENES - done)),
            "{messages}"
        );
    }
}

/// A picture may have the default name of a texture beside its scene.
#[test]
fn input_files_are_never_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["negative.obj", "negative.mtl", "negative.png"] {
        fs::copy(model(&format!("tests/{name}")), dir.path().join(name)).unwrap();
    }
    let obj = fs::read_to_string(dir.path().join("negative.obj")).unwrap();
    let mtl = fs::read_to_string(dir.path().join("negative.mtl")).unwrap();
    fs::write(dir.path().join("bumpy.obj"), obj.replace("negative.mtl", "bumpy.mtl")).unwrap();
    fs::write(dir.path().join("bumpy.mtl"), mtl.replace("negative.png", "bumpy.normal.png")).unwrap();
    fs::copy(model("tests/negative.png"), dir.path().join("bumpy.normal.png")).unwrap();
    std::os::unix::fs::symlink("negative.png", dir.path().join("link.png")).unwrap();
    let before = files(dir.path());
    for (line, names) in [
        ("negative.obj", "negative.png would overwrite an input file of negative.obj"),
        ("negative.obj --no-overwrite", "negative.png would overwrite"),
        ("negative.obj -o ./negative.png", "negative.png would overwrite"),
        ("negative.obj -o link.png", "link.png would overwrite"),
        ("bumpy.obj --aov normal", "bumpy.normal.png would overwrite an input file of bumpy.obj"),
        (
            "negative.obj -o new.png --report negative.png",
            "--report negative.png would overwrite an input file",
        ),
    ] {
        let messages = failed(&blinn(dir.path(), &format!("render {line} --size 16x16 -s 1")));
        assert!(messages.contains(names) && messages.contains("name another"), "{line}: {messages}");
        assert!(files(dir.path()) == before, "{line}");
    }
    assert!(blinn(dir.path(), "render negative.obj --size 16x16 -s 1 -o out/").status.success());
}

/// An unwritable report is an error before rendering starts.
#[cfg(target_os = "linux")]
#[test]
fn an_unwritable_report_is_found_before_rendering() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/triangle.glb");
    fs::write(dir.path().join("r.html"), "mine").unwrap();
    let before = files(dir.path());
    let render = |flags: &str| command(dir.path(), &format!("render {scene} --size 8x8 -o a.png {flags}"));
    let messages = failed(&render("--no-overwrite --report r.html").output().unwrap());
    assert!(
        messages.contains("r.html cannot be written") && messages.contains("--no-overwrite"),
        "{messages}"
    );
    let messages = failed(&render("--report /proc/new/r.html").output().unwrap());
    assert!(messages.contains("/proc/new"), "{messages}");
    let messages = failed(&render("--report -").env("TMPDIR", "/proc").output().unwrap());
    assert!(messages.contains("--report: -: no temporary file could be created"), "{messages}");
    assert!(files(dir.path()) == before);
    assert!(render("--report new.html").env("TMPDIR", "/proc").output().unwrap().status.success());
    assert!(fs::read_to_string(dir.path().join("new.html")).unwrap().ends_with("</html>\n"));
    assert!(render("--report rep/r.html").output().unwrap().status.success());
    assert!(dir.path().join("rep/r.html").is_file());
}

/// Pictures are written without their report, of which no part remains; the exit code is 1.
#[test]
fn a_report_over_the_size_limit_costs_no_image() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.glb", "b.glb"] {
        fs::copy(model("tests/triangle.glb"), dir.path().join(name)).unwrap();
    }
    let program = env!("CARGO_BIN_EXE_blinn");
    let line = "turntable a.glb b.glb --count 30 --size 8x8 -q --report r.html -o out/{stem}_#.png";
    let line = format!("ulimit -f 16; exec '{program}' {line}");
    let output = Command::new("bash").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
    let messages = failed(&output);
    assert!(messages.starts_with("blinn: --report: r.html cannot be written: "), "{messages}");
    assert_eq!(files(&dir.path().join("out")).len(), 60);
    assert!(!dir.path().join("r.html").exists());
}

#[test]
fn no_overwrite_protects_aov_previews() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/triangle.glb");
    fs::write(dir.path().join("a_2.depth.png"), "mine").unwrap();
    let line = format!("turntable {scene} --count 2 --size 8x8 --aov depth --no-overwrite -o a_#.png");
    let messages = failed(&blinn(dir.path(), &line));
    assert!(messages.contains("a_2.depth.png cannot be written"), "{messages}");
    assert_eq!(files(dir.path()).len(), 1, "nothing was rendered");
}

/// File names are bytes: names that are not UTF-8 are told apart; patterns must be UTF-8.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_utf8_are_kept_or_refused() {
    use std::os::unix::ffi::OsStrExt;
    let dir = tempfile::tempdir().unwrap();
    let name = |bytes: &[u8]| std::ffi::OsStr::from_bytes(bytes).to_os_string();
    let scenes = [name(b"a\xff.glb"), name(b"a\xfe.glb")];
    for scene in &scenes {
        fs::copy(model("tests/triangle.glb"), dir.path().join(scene)).unwrap();
    }
    let output = command(dir.path(), "render --size 8x8 -q").args(&scenes).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(dir.path().join(name(b"a\xff.png")).exists() && dir.path().join(name(b"a\xfe.png")).exists());
    let before = files(dir.path());
    let out = name(b"o\xff.png");
    let output = command(dir.path(), "render -o").arg(out).arg(&scenes[0]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("UTF-8"));
    // `transforms.json` is text.
    let views = "turntable --views 2 --size 8x8 -q";
    let output = command(dir.path(), views).arg(&scenes[0]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("set another name with -o"));
    assert!(files(dir.path()) == before);
    let output = command(dir.path(), views).args(["-o", "out/#.png"]).arg(&scenes[0]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
