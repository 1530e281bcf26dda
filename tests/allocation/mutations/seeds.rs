//! Seeds of mutations: small files of all formats, most from `models/tests`, the others generated.

use crate::common::model_path;
use crate::common::seed_files;

/// The function that reads a seed's first file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reader {
    Scene,
    Sky,
    CameraXml,
}

/// Files, one of which is mutated.
pub struct Seed {
    pub name: String,
    pub reader: Reader,
    /// The scene, and the files that it refers to.
    pub files: Vec<(String, Vec<u8>)>,
    changed: usize,
}

impl Seed {
    fn scene(name: &str, files: Vec<(&str, Vec<u8>)>, changed: usize) -> Seed {
        Seed::new(name, Reader::Scene, files, changed)
    }

    fn new(name: &str, reader: Reader, files: Vec<(&str, Vec<u8>)>, changed: usize) -> Seed {
        let files = files.into_iter().map(|(name, bytes)| (name.to_string(), bytes)).collect();
        Seed { name: name.to_string(), reader, files, changed }
    }

    /// The name of the mutated file.
    pub fn changed(&self) -> &str {
        &self.files[self.changed].0
    }

    /// The contents of the mutated file.
    pub fn bytes(&self) -> &[u8] {
        &self.files[self.changed].1
    }
}

fn model(name: &str) -> Vec<u8> {
    let path = model_path("tests").join(name);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All seeds.
pub fn all() -> Vec<Seed> {
    let mut all = Vec::new();
    for name in [
        "triangle.glb",
        "quad_nonindexed.glb",
        "gltf/strip.glb",
        "gltf/strip_list.glb",
        "gltf/strip_draco.glb",
        "gltf/strip_draco_fallback.glb",
        "gltf/quantised.glb",
        "gltf/quantised_draco.glb",
        "gltf/variants.glb",
        "gltf/blender_variants.glb",
        "gltf/more/blender_instances.glb",
        "gltf/more/blender_instances_plain.glb",
    ] {
        all.push(Seed::scene(name, vec![("a.glb", model(name))], 0));
    }
    let gltf = || model("triangle.gltf");
    all.push(Seed::scene("triangle.gltf", vec![("a.gltf", gltf())], 0));
    all.push(Seed::scene("rich.gltf", vec![("a.gltf", seed_files::rich_gltf())], 0));
    for (name, bytes) in seed_files::small_gltf() {
        all.push(Seed::scene(name, vec![("a.gltf", bytes)], 0));
    }
    // Compressed by meshopt: the JSON, then the streams.
    for stem in ["gltf/patch_pack_cf", "gltf/more/patch_pack_khr_cf"] {
        let last = stem.rsplit('/').next().unwrap();
        let (bin, fallback) = (format!("{last}.bin"), format!("{last}.fallback.bin"));
        for changed in 0..2 {
            let files = vec![
                ("a.gltf", model(&format!("{stem}.gltf"))),
                (bin.as_str(), model(&format!("{stem}.bin"))),
                (fallback.as_str(), model(&format!("{stem}.fallback.bin"))),
            ];
            all.push(Seed::scene(&format!("{stem}, file {changed}"), files, changed));
        }
    }
    for name in [
        "cmyk.jpg",
        "grey.jpg",
        "progressive.jpg",
        "rgb.jpg",
        "grey_16.png",
        "grey_alpha.png",
        "one_bit.png",
        "palette.png",
        "palette_transparent.png",
        "rgb.png",
        "rgba.png",
        "lossless.webp",
        "lossy.webp",
        "rgb.bmp",
        "rgba.tga",
        "lzw.tif",
        "palette.tif",
        "frames.gif",
    ] {
        all.push(image(name, model(&format!("images/{name}"))));
    }
    for name in [
        "alpha_etc1s.ktx2",
        "alpha_etc1s_mips.ktx2",
        "alpha_uastc_zstd_mips.ktx2",
        "alpha_uastc.ktx2",
        "busy_etc1s_mips.ktx2",
        "busy_uastc_zstd.ktx2",
        "colour_etc1s.ktx2",
        "new_colour_etc1s_mips.ktx2",
        "new_normal_uastc.ktx2",
        "colour_uastc_mips.ktx2",
        "colour_uastc_zstd.ktx2",
        "normal_etc1s_rrrg.ktx2",
    ] {
        all.push(image(name, model(&format!("gltf/ktx2/{name}"))));
    }
    for name in ["cube.obj", "negative.obj", "references/groups.obj"] {
        all.push(Seed::scene(name, vec![("a.obj", model(name))], 0));
    }
    for (name, text) in seed_files::OBJ {
        all.push(Seed::scene(name, vec![("a.obj", text.into()), ("a.mtl", seed_files::MTL.into())], 0));
    }
    let obj =
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";
    for (name, text) in [("mtl", seed_files::MTL), ("mtl of Blender", seed_files::MTL_OF_BLENDER)] {
        let png = model("images/rgba.png");
        all.push(Seed::scene(name, vec![("a.obj", obj.into()), ("a.mtl", text.into()), ("a.png", png)], 1));
    }
    for (name, file, bytes) in seed_files::polygon_files() {
        all.push(Seed::scene(name, vec![(file, bytes)], 0));
    }
    for (name, bytes) in seed_files::skies() {
        all.push(Seed::new(name, Reader::Sky, vec![("a.hdr", bytes)], 0));
    }
    all.push(Seed::new("camera.xml", Reader::CameraXml, vec![("a.xml", seed_files::CAMERA.into())], 0));
    all
}

/// A triangle with an image.
fn image(name: &str, bytes: Vec<u8>) -> Seed {
    Seed::scene(name, vec![("a.gltf", seed_files::pictured(name)), (name, bytes)], 1)
}
