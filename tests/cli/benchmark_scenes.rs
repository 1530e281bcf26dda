//! The public scenes of `blinn bench --scenes`, and the rays that `blinn rays` writes.

use std::fs;

use serde_json::{Value, json};

use crate::common::program::{blinn, folder, model, refused, runs};

/// Scenes of the manifest are measured from each camera; those that are missing are listed with their source.
#[test]
fn public_scenes_are_measured_where_they_exist() {
    let (_guard, folder) = folder();
    let scenes = folder.join("scenes");
    fs::create_dir(&scenes).unwrap();
    refused(&folder, "bench --scenes nowhere", "this is not a folder");
    let none = blinn(&folder, "bench --scenes scenes");
    let messages = String::from_utf8(none.stderr).unwrap();
    assert_eq!(none.status.code(), Some(1), "{messages}");
    assert!(
        messages
            .contains("missing: Hairball: **/hairball.obj from https://casual-effects.com/data/ (licence"),
        "{messages}"
    );
    assert!(messages.contains("none of the 15 scenes is there"), "{messages}");
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(scenes.join("mine.obj"), triangle).unwrap();
    let manifest = "[[scene]]\nname = 'Other'\nfiles = ['other.obj']\n\
        [[scene]]\nname = 'Mine'\nfiles = ['mine.obj']\n\
        sha256 = '00000000000000000000000000000000000000000000000000000000000000ff'\n\
        camera = [{ name = 'front', orbit = [0, 0] },\n\
        { name = 'near', eye = [0.5, 0.5, 2], look_at = [0.5, 0.5, 0], yfov = 40 }]\n";
    fs::write(scenes.join("manifest.toml"), manifest).unwrap();
    let line = "bench --scenes scenes --size 8x8 --rounds 1 --min-time 0.001 --threads 1 --json a.json --report a.html";
    let output = blinn(&folder, line);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{messages}");
    // A folder with scenes of its own alone needs no list of the others.
    assert!(
        messages.contains("missing: Other: other.obj\n") && messages.contains("Mine: the file differs"),
        "{messages}"
    );
    assert!(!messages.contains("Lantern"), "{messages}");
    let results = serde_json::from_slice::<Value>(&fs::read(folder.join("a.json")).unwrap()).unwrap();
    let scene = &results["scenes"][0];
    assert_eq!((&scene["name"], &scene["triangles"]), (&json!("Mine"), &json!(1)));
    assert_eq!(scene["sha256"].as_str().unwrap().len(), 64);
    let cameras = |stage: &str| -> Vec<&Value> {
        let stages = scene["stages"].as_array().unwrap();
        stages.iter().filter(|s| s["stage"] == stage).map(|s| &s["camera"]).collect()
    };
    assert_eq!(cameras("load"), [&Value::Null]);
    assert_eq!(cameras("eye"), ["front", "near"]);
    assert_eq!(cameras("frame"), ["front", "near"]);
    // With one of the built-in scenes, they are listed.
    fs::write(scenes.join("hairball.obj"), triangle).unwrap();
    let output = blinn(&folder, &format!("{line} --stages load"));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(messages.contains("missing: Lantern") && !messages.contains("missing: Hairball"), "{messages}");
    fs::write(scenes.join("manifest.toml"), manifest.replace("mine.obj", "../mine.obj")).unwrap();
    refused(&folder, "bench --scenes scenes", "must stay below the folder of scenes");
}

/// The bytes of an array of an uncompressed NumPy archive, and its header.
fn array<'f>(file: &'f [u8], name: &str) -> (&'f str, &'f [u8]) {
    let name = format!("{name}.npy");
    let at = file.windows(name.len()).position(|bytes| bytes == name.as_bytes()).unwrap();
    let size = u32::from_le_bytes(file[at - 8..at - 4].try_into().unwrap()) as usize;
    let npy = &file[at + name.len()..][..size];
    assert_eq!(&npy[..8], b"\x93NUMPY\x01\x00");
    let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    (std::str::from_utf8(&npy[10..header]).unwrap(), &npy[header..])
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

/// Every hit lies where its barycentrics put it on its triangle, and at t along its ray.
#[test]
fn dumped_hits_lie_on_their_triangles_and_rays() {
    let (_guard, folder) = folder();
    let scene = model("cornell/cornell.obj");
    runs(&folder, &format!("rays {scene} --dump out/rays.npz --size 24x24 --triangles"));
    let file = fs::read(folder.join("out/rays.npz")).unwrap();
    let count = array(&file, "kind").1.len();
    let kinds: Vec<u8> = array(&file, "kind").1.to_vec();
    // Stages are numbered from load, so eye is 2, and all nine kinds occur.
    assert_eq!(kinds.iter().filter(|&&kind| kind == 2).count(), 24 * 24);
    assert_eq!((2..=10).filter(|kind| kinds.contains(kind)).count(), 9);
    assert!(
        array(&file, "origin").0.contains(&format!("'<f4', 'fortran_order': False, 'shape': ({count}, 3)"))
    );
    let [origin, direction, t, b, vertices] =
        ["origin", "direction", "t", "barycentrics", "triangle_vertices"]
            .map(|name| floats(array(&file, name).1));
    let ids: Vec<&[u8]> = array(&file, "id").1.chunks_exact(8).collect();
    let triangle_ids: Vec<&[u8]> = array(&file, "triangle_id").1.chunks_exact(8).collect();
    let occluded = array(&file, "occluded").1;
    assert_eq!((t.len(), ids.len(), occluded.len()), (count, count, count));
    let mut hits = 0;
    for i in (0..count).filter(|&i| t[i].is_finite()) {
        let triangle = triangle_ids.iter().position(|id| *id == ids[i]).unwrap();
        for k in 0..3 {
            let corner = |j: usize| f64::from(vertices[9 * triangle + 3 * j + k]);
            let [b1, b2] = [b[2 * i], b[2 * i + 1]].map(f64::from);
            let on_triangle = corner(0) * (1.0 - b1 - b2) + corner(1) * b1 + corner(2) * b2;
            let on_ray = f64::from(origin[3 * i + k]) + f64::from(t[i]) * f64::from(direction[3 * i + k]);
            assert!((on_triangle - on_ray).abs() < 1e-4, "ray {i}: {on_triangle} {on_ray}");
        }
        hits += 1;
    }
    assert!(hits > 24 * 24, "{hits} hits");
    // Rays of 3, 4 and 5 are any-hit rays.
    for i in 0..count {
        assert!(occluded[i] == 0 || (3..=5).contains(&kinds[i]) && t[i] == f32::INFINITY, "ray {i}");
    }
    assert!(occluded.contains(&1) && (0..count).any(|i| kinds[i] == 3 && occluded[i] == 0));
}

#[test]
fn dumps_are_reproducible_and_select_kinds() {
    let (_guard, folder) = folder();
    let scene = model("cornell/cornell.obj");
    let line = format!("rays {scene} --size 16x16 --kinds shadow,bounce2");
    runs(&folder, &format!("{line} --dump a.npz"));
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(format!("{line} --dump b.npz").split_whitespace())
        .current_dir(&folder)
        .env("BLINN_SIMD", "portable")
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let [a, b] = ["a.npz", "b.npz"].map(|file| fs::read(folder.join(file)).unwrap());
    assert!(a == b, "other bytes at another SIMD level");
    let mut kinds = array(&a, "kind").1.to_vec();
    kinds.dedup();
    assert_eq!(kinds, [3, 8]);
    refused(&folder, &format!("rays {scene} --dump a.npz --kinds frame"), "expected eye, shadow");
    refused(&folder, &format!("rays {scene}"), "--dump");
    let large = blinn(&folder, &format!("rays {scene} --dump a.npz --size 8192x8192"));
    assert_eq!(large.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&large.stderr).contains("use a smaller --size"));
}
