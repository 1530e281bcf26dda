//! Estimates how much memory a scene takes.

use std::mem::size_of_val;

use glam::Vec2;

use crate::{Image, Mesh, MorphTarget, Scene};

/// Overhead of an allocator for each allocation, in bytes.
const ALLOCATION_OVERHEAD: usize = 16;

impl Scene {
    /// Returns the bytes of the large arrays: nodes and instances, meshes, images with their mip maps, animations and the
    /// environment. Materials are left out.
    pub fn memory_size(&self) -> u64 {
        let meshes: usize = self.meshes.iter().map(Mesh::memory_size).sum();
        let images: u64 = self.images.iter().map(Image::byte_size).sum();
        let keyframes = self.animations.iter().flat_map(|a| &a.channels).map(|c| &c.keyframes);
        let keyframes: usize =
            keyframes.map(|k| size_of_val(&k.times[..]) + size_of_val(&k.values[..])).sum();
        let text = |name: &String| name.capacity() + ALLOCATION_OVERHEAD;
        let nodes: usize = self.nodes.iter().map(|node| size_of_val(node) + text(&node.name)).sum();
        let objects: usize = self.objects.iter().map(|name| size_of_val(name) + text(name)).sum();
        let drawn = size_of_val(&self.instances[..]) + objects;
        let environment = self.environment.as_ref().map_or(0, |environment| environment.map.memory_size());
        // A mip pyramid is a third of its image.
        (nodes + drawn + meshes + keyframes) as u64 + images + images / 3 + environment
    }
}

impl Mesh {
    fn memory_size(&self) -> usize {
        let uv_bytes = |sets: &[Vec<Vec2>]| -> usize { sets.iter().map(|set| size_of_val(&set[..])).sum() };
        let morph = |m: &MorphTarget| {
            size_of_val(&m.positions[..])
                + size_of_val(&m.normals[..])
                + size_of_val(&m.tangents[..])
                + size_of_val(&m.colors[..])
                + uv_bytes(&m.uvs)
        };
        let morph_targets: usize = self.morph_targets.iter().map(morph).sum();
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + self.edge_marks.memory_size()
            + self.polygons.memory_size()
            + size_of_val(self.lines())
            + size_of_val(&self.normals[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.influences.joints[..])
            + size_of_val(&self.influences.weights[..])
            + uv_bytes(&self.uvs)
            + morph_targets
    }
}
