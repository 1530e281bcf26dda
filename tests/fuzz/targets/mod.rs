//! The fuzz targets: functions of bytes.
//!
//! Some use the bytes as a file; others generate a file from them with `arbitrary`, so that most inputs are
//! accepted. Then the scene is loaded, posed, built and rendered.

mod files;
mod gltf;
#[allow(dead_code, reason = "a part of it is needed here")]
#[path = "../../common/gltf_fixture.rs"]
mod gltf_fixture;
mod obj;
#[allow(dead_code, reason = "the mutations' seeds; some are what bytes are put into")]
#[path = "../../common/seed_files.rs"]
mod seed_files;
mod streams;
mod triangles;

use std::path::Path;

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{Limits, LoadOptions, load};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{AnimationChoice, Lighting, PoseSettings, Scene, View, pose};

/// Runs bytes, with a folder for files. Returns whether they were accepted.
pub type Target = fn(&[u8], &Path) -> bool;

/// All targets by name.
pub const TARGETS: [(&str, Target); 16] = [
    ("camera", files::camera),
    ("cameras", files::cameras),
    ("draco", streams::draco),
    ("glb", files::glb),
    ("gltf", gltf::target),
    ("ies", files::ies),
    ("image", files::image),
    ("ktx2", files::image),
    ("meshopt", streams::meshopt),
    ("mtl", files::mtl),
    ("obj", obj::target),
    ("obj_text", files::obj),
    ("ply", files::ply),
    ("sky", files::sky),
    ("stl", files::stl),
    ("triangles", triangles::target),
];

/// Runs a target by name, for the programs in `bins`.
#[allow(dead_code, reason = "theirs alone")]
pub fn fuzz(name: &str, bytes: &[u8]) {
    static FOLDER: std::sync::OnceLock<tempfile::TempDir> = std::sync::OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for files"));
    let target = TARGETS.iter().find(|(n, _)| *n == name).expect("a target of that name").1;
    target(bytes, folder.path());
}

/// Small limits, so that allocations outside of them stand out.
fn limits() -> Limits {
    Limits {
        vertices: 1 << 16,
        triangles: 1 << 16,
        nodes: 1 << 12,
        instances: 1 << 12,
        decompressed_bytes: 1 << 22,
        image_pixels: 1 << 20,
        texture_bytes: 16 << 20,
        ..Limits::default()
    }
}

/// Renders a file. Returns whether it was loaded.
fn load_and_render(path: &Path) -> bool {
    let Ok((scene, _)) = load(path, &LoadOptions { limits: limits(), ..LoadOptions::default() }) else {
        return false;
    };
    assert_sound(&scene);
    let at = PoseSettings { time: 0.4, animation: AnimationChoice::All, centre: None };
    let Ok(posed) = pose(&scene, &at) else { return true };
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 4, height: 3, samples: 1, ..Default::default() };
    if let Ok((camera, _)) = View::default().resolve(&posed, settings.width, settings.height) {
        let lit = Lighting::default().resolve(&posed, &camera);
        let _ = render(&Frame::new(&posed, &accel, camera, &lit), &Phong::default(), &settings, &());
    }
    true
}

/// Checks what importers guarantee: all indices are valid.
fn assert_sound(scene: &Scene) {
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < vertices));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices);
        assert!((mesh.material as usize) < scene.materials.len());
    }
    for instance in &scene.instances {
        assert!((instance.mesh as usize) < scene.meshes.len());
        assert!((instance.node as usize) < scene.nodes.len());
        assert!(instance.skin.is_none_or(|s| (s as usize) < scene.skins.len()));
    }
    for (i, node) in scene.nodes.iter().enumerate() {
        assert!(node.parent.is_none_or(|parent| (parent as usize) < i));
    }
    assert!(scene.textures.iter().all(|t| (t.image as usize) < scene.images.len()));
    assert!(scene.skins.iter().flat_map(|s| &s.joints).all(|&j| (j as usize) < scene.nodes.len()));
    assert!(scene.lights.iter().all(|l| (l.node as usize) < scene.nodes.len()));
}
