//! How meshes look to rays.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::accel::build::input_triangles::Look;
use crate::scene::{Material, OpaqueTriangles, PosedScene, SurfaceClass};

/// How the triangles of a mesh look.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshLook {
    /// By their material alone.
    look: Look,
    /// Those that are opaque though their material need not be.
    solid: Option<Arc<OpaqueTriangles>>,
}

impl MeshLook {
    /// In its own frame. Not reversed where an instance mirrors it: a mirrored ray sees the side it saw
    /// before. It is the pose's to say, for animations drive materials too.
    pub fn by_material(posed: &PosedScene, mesh: u32) -> MeshLook {
        let material = material(posed, mesh);
        let look =
            Look { class: material.surface_class(), single_sided: !material.double_sided, reversed: false };
        MeshLook { look, solid: None }
    }

    /// The same, its textures looked at.
    fn by_triangle(posed: &PosedScene, mesh: u32) -> MeshLook {
        let mut found = MeshLook::by_material(posed, mesh);
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
    pub fn placed(self, reversed: bool) -> MeshLook {
        MeshLook { look: Look { reversed, ..self.look }, ..self }
    }

    /// Of one of its triangles.
    #[inline(always)]
    pub fn of(&self, triangle: u32) -> Look {
        match &self.solid {
            Some(solid) if solid.contains(triangle) => Look { class: SurfaceClass::Opaque, ..self.look },
            _ => self.look,
        }
    }

    /// Whether light may pass through some of them in part.
    pub fn is_translucent(&self) -> bool {
        self.look.class == SurfaceClass::Translucent
    }
}

/// Looks of meshes, kept from pose to pose for as long as their material is the same.
#[derive(Debug, Default)]
pub(crate) struct Looks(BTreeMap<u32, (Material, MeshLook)>);

impl Looks {
    /// Of a mesh.
    pub fn of(&mut self, posed: &PosedScene, mesh: u32) -> MeshLook {
        let material = material(posed, mesh);
        if material.surface_class() == SurfaceClass::Opaque {
            return MeshLook::by_material(posed, mesh);
        }
        match self.0.get(&mesh) {
            Some((before, look)) if before == material => look.clone(),
            _ => {
                let look = MeshLook::by_triangle(posed, mesh);
                self.0.insert(mesh, (material.clone(), look.clone()));
                look
            }
        }
    }
}

fn material<'a>(posed: &'a PosedScene, mesh: u32) -> &'a Material {
    &posed.materials[posed.scene.meshes[mesh as usize].material as usize]
}
