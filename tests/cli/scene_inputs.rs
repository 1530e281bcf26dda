//! Scenes from standard input, `--format`, and folders given as scenes.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::program::*;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

/// Runs the program with `input` on standard input, through a pipe.
fn pipe(folder: &Path, args: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    command.args(args).current_dir(folder);
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // A program that rejects its command line does not read.
    let writer = std::thread::spawn(move || _ = stdin.write_all(&input));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

fn json(output: &Output) -> serde_json::Value {
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{messages}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn glb_gltf_and_obj_are_read_from_standard_input() {
    let (_dir, folder) = folder();
    let embedded = br#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let cornell = fs::read(model("cornell/cornell.glb")).unwrap();
    let lenient = format!("{TRIANGLE}f 1 2 \\\n3\n");
    // Far from the origin, an OBJ is parsed twice.
    let distant = "v 1000000.5 0 0\nv 1000001 0 0\nv 1000000 1 0\nf 1 2 3\n";
    for (bytes, format, triangles) in [
        (&cornell[..], "glTF", None),
        (&embedded[..], "glTF", Some(1)),
        (format!("{TRIANGLE}f 1 2 3\n").as_bytes(), "OBJ", Some(1)),
        (lenient.as_bytes(), "OBJ", Some(1)),
        (distant.as_bytes(), "OBJ", Some(1)),
    ] {
        let info = json(&pipe(&folder, &["info", "-", "--json"], bytes));
        assert_eq!((info["format"].as_str(), info["file"].as_str()), (Some(format), Some("/dev/stdin")));
        assert!(triangles.is_none_or(|count| info["triangles"] == count), "{info}");
    }
}

/// The picture is that of the same file, and its name that of the stream.
#[test]
fn a_scene_on_standard_input_renders_as_its_file_does() {
    let (_dir, folder) = folder();
    let cornell = fs::read(model("cornell/cornell.glb")).unwrap();
    let output = pipe(&folder, &["render", "-", "--size", "16x16", "-s", "1"], &cornell);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::write(folder.join("stdin.glb"), &cornell).unwrap();
    runs(&folder, "render stdin.glb --size 16x16 -s 1 -o file.png");
    let pixels = |name: &str| image::open(folder.join(name)).unwrap().to_rgb8();
    assert!(pixels("stdin.png") == pixels("file.png"));
    let output = pipe(&folder, &["render", "-", "-o", "-", "--size", "16x16", "-s", "1"], &cornell);
    let image = image::load_from_memory(&output.stdout).unwrap().to_rgb8();
    assert!(image == pixels("file.png"));
}

/// References are relative to the current folder.
#[test]
fn references_of_standard_input_are_relative_to_the_current_folder() {
    let (_dir, folder) = folder();
    fs::create_dir(folder.join("lib")).unwrap();
    fs::write(folder.join("lib/a.mtl"), "newmtl m\nKd 0 1 0\n").unwrap();
    let obj = format!("mtllib lib/a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let info = json(&pipe(&folder, &["info", "-", "--json"], obj.as_bytes()));
    assert_eq!(
        (info["materials"][0]["name"].as_str(), &info["warnings"]),
        (Some("m"), &serde_json::json!([]))
    );
}

#[test]
fn the_format_may_be_given() {
    let (_dir, folder) = folder();
    fs::write(folder.join("a.glb"), format!("{TRIANGLE}f 1 2 3\n")).unwrap();
    fails(&folder, &["info", "a.glb"], 1, "not a glTF file");
    let info = json(&blinn_args(&folder, &["info", "a.glb", "--format", "obj", "--json"]));
    assert_eq!((info["format"].as_str(), info["triangles"].as_u64()), (Some("OBJ"), Some(1)));
    let output = pipe(&folder, &["info", "-", "--format", "glb"], b"v 0 0 0\n");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && message.contains("not a glTF file"), "{message}");
    fails(&folder, &["info", "a.glb", "--format", "fbx"], 2, "fbx");
}

#[test]
fn standard_input_is_refused_where_it_cannot_be_read() {
    let (_dir, folder) = folder();
    for (args, code, message) in [
        (&["info", "-"][..], 1, "/dev/stdin: standard input is empty"),
        (&["render", "-", "-"], 2, "standard input can be read only once"),
        (&["render", "@-", "-"], 2, "standard input can be read only once"),
        (&["bench", "-"], 2, "save standard input to a file"),
        (&["job", "slurm", "render", "-", "--frames", "1-2"], 2, "save standard input"),
    ] {
        let output = pipe(&folder, args, b"");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(code) && errors.contains(message), "{args:?}: {errors}");
        assert!(names(&folder).is_empty());
    }
    for (bytes, message) in [
        (&b"nothing that is a scene"[..], "the file is in no format that blinn recognizes"),
        (b"\x01\x02\xff\0\0", "or name its format with --format"),
        (b"0.5 1 2 255 0 0\n0.5 1 3 255 0 0\n", "the file is a point cloud; save it as .ply"),
    ] {
        let output = pipe(&folder, &["info", "-"], bytes);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && errors.starts_with("blinn: /dev/stdin: "), "{errors}");
        assert!(errors.contains(message), "{errors}");
    }
}

#[test]
fn a_folder_without_scenes_is_a_wrong_command_line() {
    let (_dir, folder) = folder();
    fs::create_dir(folder.join("models")).unwrap();
    refused(
        &folder,
        "render models",
        "models: a folder without .gltf, .glb, .obj, .stl, .ply or .blend files",
    );
    fs::create_dir(folder.join("models/lamp")).unwrap();
    fs::write(folder.join("models/notes.txt"), "").unwrap();
    refused(&folder, "info models/", "a folder without .gltf, .glb, .obj, .stl, .ply or .blend files");
    fs::write(folder.join("models/bolt.STEP"), "").unwrap();
    refused(&folder, "render models", "it has 1 .step file: export them as .glb");
    fs::copy(model("tests/cube.obj"), folder.join("models/nut.obj")).unwrap();
    let output = blinn(&folder, "render models --size 8x8 -s 1 -o out/");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.contains("models: left out 1 .step file"), "{errors}");
}
