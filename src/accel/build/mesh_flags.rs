//! Surface flags of a mesh's triangles, by its material and its textures' alpha.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::bvh::surface_flags::SurfaceFlags;
use blinn_scene::{Material, OpaqueTriangles, PosedScene, SurfaceClass};

/// The surface flags of a mesh's triangles.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshFlags {
    /// Flags by the material.
    flags: SurfaceFlags,
    /// Triangles that are opaque though their material need not be, by their texture's alpha.
    opaque_triangles: Option<Arc<OpaqueTriangles>>,
}

impl MeshFlags {
    /// Returns the flags by the material alone, in local space. A mirrored instance does not reverse them: a ray
    /// that is mirrored with it sees the same side. The posed material counts, as animations may change it.
    pub fn by_material(posed: &PosedScene, mesh: u32) -> MeshFlags {
        let material = material(posed, mesh);
        let class = material.surface_class();
        let flags = SurfaceFlags { class, single_sided: !material.double_sided, reversed: false };
        MeshFlags { flags, opaque_triangles: None }
    }

    /// Returns the flags by the material and its textures' alpha at each triangle.
    fn by_triangle(posed: &PosedScene, mesh: u32) -> MeshFlags {
        let mut by_triangle = MeshFlags::by_material(posed, mesh);
        let opaque = posed.opaque_triangles(mesh);
        match opaque.count() {
            0 => {}
            all if all == posed.scene.meshes[mesh as usize].triangles.len() => {
                by_triangle.flags.class = SurfaceClass::Opaque;
            }
            _ => by_triangle.opaque_triangles = Some(Arc::new(opaque)),
        }
        by_triangle
    }

    /// Returns the flags in world space, where `reversed` is true for instances that mirror.
    pub fn in_world(self, reversed: bool) -> MeshFlags {
        MeshFlags { flags: SurfaceFlags { reversed, ..self.flags }, ..self }
    }

    /// Returns the flags of a triangle.
    #[inline(always)]
    pub fn get(&self, triangle: u32) -> SurfaceFlags {
        match &self.opaque_triangles {
            Some(opaque) if opaque.contains(triangle) => {
                SurfaceFlags { class: SurfaceClass::Opaque, ..self.flags }
            }
            _ => self.flags,
        }
    }

    /// Returns true if some triangles may transmit light.
    pub fn is_translucent(&self) -> bool {
        self.flags.class == SurfaceClass::Translucent
    }
}

/// The flags of meshes, from pose to pose: they depend on textures, and are computed again only where a material
/// changes.
#[derive(Debug, Default)]
pub(crate) struct MeshFlagsCache(BTreeMap<u32, (Material, MeshFlags)>);

impl MeshFlagsCache {
    /// Returns the flags of a mesh.
    pub fn get(&mut self, posed: &PosedScene, mesh: u32) -> MeshFlags {
        let material = material(posed, mesh);
        if material.surface_class() == SurfaceClass::Opaque {
            return MeshFlags::by_material(posed, mesh);
        }
        match self.0.get(&mesh) {
            Some((cached_material, flags)) if cached_material == material => flags.clone(),
            _ => {
                let flags = MeshFlags::by_triangle(posed, mesh);
                self.0.insert(mesh, (material.clone(), flags.clone()));
                flags
            }
        }
    }
}

fn material<'a>(posed: &'a PosedScene, mesh: u32) -> &'a Material {
    &posed.materials[posed.scene.meshes[mesh as usize].material as usize]
}
