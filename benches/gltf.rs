//! Time to load a GLB of 100 MB with textures of 4096 × 4096 pixels, compared to decoding its images alone on
//! as many threads: `cargo bench --bench gltf`.

use std::io::Cursor;
use std::path::Path;
use std::time::Instant;

use blinn::import::{LoadOptions, load};
use image::{DynamicImage, ImageFormat, RgbImage};
use rayon::prelude::*;
use serde_json::json;

const SIDE: u32 = 4096;

/// An image with detail and noise like a photographed texture.
fn noisy_image(seed: u32) -> DynamicImage {
    let mut state = seed.wrapping_mul(0x9e37_79b9) | 1;
    DynamicImage::ImageRgb8(RgbImage::from_fn(SIDE, SIDE, |x, y| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        let noise = (state >> 27) as u8;
        let wave = (((x * (seed + 3)) / 7 + y / 3) % 200) as u8;
        image::Rgb([wave.wrapping_add(noise), (y / 17) as u8 ^ noise, (x / 13) as u8])
    }))
}

fn encode_images(format: ImageFormat, count: u32) -> Vec<Vec<u8>> {
    let one = |seed| {
        let mut out = Cursor::new(Vec::new());
        match noisy_image(seed).write_to(&mut out, format) {
            Ok(()) => out.into_inner(),
            Err(e) => panic!("{e}"),
        }
    };
    (0..count).into_par_iter().map(one).collect()
}

/// A GLB with a mesh of 20,000 triangles and one material per image.
fn glb(images: &[Vec<u8>]) -> Vec<u8> {
    let side = 101u32;
    let mut bin: Vec<u8> = Vec::new();
    let floats =
        |bin: &mut Vec<u8>, values: Vec<f32>| values.iter().for_each(|v| bin.extend(v.to_le_bytes()));
    let grid = || (0..side * side).map(|i| ((i % side) as f32 * 0.01, (i / side) as f32 * 0.01));
    floats(&mut bin, grid().flat_map(|(x, y)| [x, y, 0.0]).collect());
    floats(&mut bin, grid().flat_map(|(x, y)| [x, y]).collect());
    let first = |q: u32| q / (side - 1) * side + q % (side - 1);
    for v in (0..(side - 1) * (side - 1)).map(first) {
        [v, v + 1, v + side, v + side, v + 1, v + side + 1].iter().for_each(|i| bin.extend(i.to_le_bytes()));
    }
    let vertices = (side * side) as usize;
    let indices = 6 * ((side - 1) * (side - 1)) as usize;
    let mut views = vec![
        json!({"buffer": 0, "byteOffset": 0, "byteLength": vertices * 12}),
        json!({"buffer": 0, "byteOffset": vertices * 12, "byteLength": vertices * 8}),
        json!({"buffer": 0, "byteOffset": vertices * 20, "byteLength": indices * 4}),
    ];
    for image in images {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": image.len()}));
        bin.extend(image);
        bin.resize(bin.len().next_multiple_of(4), 0);
    }
    let n = images.len();
    let primitive = |i| json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": i});
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": (0..n).map(primitive).collect::<Vec<_>>()}],
        "materials": (0..n).map(|i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}}))
            .collect::<Vec<_>>(),
        "textures": (0..n).map(|i| json!({"source": i})).collect::<Vec<_>>(),
        "images": (0..n).map(|i| json!({"bufferView": i + 3})).collect::<Vec<_>>(),
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": vertices},
            {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": vertices},
            {"bufferView": 2, "componentType": 5125, "type": "SCALAR", "count": indices}],
        "bufferViews": views, "buffers": [{"byteLength": bin.len()}],
    });
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((12 + 8 + text.len() + 8 + bin.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn seconds(run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn decode_images(images: &[Vec<u8>]) -> usize {
    images.par_iter().map(|bytes| image::load_from_memory(bytes).map_or(0, |i| i.as_bytes().len())).sum()
}

fn main() -> std::io::Result<()> {
    let folder = std::env::temp_dir().join(format!("blinn-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    for (name, format, count) in [("PNG", ImageFormat::Png, 4), ("JPEG", ImageFormat::Jpeg, 14)] {
        let images = encode_images(format, count);
        let path: &Path = &folder.join(format!("{name}.glb"));
        std::fs::write(path, glb(&images))?;
        let bytes = std::fs::metadata(path)?.len();
        let mut loads = Vec::new();
        let mut decodes = Vec::new();
        // Interleaved, so that slower phases of the machine affect both.
        for _ in 0..7 {
            decodes.push(seconds(|| assert!(decode_images(&images) > 0)));
            loads.push(seconds(|| assert!(load(path, &LoadOptions::default()).is_ok())));
        }
        let load = median(loads);
        let decode = median(decodes);
        println!(
            "{count} {name} images of {SIDE}x{SIDE} in {:.1} MB, {} threads: load {load:.3} s, images alone \
             {decode:.3} s, ratio {:.3}",
            bytes as f64 / 1e6,
            rayon::current_num_threads(),
            load / decode
        );
    }
    std::fs::remove_dir_all(&folder)
}
