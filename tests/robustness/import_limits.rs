//! What a file may ask for: each limit holds at the number itself and not one past it, and graphs
//! that would unfold without end are refused by counting.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use blinn::accel::{Accel, BuildSettings};
use blinn::import::{Limits, LoadError, LoadOptions, Warning, load, load_sky};
use blinn::scene::{PoseSettings, Scene, pose};
use serde_json::{Value, json};

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}

fn read(path: &Path, limits: Limits) -> Result<(Scene, Vec<Warning>), LoadError> {
    load(path, &LoadOptions { limits, ..LoadOptions::default() })
}

/// Finds out how much the file asks for, and holds the limit against exactly that.
fn judge(name: &str, set: impl Fn(&mut Limits, u64)) {
    let path = model(name);
    let with = |allowed: u64| {
        let mut limits = Limits::default();
        set(&mut limits, allowed);
        read(&path, limits)
    };
    let Err(LoadError::Limit { asked, allowed: 0, .. }) = with(0) else { panic!("{name} asks for nothing") };
    // A file may meet a limit at several places, each larger than the one before.
    let mut asked = asked;
    while let Err(LoadError::Limit { asked: more, .. }) = with(asked) {
        assert!(more > asked, "{name}");
        asked = more;
    }
    with(asked).unwrap_or_else(|e| panic!("{name} at the limit: {e}"));
    match with(asked - 1) {
        Err(LoadError::Limit { asked: told, allowed, .. }) => assert_eq!((told, allowed), (asked, asked - 1)),
        other => panic!("{name} one past the limit: {other:?}"),
    }
}

#[test]
fn every_limit_holds_at_the_limit_and_not_one_past() {
    for name in ["tests/triangle.glb", "tests/triangle.gltf", "tests/cube.obj"] {
        judge(name, |l, n| l.file_bytes = n);
        judge(name, |l, n| l.instances = n);
        judge(name, |l, n| l.vertices = n);
        judge(name, |l, n| l.triangles = n);
    }
    // Files that others refer to, too.
    judge("textured/textured.gltf", |l, n| l.file_bytes = n);
    judge("tests/gltf/instances_gpu.glb", |l, n| l.instances = n);
    judge("tests/gltf/strip_draco.glb", |l, n| l.vertices = n);
    judge("tests/gltf/strip_draco.glb", |l, n| l.triangles = n);
    judge("assembly/assembly.glb", |l, n| l.nodes = n);
    judge("tests/gltf/torus_meshopt_raw.glb", |l, n| l.decompressed_bytes = n);
    judge("textured/textured.glb", |l, n| l.texture_bytes = n);
    judge("textured/textured.obj", |l, n| l.texture_bytes = n);
    judge("tests/gltf/basisu.glb", |l, n| l.texture_bytes = n);
}

/// A picture that is too large costs itself alone.
#[test]
fn pictures_hold_their_limit() {
    for name in ["textured/textured.glb", "textured/textured.obj", "tests/gltf/basisu.glb"] {
        let path = model(name);
        let all = read(&path, Limits::default()).unwrap().0.images;
        let pixels = |i: &blinn::scene::Image| u64::from(i.width) * u64::from(i.height);
        let most = all.iter().map(pixels).max().unwrap();
        let left = |limit| {
            let (scene, warnings) = read(&path, Limits { image_pixels: limit, ..Limits::default() }).unwrap();
            (scene.images.len(), warnings.iter().filter(|w| w.what.contains("pixels")).count())
        };
        let large = all.iter().filter(|i| pixels(i) == most).count();
        assert_eq!(left(most), (all.len(), 0), "{name}");
        let (kept, told) = left(most - 1);
        assert!(kept <= all.len() - large && told >= 1, "{name}: {kept} kept, {told} told");
    }
}

/// Each limit of a picture of light lets pass what it names, and not one byte or pixel less.
#[test]
fn pictures_of_light_hold_their_limits() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.hdr", "b.exr"] {
        let path = dir.path().join(name);
        let blue: image::DynamicImage =
            image::ImageBuffer::from_pixel(32, 16, image::Rgb([0.0, 0.5, 2.0f32])).into();
        blue.save(&path).unwrap();
        let (bytes, pixels) = (fs::metadata(&path).unwrap().len(), 32 * 16);
        let cases: [(u64, fn(&mut Limits, u64)); 3] = [
            (bytes, |l, n| l.file_bytes = n),
            (pixels, |l, n| l.image_pixels = n),
            // Its text, and four floats for each pixel in the decoder and out of it.
            (bytes + pixels * 32, |l, n| l.memory_bytes = n),
        ];
        for (most, set) in cases {
            let with = |allowed: u64| {
                let mut limits = Limits::default();
                set(&mut limits, allowed);
                load_sky(&path, &limits)
            };
            with(most).unwrap_or_else(|e| panic!("{name} at {most}: {e}"));
            match with(most - 1) {
                Err(LoadError::Limit { asked, allowed, .. }) => {
                    assert_eq!((asked, allowed), (most, most - 1), "{name}");
                }
                other => panic!("{name} one past {most}: {other:?}"),
            }
        }
    }
}

/// A texture's file that is too large is no missing one, which would be white: nothing is shown.
#[test]
fn files_of_textures_hold_the_limit_of_files() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::copy(model("textured/planks.png"), dir.path().join("planks.png")).unwrap();
    fs::write(dir.path().join("a.mtl"), "newmtl a\nmap_Kd planks.png\n").unwrap();
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n").unwrap();
    let size = fs::metadata(dir.path().join("planks.png")).unwrap().len();
    let with = |file_bytes| read(&path, Limits { file_bytes, ..Limits::default() });
    assert_eq!(with(size).unwrap().0.images.len(), 1);
    match with(size - 1) {
        Err(LoadError::Limit { asked, allowed, .. }) => assert_eq!((asked, allowed), (size, size - 1)),
        other => panic!("{other:?}"),
    }
    // What is read of it counts as memory, and what is decoded of it once more.
    let charged = |memory_bytes| read(&path, Limits { memory_bytes, ..Limits::default() }).is_ok();
    assert!(!charged(size) && charged(64 << 20));
}

/// A glTF of nodes, saved.
fn graph(nodes: Vec<Value>, roots: Value) -> (tempfile::TempDir, PathBuf) {
    let json = json!({"asset": {"version": "2.0"}, "scenes": [{"nodes": roots}], "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3}]});
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gltf");
    fs::write(&path, json.to_string()).unwrap();
    (dir, path)
}

/// The clock is there for what would take for ever: some milliseconds are what it takes, in one of three
/// attempts where others are at work.
fn refused(nodes: Vec<Value>, roots: Value, says: &str) {
    let (_dir, path) = graph(nodes, roots);
    let attempt = || {
        let start = Instant::now();
        let error = read(&path, Limits::default()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
        start.elapsed()
    };
    let enough = Duration::from_secs(1);
    let took = (0..3).map(|_| attempt()).find(|took| *took < enough).expect("it takes more than a second");
    println!("{says}: {took:?}");
}

#[test]
fn graphs_without_end_are_refused_by_counting() {
    refused(vec![json!({"children": [0]})], json!([0]), "its own descendant");
    let ring = (0..1000).map(|i| json!({"children": [(i + 1) % 1000]})).collect();
    refused(ring, json!([0]), "its own descendant");
    // 2^40 ways to the last node.
    let doubling = |n: usize| (0..n).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({"mesh": 0})]);
    refused(doubling(40).collect(), json!([0]), "over the limit");
    // More than u64 counts.
    refused(doubling(200).collect(), json!([0]), "over the limit");
}

/// On a thread whose stack is no larger than threads usually have.
#[test]
fn chains_may_be_a_hundred_thousand_deep() {
    let run = || {
        let nodes = (1..100_000).map(|i| json!({"children": [i], "translation": [0, 0, 1e-5]}));
        let (_dir, path) = graph(nodes.chain([json!({"mesh": 0})]).collect(), json!([0]));
        let (scene, _) = read(&path, Limits::default()).unwrap();
        assert_eq!((scene.nodes.len(), scene.instances.len()), (100_000, 1));
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let depth = posed.instances[0].transform.affine.translation.z + posed.centre.z;
        assert!((depth - 1.0).abs() < 1e-3, "{depth}");
        Accel::build(&posed, &BuildSettings::default());
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).unwrap().join().unwrap();
}
