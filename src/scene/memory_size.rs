//! How much memory a scene takes.

use std::mem::size_of_val;

use crate::scene::{Image, Mesh, MorphTarget, Scene};

/// Bytes that an allocator may take for itself, for each piece of memory.
const ALLOCATED: usize = 16;

impl Scene {
    /// Bytes of its large arrays: nodes and what hangs at them, meshes, images with all their smaller copies,
    /// animations. What there is one of for each material is left out.
    pub fn memory_size(&self) -> u64 {
        let meshes: usize = self.meshes.iter().map(Mesh::memory_size).sum();
        let images: u64 = self.images.iter().map(Image::byte_size).sum();
        let keys = self.animations.iter().flat_map(|a| &a.channels).map(|c| &c.keyframes);
        let keys: usize = keys.map(|k| size_of_val(&k.times[..]) + size_of_val(&k.values[..])).sum();
        let text = |name: &String| name.capacity() + ALLOCATED;
        let nodes: usize = self.nodes.iter().map(|node| size_of_val(node) + text(&node.name)).sum();
        let objects: usize = self.objects.iter().map(|name| size_of_val(name) + text(name)).sum();
        let drawn = size_of_val(&self.instances[..]) + objects;
        // A pyramid is a third of its image.
        (nodes + drawn + meshes + keys) as u64 + images + images / 3
    }
}

impl Mesh {
    fn memory_size(&self) -> usize {
        let uvs: usize = self.uvs.iter().map(|set| size_of_val(&set[..])).sum();
        let morph = |m: &MorphTarget| {
            size_of_val(&m.positions[..]) + size_of_val(&m.normals[..]) + size_of_val(&m.tangents[..])
        };
        let morph_targets: usize = self.morph_targets.iter().map(morph).sum();
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.influences.joints[..])
            + size_of_val(&self.influences.weights[..])
            + uvs
            + morph_targets
    }
}
