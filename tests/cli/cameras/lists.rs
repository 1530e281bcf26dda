//! Names, sizes and times of cameras in lists, and what is refused.

use std::fs;

use super::{cameras, jsonl, write_scene};
use crate::common::program::*;

/// Images keep their names and bytes in chunks, and --resume renders only what changed.
#[test]
fn lists_work_like_frames() {
    let (_dir, at) = folder();
    write_scene(&at);
    let all = cameras(5);
    fs::write(at.join("c.jsonl"), jsonl(&all)).unwrap();
    let line = "render cube.obj --cameras c.jsonl -s 1";
    runs(&at, &format!("{line} -q -o whole/"));
    let whole = files(&at.join("whole"));
    assert_eq!(
        whole.keys().collect::<Vec<_>>(),
        [0, 1, 2, 3, 4].map(|i| format!("cube_v{i}.png")).iter().collect::<Vec<_>>()
    );
    for part in ["1/2", "2/2"] {
        runs(&at, &format!("{line} -q -o parts/ --chunk {part}"));
    }
    assert!(files(&at.join("parts")) == whole);
    let mut changed = all.clone();
    changed[3].t.z += 0.5;
    fs::write(at.join("c.jsonl"), jsonl(&changed)).unwrap();
    let messages = runs(&at, &format!("{line} -o parts/ --resume"));
    assert!(
        messages.contains("kept 4 of cube.obj") && messages.contains("wrote parts/cube_v3.png"),
        "{messages}"
    );
    assert_eq!(messages.matches("wrote").count(), 1, "{messages}");
    let dry = blinn(&at, &format!("{line} -o x_##.png --dry-run")).stdout;
    assert_eq!(String::from_utf8(dry).unwrap(), "x_01.png\nx_02.png\nx_03.png\nx_04.png\nx_05.png\n");
    // An animation of pictures of one size.
    runs(&at, &format!("{line} --size 32x32 --fps 5 -q -o x.gif"));
    refused(&at, &format!("{line} -o x.gif"), "an animation needs --size");
    refused(&at, &format!("{line} --fps 5"), "--fps applies only to animations");
}

/// The time of a camera poses the scene.
#[test]
fn times_of_cameras_pose_the_scene() {
    let (_dir, at) = folder();
    let figure = model("figure/figure.glb");
    let line = |time: &str, file: &str| {
        format!(
            "{{\"K\": [80,0,32,0,80,32,0,0,1], \"width\": 64, \"height\": 64, \"convention\": \"opengl\", \
             \"camera_to_world\": [1,0,0,0, 0,1,0,1, 0,0,1,3, 0,0,0,1]{time}, \"file\": \"{file}\"}}\n"
        )
    };
    let text = line("", "start.png") + &line(", \"time\": 0.4", "later.png");
    fs::write(at.join("c.jsonl"), text).unwrap();
    let lit = "--lights three-point --exposure 0";
    for (flags, name) in [("", "a"), ("--time 0.4", "b")] {
        runs(
            &at,
            &format!("render {figure} --cameras c.jsonl {lit} {flags} -s 1 -q -o {name}/{{camera}}.png"),
        );
    }
    let (a, b) = (files(&at.join("a")), files(&at.join("b")));
    assert!(a["start.png"] != a["later.png"] && b["start.png"] != a["start.png"]);
    assert!(b["later.png"] == a["later.png"], "its own time takes precedence");
}

/// Names of images stay in the folder, and no two cameras share a file.
#[test]
fn names_of_cameras_are_safe_and_distinct() {
    let (_dir, at) = folder();
    write_scene(&at);
    let text = jsonl(&cameras(3));
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "../../v1.jpg").replace("v2.jpg", "/etc/v2.jpg"))
        .unwrap();
    let dry = blinn(&at, "render cube.obj --cameras c.jsonl --dry-run -o out/{camera}.png").stdout;
    assert_eq!(String::from_utf8(dry).unwrap(), "out/v0.png\nout/v1.png\nout/v2.png\n");
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "v0.png")).unwrap();
    refused(&at, "render cube.obj --cameras c.jsonl", "use {frame} in -o");
    fs::write(at.join("c.jsonl"), text.replace("v1.jpg", "v0.depth.png")).unwrap();
    refused(&at, "render cube.obj --cameras c.jsonl --aov depth", "would both be written to");
}

#[test]
fn other_cameras_and_bad_lists_are_refused() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = cameras(1);
    let write = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
    write("ok.jsonl", &jsonl(&camera));
    for (flags, message) in [
        ("--cameras ok.jsonl --yfov 40", "--yfov"),
        ("--cameras ok.jsonl --orbit 1,2", "--orbit"),
        ("--cameras ok.jsonl --camera 0", "--camera"),
        ("--cameras ok.jsonl --frames 1-3", "--frames"),
        ("--cameras ok.jsonl --frame 3", "--frame"),
        ("--cameras ok.jsonl --intrinsics 1,1,1,1", "--intrinsics"),
        ("--cameras ok.jsonl --crop 0,0,500,5", "--crop reaches beyond"),
        ("--cameras ok.jsonl -o -", "standard output takes one image"),
        ("--cameras ok.jsonl -o ok.jsonl", "unknown format"),
        ("--cameras none.jsonl", "none.jsonl"),
        ("--chunk 1/2", "add --frames or --cameras, or name several scenes"),
        ("-o {camera}.png", "{camera} is the name of a camera of --cameras"),
    ] {
        refused(&at, &format!("render cube.obj {flags}"), message);
    }
    refused(&at, "turntable cube.obj --cameras ok.jsonl", "--cameras");
    let k = "\"K\": [[50,0,20],[0,50,20],[0,0,1]]";
    let pose = "\"camera_to_world\": [1,0,0,0, 0,1,0,0, 0,0,1,4, 0,0,0,1]";
    let size = "\"width\": 40, \"height\": 40";
    for (text, messages) in [
        ("", &["the file is empty"][..]),
        ("a b c", &["no list of cameras"]),
        ("{\"a\": 1}", &["no list of cameras", "transforms.json"]),
        ("[]", &["no list of cameras"]),
        (&format!("{{{k}, {size}}}"), &["line 1", "has no camera_to_world or world_to_camera"]),
        (&format!("{{{pose}, {size}}}"), &["line 1", "has no K"]),
        (
            &format!("{{{k}, {pose}, {size}}}\n{{{k}, {pose}, {size}, \"convention\": \"blender\"}}"),
            &["line 2", "convention 'blender'"],
        ),
        (&format!("{{{k}, {pose}, \"width\": 0, \"height\": 40}}"), &["line 1", "0 by 40 pixels"]),
        (&format!("{{{k}, {pose}, \"width\": 1e9, \"height\": 1e9}}"), &["line 1", "1 to 65536"]),
        (&format!("{{{k}, {pose}, \"width\": 40}}"), &["give both"]),
        (&format!("{{{k}, {pose}, {size}, \"time\": \"1\"}}"), &["line 1", "time", "invalid type"]),
        (&format!("{{{k}, {pose}, {size}, \"time\": NaN}}"), &["line 1", "time", "a finite number"]),
        (
            &format!("{{{}, {pose}, {size}}}", k.replace("[0,50,20]", "[0,-50,20]")),
            &["K", "greater than zero"],
        ),
        (&format!("{{{}, {pose}, {size}}}", k.replace("[50,0,", "[50,2,")), &["K has the skew 2"]),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[2,0,0,0,")),
            &["camera_to_world is not a rotation", "remove the scale"],
        ),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[-1,0,0,0,")),
            &["camera_to_world mirrors"],
        ),
        (&format!("{{{k}, {}, {size}}}", pose.replace("[1,0,0,0,", "[0,0,0,0,")), &["is not a rotation"]),
        (
            &format!("{{{k}, {}, {size}}}", pose.replace("0,0,1,4", "0,0,1,1e300")),
            &["too far from the origin"],
        ),
        (&format!("{{\n{k}, {pose}, {size}}}"), &["must be on one line"]),
        ("{\"frames\": []}", &["has no cameras"]),
        ("{\"frames\": [{\"file_path\": \"a\"}]}", &["frames[0]", "has no transform_matrix"]),
        (
            "{\"frames\": [{\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]}",
            &["frames[0]", "has no focal length"],
        ),
        ("{\"fl_x\": 9, \"k1\": 0.1, \"frames\": []}", &["k1 = 0.1 is not supported", "undistort"]),
        ("{\"fl_x\": 9, \"camera_model\": \"OPENCV_FISHEYE\", \"frames\": []}", &["OPENCV_FISHEYE"]),
        ("{\"frames\": [{\"transform_matrix\": 3}]}", &["frames[0].transform_matrix", "a matrix"]),
        ("{\"0\": {\"cam_K\": [1,0,0,0,1,0,0,0,1]}}", &["image 0 has no cam_R_w2c"]),
        ("{\"0\": {}, \"x\": {}}", &["no list of cameras"]),
    ] {
        write("bad.json", text);
        for message in messages {
            refused(&at, "render cube.obj --size 40x40 --cameras bad.json", message);
        }
        refused(&at, "render cube.obj --size 40x40 --cameras bad.json", "bad.json");
    }
}
