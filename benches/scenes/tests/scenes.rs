//! Properties of the generated scenes that benchmarks rely on: size, bit-identity, closed surfaces.

use std::collections::HashMap;
use std::error::Error;

use blinn_scenes::{GeneratedMesh, GeneratedScene, SceneKind, parse_triangle_count, write_glb, write_obj};

#[test]
fn every_kind_has_the_requested_number_of_triangles() {
    for kind in SceneKind::ALL {
        for asked in [10_000, 70_002, 123_456] {
            let scene = kind.generate(asked);
            assert_eq!(scene.stored_triangles(), asked.max(kind.min_triangles()), "{kind}");
            let expected = if kind == SceneKind::Forest { 1000 * asked } else { asked / 2 };
            assert!(scene.drawn_triangles() > expected, "{kind} draws {}", scene.drawn_triangles());
        }
        assert_eq!(kind.generate(60_001).stored_triangles(), 60_000, "{kind}: odd counts are lowered by one");
        assert_eq!(kind.generate(0).stored_triangles(), kind.min_triangles(), "{kind}");
    }
}

/// If a hash changes, old and new measurements no longer compare.
#[test]
fn scenes_are_bit_identical_everywhere() {
    let hashes: Vec<String> =
        SceneKind::ALL.iter().map(|kind| format!("{kind} {:016x}", kind.generate(50_000).hash())).collect();
    assert_eq!(
        hashes,
        [
            "scan 8c971d1fe58f9da5",
            "interior eae5a1dc1d166a12",
            "stadium 88aa97cda2e18157",
            "forest b75a95026698e0bc",
            "slivers 85922b80881c9a48",
            "soup 644dc8a53fe8081f",
            "layers 973d5036f3ebd7a9",
        ]
    );
}

#[test]
fn indices_positions_and_normals_are_valid() {
    for kind in SceneKind::ALL {
        for mesh in &kind.generate(50_000).meshes {
            let n = mesh.positions.len();
            assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < n), "{kind} {}", mesh.name);
            assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()), "{kind} {}", mesh.name);
            let unit = |v: &[f32; 3]| (v.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-4;
            assert!(mesh.normals.is_empty() || mesh.normals.len() == n, "{kind} {}", mesh.name);
            assert!(mesh.normals.iter().all(unit), "{kind} {}", mesh.name);
        }
    }
}

fn volume(mesh: &GeneratedMesh) -> f64 {
    let corner = |v: u32| mesh.positions[v as usize].map(f64::from);
    let part = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    mesh.triangles.iter().map(part).sum::<f64>() / 6.0
}

#[test]
fn a_scan_is_closed_faces_outward_and_has_even_areas() {
    for asked in [48, 10_000, 70_000, 69_998] {
        let scene = SceneKind::Scan.generate(asked);
        let mesh = &scene.meshes[0];
        let mut edges = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                assert!(edges.insert((t[k], t[(k + 1) % 3]), ()).is_none(), "an edge used twice one way");
            }
        }
        assert!(edges.keys().all(|&(a, b)| edges.contains_key(&(b, a))), "{asked}: an open edge");
        assert!(volume(mesh) > 0.5, "{asked}: volume {}", volume(mesh));
    }
    let scene = SceneKind::Scan.generate(70_000);
    let mesh = &scene.meshes[0];
    let mut areas: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].map(f64::from));
            let (e, f) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
            let n = [0, 1, 2].map(|k| e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3]);
            n.iter().map(|x| x * x).sum::<f64>().sqrt()
        })
        .collect();
    areas.sort_by(f64::total_cmp);
    let (low, high) = (areas[areas.len() / 20], areas[areas.len() * 19 / 20]);
    assert!(low > 0.0 && high / low < 12.0, "nine in ten areas lie within a factor of {}", high / low);
}

#[test]
fn layers_coincide() {
    let mesh = &SceneKind::Layers.generate(20_000).meshes[0];
    let mut places: HashMap<[[u32; 3]; 3], usize> = HashMap::new();
    for t in &mesh.triangles {
        *places.entry(t.map(|v| mesh.positions[v as usize].map(f32::to_bits))).or_default() += 1;
    }
    assert!(places.values().all(|&n| n >= 8), "every triangle has seven others in its place");
}

fn small() -> GeneratedScene {
    GeneratedScene { textured: true, ..SceneKind::Interior.generate(50_000) }
}

#[test]
fn the_lengths_in_a_glb_are_right() -> Result<(), Box<dyn Error>> {
    let path = std::env::temp_dir().join(format!("blinn-scenes-{}.glb", std::process::id()));
    let scene = small();
    write_glb(&scene, &path)?;
    let bytes = std::fs::read(&path)?;
    std::fs::remove_file(&path)?;
    let word =
        |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
    assert_eq!((&bytes[..4], word(8)), (&b"glTF"[..], bytes.len()));
    let text = word(12);
    let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + text])?;
    let buffer = json["buffers"][0]["byteLength"].as_u64().unwrap_or_default() as usize;
    assert_eq!((word(20 + text), bytes.len()), (buffer, 28 + text + buffer));
    let counts = json["accessors"].as_array().into_iter().flatten().filter(|a| a["type"] == "SCALAR");
    assert_eq!(
        counts.filter_map(|a| a["count"].as_u64()).sum::<u64>() as usize,
        3 * scene.stored_triangles()
    );
    Ok(())
}

#[test]
fn an_obj_contains_every_instance() -> Result<(), Box<dyn Error>> {
    let path = std::env::temp_dir().join(format!("blinn-scenes-{}.obj", std::process::id()));
    let scene = small();
    write_obj(&scene, &path)?;
    let text = std::fs::read_to_string(&path)?;
    std::fs::remove_file(path.with_extension("mtl"))?;
    std::fs::remove_file(&path)?;
    let lines = |start: &str| text.lines().filter(|l| l.starts_with(start)).count();
    assert_eq!(lines("f "), scene.drawn_triangles());
    assert_eq!(lines("v "), scene.meshes.iter().map(|m| m.positions.len()).sum::<usize>());
    Ok(())
}

#[test]
fn triangle_counts_are_parsed() {
    let read = ["70000", "70k", "1.1m", "30M"].map(parse_triangle_count);
    assert_eq!(read, [Ok(70_000), Ok(70_000), Ok(1_100_000), Ok(30_000_000)]);
    for wrong in ["", "k", "-3", "0", "1e9m", "nan", "7x"] {
        assert!(parse_triangle_count(wrong).is_err(), "{wrong}");
    }
}
