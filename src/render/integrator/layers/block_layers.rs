//! The layered points of a block: their shares of light before lights are evaluated, and the light of each source that they
//! reflect.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::frame::Frame;
use crate::integrator::layers::layered_point::{
    LayerView, LayeredPoint, LobePdfs, PointLobes, ReflectedShares,
};
use crate::integrator::microfacet_highlights::{LobeWeights, add_highlights};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use crate::integrator::surface::specular_normal::specular_normal;
use blinn_core::geometry::Rgb;

/// Gives layered points the shares of their layers, in place of those of plain materials.
pub(crate) fn cover_layered_points(frame: &Frame, block: &mut PointBlock) {
    for i in block.layered.lanes() {
        if block.has_turned_normals {
            turn_coat_normal(block, i);
        }
        let Some((point, view)) = layer_view(block, i) else { continue };
        let albedo = point.anisotropic_facets(&view).map(|facets| facets.albedo(view.layers.ior));
        let film_mean = point.film_mean_in(&view);
        if let Some(point) = block.layered.get_mut(i) {
            (point.stretched_albedo, point.film_mean) = (albedo, film_mean);
        }
        let Some(lobes) = point_lobes(block, i) else { continue };
        let shares = lobes.shares();
        if let Some(point) = block.layered.get_mut(i) {
            point.k_a = shares.k_a;
            point.transmitted *= shares.base;
        }
        set3(&mut block.k.k_d, i, shares.k_d.to_array());
        set3(&mut block.k_r, i, shares.facets.to_array());
        block.k_r_coat[i] = shares.coat;
        block.coat_alpha[i] = lobes.coat.alpha;
        block.base_share[i] = shares.base;
        block.highlights.points &= !(1 << i);
        let k_a = vec3(&block.k.k_a, i) * shares.base + shares.k_a;
        let k_e: Rgb = vec3(&block.k.k_e, i);
        block.set_base_radiance(i, k_e * shares.below_coat + k_a * frame.ambient_at(block.n(i)));
    }
}

/// Turns the normal of the coat of point `i` as that of other specular lobes.
fn turn_coat_normal(block: &mut PointBlock, i: usize) {
    let (n_g, v) = (dvec3(&block.n_g, i), block.v(i));
    if let Some(point) = block.layered.get_mut(i) {
        point.coat.n = specular_normal(point.coat.n, n_g, v);
    }
}

/// The lobes of the layered point in lane `i`; `None` for a plain one.
pub(crate) fn point_lobes(block: &PointBlock, i: usize) -> Option<PointLobes> {
    layer_view(block, i).map(|(point, view)| point.lobes(&view))
}

/// The layered point in lane `i` and how it is seen; `None` for a plain one.
pub(crate) fn layer_view(block: &PointBlock, i: usize) -> Option<(&LayeredPoint, LayerView)> {
    let point = block.layered.get(i)?;
    let view = LayerView {
        n: block.n_specular(i),
        v: block.v(i),
        layers: block.k.layers.get(i),
        alpha: block.lobe_alpha[i],
        alpha2_increase: block.alpha2_increase[i],
    };
    Some((point, view))
}

/// Adds I/r² times the light that the layers of a block's points reflect to their current light.
#[inline(always)]
pub(crate) fn add_layers(block: &mut PointBlock, light: &IncidentLight) {
    if block.highlights.points != 0 {
        add_highlights(block, light, &LobeWeights::ONE);
    }
    if block.layered.mask() != 0 {
        add_layered_light(block, light, false, &|_, _| LayerWeights::ONE);
    }
}

/// Factors of what the lobes of a point reflect.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerWeights {
    pub facets: f32,
    pub coat: f32,
    pub diffuse: f32,
}

impl LayerWeights {
    const ONE: LayerWeights = LayerWeights { facets: 1.0, coat: 1.0, diffuse: 1.0 };

    /// Weights without specular lobes.
    pub fn diffuse(weight: f32) -> LayerWeights {
        LayerWeights { facets: 0.0, coat: 0.0, diffuse: weight }
    }
}

/// Adds I/r² times the light that layered points reflect to their current light. `weights` computes factors of the lobes of a
/// point from its lane and from how they spawn rays.
#[inline(never)]
pub(crate) fn add_layered_light(
    block: &mut PointBlock,
    light: &IncidentLight,
    has_exact_fresnel: bool,
    weights: &dyn Fn(usize, LobePdfs) -> LayerWeights,
) {
    for i in block.layered.lanes() {
        let irradiance: Rgb = vec3(&light.irradiance, i);
        if irradiance == Rgb::ZERO {
            continue;
        }
        let Some(lobes) = point_lobes(block, i) else { continue };
        let l = light.l(i);
        let n_dot_l = match block.has_turned_normals {
            true if light.n_g_dot_l[i] > 0.0 => block.n_specular(i).dot(l) as f32,
            true => 0.0,
            false => light.n_dot_l[i],
        };
        if !(n_dot_l > 0.0) {
            continue;
        }
        let l = l.as_vec3();
        let ReflectedShares { facets, coat, diffuse } = lobes.reflect(l, n_dot_l, has_exact_fresnel);
        let weights = weights(i, lobes.pdfs(l));
        let limit = |share: Rgb| {
            let mean = share.element_sum() * (1.0 / 3.0);
            let max = block.highlights.max_share[i] * n_dot_l;
            if mean > max { share * (max / mean) } else { share }
        };
        let specular = limit(facets) * weights.facets + limit(coat) * weights.coat;
        let reflected = irradiance * (specular + diffuse * weights.diffuse);
        let before: Rgb = vec3(&block.current_light, i);
        set3(&mut block.current_light, i, (before + reflected).to_array());
    }
}
