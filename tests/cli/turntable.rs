//! `blinn turntable`: a model or a camera once around.

use std::fs;
use std::path::Path;

use crate::common::program::*;

const SMALL: &str = "--size 32x18 -s 1";

fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).unwrap().into_rgb8()
}

/// The mean difference of two pictures, of 255.
fn apart(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.as_raw().len() as f64
}

#[test]
fn a_turntable_goes_once_around() {
    let (_dir, at) = folder();
    let scene = model("still-life/still-life.glb");
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 -q"));
    let all = files(&at);
    let expected: Vec<String> = (1..=4).map(|i| format!("still-life_000{i}.png")).collect();
    assert!(all.keys().eq(&expected), "{:?}", all.keys());
    runs(&at, &format!("render {scene} {SMALL} -q -o once.png"));
    let first = pixels(&at.join(&expected[0]));
    assert!(pixels(&at.join("once.png")) == first, "the first frame is the picture itself");
    let distinct: std::collections::BTreeSet<_> = all.values().collect();
    assert_eq!(distinct.len(), 4);
    // Farms render some of the frames; they are the same.
    runs(&at, &format!("turntable --frames 4 {scene} {SMALL} --only 2,4 -q -o only/"));
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --chunk 2/2 -q -o share/"));
    assert_eq!(names(&at.join("only")), [&expected[1][..], &expected[3]]);
    assert_eq!(names(&at.join("share")), [&expected[2][..], &expected[3]]);
    for part in ["only", "share"] {
        assert!(files(&at.join(part)).iter().all(|(name, bytes)| all[name] == *bytes), "{part}");
    }
    // The other way round, and from elsewhere on.
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --direction cw -q -o cw/#.png"));
    assert!(apart(&pixels(&at.join("cw/2.png")), &pixels(&at.join(&expected[3]))) < 0.1);
    runs(&at, &format!("turntable {scene} {SMALL} --count 4 --start 90 -q -o on/#.png"));
    assert!(apart(&pixels(&at.join("on/1.png")), &pixels(&at.join(&expected[1]))) < 0.1);
}

/// The scene is turned in the file itself, and the turntable's frame must be what `render` makes of it.
#[test]
fn a_turntable_frame_equals_the_rotated_model() {
    let (_dir, at) = folder();
    let quarter = |[x, y, z]: [f64; 3]| [z, y, -x];
    let corners = [[-1., 0., -1.], [2., 0., -1.], [-1., 0., 1.], [-1., 3., -1.]];
    let faces = "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
    let obj = |turned: bool| {
        // Turned about the middle of the bounds, which is (.5, ., 0).
        let place =
            |c: [f64; 3]| if turned { quarter([c[0] - 0.5, c[1], c[2]]) } else { [c[0] - 0.5, c[1], c[2]] };
        corners.map(place).map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat() + faces
    };
    fs::write(at.join("a.obj"), obj(false)).unwrap();
    fs::write(at.join("b.obj"), obj(true)).unwrap();
    let flags = "--size 64x36 -s 4 --view-point 3,5,8 --look-at 0,1,0 --yfov 40 --point-light 4,6,3,40 \
                 --sun -1,-1,-.3,.4 --ambient .1,.1,.1 --ground plane --aov position,normal";
    runs(&at, &format!("turntable a.obj {flags} --count 4 --only 2 -q -o turned_#.exr"));
    runs(&at, &format!("render b.obj {flags} -q -o still.exr"));
    let read = |name: &str| {
        let image = exr::prelude::read_all_flat_layers_from_file(at.join(name)).unwrap();
        let channels = image.layer_data[0].channel_data.list.clone();
        channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect::<Vec<_>>()))
    };
    let mut looked_at = 0;
    for ((name, turned), (_, still)) in read("turned_2.exr").zip(read("still.exr")) {
        // Rounding moves an edge over a sample here and there.
        let off = turned.iter().zip(&still).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
        assert!(off <= turned.len() / 200, "{name}: {off} of {} pixels differ", turned.len());
        looked_at += 1;
    }
    assert_eq!(looked_at, 10);
}

#[test]
fn a_rotating_camera_moves_only_its_own_lights() {
    let (_dir, at) = folder();
    fs::write(
        at.join("a.obj"),
        "v -1 0 -1\nv 2 0 -1\nv -1 0 1\nv -1 3 -1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
    )
    .unwrap();
    let frame = |flags: &str, out: &str| {
        runs(&at, &format!("turntable a.obj --size 64x36 -s 4 --count 4 --only 2 -q {flags} -o {out}#.png"));
        pixels(&at.join(format!("{out}2.png")))
    };
    let model = frame("--lights three-point", "model");
    // Lights that are fixed to the camera: no matter which of the two moves.
    let camera = frame("--lights three-point --turn camera --direction cw", "camera");
    assert!(apart(&model, &camera) < 0.3, "{}", apart(&model, &camera));
    let sun = "--sun -1,-1,-.3,1";
    let lit = (frame(sun, "sun-model"), frame(&format!("{sun} --turn camera --direction cw"), "sun-camera"));
    assert!(apart(&lit.0, &lit.1) > 3.0, "a sun stands still: {}", apart(&lit.0, &lit.1));
}

#[test]
fn invalid_turntables_are_refused() {
    let (_dir, at) = folder();
    let scene = model("cornell/cornell.glb");
    for (flags, message) in [
        ("--count 0", "0"),
        ("--count 4 --only 5", "the frames are 1 to 4"),
        ("--axis 0,0,0", "must not be zero"),
        ("--axis x --ground plane", "--turn camera"),
        ("--elevation 91", "±90"),
        ("--elevation 9 --orbit 1,2", "--orbit"),
        ("-o -", "several frames"),
        ("--frame 2", "--frame"),
    ] {
        refused(&at, &format!("turntable {scene} {flags}"), message);
    }
}
