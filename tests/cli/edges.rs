//! Edges over pictures, as points and lines without faces are: lines that the camera sees.

use std::fs;
use std::path::Path;

use image::RgbaImage;

use crate::common::program::*;

/// A cube of side 2 about the origin whose faces are quads, each of a material of its own, and whose vertices are not shared.
fn cube() -> String {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1 } else { -1 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = String::new();
    for (face, corners) in faces.iter().enumerate() {
        for &i in corners {
            let [x, y, z] = corner(i);
            text += &format!("v {x} {y} {z}\n");
        }
        text += &format!("usemtl {face}\nf -4 -3 -2 -1\n");
    }
    text
}

/// A square in the plane z = 0.
const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";
/// A camera that sees the square from −2 to 2, in 64 pixels.
const FRONT: &str =
    "--view-point 0,0,8 --look-at 0,0,0 --projection orthographic --view-rect -2,2,-2,2 --size 64x64";

fn render(folder: &Path, options: &str) -> RgbaImage {
    runs(folder, &format!("render a.obj -o a.png {options}"));
    image::open(folder.join("a.png")).unwrap().into_rgba8()
}

/// Sum of alpha over a picture, in pixels.
pub fn coverage(picture: &RgbaImage) -> f64 {
    picture.pixels().map(|pixel| f64::from(pixel[3]) / 255.0).sum()
}

/// Lines have the area of their length times their width, whatever the resolution, and round ends.
#[test]
fn drawings_cover_what_their_lines_do() {
    let (_guard, folder) = folder();
    fs::write(folder.join("a.obj"), SQUARE).unwrap();
    let only = format!("{FRONT} --edges-only -s 64");
    for (options, length, width) in [
        ("--edges boundary", 128.0, 1.0),
        ("--edges feature", 128.0, 1.0),
        ("--edges silhouette --edge-width 2px", 128.0, 2.0),
        ("--edges all", 128.0, 1.0),
        ("--edges boundary --edge-width .125", 128.0, 2.0),
    ] {
        let area = coverage(&render(&folder, &format!("{only} {options}")));
        let expected = length * width;
        assert!((area - expected).abs() < 0.04 * expected, "{options}: {area}, not {expected}");
    }
    // A pixel stays a pixel.
    let large = render(
        &folder,
        &format!("{} --edges-only -s 64 --edges boundary", FRONT.replace("64x64", "256x256")),
    );
    assert!((coverage(&large) - 512.0).abs() < 10.0, "{}", coverage(&large));
}

/// Wireframes have the sides of polygons and no diagonals. Those of a bent quad are part of its outline.
#[test]
fn wireframes_have_the_edges_of_polygons() {
    let (_guard, folder) = folder();
    let diagonal = 32.0 * std::f64::consts::SQRT_2;
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n";
    // The middle of a side is a vertex of it; a vertex twice makes a triangle without area.
    let pentagon = SQUARE.replace("f 1 2 3 4", "v 0 -1 0\nf 1 5 2 2 3 4");
    for (name, text, length) in [
        ("a.obj", SQUARE.to_string(), 128.0),
        ("a.obj", SQUARE.replace("f 1 2 3 4", "f 1 2 3\nf 1 3 4"), 128.0 + diagonal),
        ("a.obj", pentagon, 128.0),
        ("a.ply", format!("{ply}4 0 1 2 3\n"), 128.0),
        ("a.ply", format!("{}3 0 1 2\n3 0 2 3\n", ply.replace("face 1", "face 2")), 128.0 + diagonal),
        ("a.obj", SQUARE.replace("1 1 0", "1 1 1"), 128.0),
    ] {
        fs::write(folder.join(name), text).unwrap();
        let options = format!("{FRONT} --edges-only -s 64 --up y --edges all");
        runs(&folder, &format!("render {name} -o a.png {options}"));
        let area = coverage(&image::open(folder.join("a.png")).unwrap().into_rgba8());
        assert!((area - length).abs() < 0.04 * length, "{name}: {area}, not {length}");
    }
    // A quad folded along its diagonal, which lies above both halves in the picture.
    fs::write(folder.join("a.obj"), "v -1 0 0\nv 0 -1 1\nv 1 0 0\nv 0 -1 -2\nf 1 2 3 4\n").unwrap();
    for (options, length) in
        [("silhouette", 32.0 + diagonal), ("feature --edge-angle 5", diagonal), ("all", diagonal)]
    {
        let area = coverage(&render(&folder, &format!("{FRONT} --edges-only -s 64 --edges {options}")));
        assert!((area - length).abs() < 0.04 * length, "{options}: {area}, not {length}");
    }
}

/// Materials and split vertices make no borders; the diagonals of quads are flat.
#[test]
fn a_cube_has_twelve_edges_of_which_nine_are_visible() {
    let (_guard, folder) = folder();
    fs::write(folder.join("a.obj"), cube()).unwrap();
    let view = "--view-point 20,20,20 --look-at 0,0,0 --projection orthographic --view-rect -2,2,-2,2 --size 128x128";
    // All edges are foreshortened alike.
    let edge = 2.0 * (2.0f64 / 3.0).sqrt() * 32.0;
    let drawn = |options: &str| {
        let picture = render(&folder, &format!("{view} --edges-only -s 16 {options}"));
        coverage(&picture) / edge
    };
    let near = |count: f64, expected: f64| assert!((count - expected).abs() < 0.3, "{count}, not {expected}");
    near(drawn("--edges feature"), 9.0);
    near(drawn("--edges all"), 9.0);
    near(drawn("--edges silhouette"), 6.0);
    assert_eq!(drawn("--edges boundary"), 0.0);
    near(drawn("--edges feature --edge-angle 100"), 0.0);
    // A quarter, or five eighths, of three hidden edges is drawn.
    near(drawn("--edges feature --hidden-edges faint"), 9.75);
    near(drawn("--edges feature --hidden-edges dashed"), 9.0 + 3.0 * 5.0 / 8.0);
}

#[test]
fn edges_lie_over_the_shading_and_change_no_layers() {
    let (_guard, folder) = folder();
    fs::write(folder.join("a.obj"), SQUARE).unwrap();
    let options = format!("{FRONT} --aov depth,object-id -s 16");
    let plain = render(&folder, &options);
    let read = || ["a.depth.png", "a.object-id.png"].map(|name| image::open(folder.join(name)).unwrap());
    let layers = read();
    let red = render(&folder, &format!("{options} --edges boundary --edge-color #f00 --edge-width 4px"));
    assert!(layers == read());
    assert_eq!(plain.get_pixel(32, 32), red.get_pixel(32, 32));
    for (x, y) in [(16, 32), (47, 32), (32, 16)] {
        let [r, g, b, a] = red.get_pixel(x, y).0;
        assert!(r > 200 && g < 60 && b < 60 && a == 255, "{x} {y}: {r} {g} {b} {a}");
    }
}

#[test]
fn edge_options_are_checked() {
    let (_guard, folder) = folder();
    fs::write(folder.join("a.obj"), SQUARE).unwrap();
    for (options, message) in [
        ("--edges features", "did you mean 'feature'?"),
        ("--edges feature --edge-width 1000px", "at most 100 pixels"),
        ("--edges feature --edge-angle 200", "degrees from 0 to 180"),
        ("--edges feature --hidden-edges dotted", "dotted"),
        ("--edges-only", "--edges"),
    ] {
        refused(&folder, &format!("render a.obj -o a.png {options}"), message);
    }
}

/// Scene units cast shadows, pixels do not.
#[test]
fn points_of_a_size_in_metres_cast_shadows() {
    let (_guard, folder) = folder();
    fs::write(folder.join("a.obj"), format!("{}p 5\nv 0 0 2\n", SQUARE.replace("f ", "v 0 0 2\nf ")))
        .unwrap();
    let view = FRONT.replace("0,0,8", "6,0,8");
    let options = format!("{view} --lights none --sun 0,0,-1,3");
    let dark = |size: &str| {
        let picture = render(&folder, &format!("{options} --point-size {size}"));
        picture.pixels().filter(|pixel| pixel[0] < 30).count()
    };
    let (pixels, metres) = (dark("8px"), dark(".5"));
    // The shadow is a disc of radius 1/4 at an angle: π/16 · 4/5 · 16² = 40 pixels, some of them at its rim.
    assert!(pixels == 0 && (26..=40).contains(&metres), "{metres} {pixels}");
}

/// The estimated memory counts the edges that a smooth surface can draw.
#[test]
fn smooth_surfaces_need_less_memory_for_their_edges() {
    let (_guard, folder) = folder();
    // A grid of 20,000 triangles, flat but for the peaks on request.
    let grid = |height: f64| {
        let mut text = String::new();
        for i in 0..101 * 101 {
            let (x, y) = (i % 101, i / 101);
            text += &format!("v {x} {y} {}\n", height * f64::from((x + y) % 2));
        }
        for i in (0..100 * 101).filter(|i| i % 101 < 100) {
            text += &format!("f {} {} {}\nf {} {1} {}\n", i + 1, i + 2, i + 102, i + 102, i + 103);
        }
        text
    };
    let needed = |text: &str, kinds: &str| -> f64 {
        fs::write(folder.join("a.obj"), text).unwrap();
        let messages = runs(&folder, &format!("render a.obj -o a.png --size 16x16 -s 1 --perf {kinds}"));
        let (_, estimate) = messages.split_once("estimate").unwrap_or_else(|| panic!("{messages}"));
        let words: Vec<&str> = estimate.split_whitespace().collect();
        assert_eq!(words[1], "MiB", "{messages}");
        words[0].parse().unwrap()
    };
    let [smooth, rough] = [grid(0.0), grid(3.0)];
    let (none, all) = (needed(&smooth, ""), needed(&smooth, "--edges all"));
    // 2 edges of 104 bytes for each triangle.
    assert!(all > none + 2.0, "{none} {all}");
    assert!(needed(&smooth, "--edges feature") < all - 2.0);
    assert!(needed(&rough, "--edges feature") > all - 1.0);
}
