//! `--max-memory`: scenes that would need more are rejected before the memory is allocated, and accepted
//! scenes stay within it.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::Command;

use crate::common::model_path;

/// Scenes of all kinds, with flags that need memory of their own.
const SCENES: [(&str, &str); 13] = [
    ("cornell/cornell.obj", "--size 640x360"),
    ("cornell/cornell.glb", "--size 1920x1080"),
    ("textured/textured.obj", "--size 320x180"),
    ("textured/textured.gltf", "--size 320x180 --aov depth,normal,position,albedo"),
    ("still-life/still-life.glb", "--size 640x360 --aov cryptomatte"),
    (
        "still-life/still-life.glb",
        "--size 960x540 --aov depth,normal,position,albedo,uv,mask,object-id,cryptomatte",
    ),
    ("assembly/assembly.glb", "--size 1280x720"),
    ("figure/figure.glb", "--size 320x180 --frames=1-4"),
    ("tests/closed_sphere.obj", "--size 320x180"),
    ("tests/gltf/instances_gpu.glb", "--size 320x180"),
    ("tests/gltf/torus_meshopt_filters.glb", "--size 64x64"),
    ("assembly/assembly.glb", "--size 1280x720 --edges all"),
    (
        "figure/figure.glb",
        "--size 320x180 --edges feature,silhouette --edges-only --hidden-edges dashed --frames=1-4",
    ),
];

/// Renders a scene within `allowed` bytes. Returns the messages, as an error where the exit code is not 0.
fn run(folder: &Path, (scene, flags): (&str, &str), allowed: u64) -> Result<String, String> {
    let scene = if scene.starts_with('@') { scene.into() } else { model_path(scene) };
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    let samples = if flags.contains("-s ") { "" } else { "-s 1" };
    let common = "-o {index}.exr --perf".split(' ').chain(samples.split_whitespace());
    command.arg("render").arg(scene).args(flags.split_whitespace()).args(common);
    command.args(["--max-memory", &allowed.to_string(), "--threads", "2"]).current_dir(folder);
    let output = command.output().unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    if output.status.success() { Ok(messages) } else { Err(messages) }
}

/// The first number of a text after `mark`, with its unit.
fn bytes_after(text: &str, mark: &str) -> Option<f64> {
    let mut words = text[text.find(mark)? + mark.len()..].split_whitespace();
    let number: f64 = words.next()?.parse().ok()?;
    let unit = match words.next()? {
        "GiB" => 1u64 << 30,
        "MiB" => 1 << 20,
        "KiB" => 1 << 10,
        _ => 1,
    };
    Some(number * unit as f64)
}

/// The last number before `mark`.
fn number_before(text: &str, mark: &str) -> Option<f64> {
    text[..text.find(mark)?].split_whitespace().next_back()?.parse().ok()
}

/// A small file with large demands: 16,000 meshes that share 65,000 vertices.
#[test]
fn repeated_accessors_count_against_the_limit() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("a.gltf");
    let primitive = r#"{"attributes": {"POSITION": 0}}"#;
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{}]}}], "buffers": [{{"byteLength": 780000, "uri": "a.bin"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 780000}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 65000}}]}}"#,
        vec![primitive; 16_000].join(",")
    );
    std::fs::write(&scene, json).unwrap();
    std::fs::write(dir.path().join("a.bin"), vec![0; 780_000]).unwrap();
    let messages = run(dir.path(), (scene.to_str().unwrap(), "--size 16x16"), 4 << 30).unwrap_err();
    assert!(
        messages.contains("bytes of memory") && messages.contains("exceeds the limit of 4294967296"),
        "{messages}"
    );
}

/// 200,000 animated nodes and one drawn triangle: memory goes to the node transforms, which every thread
/// computes for a time of its own.
fn write_nodes(scene: &Path) {
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [{}]}}], "nodes": [{{"mesh": 0}}{}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "animations": [{{"channels": [{{"sampler": 0, "target": {{"node": 0, "path": "translation"}}}}],
            "samplers": [{{"input": 1, "output": 0}}]}}],
        "buffers": [{{"byteLength": 48, "uri": "a.bin"}}], "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}},
            {{"bufferView": 0, "byteOffset": 36, "componentType": 5126, "type": "SCALAR", "count": 3,
                "min": [0], "max": [2]}}]}}"#,
        (0..=NODES).map(|i| i.to_string()).collect::<Vec<_>>().join(","),
        ",{}".repeat(NODES)
    );
    std::fs::write(scene, json).unwrap();
    let numbers = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(scene.with_extension("bin"), bytes).unwrap();
}

const NODES: usize = 200_000;

/// Noise filters hold rows of a picture, and light layers all of it.
#[test]
fn noisy_pictures_stay_within_the_limit() {
    for flags in [
        "--indirect 1",
        "--indirect 1 --denoise off",
        "--aperture-radius 0.05",
        "--indirect 1 --aov diffuse-direct,diffuse-indirect",
    ] {
        keeps_within(("cornell/cornell.glb", &format!("--size 960x540 -s 2 {flags}")));
    }
    // Metals.
    keeps_within(("assembly/assembly.glb", "--size 1280x720 -s 2"));
}

/// An environment map is read before the scene, and stays.
#[test]
fn an_environment_stays_within_the_limit() {
    const SIZE: [usize; 2] = [4096, 2048];
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("light.hdr");
    let [width, height] = SIZE;
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    bytes.extend((0..width * height).flat_map(|i| [128, (i % 251) as u8, 90, 128]));
    std::fs::write(&file, bytes).unwrap();
    let flags = format!("--size 640x360 --hdri {}", file.display());
    let [allowed, peak] = keeps_within(("tests/closed_sphere.obj", &flags));
    assert!(allowed as f64 <= 1.3 * peak as f64, "{allowed} bytes for {peak}");
}

#[test]
fn accepted_scenes_stay_within_the_limit() {
    let scenes = tempfile::tempdir().unwrap();
    let nodes = scenes.path().join("a.gltf");
    write_nodes(&nodes);
    for case in SCENES.into_iter().chain([(nodes.to_str().unwrap(), "--size 64x64")]) {
        keeps_within(case);
    }
}

/// A tetrahedron with many coincident faces, instanced often enough for a BLAS of its own.
#[test]
fn many_instances_stay_within_the_limit() {
    const COPIES: usize = 120_000;
    let dir = tempfile::tempdir().unwrap();
    let corners = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0u8, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].as_flattened().repeat(3);
    let at = |i: usize| [i % 50, i / 50 % 50, i / 2500].map(|x| 2.0 * x as f32);
    let floats = corners.into_iter().chain((0..COPIES).map(at)).flatten().flat_map(f32::to_le_bytes);
    let bytes: Vec<u8> = floats.chain(faces.iter().copied()).collect();
    std::fs::write(dir.path().join("a.bin"), &bytes).unwrap();
    let (all, copies) = (bytes.len(), 12 * COPIES);
    let rest = format!(
        r#""buffers": [{{"byteLength": {all}, "uri": "a.bin"}}], "bufferViews": [
        {{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": {copies}}},
        {{"buffer": 0, "byteOffset": {}, "byteLength": {}}}], "accessors": [
        {{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}},
        {{"bufferView": 1, "componentType": 5126, "type": "VEC3", "count": {COPIES}}},
        {{"bufferView": 2, "componentType": 5121, "type": "SCALAR", "count": {}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 2}}]}}]"#,
        48 + copies,
        faces.len(),
        faces.len(),
    );
    let own = |i: usize| {
        let [x, y, z] = at(i);
        format!(r#"{{"mesh": 0, "name": "copy {i}", "translation": [{x}, {y}, {z}]}}"#)
    };
    let nodes: Vec<String> = (0..COPIES).map(own).collect();
    let instanced =
        r#"{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}"#;
    for (name, nodes) in [("instances.gltf", instanced), ("nodes.gltf", &nodes.join(","))] {
        let scene = dir.path().join(name);
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensionsUsed": ["EXT_mesh_gpu_instancing"], "nodes": [{nodes}], {rest}}}"#
        );
        std::fs::write(&scene, json).unwrap();
        keeps_within((scene.to_str().unwrap(), "--size 64x64"));
    }
}

/// Writes a wavy square of `side` by `side` vertices: points as PLY with colours, or triangles as STL.
fn write_grid(file: &Path, side: usize) {
    let vertex = |i: usize, j: usize| {
        let [u, v] = [i, j].map(|k| 2.0 * k as f32 / side as f32 - 1.0);
        [u, 0.1 * (9.0 * u).sin() * (7.0 * v).cos(), v]
    };
    let bytes = |vertex: [f32; 3]| vertex.into_iter().flat_map(f32::to_le_bytes);
    let mut out = Vec::new();
    if file.extension().is_some_and(|ending| ending == "ply") {
        let columns = "property float x\nproperty float y\nproperty float z\n\
            property uchar red\nproperty uchar green\nproperty uchar blue\n";
        let count = side * side;
        let format = "ply\nformat binary_little_endian 1.0\n";
        out.extend(format!("{format}element vertex {count}\n{columns}end_header\n").into_bytes());
        (0..count).for_each(|i| out.extend(bytes(vertex(i % side, i / side)).chain([200, 100, 50])));
    } else {
        out.extend([b' '; 80]);
        out.extend((2 * (side as u32 - 1).pow(2)).to_le_bytes());
        for (i, j) in (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| (i, j))) {
            for corners in [[(0, 0), (0, 1), (1, 0)], [(1, 0), (0, 1), (1, 1)]] {
                let corners = corners.map(|(a, b)| vertex(i + a, j + b));
                let facet = [[0.0, 1.0, 0.0]].into_iter().chain(corners);
                out.extend(facet.flat_map(bytes).chain([0, 0]));
            }
        }
    }
    std::fs::write(file, out).unwrap();
}

/// Scenes of more than 100 MB, and a large picture, are not refused where they fit: `benches/memory.py` measures more.
#[test]
fn estimates_of_large_scenes_are_close_to_their_peaks() {
    let dir = tempfile::tempdir().unwrap();
    let [points, triangles] = ["a.ply", "a.stl"].map(|name| dir.path().join(name));
    write_grid(&points, 1500);
    write_grid(&triangles, 600);
    let [points, triangles] = [&points, &triangles].map(|file| file.to_str().unwrap());
    let layers = "--size 1920x1080 --aov depth,normal,cryptomatte";
    for case in [(points, "--size 320x180"), (triangles, "--size 320x180"), ("assembly/assembly.glb", layers)]
    {
        let [allowed, peak] = keeps_within(case);
        assert!(allowed as f64 <= 1.3 * peak as f64, "{case:?}: {allowed} bytes for {peak}");
    }
}

/// Scenes are rendered side by side only if there is memory for all of them.
#[test]
fn batches_stay_within_the_limit() {
    let lists = tempfile::tempdir().unwrap();
    for (scene, flags) in [SCENES[2], SCENES[9], SCENES[1]] {
        let [allowed, _] = keeps_within((scene, flags));
        let list = lists.path().join("list");
        std::fs::write(&list, format!("{}\n", model_path(scene).display()).repeat(4)).unwrap();
        for allowed in [allowed, 2 * allowed] {
            let dir = tempfile::tempdir().unwrap();
            let messages = run(dir.path(), (&format!("@{}", list.display()), flags), allowed).unwrap();
            assert_eq!(messages.matches("wrote").count(), 4, "{messages}");
            let peak = bytes_after(&messages, "perf: memory").unwrap() as u64;
            println!("{scene}: {} MiB allowed, {} MiB taken by a batch", allowed >> 20, peak >> 20);
            assert!(peak <= allowed, "{scene}: {peak} of {allowed} bytes");
        }
    }
}

/// Raises the limit to what each error asks for until the scene is rendered, and checks that its peak stays
/// within that limit. Returns both.
fn keeps_within(case: (&str, &str)) -> [u64; 2] {
    let dir = tempfile::tempdir().unwrap();
    let (mut allowed, mut refused) = (1 << 20, 0);
    let messages = loop {
        match run(dir.path(), case, allowed) {
            Ok(messages) => break messages,
            Err(messages) => {
                refused += 1;
                assert!(refused < 20, "{case:?}: {messages}");
                // The limit for the file is exact; that for its images is within a tenth.
                let more = number_before(&messages, "exceeds the limit")
                    .or_else(|| bytes_after(&messages, "needs about").map(|b| b * 1.01));
                let more = more.unwrap_or_else(|| panic!("{case:?}: {messages}")).ceil() as u64;
                assert!(more > allowed, "{case:?}: {messages}");
                allowed = more;
                assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{case:?}");
            }
        }
    };
    let peak = bytes_after(&messages, "perf: memory").unwrap_or_else(|| panic!("{messages}")) as u64;
    println!("{case:?}: {} MiB allowed, {} MiB taken", allowed >> 20, peak >> 20);
    assert!(refused >= 1 && peak <= allowed, "{case:?}: {peak} of {allowed} bytes");
    [allowed, peak]
}

/// Batches free the memory of each scene. The peak is at most 1.15 times that of the largest scene rendered 30 times:
/// the peaks of two scenes side by side have coincided by then.
#[cfg(target_env = "gnu")]
#[test]
fn a_batch_needs_hardly_more_memory_than_its_largest_scene() {
    const FILES: [&str; 5] = [
        "assembly/assembly.glb",
        "still-life/still-life.glb",
        "textured/textured.obj",
        "figure/figure.glb",
        "cornell/cornell.obj",
    ];
    let peak = |scenes: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let list: Vec<String> =
            scenes.iter().map(|s| format!("{}/models/{s}\n", env!("CARGO_MANIFEST_DIR"))).collect();
        std::fs::write(folder.path().join("list"), list.concat()).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args("render @list -o {index}.png --size 160x90 -s 1 --perf --threads 2".split(' '))
            .current_dir(folder.path())
            .output()
            .unwrap();
        let messages = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{messages}");
        assert_eq!(messages.matches(".png").count(), scenes.len(), "{messages}");
        bytes_after(&messages, "perf: memory").unwrap()
    };
    let largest = FILES.map(|file| peak(&[file; 30])).into_iter().fold(0.0, f64::max);
    let many: Vec<&str> = FILES.into_iter().cycle().take(60).collect();
    let batch = peak(&many);
    println!("{largest} bytes at most for one scene again and again, {batch} in a batch");
    assert!(batch < 1.15 * largest, "{batch} of {largest} bytes");
}
