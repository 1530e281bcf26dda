//! `blinn sheet`: the picture, its scale, and the description that `--json` prints.

use std::fs;

use blinn::glam::DVec3;
use serde_json::Value;

use crate::common::program::*;

fn sheet(dir: &std::path::Path, line: &str) -> Value {
    let output = blinn(dir, &format!("sheet {line} --json -q"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn vector(value: &Value) -> DVec3 {
    let number = |i: usize| value[i].as_f64().unwrap();
    DVec3::new(number(0), number(1), number(2))
}

fn corners(json: &Value) -> Vec<DVec3> {
    let ends = [vector(&json["bounds"]["min"]), vector(&json["bounds"]["max"])];
    (0..8).map(|i| DVec3::from([0, 1, 2].map(|axis| ends[i >> axis & 1][axis]))).collect()
}

/// The matrices agree with a projection from the cameras alone, and with the pixels of the picture.
#[test]
fn the_matrices_map_corners_to_their_pixels() {
    let (_dir, dir) = folder();
    // A box of 2 × 3 × 5 far from the origin.
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    let moved: String = cube
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            Some(numbers) => {
                let v: Vec<f64> = numbers.split(' ').map(|n| n.parse().unwrap()).collect();
                format!("v {} {} {}\n", v[0] + 70.0, 1.5 * v[1] - 8.0, 2.5 * v[2] + 9.0)
            }
            None => format!("{line}\n"),
        })
        .collect();
    fs::write(dir.join("box.obj"), moved).unwrap();
    let json = sheet(&dir, "box.obj --size 900x701 --background #ff00ff -o s.png");
    let picture = image::open(dir.join("s.png")).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (900, 701));
    assert_eq!(json["cells"].as_array().unwrap().len(), 4);
    for cell in json["cells"].as_array().unwrap() {
        let number = |group: &str, key: &str| cell[group][key].as_f64().unwrap();
        let (mut min, mut max) = ([f64::INFINITY; 2], [0f64; 2]);
        for corner in corners(&json) {
            let offset = corner - vector(&cell["camera"]["view_point"]);
            let x = offset.dot(vector(&cell["camera"]["u"])) / number("camera", "view_width") + 0.5;
            let y = offset.dot(vector(&cell["camera"]["v"])) / number("camera", "view_height") + 0.5;
            let expected = [
                number("rect", "x") + x * number("rect", "width"),
                number("rect", "y") + (1.0 - y) * number("rect", "height"),
            ];
            for (axis, expected) in expected.into_iter().enumerate() {
                let row = &cell["model_to_pixel"][axis];
                let pixel = vector(row).dot(corner) + row[3].as_f64().unwrap();
                assert!((pixel - expected).abs() < 1e-3, "{}: {pixel} {expected}", cell["view"]);
                min[axis] = min[axis].min(pixel);
                max[axis] = max[axis].max(pixel);
            }
        }
        if cell["view"] == "isometric" {
            continue;
        }
        // Just inside the outline is the box, just outside the background. The filter blurs by 1.5 pixels.
        let [left, top] = min.map(|v| v as u32);
        let [right, bottom] = max.map(|v| v as u32);
        let is_background = |x: u32, y: u32| {
            let [r, g, b] = picture.get_pixel(x, y).0;
            r > 250 && g < 5 && b > 250
        };
        let row = (top + bottom) / 2;
        let column = (left + right) / 2;
        for (outside, inside) in [((left - 3, row), (left + 3, row)), ((column, top - 3), (column, top + 3))]
        {
            let at = |(x, y)| is_background(x, y);
            assert!(at(outside) && !at(inside), "{}: {outside:?} {inside:?}", cell["view"]);
        }
    }
}

/// `render` with the camera of a cell gives the pixels of the cell.
#[test]
fn a_cell_is_the_picture_of_its_camera() {
    let (_dir, dir) = folder();
    let scene = model("lecture/lecture.obj");
    let json = sheet(&dir, &format!("{scene} --size 400x300 -s 1 -o s.png"));
    let cell = &json["cells"][1];
    assert_eq!(cell["view"], "isometric");
    let list = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
    let camera = &cell["camera"];
    let line = format!(
        "render {scene} --projection orthographic --view-point {} --view-dir {} --view-up {} --view-width {} \
         --view-height {} --size 200x150 -s 1 --background .8,.82,.85 -o c.png",
        list(vector(&camera["view_point"])),
        list(-vector(&camera["w"])),
        list(vector(&camera["v"])),
        camera["view_width"],
        camera["view_height"]
    );
    runs(&dir, &line);
    let [sheet, alone] = ["s.png", "c.png"].map(|name| image::open(dir.join(name)).unwrap().into_rgb8());
    // Without the labels at the edges.
    let area = || (25..125).flat_map(|y| (10..190).map(move |x| (x, y)));
    let differing = area().filter(|&(x, y)| sheet.get_pixel(200 + x, y) != alone.get_pixel(x, y)).count();
    assert!(differing < 20, "{differing} pixels differ");
    let colors: std::collections::HashSet<_> = area().map(|(x, y)| alone.get_pixel(x, y).0).collect();
    assert!(colors.len() > 20);
}

#[test]
fn several_scenes_and_failures_are_listed() {
    let (_dir, dir) = folder();
    fs::write(dir.join("broken.glb"), "glTF").unwrap();
    let scene = model("tests/cube.obj");
    let output = blinn(&dir, &format!("sheet {scene} broken.glb --size 256x256 -s 1 --json -o out/"));
    assert_eq!(output.status.code(), Some(1));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json[0]["file"], "out/cube_sheet.png");
    assert!(json[1]["error"].as_str().unwrap().contains("broken.glb"));
    assert_eq!(names(&dir), ["broken.glb", "out/cube_sheet.png"]);
    runs(&dir, &format!("sheet {scene} --size 256x256 -s 1"));
    assert!(dir.join("cube_sheet.png").exists());
}

/// Sizes of files with z up are named along the axes of the file, too.
#[test]
fn sizes_are_those_of_the_file_where_z_is_up() {
    let (_dir, dir) = folder();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 2\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0\n2 0 0\n2 3 0\n0 0 5\n3 0 1 2\n3 0 1 3\n";
    fs::write(dir.join("part.ply"), ply).unwrap();
    let json = sheet(&dir, "part.ply --size 256x256 -s 1");
    let size = |key: &str| vector(&json[key]).to_array();
    assert_eq!((json["up"].as_str(), size("size_in_file")), (Some("z"), [2.0, 3.0, 5.0]));
    assert_eq!(vector(&json["bounds"]["size"]).to_array(), [2.0, 5.0, 3.0]);
    let json = sheet(&dir, "part.ply --up y --size 256x256 -s 1");
    assert_eq!(
        (json["up"].as_str(), vector(&json["size_in_file"])),
        (Some("y"), vector(&json["bounds"]["size"]))
    );
    let text = String::from_utf8(blinn(&dir, "info part.ply").stdout).unwrap();
    assert!(text.contains("\nup: z in the file, turned to y"), "{text}");
}

#[test]
fn wrong_outputs_are_usage_errors() {
    let (_dir, dir) = folder();
    let scene = model("tests/cube.obj");
    refused(&dir, &format!("sheet {scene} -o a.exr"), "set -o to .png, .jpg or .webp");
    for name in ["a.gif", "a.bmp"] {
        refused(&dir, &format!("sheet {scene} -o {name}"), "set -o to .png, .jpg or .webp");
    }
    refused(&dir, &format!("sheet {scene} -o - --json"), "standard output");
    refused(&dir, &format!("sheet {scene} --size 100x500"), "at least 128x128");
    refused(&dir, &format!("sheet {scene} --orbit 1,2"), "--orbit");
}

fn names_of(json: &Value) -> Vec<&str> {
    json["cells"].as_array().unwrap().iter().map(|cell| cell["view"].as_str().unwrap()).collect()
}

/// Views have their names in the list and below their pictures; cameras of the file have theirs.
#[test]
fn named_views_have_their_names() {
    let (_dir, dir) = folder();
    let scene = model("reconstruction/reconstruction.glb");
    let json = sheet(
        &dir,
        &format!("{scene} --views front,30/20,turntable=2,cameras,front --size 800x600 -s 1 -o s.png"),
    );
    let expected = [
        "front",
        "30°, 20° up",
        "0°",
        "180°",
        "Overview",
        "Left camera",
        "Middle camera",
        "Right camera",
        "front (2)",
    ];
    assert_eq!(names_of(&json), expected);
    let picture = image::open(dir.join("s.png")).unwrap().into_rgb8();
    let cells = json["cells"].as_array().unwrap();
    for row in cells.chunks(3) {
        let number = |cell: &Value, key: &str| cell["rect"][key].as_u64().unwrap() as u32;
        let bottoms = row.iter().map(|cell| number(cell, "y") + number(cell, "height"));
        // The lowest is that of a direction, which fills its space.
        let bottom = bottoms.max().unwrap();
        for cell in row {
            let columns = number(cell, "x")..number(cell, "x") + number(cell, "width");
            let pixels = (bottom..bottom + 19).flat_map(|y| columns.clone().map(move |x| (x, y)));
            let dark = pixels.filter(|&(x, y)| picture.get_pixel(x, y).0.iter().all(|v| *v < 200)).count();
            assert!(dark > 10, "{}: the name stands below", cell["view"]);
            let has_divisor = cell["model_to_pixel"].as_array().unwrap().len() == 3;
            assert_eq!(cell["camera"]["projection"] == "perspective", has_divisor);
        }
    }
    // Directions have one scale, in which the whole scene fits.
    let scale = json["pixels_per_unit"].as_f64().unwrap();
    for cell in &cells[..4] {
        let rect = ["width", "height"].map(|key| cell["rect"][key].as_f64().unwrap());
        let camera = ["view_width", "view_height"].map(|key| cell["camera"][key].as_f64().unwrap());
        assert!((rect[0] / camera[0] / scale - 1.0).abs() < 1e-9);
        for corner in corners(&json) {
            for axis in 0..2 {
                let row = &cell["model_to_pixel"][axis];
                let pixel = vector(row).dot(corner) + row[3].as_f64().unwrap();
                let from = cell["rect"][["x", "y"][axis]].as_f64().unwrap();
                assert!((from..from + rect[axis]).contains(&pixel), "{}: {pixel}", cell["view"]);
            }
        }
    }
    // A scene without cameras, and several scenes: a sheet for each.
    let cube = model("tests/cube.obj");
    let output = blinn(&dir, &format!("sheet {scene} {cube} --views cameras --size 256x256 -s 1 -o out/"));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && text.contains("the file has no cameras"), "{text}");
    assert!(names(&dir).contains(&"out/reconstruction_sheet.png".to_string()));
}

/// Cameras of a list are those of `render`, with their times, and have names also without ones in the list.
#[test]
fn cameras_of_a_list_are_those_of_render() {
    let (_dir, dir) = folder();
    let figure = model("figure/figure.glb");
    let line = |x: f64, rest: &str| {
        format!(
            "{{\"K\": [80,0,32,0,80,32,0,0,1], \"width\": 64, \"height\": 64, \"convention\": \"opengl\", \
             \"camera_to_world\": [1,0,0,{x}, 0,1,0,1, 0,0,1,3, 0,0,0,1]{rest}}}\n"
        )
    };
    let long = format!("{}end", "x".repeat(150));
    let text = line(0.0, ", \"file\": \"side.png\"")
        + &line(0.5, ", \"file\": \"side.jpg\", \"time\": 0.4")
        + &line(-0.5, "")
        + &line(0.2, &format!(", \"file\": \"{long}.png\""));
    fs::write(dir.join("c.jsonl"), text).unwrap();
    let lit = "--lights three-point --exposure 0 -s 1";
    let json = sheet(&dir, &format!("{figure} --cameras c.jsonl {lit} --size 900x250 -o s.png"));
    assert_eq!(names_of(&json), ["side", "side (2)", "camera 3", long.as_str()]);
    let side = json["cells"][0]["rect"]["width"].as_u64().unwrap() as u32;
    let background = "--background .8,.82,.85";
    runs(
        &dir,
        &format!("render {figure} --cameras c.jsonl {lit} {background} --size {side}x{side} -q -o c/#.png"),
    );
    let picture = image::open(dir.join("s.png")).unwrap().into_rgb8();
    // The mean difference of a cell and an image.
    let difference = |cell: usize, number: usize| {
        let alone = image::open(dir.join(format!("c/{number}.png"))).unwrap().into_rgb8();
        let rect = &json["cells"][cell]["rect"];
        let at = |key: &str| rect[key].as_u64().unwrap() as u32;
        assert_eq!(alone.dimensions(), (at("width"), at("height")));
        let sum: f64 = alone
            .enumerate_pixels()
            .flat_map(|(x, y, pixel)| {
                let other = picture.get_pixel(at("x") + x, at("y") + y).0;
                (0..3).map(move |i| f64::from(pixel.0[i].abs_diff(other[i])))
            })
            .sum();
        sum / f64::from(3 * side * side)
    };
    for cell in 0..4 {
        assert!(difference(cell, cell + 1) < 1.5, "{cell}: {}", difference(cell, cell + 1));
    }
    assert!(difference(0, 2) > 2.0, "views differ: {}", difference(0, 2));
    let some = sheet(&dir, &format!("{figure} --cameras c.jsonl --only 3,1 {lit} --size 900x250 -o t.png"));
    assert_eq!(names_of(&some), ["camera 3", "side"]);
}

#[test]
fn views_without_room_and_unknown_ones_are_refused() {
    let (_dir, dir) = folder();
    fs::copy(model("tests/cube.obj"), dir.join("cube.obj")).unwrap();
    fs::write(dir.join("c.jsonl"), "").unwrap();
    for (flags, message) in [
        ("--views turntable=200 --size 500x500", "has no room for 200 views"),
        ("--views side", "expected front, right, back"),
        ("--views 0/100", "elevations are from -90 to 90"),
        ("--views front --cameras c.jsonl", "cannot be used with"),
        ("--cameras c.jsonl", "--cameras: "),
        ("--only 1", "--cameras"),
    ] {
        refused(&dir, &format!("sheet cube.obj {flags}"), message);
    }
}

/// A flat scene has no area from the front and from the right.
#[test]
fn views_that_show_nothing_are_named() {
    let (_dir, dir) = folder();
    fs::write(dir.join("flat.obj"), "v 0 0 0\nv 1 0 0\nv 1 0 1\nf 3 2 1\n").unwrap();
    let messages = runs(&dir, "sheet flat.obj");
    let expected = "the views front, right show nothing: no object is seen from there";
    assert!(messages.contains(expected) && !messages.contains("--orbit"), "{messages}");
}
