//! `render --frames` and `turntable` into GIF, APNG, MP4, WebP and HTML.

use std::fs;
#[cfg(unix)]
use std::io::BufRead;
use std::process::Command;

use crate::common::program::*;

const SMALL: &str = "--size 32x18 -s 1";
const ENDINGS: [&str; 4] = ["gif", "apng", "mp4", "html"];

/// The output equals that of `assemble` on the same frames, byte for byte.
#[test]
fn an_animation_has_the_bytes_of_assembled_frames() {
    let (_dir, at) = folder();
    let scene = model("still-life/still-life.glb");
    let turn = format!("turntable {scene} {SMALL} --count 5 --start 20 -q");
    runs(&at, &format!("{turn} -o frames/####.png"));
    for ending in ENDINGS {
        let messages = runs(&at, &format!("{turn} --fps 12 --loop once -o one/spin.{ending}"));
        assert_eq!(messages, "");
        runs(&at, &format!("assemble frames --fps 12 --loop once -q -o two/spin.{ending}"));
    }
    let one = files(&at.join("one"));
    assert_eq!(one.keys().collect::<Vec<_>>(), ["spin.apng", "spin.gif", "spin.html", "spin.mp4"]);
    for (name, bytes) in files(&at.join("two")) {
        assert!(one[&name] == bytes, "{name}");
    }
    // On any number of threads.
    runs(&at, &format!("{turn} --fps 12 --loop once --threads 1 -o one/spin.gif"));
    assert!(fs::read(at.join("one/spin.gif")).unwrap() == one["spin.gif"]);
}

/// Dragging on an HTML page moves the front of the model along: a turning camera and a turning model rotate
/// in opposite directions.
#[test]
fn the_drag_direction_of_a_page_follows_the_rotation() {
    let (_dir, at) = folder();
    let turn = format!("turntable {} {SMALL} --count 3 -q", model("still-life/still-life.glb"));
    for (flags, way) in [
        ("", "1"),
        ("--direction cw", "-1"),
        ("--turn camera", "-1"),
        ("--turn camera --direction cw", "1"),
        ("--axis 0,-1,0", "-1"),
        ("--axis x", "1"),
    ] {
        runs(&at, &format!("{turn} {flags} -o spin.html"));
        let page = fs::read_to_string(at.join("spin.html")).unwrap();
        assert!(page.contains(&format!("WAY = {way};")), "{flags}");
    }
    runs(&at, &format!("{turn} --direction cw -o spin.html"));
    runs(&at, &format!("{turn} --direction cw -o frames/####.png"));
    runs(&at, "assemble frames --direction cw -q -o two/spin.html");
    assert!(fs::read(at.join("spin.html")).unwrap() == fs::read(at.join("two/spin.html")).unwrap());
}

#[test]
fn an_animation_plays_at_the_speed_of_its_clip() {
    let (_dir, at) = folder();
    let line = format!("render {} {SMALL} --no-background -q --fps 5 --frames", model("figure/figure.glb"));
    runs(&at, &format!("{line} -o frames/####.png"));
    let count = files(&at.join("frames")).len();
    assert!(count > 3);
    runs(&at, &format!("{line} -o walk.apng"));
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(at.join("walk.apng")).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames as usize, count);
    let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut buffer).unwrap();
    let control = reader.info().frame_control().unwrap();
    let seconds = f64::from(control.delay_num) / f64::from(control.delay_den);
    assert!((seconds - 0.2).abs() < 1e-3, "{seconds}");
    // Backwards, and in part: in the requested order.
    runs(&at, &format!("{line}=3-1:-1 -o backward.apng"));
    runs(&at, &format!("{line}=1-3 -o forward.apng"));
    assert!(fs::read(at.join("backward.apng")).unwrap() != fs::read(at.join("forward.apng")).unwrap());
}

#[test]
fn each_scene_gets_its_own_animation() {
    let (_dir, at) = folder();
    let (a, b) = (model("cornell/cornell.glb"), model("figure/figure.glb"));
    let line = format!("turntable {a} {b} {SMALL} --count 2");
    let dry = blinn(&at, &format!("{line} -o out/{{stem}}.gif --dry-run"));
    assert_eq!(String::from_utf8(dry.stdout).unwrap(), "out/cornell.gif\nout/figure.gif\n");
    let messages = runs(&at, &format!("{line} -o out/{{stem}}.gif --report out/r.html"));
    assert!(
        messages.ends_with("wrote out/cornell.gif\nwrote out/figure.gif\nwrote out/r.html\n"),
        "{messages}"
    );
    let page = fs::read_to_string(at.join("out/r.html")).unwrap();
    assert_eq!(page.matches("<figure>").count(), 2);
    assert!(page.contains("href=\"./figure.gif\""));
    refused(&at, &format!("{line} -o spin.gif"), "would both be written to spin.gif");
}

/// Names without a frame number get one, except those with endings that are animations only.
#[test]
fn a_turntable_to_webp_writes_an_image_per_frame() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    runs(&at, &format!("turntable {scene} {SMALL} --count 2 -q -o a.webp"));
    assert_eq!(names(&at), ["a_0001.webp", "a_0002.webp"]);
}

#[test]
fn unsupported_animation_options_are_usage_errors() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    for ending in ENDINGS {
        refused(&at, &format!("render {scene} -o a.{ending}"), "add --frames, use blinn turntable");
    }
    for (flags, message) in [
        ("-o a.gif --only 1-3", "--only leaves out frames of the animation"),
        ("-o a.mp4 --chunk 1/2", "then use blinn assemble"),
        ("-o a.apng --resume", "--resume does not apply to animations"),
        ("-o a.html --aov depth", "--aov does not apply to animations"),
        ("-o a.gif --depth 16", "8 bits per channel"),
        ("-o a.gif --encoder-quality 50", "--encoder-quality applies only to .jpg, .mp4 and .html"),
        ("-o a_##.gif", "remove the frame number"),
        ("-o a.mp4 --background transparent", "MP4 has no transparency"),
        ("-o a.mp4 --no-background", "MP4 has no transparency"),
        ("-o a.png --loop once", "--loop applies only to animations"),
        ("-o a.png --fps 12", "--fps applies only to animations"),
        ("--fps 12", "--fps applies only to animations"),
        ("-o a.gif --fps 0", "greater than zero"),
        ("-o a.gif --fps 60", "at most 50 frames a second"),
        ("-o a.mp4 --fps 1e-9", "frames a second, not 0.000000001"),
        ("-o a.apng --fps .01", "APNG has at least one frame in 6.5 s"),
        ("-o a.gif --size 65536x1", "GIF has at most 65535 pixels"),
        ("-o a.html --size 1x16384", "WebP has at most 16383 pixels"),
        ("-o a.mp4 --size 8x8", "MP4 has at most 3840x2160 pixels"),
        ("-o a.mp4 --size 2160x3841", "MP4 has at most 3840x2160 pixels"),
        ("-o a.mp4 --size 64x64 --crop 0,0,8,8", "at least 16 a side, not 8x8"),
        ("-o a.gif --loop twice", "forever, once"),
    ] {
        refused(&at, &format!("turntable {scene} {flags}"), message);
    }
    refused(&at, &format!("render {scene} --frames 1-4 --chunk 1/2 -o a.gif"), "--chunk leaves out frames");
    refused(&at, &format!("render {scene} --loop once"), "--loop applies only to animations");
}

#[test]
fn a_size_beyond_the_format_is_an_error_of_one_line() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    // The size depends on the scene: its camera has an aspect ratio of 100.
    let text = fs::read_to_string(model("tests/triangle.gltf")).unwrap();
    let mut wide: serde_json::Value = serde_json::from_str(&text).unwrap();
    wide["cameras"] = serde_json::json!([{"type": "perspective",
        "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 100.0}}]);
    let nodes = wide["nodes"].as_array_mut().unwrap();
    nodes.push(serde_json::json!({"camera": 0, "translation": [0, 0, 5]}));
    let camera = nodes.len() - 1;
    wide["scenes"][0]["nodes"].as_array_mut().unwrap().push(camera.into());
    fs::write(at.join("wide.gltf"), wide.to_string()).unwrap();
    for (command, message) in [("", "a.mp4 cannot be written: MP4 has"), ("job slurm ", "-o a.mp4: MP4 has")]
    {
        let output = blinn(&at, &format!("{command}turntable wide.gltf -s 1 --count 2 -o a.mp4"));
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{messages}");
        assert!(messages.lines().count() == 1 && messages.contains(message), "{messages}");
        assert!(output.stdout.is_empty());
    }
    fs::remove_file(at.join("wide.gltf")).unwrap();
    refused(&at, &format!("job slurm turntable {scene} --size 8x8 -o a.mp4"), "MP4 has at most");
    fs::write(at.join("kept.gif"), "kept").unwrap();
    let output = blinn(&at, &format!("turntable {scene} {SMALL} --count 2 -o kept.gif --no-overwrite"));
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(names(&at), ["kept.gif"]);
    assert_eq!(fs::read(at.join("kept.gif")).unwrap(), b"kept");
}

/// Terminated, killed, or on a full disk: no file, and no part of one.
#[cfg(unix)]
#[test]
fn an_animation_file_is_complete_or_absent() {
    use std::os::unix::process::ExitStatusExt;
    let scene = model("cornell/cornell.glb");
    let signals = [("-INT", Some(130), None), ("-TERM", Some(143), None), ("-KILL", None, Some(9))];
    for (signal, code, died) in signals.into_iter().filter(|(signal, ..)| heeds(signal)) {
        let (_dir, at) = folder();
        let line = format!("turntable {scene} --count 4000 --size 64x36 -s 4 -o a.apng --progress plain");
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line.split(' '))
            .current_dir(&at)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let messages = std::io::BufReader::new(child.stderr.as_mut().unwrap());
        assert!(messages.lines().any(|line| line.unwrap().contains('%')), "it ended");
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let status = child.wait().unwrap();
        assert_eq!((status.code(), status.signal()), (code, died));
        assert!(names(&at).is_empty(), "{signal}: {:?}", names(&at));
    }
    let (_dir, at) = folder();
    let program = env!("CARGO_BIN_EXE_blinn");
    let line = format!("ulimit -f 4; exec '{program}' turntable '{scene}' --size 320x180 -s 1 -q -o a.apng");
    let output = Command::new("bash").args(["-c", &line]).current_dir(&at).output().unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.lines().count() == 1 && messages.contains("a.apng cannot be written"), "{messages}");
    assert!(names(&at).is_empty());
}
