//! `blinn sheet` of several scenes in one file: a picture of each, on pages.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::program::*;

/// Writes a box of a size.
fn write_box(file: &Path, size: [f64; 3]) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    let scaled = cube.lines().map(|line| match line.strip_prefix("v ") {
        Some(numbers) => {
            let v: Vec<f64> = numbers.split(' ').map(|n| n.parse().unwrap()).collect();
            format!("v {} {} {}\n", v[0] * size[0], v[1] * size[1], v[2] * size[2])
        }
        None => format!("{line}\n"),
    });
    fs::write(file, scaled.collect::<String>()).unwrap();
}

/// A folder of three boxes, two of one name, and a broken file between them.
fn write_parts(at: &Path) {
    write_box(&at.join("parts/a.obj"), [1.0, 2.0, 3.0]);
    write_box(&at.join("parts/b/a.obj"), [3.0, 1.0, 1.0]);
    fs::write(at.join("parts/broken.glb"), "glTF").unwrap();
    write_box(&at.join("parts/c.obj"), [100.0, 100.0, 1.0]);
}

fn scenes(page: &Value) -> Vec<&str> {
    page["cells"].as_array().unwrap().iter().map(|cell| cell["scene"].as_str().unwrap()).collect()
}

fn rect(cell: &Value) -> [u32; 4] {
    ["x", "y", "width", "height"].map(|key| cell["rect"][key].as_u64().unwrap() as u32)
}

#[test]
fn each_scene_has_a_picture_with_its_name() {
    let (_dir, dir) = folder();
    write_parts(&dir);
    let output = blinn(&dir, "sheet parts/ --size 800x600 -s 1 --json -o out/contact.png");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("1 of 4 scenes failed"), "{messages}");
    assert_eq!(names(&dir.join("out")), ["contact.png"]);
    let page: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(page["file"], "out/contact.png");
    assert_eq!(scenes(&page), ["parts/a.obj", "parts/b/a.obj", "parts/broken.glb", "parts/c.obj"]);
    let cells = page["cells"].as_array().unwrap();
    assert!(cells[2]["error"].as_str().unwrap().contains("broken.glb") && cells[2]["rect"].is_null());

    let picture = image::open(dir.join("out/contact.png")).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (800, 600));
    let background = *picture.get_pixel(0, 599);
    let count_in = |[x, y, width, height]: [u32; 4], is_counted: &dyn Fn([u8; 3]) -> bool| {
        let pixels = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y)));
        pixels.filter(|&(x, y)| is_counted(picture.get_pixel(x, y).0)).count()
    };
    // Two columns and rows: the broken scene is below the first one.
    let [left, _, width, height] = rect(&cells[0]);
    let [right, bottom, ..] = rect(&cells[3]);
    assert!(right >= left + width && bottom >= height);
    let places = [rect(&cells[0]), rect(&cells[1]), [left, bottom, width, height], rect(&cells[3])];
    for (i, place) in places.into_iter().enumerate() {
        let covered = count_in(place, &|pixel: [u8; 3]| pixel != background.0);
        let expected = if i == 2 { 0..1 } else { 3000..(width * height) as usize };
        assert!(expected.contains(&covered), "{i}: {covered}");
        let name = [place[0], place[1] + place[3], place[2], 19];
        assert!(
            count_in(name, &|pixel: [u8; 3]| pixel.iter().all(|v| *v < 200)) > 10,
            "{i}: the name stands below"
        );
    }
    for i in [0, 1, 3] {
        assert_eq!(cells[i]["view"], "isometric");
        assert!(cells[i]["exposure"].is_number());
    }
    // The scenes have a hundredfold difference in size, and each fills its place.
    let scale = |i: usize| f64::from(places[i][2]) / cells[i]["camera"]["view_width"].as_f64().unwrap();
    assert!(scale(0) > 20.0 * scale(3), "{} {}", scale(0), scale(3));
}

#[test]
fn the_first_of_the_views_is_shown() {
    let (_dir, dir) = folder();
    write_box(&dir.join("a.obj"), [1.0; 3]);
    fs::copy(model("reconstruction/reconstruction.glb"), dir.join("r.glb")).unwrap();
    let line = "sheet a.obj r.glb --views cameras,front,top --size 256x256 -s 1 --json -q -o s.png";
    let output = blinn(&dir, line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page: Value = serde_json::from_slice(&output.stdout).unwrap();
    let views: Vec<&str> =
        page["cells"].as_array().unwrap().iter().map(|cell| cell["view"].as_str().unwrap()).collect();
    assert_eq!(views, ["front", "Overview"], "a file without cameras shows the next view");
}

/// Scenes that have no room on a page of readable pictures are on the next ones, and bytes do not depend on threads.
#[test]
fn many_scenes_have_pages() {
    let (_dir, dir) = folder();
    for i in 0..5 {
        write_box(&dir.join(format!("parts/{i}.obj")), [1.0 + f64::from(i), 1.0, 2.0]);
    }
    let output = blinn(&dir, "sheet parts --size 256x256 -s 1 --json -q -o p.png");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let pages = json.as_array().unwrap();
    assert_eq!(
        pages.iter().map(|page| page["file"].as_str().unwrap()).collect::<Vec<_>>(),
        ["p.png", "p-2.png"]
    );
    assert_eq!(scenes(&pages[0]), ["parts/0.obj", "parts/1.obj", "parts/2.obj", "parts/3.obj"]);
    assert_eq!(scenes(&pages[1]), ["parts/4.obj"]);
    for page in pages {
        for cell in page["cells"].as_array().unwrap() {
            let [.., width, height] = rect(cell);
            assert!(width.min(height) >= 96, "{width}x{height}");
        }
    }
    for threads in [1, 3] {
        runs(&dir, &format!("sheet parts --size 256x256 -s 1 -q --threads {threads} -o t/p.png"));
        for name in ["p.png", "p-2.png"] {
            let [a, b] = [dir.join(name), dir.join("t").join(name)].map(|file| fs::read(file).unwrap());
            assert!(a == b, "{name} with {threads} threads");
        }
    }
    // All pages are checked before a scene is read.
    fs::remove_file(dir.join("p.png")).unwrap();
    let output = blinn(&dir, "sheet parts --size 256x256 -s 1 --no-overwrite -o p.png");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && messages.contains("p-2.png"), "{messages}");
    assert!(!dir.join("p.png").exists());
}

/// A page never replaces a file that one of its scenes refers to.
#[test]
fn inputs_are_kept() {
    let (_dir, dir) = folder();
    write_box(&dir.join("a.obj"), [1.0; 3]);
    runs(&dir, "sheet a.obj --size 128x128 -s 1 -q -o t.png");
    fs::write(dir.join("t.mtl"), "newmtl m\nmap_Kd t.png\n").unwrap();
    fs::write(
        dir.join("b.obj"),
        "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n",
    )
    .unwrap();
    let before = fs::read(dir.join("t.png")).unwrap();
    let output = blinn(&dir, "sheet a.obj b.obj --size 256x256 -s 1 -o t.png");
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("t.png would overwrite an input file of b.obj"), "{messages}");
    assert!(fs::read(dir.join("t.png")).unwrap() == before);
}

/// One scene, a folder of outputs, a placeholder or a list of cameras: each scene has a sheet of its own, or is refused.
#[test]
fn other_outputs_are_sheets_of_their_own() {
    let (_dir, dir) = folder();
    write_box(&dir.join("parts/a.obj"), [1.0; 3]);
    let output = blinn(&dir, "sheet parts --size 256x256 -s 1 --json -q -o one.png");
    let one: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&one["scene"], one["cells"].as_array().unwrap().len()), (&Value::from("parts/a.obj"), 4));
    write_box(&dir.join("parts/b.obj"), [1.0; 3]);
    runs(&dir, "sheet parts --size 256x256 -s 1 -q -o {stem}.png");
    runs(&dir, "sheet parts --size 256x256 -s 1 -q -o out/");
    assert_eq!(names(&dir.join("out")), ["a_sheet.png", "b_sheet.png"]);
    assert!(dir.join("a.png").exists() && dir.join("b.png").exists());
    let camera = "{\"K\": [80,0,32,0,80,32,0,0,1], \"width\": 64, \"height\": 64, \"convention\": \"opengl\", \
                  \"camera_to_world\": [1,0,0,0, 0,1,0,0, 0,0,1,9, 0,0,0,1]}\n";
    fs::write(dir.join("c.jsonl"), camera).unwrap();
    refused(&dir, "sheet parts --cameras c.jsonl -o s.png", "would both be written to s.png");
    refused(&dir, "sheet parts -o -", "standard output takes one image");
    refused(&dir, "sheet parts --size 100x500 -o s.png", "at least 128x128");
}
