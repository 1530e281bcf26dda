//! How meshes look to rays.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::accel::build::input_triangles::SurfaceFlags;
use crate::scene::{Material, OpaqueTriangles, PosedScene, SurfaceClass};

/// How the triangles of a mesh look.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshFlags {
    /// By their material alone.
    look: SurfaceFlags,
    /// Those that are opaque though their material need not be.
    solid: Option<Arc<OpaqueTriangles>>,
}

impl MeshFlags {
    /// In its own frame. Not reversed where an instance mirrors it: a mirrored ray sees the side it saw
    /// before. It is the pose's to say, for animations drive materials too.
    pub fn by_material(posed: &PosedScene, mesh: u32) -> MeshFlags {
        let material = material(posed, mesh);
        let look = SurfaceFlags {
            class: material.surface_class(),
            single_sided: !material.double_sided,
            reversed: false,
        };
        MeshFlags { look, solid: None }
    }

    /// The same, its textures looked at.
    fn by_triangle(posed: &PosedScene, mesh: u32) -> MeshFlags {
        let mut found = MeshFlags::by_material(posed, mesh);
        let solid = posed.opaque_triangles(mesh);
        match solid.count() {
            0 => {}
            all if all == posed.scene.meshes[mesh as usize].triangles.len() => {
                found.look.class = SurfaceClass::Opaque;
            }
            _ => found.solid = Some(Arc::new(solid)),
        }
        found
    }

    /// The same in a world where its front may be the other side.
    pub fn placed(self, reversed: bool) -> MeshFlags {
        MeshFlags { look: SurfaceFlags { reversed, ..self.look }, ..self }
    }

    /// Of one of its triangles.
    #[inline(always)]
    pub fn of(&self, triangle: u32) -> SurfaceFlags {
        match &self.solid {
            Some(solid) if solid.contains(triangle) => {
                SurfaceFlags { class: SurfaceClass::Opaque, ..self.look }
            }
            _ => self.look,
        }
    }

    /// Whether light may pass through some of them in part.
    pub fn is_translucent(&self) -> bool {
        self.look.class == SurfaceClass::Translucent
    }
}

/// SurfaceFlagsCache of meshes, kept from pose to pose for as long as their material is the same.
#[derive(Debug, Default)]
pub(crate) struct SurfaceFlagsCache(BTreeMap<u32, (Material, MeshFlags)>);

impl SurfaceFlagsCache {
    /// Of a mesh.
    pub fn of(&mut self, posed: &PosedScene, mesh: u32) -> MeshFlags {
        let material = material(posed, mesh);
        if material.surface_class() == SurfaceClass::Opaque {
            return MeshFlags::by_material(posed, mesh);
        }
        match self.0.get(&mesh) {
            Some((before, look)) if before == material => look.clone(),
            _ => {
                let look = MeshFlags::by_triangle(posed, mesh);
                self.0.insert(mesh, (material.clone(), look.clone()));
                look
            }
        }
    }
}

fn material<'a>(posed: &'a PosedScene, mesh: u32) -> &'a Material {
    &posed.materials[posed.scene.meshes[mesh as usize].material as usize]
}
