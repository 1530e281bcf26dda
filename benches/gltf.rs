//! Time to load a GLB of 100 MB with textures of 4096 × 4096 pixels, compared to decoding its images alone on
//! as many threads: `cargo bench --bench gltf`.

#[allow(dead_code, reason = "tests need the rest")]
#[path = "../src/import/gltf/fixture.rs"]
mod fixture;

use std::io::Cursor;
use std::path::Path;
use std::time::Instant;

use blinn::import::{LoadOptions, load};
use fixture::{Fixture, bytes_of};
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
    let grid = || (0..side * side).map(|i| [(i % side) as f32 * 0.01, (i / side) as f32 * 0.01]);
    let first = |q: u32| q / (side - 1) * side + q % (side - 1);
    let quads = (0..(side - 1) * (side - 1)).map(first);
    let triangles: Vec<u32> =
        quads.flat_map(|v| [v, v + 1, v + side, v + side, v + 1, v + side + 1]).collect();
    let mut file = Fixture::empty();
    let positions = file.vec3(&grid().map(|[x, y]| [x, y, 0.0]).collect::<Vec<_>>());
    let uvs = file.vec2(&grid().collect::<Vec<_>>());
    let indices = file.accessor(5125, "SCALAR", triangles.len(), &bytes_of(&triangles));
    let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
    let mut primitives = Vec::new();
    for bytes in images {
        let view = file.view(bytes);
        let image = file.push("images", json!({"bufferView": view}));
        let texture = file.push("textures", json!({"source": image}));
        let base_color = json!({"baseColorTexture": {"index": texture}});
        let material = file.push("materials", json!({"pbrMetallicRoughness": base_color}));
        primitives.push(json!({"attributes": attributes, "indices": indices, "material": material}));
    }
    file.push("meshes", json!({"primitives": primitives}));
    file.node(json!({"mesh": 0}));
    file.glb()
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
