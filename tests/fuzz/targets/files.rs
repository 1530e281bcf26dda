//! Bytes as a scene file, or as a file that a scene refers to.

use std::fs;
use std::path::Path;

use blinn::import::{load_camera_xml, load_environment};

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

pub fn mtl(bytes: &[u8], folder: &Path) -> bool {
    const OBJ: &str =
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";
    fs::write(folder.join("a.mtl"), bytes).unwrap();
    let path = folder.join("a.obj");
    fs::write(&path, OBJ).unwrap();
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
