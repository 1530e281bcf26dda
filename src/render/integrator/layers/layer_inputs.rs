//! Makes the layers of points from materials.

use glam::DVec3;

use crate::integrator::layers::coat::CoatNormal;
use crate::integrator::layers::layered_point::LayeredPoint;
use crate::integrator::material::material_inputs::MaterialInputs;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shading_triangle::TriangleSurface;
use crate::integrator::surface::soa::{dvec3, vec3};
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_eval::TextureEvalContext;
use blinn_scene::{Material, NormalMap, PosedScene};

/// The textures of a layered material at the points of a block.
pub(crate) struct LayerInputs<'a> {
    posed: &'a PosedScene<'a>,
    material: &'a Material,
    inputs: &'a MaterialInputs<'a>,
}

impl<'a> LayerInputs<'a> {
    pub fn new(
        posed: &'a PosedScene<'a>,
        material: &'a Material,
        inputs: &'a MaterialInputs<'a>,
    ) -> LayerInputs<'a> {
        LayerInputs { posed, material, inputs }
    }

    /// The layers of the point in a lane, whose coefficients are known.
    pub fn layers(&self, triangle: &TriangleSurface, block: &PointBlock, lane: usize) -> LayeredPoint {
        LayeredPoint { k_d: vec3(&block.k.k_d, lane), coat: self.coat_normal(triangle, block, lane) }
    }

    /// The normal of the coat: that of its own map, or of the vertices.
    fn coat_normal(&self, triangle: &TriangleSurface, block: &PointBlock, lane: usize) -> CoatNormal {
        let (n, alpha2_increase) = match &self.material.clearcoat.normal {
            Some(map) => self.filtered_normal(map, triangle, block, lane),
            None => (dvec3(&block.n_v, lane), block.coords(lane).differentials.alpha2_increase()),
        };
        CoatNormal { n, alpha2_increase }
    }

    /// The mean normal of a map over the sample's footprint, and the increase of α² by its normals.
    fn filtered_normal(
        &self,
        map: &NormalMap,
        triangle: &TriangleSurface,
        block: &PointBlock,
        lane: usize,
    ) -> (DVec3, f32) {
        let sampled_normal = Some(self.inputs.texels.normal(&map.texture, lane));
        let ctx = TextureEvalContext { sampled_normal, ..triangle.texture_context(block.coords(lane)) };
        let surface = SurfacePoint { ctx, ..triangle.surface_from_hit(&block.hit(lane)) };
        surface.mapped_normal(self.posed, Some(map))
    }
}
