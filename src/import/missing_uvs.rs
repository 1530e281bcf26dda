//! Textures that nothing says the place of.

use std::collections::BTreeMap;

use crate::import::error::Warning;
use crate::import::files::uri::printable;
use crate::scene::Scene;

/// Tells of materials with textures whose coordinates their meshes lack: one place of the image is seen all
/// over such a mesh.
pub(crate) fn warnings(scene: &Scene) -> Vec<Warning> {
    // By material and set: the first mesh, and how many there are.
    let mut lacking: BTreeMap<(u32, u32), (&str, usize)> = BTreeMap::new();
    for mesh in &scene.meshes {
        let mut sets: Vec<u32> =
            scene.materials[mesh.material as usize].textures().map(|texture| texture.uv_set).collect();
        sets.sort_unstable();
        sets.dedup();
        let lacks = |set: &u32| mesh.uv_set(*set).is_none();
        for set in sets.into_iter().filter(lacks) {
            lacking.entry((mesh.material, set)).or_insert((&mesh.name, 0)).1 += 1;
        }
    }
    let tell = |((material, set), (mesh, count)): ((u32, u32), (&str, usize))| {
        let material = called("material", &scene.materials[material as usize].name);
        let mesh = called("mesh", mesh);
        let others = match count {
            1 => String::new(),
            _ => format!(" and {} more", count - 1),
        };
        let what = format!(
            "{material}: {mesh}{others} lacks texture coordinates (set {set}): its textures show one colour \
             there; unwrap it before export"
        );
        Warning { place: String::new(), what }
    };
    lacking.into_iter().map(tell).collect()
}

/// A thing by its name, if it has one.
fn called(what: &str, name: &str) -> String {
    if name.is_empty() { format!("a {what}") } else { format!("{what} '{}'", printable(name)) }
}
