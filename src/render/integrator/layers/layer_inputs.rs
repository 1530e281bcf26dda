//! Makes the layers of points from materials.

use glam::DVec3;

use crate::integrator::layers::coat::CoatNormal;
use crate::integrator::layers::facets::Anisotropy;
use crate::integrator::layers::layered_point::LayeredPoint;
use crate::integrator::layers::sheen::Sheen;
use crate::integrator::layers::thin_film::ThinFilm;
use crate::integrator::material::material_inputs::MaterialInputs;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shading_triangle::TriangleSurface;
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use crate::integrator::surface::surface_point::SurfacePoint;
use crate::integrator::surface::texture_eval::TextureEvalContext;
use blinn_core::geometry::Rgb;
use blinn_scene::{Material, NormalMap, PosedScene, Reflectance, TexelSemantics};

/// The textures of a layered material at the points of a block.
pub(crate) struct LayerInputs<'a> {
    posed: &'a PosedScene<'a>,
    material: &'a Material,
    inputs: &'a MaterialInputs<'a>,
}

/// The diffuse transmission of a base.
struct TransmittedShare {
    /// The share of its light that comes from behind.
    share: f32,
    /// The share of light from behind that it transmits.
    color: Rgb,
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
        let transmission = self.diffuse_transmission(block, lane);
        LayeredPoint {
            k_d: vec3(&block.k.k_d, lane) * (1.0 - transmission.share),
            transmitted: transmission.color,
            coat: self.coat_normal(triangle, block, lane),
            anisotropy: self.anisotropy(triangle, block, lane),
            sheen: self.sheen(lane),
            film: self.film(lane),
            stretched_albedo: None,
            film_mean: None,
            k_a: Rgb::ZERO,
        }
    }

    /// The sheen; `None` where it is black.
    fn sheen(&self, lane: usize) -> Option<Sheen> {
        let blinn_scene::Sheen { color, roughness, model } = &self.material.sheen;
        let color = vec3(&self.inputs.color(color, TexelSemantics::Color), lane).clamp(Rgb::ZERO, Rgb::ONE);
        let roughness = || self.inputs.share(roughness)[lane];
        (color != Rgb::ZERO).then(|| Sheen { color, roughness: roughness(), model: *model })
    }

    /// Moves the share of the ambient light of the point in a lane that comes from behind away from k_a.
    pub fn split_ambient(&self, block: &mut PointBlock, lane: usize) {
        let share = self.diffuse_transmission(block, lane).share;
        if share > 0.0 {
            let k_a: Rgb = vec3(&block.k.k_a, lane);
            set3(&mut block.k.k_a, lane, (k_a * (1.0 - share)).to_array());
        }
    }

    /// The part that the base transmits diffusely.
    fn diffuse_transmission(&self, block: &PointBlock, lane: usize) -> TransmittedShare {
        let blinn_scene::DiffuseTransmission { factor, color } = &self.material.diffuse_transmission;
        if !(factor.factor > 0.0) {
            return TransmittedShare { share: 0.0, color: Rgb::ZERO };
        }
        let share = self.inputs.share(factor)[lane];
        let color = vec3(&self.inputs.color(color, TexelSemantics::Color), lane).clamp(Rgb::ZERO, Rgb::ONE);
        let metallic = match &self.material.reflectance {
            Reflectance::MetallicRoughness { metallic, .. } => self.inputs.share(metallic)[lane],
            _ => 0.0,
        };
        // The rest of the base is metal, or transmits light straight.
        let base = (1.0 - metallic) * (1.0 - block.k.transmission_weight[lane]);
        TransmittedShare { share, color: color * (share * base) }
    }

    /// The thin film; `None` where it is not there.
    fn film(&self, lane: usize) -> Option<ThinFilm> {
        let blinn_scene::Iridescence { factor, ior, min_thickness, max_thickness, thickness_texture } =
            &self.material.iridescence;
        let share = self.inputs.share(factor)[lane];
        let mut thickness = *max_thickness;
        if thickness_texture.is_some() {
            let [_, g, _, _] = &self.inputs.texels.get(thickness_texture.as_ref(), TexelSemantics::Data).rgba;
            thickness = min_thickness + (max_thickness - min_thickness) * g[lane];
        }
        (share > 0.0 && thickness > 0.0).then_some(ThinFilm { share, ior: *ior, thickness })
    }

    /// The stretch of the microfacets; `None` without one or on a mesh without tangents.
    fn anisotropy(&self, triangle: &TriangleSurface, block: &PointBlock, lane: usize) -> Option<Anisotropy> {
        // Texels are found by the address of their reference, so that a copy of it finds none.
        let blinn_scene::Anisotropy { strength, rotation, texture, model } =
            self.material.anisotropy.as_ref()?;
        let [mut x, mut y, mut strength] = [1.0, 0.0, *strength];
        if texture.is_some() {
            let texels = self.inputs.texels.get(texture.as_ref(), TexelSemantics::Data);
            let [r, g, b, _] = texels.rgba.each_ref().map(|channel| channel[lane]);
            [x, y] = [2.0 * r - 1.0, 2.0 * g - 1.0];
            strength *= b;
        }
        if !(strength > 0.0) {
            return None;
        }
        let (sin, cos) = (libm::sinf(*rotation), libm::cosf(*rotation));
        let [x, y] = [x * cos - y * sin, x * sin + y * cos].map(f64::from);
        let surface = triangle.surface_from_hit(&block.hit(lane));
        let [t, b] = surface.tangents(self.posed)?;
        let direction = (t * x + b * y).try_normalize()?;
        Some(Anisotropy { direction, strength: strength.min(1.0), model: *model })
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
