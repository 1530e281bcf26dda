//! Bytes as a scene file, or as a file that a scene refers to.

use std::fs;
use std::path::Path;

use blinn::import::{CameraFile, load_camera_xml, load_environment};

use super::{limits, load_and_render, seed_files};

pub fn glb(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("a.glb");
    fs::write(&path, bytes).unwrap();
    load_and_render(&path)
}

pub fn obj(bytes: &[u8], folder: &Path) -> bool {
    fs::write(folder.join("a.mtl"), seed_files::MTL).unwrap();
    let path = folder.join("a.obj");
    fs::write(&path, bytes).unwrap();
    load_and_render(&path)
}

pub fn ply(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("a.ply");
    fs::write(&path, bytes).unwrap();
    load_and_render(&path)
}

pub fn stl(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("a.stl");
    fs::write(&path, bytes).unwrap();
    load_and_render(&path)
}

pub fn mtl(bytes: &[u8], folder: &Path) -> bool {
    const OBJ: &str =
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";
    fs::write(folder.join("a.mtl"), bytes).unwrap();
    let path = folder.join("a.obj");
    fs::write(&path, OBJ).unwrap();
    load_and_render(&path)
}

/// A photometric profile of the light above a triangle.
pub fn ies(bytes: &[u8], folder: &Path) -> bool {
    fs::write(folder.join("a.ies"), bytes).unwrap();
    let path = folder.join("a.gltf");
    fs::write(&path, seed_files::lit_by("a.ies")).unwrap();
    load_and_render(&path)
}

/// An image of any format on a triangle.
pub fn image(bytes: &[u8], folder: &Path) -> bool {
    fs::write(folder.join("a.img"), bytes).unwrap();
    let path = folder.join("a.gltf");
    fs::write(&path, seed_files::pictured("a.img")).unwrap();
    load_and_render(&path)
}

/// Radiance HDR or OpenEXR.
pub fn sky(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("a.hdr");
    fs::write(&path, bytes).unwrap();
    load_environment(&path, &limits()).is_ok()
}

pub fn camera(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("a.xml");
    fs::write(&path, bytes).unwrap();
    load_camera_xml(&path).is_ok()
}

/// A list of cameras: JSON, or a file of a COLMAP model beside a valid one.
pub fn cameras(bytes: &[u8], folder: &Path) -> bool {
    /// One PINHOLE with id 1.
    const LENSES: &str = "1 PINHOLE 8 8 9 9 4 4\n";
    const IMAGES: &str = "1 1 0 0 0 0 0 4 1 a.png\n\n";
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    write("list.json", bytes);
    write("images/images.txt", bytes);
    write("images/cameras.txt", LENSES.as_bytes());
    write("cameras/images.txt", IMAGES.as_bytes());
    write("cameras/cameras.txt", bytes);
    let mut lenses =
        [1u64.to_le_bytes().to_vec(), 1u64.to_le_bytes()[..4].to_vec(), vec![1, 0, 0, 0]].concat();
    lenses.extend([8u64, 8].iter().flat_map(|v| v.to_le_bytes()));
    lenses.extend([9f64, 9.0, 4.0, 4.0].iter().flat_map(|v| v.to_le_bytes()));
    write("binary/cameras.bin", &lenses);
    write("binary/images.bin", bytes);
    write("lenses/cameras.bin", bytes);
    write("lenses/images.bin", &0u64.to_le_bytes());
    let mut accepted = false;
    for name in ["list.json", "images", "cameras", "binary", "lenses"] {
        let Ok(list) = CameraFile::open(&folder.join(name), &limits()) else { continue };
        for index in 0..list.len().min(64) {
            let camera = list.camera(index).expect("a camera that was checked");
            assert!(camera.camera((8, 8)).view_point.is_finite());
        }
        accepted = true;
    }
    accepted
}
