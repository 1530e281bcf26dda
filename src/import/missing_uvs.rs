//! Warnings for materials on meshes without the texture coordinates that they need.

use std::collections::BTreeMap;

use crate::error::Warning;
use crate::files::escape::printable;
use blinn_scene::{Mesh, Scene};

/// Meshes of a material that lack a set of texture coordinates.
struct Lacking<'s> {
    first: &'s Mesh,
    count: usize,
}

/// Warns of each material and set of texture coordinates that some of the material's meshes lack. Such a mesh
/// shows a single texel. Blender's loose edges and vertices have the material of the faces beside them and cannot be
/// unwrapped: they are no reason to warn.
pub(crate) fn warnings(scene: &Scene) -> Vec<Warning> {
    let mut lacking: BTreeMap<(u32, u32), Lacking<'_>> = BTreeMap::new();
    let is_loose = |mesh: &Mesh| mesh.has_rounds() && scene.source.is_blender();
    for mesh in scene.meshes.iter().filter(|mesh| !is_loose(mesh)) {
        let textures = scene.materials[mesh.material as usize].textures();
        let mut sets: Vec<u32> = textures.map(|texture| texture.uv_set).collect();
        sets.sort_unstable();
        sets.dedup();
        for set in sets.into_iter().filter(|set| mesh.uv_set(*set).is_none()) {
            let meshes = lacking.entry((mesh.material, set)).or_insert(Lacking { first: mesh, count: 0 });
            meshes.count += 1;
        }
    }
    let warning = |(&(material, set), meshes): (&(u32, u32), &Lacking<'_>)| {
        let what = format!("no texture coordinates (set {set}), so its textures show a single colour there");
        meshes.warning(scene, material, &what)
    };
    lacking.iter().map(warning).collect()
}

/// Warns of each material with anisotropy that some of its meshes show without, for lack of tangents.
pub(crate) fn anisotropy_warnings(scene: &Scene) -> Vec<Warning> {
    let mut lacking: BTreeMap<u32, Lacking<'_>> = BTreeMap::new();
    for mesh in scene.meshes.iter().filter(|mesh| !mesh.has_rounds()) {
        let anisotropy = &scene.materials[mesh.material as usize].anisotropy;
        if mesh.tangents.is_empty() && anisotropy.as_ref().is_some_and(|of| of.strength > 0.0) {
            lacking.entry(mesh.material).or_insert(Lacking { first: mesh, count: 0 }).count += 1;
        }
    }
    let what = "neither tangents nor texture coordinates, so its highlights are round there";
    lacking.iter().map(|(&material, meshes)| meshes.warning(scene, material, what)).collect()
}

impl Lacking<'_> {
    /// Warns that the meshes of a material have `what`.
    fn warning(&self, scene: &Scene, material: u32, what: &str) -> Warning {
        let material = described("material", &scene.materials[material as usize].name);
        let mesh = described("mesh", &self.first.name);
        let more = if self.count == 1 { String::new() } else { format!(" and {} more", self.count - 1) };
        let verb = if self.count == 1 { "has" } else { "have" };
        let advice = match self.first.has_rounds() {
            true => "export its points and lines with texture coordinates, or with colours",
            false => "unwrap the mesh before exporting it",
        };
        let message = format!("{material}: {mesh}{more} {verb} {what}; {advice}");
        Warning { location: String::new(), message }
    }
}

/// A kind of object with its name, if it has one.
fn described(kind: &str, name: &str) -> String {
    if name.is_empty() { format!("a {kind}") } else { format!("{kind} '{}'", printable(name)) }
}

#[cfg(test)]
mod tests {
    use blinn_scene::{Anisotropy, Material, Rounds, TextureRef, UvTransform};
    use glam::Vec4;

    use super::*;

    #[test]
    fn only_meshes_that_can_be_unwrapped_should_be() {
        let texture = Some(TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY });
        let mut scene = Scene {
            materials: vec![Material { name: "wood".into(), ..Material::default() }],
            meshes: vec![Mesh::default()],
            ..Scene::default()
        };
        scene.materials[0].base_color.texture = texture;
        assert!(warnings(&scene)[0].message.ends_with("; unwrap the mesh before exporting it"));
        scene.meshes[0].rounds = Rounds::Lines(Vec::new());
        let expected = "; export its points and lines with texture coordinates, or with colours";
        assert!(warnings(&scene)[0].message.ends_with(expected));
        scene.source.generator = "Khronos glTF Blender I/O v5.1.18".into();
        assert!(warnings(&scene).is_empty());
    }

    #[test]
    fn anisotropy_without_tangents_is_a_warning() {
        let scene = |strength: f32, tangents: Vec<Vec4>| {
            let anisotropy = Some(Anisotropy { strength, ..Anisotropy::default() });
            let material = Material { name: "steel".into(), anisotropy, ..Material::default() };
            let mesh = Mesh { tangents, ..Mesh::default() };
            Scene { materials: vec![material], meshes: vec![mesh], ..Scene::default() }
        };
        let warnings = anisotropy_warnings(&scene(1.0, Vec::new()));
        assert_eq!(warnings.len(), 1);
        let expected = "material 'steel': a mesh has neither tangents nor texture coordinates, so its highlights are round";
        assert!(warnings[0].message.starts_with(expected), "{}", warnings[0].message);
        for quiet in [scene(0.0, Vec::new()), scene(1.0, vec![Vec4::X])] {
            assert!(anisotropy_warnings(&quiet).is_empty());
        }
    }
}
