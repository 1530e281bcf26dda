//! Names of the file's cameras, as options give them.

use blinn_scene::Scene;

/// A name that finds the file's camera number `index`: the index, unless that is the name of another camera.
pub fn camera_name(scene: &Scene, index: usize) -> String {
    let number = index.to_string();
    let camera = &scene.cameras[index];
    let node = &scene.nodes[camera.node as usize].name;
    let names = [&number, node, &camera.name];
    names.into_iter().find(|name| scene.find_camera(name) == Some(index)).unwrap_or(&number).clone()
}
