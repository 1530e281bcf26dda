//! Splits the light at a surface among its specular layers and the base below them.

use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::cover_layered_points;
use crate::integrator::material::directional_albedo::{COAT_IOR, FacetAlbedos, FacetLobe};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::highlights::{FacetLobeLanes, widened};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, LaneArray, mask, set3, vec3};
use blinn_core::simd::AutovecKernel;

/// Sets k_r, α and highlights of the lobes of all reflecting points, and scales k_e + k_a I_a, k_d and k_s in place to
/// the share that the layers above leave to them. To be called once per batch, after v is known.
pub(crate) fn apply_specular_layers(frame: &Frame, batch: &mut ShadingBatch) {
    for (block, count) in batch.soa.blocks_mut() {
        let reflecting = block.reflecting_lanes(count);
        if reflecting != 0 {
            frame.simd().run(SplitLight { frame, block, reflecting });
        }
        if block.layered.mask() != 0 {
            cover_layered_points(frame, block);
        }
    }
}

/// [`apply_specular_layers`] at a block of points.
struct SplitLight<'a> {
    frame: &'a Frame<'a>,
    block: &'a mut PointBlock,
    /// The points that reflect, as a bit mask.
    reflecting: u32,
}

impl AutovecKernel for SplitLight<'_> {
    #[inline(always)]
    fn run(self) {
        let SplitLight { frame, block, reflecting } = self;
        let layers = &block.k.layers;
        let mut reflects = [false; LANES];
        let mut increase = [0.0; LANES];
        let [mut cos, mut alpha, mut coat_alpha] = [[0.0; LANES]; 3];
        for i in 0..LANES {
            reflects[i] = reflecting >> i & 1 != 0;
            cos[i] = block.n_specular(i).dot(block.v(i)) as f32;
            increase[i] = block.alpha2_increase[i];
            alpha[i] = widened(layers.alpha[i], increase[i]);
            coat_alpha[i] = widened(layers.coat_alpha[i], increase[i]);
        }
        let facets = FacetAlbedos::new(&cos, &alpha, &layers.ior);
        let mut coats = [FacetLobe::NONE; LANES];
        let mut is_coated = [false; LANES];
        for i in 0..LANES {
            is_coated[i] = layers.coat[i] > 0.0;
        }
        let has_coat = mask(&is_coated) & reflecting != 0;
        if has_coat {
            let coat = FacetAlbedos::new(&cos, &coat_alpha, &[COAT_IOR; LANES]);
            for i in 0..LANES {
                coats[i] = coat.get(i).coat();
            }
        }
        let mut ambient = [[0.0; LANES]; 3];
        match frame.opaque_sky() {
            // Traced light takes the place of I_a.
            _ if frame.indirect > 0 => {}
            None => {
                for i in 0..LANES {
                    set3(&mut ambient, i, frame.ambient.to_array());
                }
            }
            Some(sky) => {
                let to_world = frame.scene_to_world.matrix3;
                for i in 0..LANES {
                    set3(&mut ambient, i, sky.ambient(to_world * block.n(i)).to_array());
                }
            }
        }
        // Local arrays cannot alias what the loop reads, which lets the compiler vectorise it.
        let zero = [[0.0; LANES]; 3];
        let [mut k_r, mut k_d, mut k_s, mut base_radiance] = [zero; 4];
        let [mut k_r_coat, mut base_share] = [[0.0; LANES]; 2];
        let [mut facet_lobes, mut coat_lobes] = [FacetLobeLanes::ZERO; 2];
        let mut has_highlights = [false; LANES];
        for i in 0..LANES {
            let of_lane = layers.get(i);
            let lobes = of_lane.combine(&facets.get(i), coats[i]);
            let below_coat = 1.0 - lobes.coat.albedo.x;
            let (all_d, all_s) = (vec3(&block.k.k_d, i), vec3(&block.k.k_s, i));
            // The Ks of MTL's glass is for highlights alone.
            let covered = all_d * if of_lane.has_highlights { lobes.base_share } else { below_coat };
            let is_covered = reflects[i] & of_lane.covers_base;
            set3(&mut k_d, i, if is_covered { covered } else { all_d }.to_array());
            set3(&mut k_s, i, if reflects[i] { all_s * below_coat } else { all_s }.to_array());
            let from_base = vec3(&block.k.k_a, i) * lobes.base_share * vec3(&ambient, i);
            let radiance = vec3(&block.k.k_e, i) * below_coat + from_base;
            let radiance = if reflects[i] { radiance } else { vec3(&block.radiance, i) };
            set3(&mut base_radiance, i, radiance.to_array());
            set3(&mut k_r, i, lobes.facets.albedo.to_array());
            k_r_coat[i] = lobes.coat.albedo.x;
            base_share[i] = lobes.base_share;
            has_highlights[i] = reflects[i] & of_lane.has_highlights;
            facet_lobes.set(i, &lobes.facets);
            coat_lobes.set(i, &lobes.coat);
        }
        block.highlights.set_facets(mask(&has_highlights), &facet_lobes, &layers.alpha, &increase);
        if has_coat {
            block.highlights.set_coats(&coat_lobes, &layers.coat_alpha, &increase);
        }
        (block.k.k_d, block.k.k_s) = (k_d, k_s);
        for c in 0..3 {
            copy(&mut block.k_r[c], &k_r[c]);
            copy(&mut block.radiance[c], &base_radiance[c]);
            copy(&mut block.unshadowed[c], &base_radiance[c]);
        }
        copy(&mut block.k_r_coat, &k_r_coat);
        copy(&mut block.base_share, &base_share);
        copy(&mut block.lobe_alpha, &alpha);
        copy(&mut block.coat_alpha, &coat_alpha);
    }
}

/// Sets the lanes of all points of a block.
#[inline(always)]
fn copy(to: &mut LaneArray<f32>, from: &[f32; LANES]) {
    to[..LANES].copy_from_slice(from);
}
