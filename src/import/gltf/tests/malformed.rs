//! Truncated, corrupt and malicious files: an error or a scene, never a panic.

use serde_json::{Value, json};

use super::super::fixture::{Fixture, bytes_of};
use super::super::load;
use super::loading::folder;
use crate::{Limits, LoadOptions, Warning};
use blinn_scene::pose;
use blinn_scene::{AnimationChoice, PoseSettings};

/// Limits that keep the allocations of mutants small.
fn options() -> LoadOptions {
    let small = 1 << 16;
    let limits = Limits {
        file_bytes: small,
        vertices: small,
        triangles: small,
        nodes: small,
        instances: small,
        image_pixels: small,
        decompressed_bytes: 1 << 20,
        texture_bytes: small,
        ..Limits::default()
    };
    LoadOptions { limits, ..LoadOptions::default() }
}

/// A file with most features.
pub(super) fn rich() -> Fixture {
    let mut fixture = Fixture::triangle();
    let uvs = fixture.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let indices = fixture.indices(&[0, 1, 2]);
    let joints = fixture.accessor(5121, "VEC4", 3, &[0; 12]);
    let weights = fixture.vec4(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    let at = fixture.view(&[1]);
    let delta = fixture.view(&bytes_of(&[1.0f32, 2.0, 3.0]));
    let sparse = json!({"count": 1, "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": delta}});
    let morph = fixture
        .push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": sparse}));
    let primitive = fixture.primitive();
    primitive["indices"] = json!(indices);
    primitive["material"] = json!(0);
    primitive["targets"] = json!([{"POSITION": morph}]);
    primitive["attributes"]["TEXCOORD_0"] = json!(uvs);
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    fixture.push("images", json!({"uri": "data:image/bmp;base64,Qk1GAAAAAAAAADYAAAAoAAAAAQAAAAEAAAABABgAAAAAABAAAAATCwAAEwsAAAAAAAAAAAAA/wAAAA=="}));
    fixture.push("textures", json!({"source": 0}));
    fixture.push("materials", json!({"normalTexture": {"index": 0}}));
    fixture.node(
        json!({"translation": [0, 0, 1], "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}),
    );
    fixture.push("skins", json!({"joints": [1]}));
    fixture.json["nodes"][0]["skin"] = json!(0);
    fixture.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}));
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "spot"}]);
    let input = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let output = fixture.vec3(&[[0.0; 3], [1.0; 3]]);
    let animation = json!({"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": input, "output": output}]});
    fixture.push("animations", animation);
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": output}}});
    fixture.node(json!({"mesh": 0, "extensions": copies}));
    fixture
}

/// Loads and poses a file without panics. Returns whether it loads.
fn loads(bytes: &[u8]) -> bool {
    let Ok((scene, _)) = load(bytes, &folder(), &options()) else { return false };
    let _ = pose(&scene, &PoseSettings { time: 0.4, animation: AnimationChoice::All, centre: None });
    true
}

#[test]
fn truncated_files_are_errors_or_read_with_a_warning() {
    let glb = rich().glb();
    assert!(loads(&glb));
    let mut read = 0;
    for end in 0..glb.len() {
        match load(&glb[..end], &folder(), &options()) {
            Ok((scene, warnings)) => {
                let is_reported = |w: &Warning| w.message.starts_with("the file is truncated");
                assert!(
                    warnings.iter().any(is_reported),
                    "truncated at {end} of {}: {warnings:?}",
                    glb.len()
                );
                assert!(scene.instanced_triangle_count() > 0);
                read += 1;
            }
            Err(_) => assert!(end < glb.len() - 1, "truncated by a byte"),
        }
    }
    assert!(read > 30, "{read}");
}

#[test]
fn the_complete_meshes_of_a_truncated_file_are_read() {
    let mut fixture = Fixture::triangle();
    let far = fixture.vec3(&[[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]]);
    fixture.push("meshes", json!({"primitives": [{"attributes": {"POSITION": far}}]}));
    fixture.node(json!({"mesh": 1}));
    let glb = fixture.glb();
    let (scene, warnings) = load(&glb[..glb.len() - 4], &folder(), &options()).unwrap();
    assert_eq!(scene.instanced_triangle_count(), 1);
    let message = "has 2 of 3 elements; ignored what needs the others";
    assert!(warnings.iter().any(|w| w.to_string() == format!("accessors[2]: {message}")), "{warnings:?}");
    // If no triangle is complete, that is an error.
    let error = load(&glb[..glb.len() - 80], &folder(), &options()).map(|_| ()).unwrap_err().to_string();
    assert_eq!(error, "GLB: the file is truncated before the end of its first triangle");
}

#[test]
fn the_complete_triangles_of_a_truncated_mesh_are_read() {
    // The indices are last.
    let mut fixture = Fixture::triangle();
    let indices = fixture.indices(&[0, 1, 2, 2, 1, 0]);
    fixture.primitive()["indices"] = json!(indices);
    let glb = fixture.glb();
    let (scene, _) = load(&glb[..glb.len() - 2], &folder(), &options()).unwrap();
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].normals.len()), (1, 3));
    // The positions are last.
    let mut fixture = Fixture::triangle();
    let indices = fixture.indices(&[0, 1, 2, 1, 2, 3]);
    let positions = fixture.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    fixture.json["meshes"][0]["primitives"] =
        json!([{"indices": indices, "attributes": {"POSITION": positions, "NORMAL": 1}}]);
    let glb = fixture.glb();
    let (scene, _) = load(&glb[..glb.len() - 5], &folder(), &options()).unwrap();
    assert_eq!((&scene.meshes[0].triangles[..], scene.meshes[0].positions.len()), (&[[0, 1, 2]][..], 3));
}

#[test]
fn the_complete_keyframes_of_a_truncated_file_are_read() {
    let mut fixture = Fixture::triangle();
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0, 2.0]);
    let values = fixture.vec3(&[[0.0; 3], [1.0; 3], [2.0; 3]]);
    fixture.push(
        "animations",
        json!({"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": times, "output": values}]}),
    );
    let glb = fixture.glb();
    let (scene, _) = load(&glb[..glb.len() - 1], &folder(), &options()).unwrap();
    assert_eq!(scene.animations[0].channels[0].keyframes.times, [0.0, 1.0]);
}

#[test]
fn changed_bytes_do_not_panic() {
    let glb = rich().glb();
    let mut loaded = 0;
    let mut rejected = 0;
    for at in 0..glb.len() {
        const CHANGES: [fn(u8) -> u8; 6] =
            [|b| b ^ 1, |b| b ^ 0x80, |_| 0xff, |_| 0, |_| b'9', |b| b.wrapping_add(1)];
        for change in CHANGES {
            let mut mutant = glb.clone();
            mutant[at] = change(mutant[at]);
            if loads(&mutant) { loaded += 1 } else { rejected += 1 }
        }
    }
    assert!(loaded > 1000 && rejected > 1000, "{loaded} loaded, {rejected} rejected");
}

/// Calls `visit` with copies of the file, each with another value replaced by `with`.
fn replace_each(json: &Value, with: &Value, visit: &mut dyn FnMut(Value)) {
    fn paths(value: &Value, path: String, out: &mut Vec<String>) {
        out.push(path.clone());
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| paths(v, format!("{path}/{k}"), out)),
            Value::Array(list) => {
                list.iter().enumerate().for_each(|(i, v)| paths(v, format!("{path}/{i}"), out))
            }
            _ => {}
        }
    }
    let mut all = Vec::new();
    paths(json, String::new(), &mut all);
    for path in &all {
        let mut changed = json.clone();
        *changed.pointer_mut(path).unwrap() = with.clone();
        visit(changed);
    }
}

#[test]
fn replaced_values_do_not_panic() {
    let fixture = rich();
    let glb = fixture.glb();
    let header = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&glb[20..header]).unwrap();
    let values = [
        json!(null),
        json!(-1),
        json!(0),
        json!(1),
        json!(7),
        json!(5.5),
        json!(255),
        json!(1e300),
        json!(u64::MAX),
        json!(u32::MAX),
        json!("text"),
        json!([]),
        json!({}),
        json!([0, 0]),
        json!(true),
    ];
    let mut tried = 0;
    for value in &values {
        replace_each(&json, value, &mut |changed| {
            let text = changed.to_string();
            let mut file = b"glTF\x02\0\0\0".to_vec();
            file.extend(((20 + text.len() + glb.len() - header) as u32).to_le_bytes());
            file.extend((text.len() as u32).to_le_bytes());
            file.extend(b"JSON");
            file.extend(text.as_bytes());
            file.extend(&glb[header..]);
            loads(&file);
            tried += 1;
        });
    }
    assert!(tried > 2000, "{tried}");
}

#[test]
fn small_files_that_request_much_memory_are_errors() {
    // A thousand morph targets, each of a million zeros that take no bytes in the file.
    let mut fixture = Fixture::empty();
    let huge = json!({"componentType": 5126, "type": "VEC3", "count": 1_000_000});
    fixture.push("accessors", huge);
    let targets: Vec<Value> = (0..1000).map(|_| json!({"POSITION": 0})).collect();
    fixture.push("meshes", json!({"primitives": [{"attributes": {"POSITION": 0}, "targets": targets}]}));
    fixture.node(json!({"mesh": 0}));
    assert!(fixture.error().contains("exceeds the limit"), "{}", fixture.error());
    // Deeply nested JSON.
    let deep = format!("{{\"asset\":{}", "[".repeat(1 << 20));
    assert!(load(deep.as_bytes(), &folder(), &options()).is_err());
}

#[test]
fn other_text_does_not_panic() {
    for text in ["", "{", "null", "{}", "[1]", "\u{feff}", "glTF", "{\"asset\":5}"] {
        loads(text.as_bytes());
    }
    let (scene, warnings) = load(b"\xef\xbb\xbf {} \n", &folder(), &options()).unwrap();
    assert!(scene.nodes.is_empty());
    assert_eq!(warnings.len(), 1, "{warnings:?}");
}

/// Damaged streams of Draco, meshopt and Basis Universal, some with third-party decoders.
#[test]
fn damaged_compressed_streams_do_not_panic() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/gltf");
    let mut state = 1u64;
    let mut damaged = 0;
    let mut rejected = 0;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as usize) % below
    };
    for name in [
        "torus_draco_eb.glb",
        "torus_draco_seq.glb",
        "ring_draco_valence.glb",
        "patch_draco_fallback.glb",
        "torus_meshopt_filters.glb",
        "mixed_meshopt_khr_filters.glb",
        "instances_pack_khr_mi.glb",
        "basisu.glb",
    ] {
        let intact = std::fs::read(folder.join(name)).unwrap();
        let json = u32::from_le_bytes(intact[12..16].try_into().unwrap()) as usize;
        for _ in 0..400 {
            let mut bad = intact.clone();
            for _ in 0..1 + random(3) {
                let at = 28 + json + random(intact.len() - 28 - json);
                bad[at] = if random(2) == 0 { random(256) as u8 } else { bad[at] ^ 1 << random(8) };
            }
            damaged += 1;
            rejected += usize::from(!loads(&bad));
        }
    }
    assert!(damaged == 3200 && (100..3200).contains(&rejected), "{rejected} of {damaged} rejected");
}

/// A file of a few kilobytes can refer to the same buffer a thousand times.
#[test]
fn buffers_with_the_same_uri_are_read_once() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.bin"), [0; 3000]).unwrap();
    let limits = Limits { file_bytes: 10_000, ..Limits::default() };
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let load = |uri: &dyn Fn(usize) -> String| {
        let mut fixture = Fixture::triangle();
        for i in 0..100 {
            fixture.push("buffers", json!({"byteLength": 3001, "uri": uri(i)}));
        }
        let folder = crate::files::scene_folder::SceneFolder::of(&dir.path().join("a.glb"), false);
        load(&fixture.glb(), &folder, &options)
    };
    let (_, warnings) = load(&|_| "a.bin".into()).unwrap();
    assert_eq!(warnings.iter().filter(|w| w.message.contains("byteLength is 3001")).count(), 100);
    // The limit holds for all names of the file together.
    let error = load(&|i| format!("{}a.bin", "./".repeat(i))).unwrap_err().to_string();
    assert_eq!(error, "file size in bytes: 3000 exceeds the limit of 1000");
}

/// gltfpack -cf writes a fallback buffer of uncompressed data, which is often not distributed.
#[test]
fn an_unused_fallback_buffer_may_be_missing() {
    let from = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/gltf");
    let to = tempfile::tempdir().unwrap();
    for name in ["patch_pack_cf.gltf", "patch_pack_cf.bin"] {
        std::fs::copy(from.join(name), to.path().join(name)).unwrap();
    }
    let load = |folder: &std::path::Path| {
        let options = LoadOptions::default();
        crate::load(&folder.join("patch_pack_cf.gltf"), &options).map_err(|e| e.to_string())
    };
    let (with_fallback, _) = load(&from).unwrap();
    let (without_fallback, warnings) = load(to.path()).unwrap();
    assert_eq!(with_fallback.meshes[0].positions, without_fallback.meshes[0].positions);
    assert_eq!(warnings, []);
    // An uncompressed buffer view needs it.
    let file = to.path().join("patch_pack_cf.gltf");
    let mut json: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let views = json["bufferViews"].as_array_mut().unwrap();
    let view = views.iter_mut().find(|view| !view["extensions"].is_null()).unwrap();
    view.as_object_mut().unwrap().remove("extensions");
    std::fs::write(&file, json.to_string()).unwrap();
    assert!(load(to.path()).unwrap_err().contains("patch_pack_cf.fallback.bin"));
}

#[test]
fn a_missing_buffer_is_an_error_only_for_what_is_drawn() {
    let mut fixture = Fixture::triangle();
    fixture.push("buffers", json!({"uri": "missing.bin", "byteLength": 36}));
    let view = fixture.push("bufferViews", json!({"buffer": 1, "byteLength": 36}));
    let missing =
        json!({"bufferView": view, "byteOffset": 0, "componentType": 5126, "type": "VEC3", "count": 3});
    let missing = fixture.push("accessors", missing);
    fixture.push("meshes", json!({"primitives": [{"attributes": {"POSITION": missing}}]}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0, 2.0]);
    fixture.push(
        "animations",
        json!({"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": times, "output": missing}]}),
    );
    fixture.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    fixture.push("textures", json!({"source": 0}));
    fixture.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    fixture.primitive()["material"] = json!(0);
    let (scene, warnings) = fixture.load();
    assert!(scene.instanced_triangle_count() == 1 && scene.animations[0].channels.is_empty());
    let error = "buffers[1].uri: 'missing.bin' cannot be read: No such file or directory (os error 2)";
    assert_eq!(warnings[0], format!("{error}; ignored everything stored in the buffer"));
    assert!(warnings.iter().any(|w| w.starts_with("animations[0].channels[0]: ")), "{warnings:?}");
    assert!(warnings.iter().any(|w| w.ends_with("; used white (flat for normal maps)")), "{warnings:?}");
    // A drawn mesh needs it.
    fixture.primitive()["attributes"]["POSITION"] = json!(missing);
    assert_eq!(fixture.error(), error);
}
