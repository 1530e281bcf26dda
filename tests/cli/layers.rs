//! Layers of geometry: camera space, object coordinates, flow, triangles. They are read from EXR files.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use serde_json::json;

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;
use crate::image_output::{channel, read_exr};

/// Size of the pictures.
pub const SIZE: (usize, usize) = (48, 36);
/// A camera without perspective: 4 m × 3 m in front of the plane z = 0.
pub const FRONT: &str =
    "--view-point 0,0,9 --view-dir 0,0,-1 --projection orthographic --view-width 4 --view-height 3";
/// Pixels per metre of [`FRONT`].
pub const SCALE: f64 = 12.0;

/// The channels of layers, pixel by pixel.
pub struct Layers(crate::image_output::Exr);

impl Layers {
    pub fn read(path: &Path) -> Layers {
        Layers(read_exr(path))
    }

    pub fn values(&self, name: &str) -> Vec<f64> {
        channel(&self.0, name).into_iter().map(f64::from).collect()
    }

    pub fn vectors(&self, name: &str, letters: &str) -> Vec<DVec3> {
        let all: Vec<Vec<f64>> =
            letters.chars().map(|letter| self.values(&format!("{name}.{letter}"))).collect();
        (0..all[0].len()).map(|i| DVec3::from_array(std::array::from_fn(|k| all[k][i]))).collect()
    }
}

/// Renders EXR layers of `scene`.
pub fn layers(at: &Path, scene: &str, aovs: &str, flags: &str) -> Layers {
    let (w, h) = SIZE;
    runs(at, &format!("render {scene} --size {w}x{h} -s 1 -q -o a.exr --aov {aovs} {flags}"));
    Layers::read(&at.join("a.exr"))
}

/// Pixels with a hit.
pub fn hits(layers: &Layers) -> Vec<usize> {
    let found: Vec<usize> =
        layers.values("mask.A").iter().enumerate().filter(|(_, v)| **v > 0.0).map(|(i, _)| i).collect();
    assert!(found.len() > 60, "{} hits", found.len());
    found
}

/// The centre of a pixel, rows downward.
pub fn centre(i: usize) -> DVec2 {
    DVec2::new((i % SIZE.0) as f64 + 0.5, (i / SIZE.0) as f64 + 0.5)
}

#[test]
fn camera_layers_follow_from_world_layers() {
    let (_dir, at) = folder();
    let eye = DVec3::new(0.3, 0.7, 2.4);
    // Looks along −x + −z, upright.
    let w = DVec3::new(0.28, 0.0, 0.96);
    let u = DVec3::new(0.96, 0.0, -0.28);
    let view = "--view-point .3,.7,2.4 --view-dir=-.28,0,-.96 --view-up 0,1,0 --yfov 60 --clip off";
    let aovs = "mask,depth,distance,position,normal,camera-position,camera-normal";
    let all = layers(&at, &model("textured/textured.glb"), aovs, view);
    let [position, normal] = ["position", "normal"].map(|name| all.vectors(name, "XYZ"));
    let [in_camera, normal_in_camera] =
        ["camera-position", "camera-normal"].map(|name| all.vectors(name, "XYZ"));
    let to_camera = |v: DVec3| DVec3::new(v.dot(u), v.y, v.dot(w));
    let (depth, distance) = (all.values("depth.Z"), all.values("distance.D"));
    for i in hits(&all) {
        assert!(in_camera[i].abs_diff_eq(to_camera(position[i] - eye), 1e-5));
        assert!(normal_in_camera[i].abs_diff_eq(to_camera(normal[i]), 1e-6));
        assert!((in_camera[i].z + depth[i]).abs() < 1e-5);
        assert!((in_camera[i].length() - distance[i]).abs() < 1e-5);
        // A pinhole camera of OpenGL: the position projects to the centre of its pixel.
        let focal = 0.5 * SIZE.1 as f64 / (30f64.to_radians()).tan();
        let p = in_camera[i];
        let pixel = DVec2::new(-p.x / p.z, p.y / p.z) * focal + 0.5 * DVec2::new(48.0, 36.0);
        assert!(pixel.abs_diff_eq(centre(i), 1e-3), "{pixel}");
    }
    let miss = all.values("mask.A").iter().position(|v| *v == 0.0).unwrap();
    assert!(distance[miss] == f64::INFINITY && in_camera[miss] == DVec3::ZERO);
}

/// A box of 1 × 2 × 2 metres after the scale of its node: the diagonal is 3 m.
#[test]
fn object_coordinates_turn_with_the_object() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 });
    let corners: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let positions = fixture.vec3(&corners);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<u16> =
        faces.iter().flat_map(|f: &[u16; 4]| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect();
    let indices = fixture.indices(&triangles);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    fixture.push("meshes", json!({"primitives": [primitive]}));
    let half = 0.5f64.sqrt();
    fixture.node(json!({"name": "box", "mesh": 0, "translation": [0.2, 0.1, 0.0],
        "rotation": [0.0, 0.0, half, half], "scale": [0.5, 1.0, 1.0]}));
    std::fs::write(at.join("box.glb"), fixture.glb()).unwrap();
    let all = layers(&at, "box.glb", "mask,position,nocs,triangle-id,barycentric", FRONT);
    let [position, nocs] = ["position", "nocs"].map(|name| all.vectors(name, "XYZ"));
    let weights = all.vectors("barycentric", "UVW");
    let ids = all.values("triangle-id.I");
    // A quarter turn about z.
    let turn = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);
    for i in hits(&all) {
        let local = turn.transpose() * (position[i] - DVec3::new(0.2, 0.1, 0.0));
        assert!(nocs[i].abs_diff_eq(local / 3.0 + 0.5, 1e-6), "{} {local}", nocs[i]);
        // The triangle's corners with the barycentrics as weights give the point.
        let id = ids[i] as usize;
        let corner = |k: usize| DVec3::from(corners[triangles[3 * (id - 1) + k] as usize].map(f64::from));
        let p = corner(0) * weights[i].x + corner(1) * weights[i].y + corner(2) * weights[i].z;
        assert!((p * DVec3::new(0.5, 1.0, 1.0)).abs_diff_eq(local, 1e-5), "{p} {local}");
    }
    assert!(ids.contains(&0.0), "0 without a hit");
}

/// A square that moves by 1/8 m in each frame, behind a strip that stands still.
fn write_moving_square(at: &Path) {
    let mut fixture = Fixture::empty();
    let square = |fixture: &mut Fixture, half: [f32; 2]| {
        let [x, y] = half;
        let positions = fixture.vec3(&[[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]);
        let indices = fixture.indices(&[0, 1, 2, 0, 2, 3]);
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        fixture.push("meshes", json!({"primitives": [primitive]}))
    };
    let square_mesh = square(&mut fixture, [0.5, 0.5]);
    let strip_mesh = square(&mut fixture, [0.23, 1.0]);
    let moving = fixture.node(json!({"name": "square", "mesh": square_mesh}));
    fixture.node(json!({"name": "strip", "mesh": strip_mesh, "translation": [0.0, 0.0, 1.0]}));
    let input = fixture.floats("SCALAR", 1, &[0.0, 2.0]);
    let output = fixture.vec3(&[[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0]]);
    fixture.push(
        "animations",
        json!({"samplers": [{"input": input, "output": output, "interpolation": "LINEAR"}],
            "channels": [{"sampler": 0, "target": {"node": moving, "path": "translation"}}]}),
    );
    std::fs::write(at.join("moving.glb"), fixture.glb()).unwrap();
}

#[test]
fn flow_leads_to_the_same_point_of_the_next_frame() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let aovs = "mask,object-id,position,flow-forward,flow-backward";
    // 3 m in 2 s at 12 frames per second: 1/8 m, so 1.5 pixels, a frame.
    for (frame, centre_x) in [(8, -0.5), (12, 0.0), (16, 0.5)] {
        let all = layers(&at, "moving.glb", aovs, &format!("{FRONT} --fps 12 --frame {frame}"));
        let position = all.vectors("position", "XYZ");
        let ids = all.values("object-id.I");
        for (name, step) in [("flow-forward", 1.0), ("flow-backward", -1.0)] {
            let flow = all.vectors(name, "XYV");
            let mut seen = [[0, 0]; 2];
            for i in hits(&all) {
                let moves = ids[i] == 1.0;
                let expected = if moves { DVec2::new(step * 0.125 * SCALE, 0.0) } else { DVec2::ZERO };
                assert!(flow[i].truncate().abs_diff_eq(expected, 1e-4), "{name} {}", flow[i]);
                // The strip covers −0.23…0.23 m.
                let x = position[i].x + step * 0.125;
                let is_hidden = moves && x.abs() < 0.23;
                assert!(!moves || (x - (centre_x + step * 0.125)).abs() <= 0.5);
                assert_eq!(flow[i].z == 0.0, is_hidden, "{name} at {}", position[i]);
                seen[usize::from(moves)][usize::from(is_hidden)] += 1;
            }
            assert!(seen[0][0] > 50 && seen[1][0] > 50, "{seen:?}");
            assert!(frame == 12 || seen[1][1] > 0 || (step > 0.0) != (frame < 12), "{seen:?}");
        }
        let miss = ids.iter().position(|id| *id == 0.0).unwrap();
        assert_eq!(all.vectors("flow-forward", "XYV")[miss], DVec3::ZERO);
    }
}

/// Flow is that of the complete sequence: it depends neither on the frames that are rendered nor on a crop.
#[test]
fn flow_depends_only_on_the_frame() {
    let (_dir, at) = folder();
    let flags = "--count 12 --size 48x36 -s 1 -q --aov mask,flow-forward,flow-backward,nocs,object-id";
    let scene = model("assembly/assembly.glb");
    runs(&at, &format!("turntable {scene} {flags} --only 1,2,12 -o all/##.exr"));
    let frames = ["01", "02", "12"].map(|n| Layers::read(&at.join(format!("all/{n}.exr"))));
    runs(&at, &format!("turntable {scene} {flags} --only 12 --crop 10,8,20,20 -o crop/##.exr"));
    let crop = Layers::read(&at.join("crop/12.exr"));
    let whole = frames[2].vectors("flow-forward", "XYV");
    for (k, v) in crop.vectors("flow-forward", "XYV").iter().enumerate() {
        assert_eq!(*v, whole[(8 + k / 20) * SIZE.0 + 10 + k % 20]);
    }
    // The turn starts again after the last frame. A visible point has the same object coordinates there.
    for (from, to, name) in [(0, 1, "flow-forward"), (1, 0, "flow-backward"), (2, 0, "flow-forward")] {
        let flow = frames[from].vectors(name, "XYV");
        let nocs = [from, to].map(|k| frames[k].vectors("nocs", "XYZ"));
        let ids = [from, to].map(|k| frames[k].values("object-id.I"));
        let mut apart = Vec::new();
        for i in hits(&frames[from]).into_iter().filter(|&i| flow[i].z > 0.0) {
            let pixel = (centre(i) + flow[i].truncate()).floor();
            let k = pixel.y.min(35.0) as usize * SIZE.0 + pixel.x.min(47.0) as usize;
            if ids[0][i] == ids[1][k] {
                apart.push((nocs[0][i] - nocs[1][k]).length());
            }
        }
        apart.sort_by(f64::total_cmp);
        assert!(apart.len() > 200 && apart[apart.len() / 2] < 0.02, "{name}: {:?}", apart[apart.len() / 2]);
    }
}

#[test]
fn flow_needs_frames() {
    let (_dir, at) = folder();
    let cube = model("tests/cube.obj");
    refused(&at, &format!("render {cube} -o a.exr --aov flow-forward"), "set --frame or --frames");
    refused(&at, &format!("turntable {cube} --views 3 -o a/#.exr --aov flow-backward"), "without --views");
    // Without animation, nothing moves.
    let still = layers(&at, &cube, "mask,flow-forward", "--frame 3");
    let flow = still.vectors("flow-forward", "XYV");
    assert!(hits(&still).into_iter().all(|i| flow[i] == DVec3::Z));
}

/// A list of one camera at the times of frames has their flow, except beyond its ends.
#[test]
fn flow_leads_from_camera_to_camera() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let flags = "--size 48x36 -s 1 -q --aov mask,flow-forward,flow-backward";
    let camera = |frame: usize| {
        format!("--frame {frame} --fps 4 --view-point 0,0,6 --view-dir 0,0,-1 --view-up 0,1,0")
    };
    let line = |shift: f64, frame: f64, size: u32| {
        format!(
            "{{\"K\": [[60, 0, 24], [0, 60, 18], [0, 0, 1]], \"width\": {size}, \"height\": 36, \
             \"convention\": \"opengl\", \"time\": {}, \"camera_to_world\": \
             [[1, 0, 0, {shift}], [0, 1, 0, 0], [0, 0, 1, 6], [0, 0, 0, 1]]}}\n",
            frame / 4.0
        )
    };
    let write = |name: &str, lines: &[String]| std::fs::write(at.join(name), lines.concat()).unwrap();
    let still = [3.0, 4.0, 5.0].map(|frame| line(0.0, frame, 48));
    write("still.jsonl", &still);
    runs(&at, &format!("render moving.glb --cameras still.jsonl {flags} -o list/#.exr"));
    let lens = "--intrinsics 60,60,24,18";
    runs(&at, &format!("render moving.glb {} {lens} {flags} -o frame.exr", camera(4)));
    let [first, middle, last] = ["1", "2", "3"].map(|n| Layers::read(&at.join(format!("list/{n}.exr"))));
    let frame = Layers::read(&at.join("frame.exr"));
    for name in ["flow-forward", "flow-backward"] {
        assert_eq!(middle.vectors(name, "XYV"), frame.vectors(name, "XYV"), "{name}");
    }
    let is_empty =
        |layers: &Layers, name: &str| layers.vectors(name, "XYV").iter().all(|v| *v == DVec3::ZERO);
    assert!(is_empty(&first, "flow-backward") && !is_empty(&first, "flow-forward"));
    assert!(is_empty(&last, "flow-forward") && !is_empty(&last, "flow-backward"));
    // A camera that moves to the right by 0.1 m moves points at a depth of 5 m by 1.2 pixels to the left.
    write("moving.jsonl", &[line(0.0, 3.0, 48), line(0.1, 4.0, 48)]);
    runs(&at, &format!("render moving.glb --hide square --cameras moving.jsonl {flags} -o moved/#.exr"));
    let moved = Layers::read(&at.join("moved/1.exr"));
    let flow = moved.vectors("flow-forward", "XYV");
    assert!(hits(&moved).into_iter().all(|i| flow[i].truncate().abs_diff_eq(DVec2::new(-1.2, 0.0), 1e-4)));
    // --resume makes an image again if the camera after it changes.
    write("moving.jsonl", &[line(0.0, 3.0, 48), line(0.2, 4.0, 48)]);
    let again =
        format!("render moving.glb --hide square --cameras moving.jsonl {flags} -o moved/#.exr --resume");
    runs(&at, &again);
    assert!(Layers::read(&at.join("moved/1.exr")).vectors("flow-forward", "XYV") != flow);
    let refuses = |lines: &[String], message: &str| {
        write("bad.jsonl", lines);
        refused(&at, "render moving.glb --cameras bad.jsonl --aov flow-forward -o b/#.exr", message);
    };
    refuses(&[line(0.0, 4.0, 48), line(0.0, 4.0, 48)], "not every camera has a later time");
    refuses(&[line(0.0, 4.0, 48), line(0.0, 5.0, 50)], "different sizes");
}

/// --resume renders a frame again if its neighbours change.
#[test]
fn a_frame_with_flow_depends_on_its_neighbours() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let render = |aov: &str, fps: u32| {
        let frame = fps / 2;
        runs(
            &at,
            &format!(
                "render moving.glb --size 24x18 -s 1 --fps {fps} --frame {frame} -o {aov}.exr --aov {aov} --resume"
            ),
        )
    };
    for (aov, is_made_again) in [("depth", false), ("flow-forward", true)] {
        render(aov, 4);
        let before = std::fs::read(at.join(format!("{aov}.exr"))).unwrap();
        render(aov, 8);
        assert_eq!(std::fs::read(at.join(format!("{aov}.exr"))).unwrap() != before, is_made_again, "{aov}");
    }
}

#[test]
fn layers_have_previews() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let names = ["distance", "camera-normal", "camera-position", "nocs", "flow-forward", "barycentric"];
    let aovs = format!("{},triangle-id", names.join(","));
    runs(&at, &format!("render moving.glb {FRONT} --size 48x36 -s 1 --frame 12 -q -o a.png --aov {aovs}"));
    for name in names.into_iter().chain(["triangle-id"]) {
        let preview = image::open(at.join(format!("a.{name}.png"))).unwrap().into_rgb8();
        assert_eq!(preview.get_pixel(0, 0).0, [0; 3], "{name}: nothing is hit");
        assert_ne!(preview.get_pixel(24, 18).0, [0; 3], "{name}");
    }
}

/// The layers of light add up to the colours of an EXR file, over a background as well.
#[test]
fn layers_of_light_add_up_to_the_picture() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let names = [
        "diffuse-direct",
        "diffuse-indirect",
        "specular-direct",
        "specular-indirect",
        "emission",
        "environment",
    ];
    let line = format!("render moving.glb {FRONT} --size 48x36 --frame 12 -q --aov {}", names.join(","));
    for (file, background) in [
        ("clear.exr", ""),
        ("grey.exr", "--background .2,.3,.4"),
        ("sky.exr", "--background hdri --hdri sky"),
    ] {
        runs(&at, &format!("{line} {background} -o {file}"));
        let layers = Layers::read(&at.join(file));
        let parts = names.map(|name| layers.vectors(name, "RGB"));
        let [r, g, b] = ["R", "G", "B"].map(|channel| layers.values(channel));
        assert!(r.iter().any(|&r| r > 0.1), "{file}");
        for i in 0..r.len() {
            let (sum, color) =
                (parts.iter().map(|part| part[i]).sum::<DVec3>(), DVec3::new(r[i], g[i], b[i]));
            assert!(sum.abs_diff_eq(color, 1e-5), "{file}: pixel {i}: {sum} for {color}");
        }
    }
    let line = format!("render moving.glb {FRONT} --size 48x36 --frame 12 -q -o a.png --aov {}", names[3]);
    runs(&at, &line);
    let preview = image::open(at.join("a.specular-indirect.png")).unwrap().into_rgb8();
    assert_ne!(preview.get_pixel(24, 18).0, [0; 3]);
}

/// 16-bit depth in the unit of a flag, and a warning where 16 bits do not suffice.
#[test]
fn depth_has_the_unit_that_a_flag_sets() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let line = format!("render moving.glb {FRONT} --size 48x36 -s 1 --frame 0 --aov depth -o a.png");
    // The strip is 8 m from the eye, the square 9 m.
    for (unit, strip, square) in [("mm", 8000, 9000), ("m", 8, 9), ("0.0005", 16_000, 18_000)] {
        let messages = runs(&at, &format!("{line} --depth-unit {unit}"));
        assert!(!messages.contains("warning"), "{messages}");
        let image::DynamicImage::ImageLuma16(depth) = image::open(at.join("a.depth.png")).unwrap() else {
            panic!("not 16-bit grey");
        };
        let at_pixel = |x: u32| depth.get_pixel(x, 18).0[0];
        assert_eq!((at_pixel(47), at_pixel(6), at_pixel(24)), (0, square, strip), "{unit}");
    }
    let messages = runs(&at, &format!("{line} --depth-unit .0001"));
    assert!(messages.contains("frame 0 has depths up to 9 m"), "{messages}");
    assert!(messages.contains("set a larger --depth-unit"), "{messages}");
    fails(&at, &format!("{line} --depth-unit .0001 --strict").split(' ').collect::<Vec<_>>(), 1, "6.5535 m");
    refused(&at, "render moving.glb -o a.png --depth-unit mm", "only to --aov depth");
    refused(&at, "render moving.glb -o a.exr --aov depth --depth-unit mm", "an .exr holds metres");
    refused(&at, "render moving.glb --frames -o a.gif --depth-unit mm", "only to images");
    refused(&at, "render moving.glb -o a.png --aov depth --depth-unit 0", "greater than zero");
    // A dataset says it.
    runs(&at, "turntable moving.glb --views 2 --size 24x18 -s 1 -q -o ds/#.png --depth-unit mm");
    let text = std::fs::read_to_string(at.join("ds/transforms.json")).unwrap();
    assert!(text.contains("\"integer_depth_scale\": 0.001"), "{text}");
}

/// Ids beside an image are indices into a palette: the pixels are those of an EXR.
#[test]
fn id_images_hold_ids_and_names() {
    let (_dir, at) = folder();
    write_moving_square(&at);
    let line =
        format!("render moving.glb {FRONT} --size 48x36 -s 1 -q --frame 0 --aov object-id,material-id");
    runs(&at, &format!("{line} -o a.exr"));
    runs(&at, &format!("{line} -o a.png"));
    let all = Layers::read(&at.join("a.exr"));
    for name in ["object-id", "material-id"] {
        let file = std::fs::File::open(at.join(format!("a.{name}.png"))).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(reader.info().color_type, png::ColorType::Indexed);
        let expected = all.values(&format!("{name}.I"));
        assert!(pixels.iter().map(|&id| f64::from(id)).eq(expected), "{name}");
        let names = reader.info().utf8_text.iter().find(|chunk| chunk.keyword == "names").unwrap();
        let names = names.get_text().unwrap();
        assert!(name == "material-id" || names == r#"{"1":"square","2":"strip"}"#, "{names}");
    }
}

#[test]
fn a_heat_map_is_an_aov_layer() {
    let (_guard, folder) = folder();
    let scene = model("cornell/cornell.obj");
    runs(&folder, &format!("render {scene} -o a.png --size 48x27 -s 1 --aov steps"));
    runs(&folder, &format!("render {scene} -o b.png --size 48x27 -s 1 --aov steps --threads 1"));
    let all = files(&folder);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["a.png", "a.steps.png", "b.png", "b.steps.png"]);
    assert!(all["a.steps.png"] == all["b.steps.png"] && all["a.png"] == all["b.png"]);
    let shown = image::open(folder.join("a.steps.png")).unwrap().to_rgb8();
    let mut colors: Vec<_> = shown.pixels().collect();
    colors.sort_by_key(|p| p.0);
    colors.dedup();
    assert!(colors.len() > 4, "{} colours", colors.len());
}
