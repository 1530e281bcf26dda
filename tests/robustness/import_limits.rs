//! Limits of imports: each limit allows exactly its number and nothing beyond, and node graphs that expand
//! exponentially are rejected by counting their paths.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{Limits, LoadError, LoadOptions, Warning, load, load_environment};
use blinn::scene::{PoseSettings, Scene, pose};
use serde_json::{Value, json};

use crate::common::model_path;

fn read(path: &Path, limits: Limits) -> Result<(Scene, Vec<Warning>), LoadError> {
    load(path, &LoadOptions { limits, ..LoadOptions::default() })
}

/// Finds how much the file requests, and checks the limit at exactly that amount and one below.
fn check_limit(name: &str, set: impl Fn(&mut Limits, u64)) {
    let path = model_path(name);
    let with = |allowed: u64| {
        let mut limits = Limits::default();
        set(&mut limits, allowed);
        read(&path, limits)
    };
    let Err(LoadError::Limit { requested, allowed: 0, .. }) = with(0) else {
        panic!("{name} requests nothing")
    };
    // The limit may be checked several times, each time for a larger amount.
    let mut largest = requested;
    while let Err(LoadError::Limit { requested, .. }) = with(largest) {
        assert!(requested > largest, "{name}");
        largest = requested;
    }
    with(largest).unwrap_or_else(|e| panic!("{name} at the limit: {e}"));
    match with(largest - 1) {
        Err(LoadError::Limit { requested, allowed, .. }) => {
            assert_eq!((requested, allowed), (largest, largest - 1));
        }
        other => panic!("{name} one past the limit: {other:?}"),
    }
}

#[test]
fn every_limit_holds_at_the_limit_and_not_one_past() {
    for name in ["tests/triangle.glb", "tests/triangle.gltf", "tests/cube.obj"] {
        check_limit(name, |l, n| l.file_bytes = n);
        check_limit(name, |l, n| l.instances = n);
        check_limit(name, |l, n| l.vertices = n);
        check_limit(name, |l, n| l.triangles = n);
    }
    // Referenced files count as well.
    check_limit("textured/textured.gltf", |l, n| l.file_bytes = n);
    check_limit("tests/gltf/instances_gpu.glb", |l, n| l.instances = n);
    check_limit("tests/gltf/strip_draco.glb", |l, n| l.vertices = n);
    check_limit("tests/gltf/strip_draco.glb", |l, n| l.triangles = n);
    check_limit("assembly/assembly.glb", |l, n| l.nodes = n);
    check_limit("tests/gltf/torus_meshopt_raw.glb", |l, n| l.decompressed_bytes = n);
    check_limit("textured/textured.glb", |l, n| l.texture_bytes = n);
    check_limit("textured/textured.obj", |l, n| l.texture_bytes = n);
    check_limit("tests/gltf/basisu.glb", |l, n| l.texture_bytes = n);
}

/// An image that is too large is ignored; the scene is loaded without it.
#[test]
fn image_pixels_are_limited_per_image() {
    for name in ["textured/textured.glb", "textured/textured.obj", "tests/gltf/basisu.glb"] {
        let path = model_path(name);
        let all = read(&path, Limits::default()).unwrap().0.images;
        let pixels = |i: &blinn::scene::Image| u64::from(i.width) * u64::from(i.height);
        let most = all.iter().map(pixels).max().unwrap();
        let left = |limit| {
            let (scene, warnings) = read(&path, Limits { image_pixels: limit, ..Limits::default() }).unwrap();
            (scene.images.len(), warnings.iter().filter(|w| w.message.contains("pixels")).count())
        };
        let large = all.iter().filter(|i| pixels(i) == most).count();
        assert_eq!(left(most), (all.len(), 0), "{name}");
        let (kept, warned) = left(most - 1);
        assert!(kept <= all.len() - large && warned >= 1, "{name}: {kept} kept, {warned} warned");
    }
}

/// Each limit of an environment map allows exactly its size, and not one byte or pixel less.
#[test]
fn environment_maps_are_limited_in_bytes_pixels_and_memory() {
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
            // Per pixel three floats, a quarter of a copy, mip levels, and light sources. The file has been freed.
            (pixels * (12 + 3 + 3 + 24), |l, n| l.memory_bytes = n),
        ];
        for (most, set) in cases {
            let with = |allowed: u64| {
                let mut limits = Limits::default();
                set(&mut limits, allowed);
                load_environment(&path, &limits)
            };
            with(most).unwrap_or_else(|e| panic!("{name} at {most}: {e}"));
            match with(most - 1) {
                Err(LoadError::Limit { requested, allowed, .. }) => {
                    assert_eq!((requested, allowed), (most, most - 1), "{name}");
                }
                other => panic!("{name} one past {most}: {other:?}"),
            }
        }
    }
}

/// A texture file that is too large is an error; only a missing one is replaced by white.
#[test]
fn texture_files_are_limited_in_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::copy(model_path("textured/planks.png"), dir.path().join("planks.png")).unwrap();
    fs::write(dir.path().join("a.mtl"), "newmtl a\nmap_Kd planks.png\n").unwrap();
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n").unwrap();
    let size = fs::metadata(dir.path().join("planks.png")).unwrap().len();
    let with = |file_bytes| read(&path, Limits { file_bytes, ..Limits::default() });
    assert_eq!(with(size).unwrap().0.images.len(), 1);
    match with(size - 1) {
        Err(LoadError::Limit { requested, allowed, .. }) => {
            assert_eq!((requested, allowed), (size, size - 1))
        }
        other => panic!("{other:?}"),
    }
    // Both the file and its decoded texels count as memory.
    let charged = |memory_bytes| read(&path, Limits { memory_bytes, ..Limits::default() }).is_ok();
    assert!(!charged(size) && charged(64 << 20));
}

/// Writes a glTF of these nodes.
fn graph(nodes: Vec<Value>, roots: Value) -> (tempfile::TempDir, PathBuf) {
    let json = json!({"asset": {"version": "2.0"}, "scenes": [{"nodes": roots}], "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3}]});
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gltf");
    fs::write(&path, json.to_string()).unwrap();
    (dir, path)
}

/// Checks that the graph is loaded within a second; it takes some milliseconds, and would take forever if paths
/// were expanded. Three attempts, since other tests run at the same time.
fn is_loaded(nodes: Vec<Value>, roots: Value, count: usize) {
    let (_dir, path) = graph(nodes, roots);
    let attempt = || {
        let start = Instant::now();
        let (scene, warnings) = read(&path, Limits::default()).unwrap();
        assert_eq!((scene.nodes.len(), warnings.len()), (count, 1), "{warnings:?}");
        start.elapsed()
    };
    let enough = Duration::from_secs(1);
    let elapsed = (0..3).map(|_| attempt()).find(|elapsed| *elapsed < enough).expect("more than a second");
    println!("{count} nodes: {elapsed:?}");
}

#[test]
fn each_node_of_cyclic_and_exponential_graphs_is_loaded_once() {
    is_loaded(vec![json!({"children": [0]})], json!([0]), 1);
    let ring = (0..1000).map(|i| json!({"children": [(i + 1) % 1000]})).collect();
    is_loaded(ring, json!([0]), 1000);
    // 2^40 paths to the last node, and more than fit in 64 bits.
    let doubling = |n: usize| (0..n).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({"mesh": 0})]);
    is_loaded(doubling(40).collect(), json!([0]), 41);
    is_loaded(doubling(200).collect(), json!([0]), 201);
}

/// On a thread with the default stack size.
#[test]
fn chains_of_a_hundred_thousand_nodes_are_loaded() {
    let run = || {
        let nodes = (1..100_000).map(|i| json!({"children": [i], "translation": [0, 0, 1e-5]}));
        let (_dir, path) = graph(nodes.chain([json!({"mesh": 0})]).collect(), json!([0]));
        let (scene, _) = read(&path, Limits::default()).unwrap();
        assert_eq!((scene.nodes.len(), scene.instances.len()), (100_000, 1));
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let depth = posed.instances[0].transform.affine.translation.z + posed.centre.z;
        assert!((depth - 1.0).abs() < 1e-3, "{depth}");
        Accel::build(&posed, &AccelSettings::default());
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).unwrap().join().unwrap();
}
