//! The layered points of a block: their shares of light before lights are evaluated, and the light of each source that they
//! reflect.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::frame::Frame;
use crate::integrator::layers::layered_point::{LayerView, LobePdfs, PointLobes, ReflectedShares};
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
        let Some(lobes) = point_lobes(block, i) else { continue };
        let shares = lobes.shares();
        set3(&mut block.k.k_d, i, shares.k_d.to_array());
        set3(&mut block.k_r, i, shares.facets.to_array());
        block.k_r_coat[i] = shares.coat;
        block.coat_alpha[i] = lobes.coat.alpha;
        block.base_share[i] = shares.base;
        block.highlights.points &= !(1 << i);
        let k_a = layered_k_a(block, i);
        let k_e: Rgb = vec3(&block.k.k_e, i);
        block.set_base_radiance(i, k_e * lobes.below_coat() + k_a * frame.ambient_at(block.n(i)));
    }
}

/// Turns the normal of the coat of point `i` as that of other specular lobes.
fn turn_coat_normal(block: &mut PointBlock, i: usize) {
    let (n_g, v) = (dvec3(&block.n_g, i), block.v(i));
    if let Some(point) = block.layered.get_mut(i) {
        point.coat.n = specular_normal(point.coat.n, n_g, v);
    }
}

/// k_a of point `i`, as far as its layers let light through.
fn layered_k_a(block: &PointBlock, i: usize) -> Rgb {
    vec3(&block.k.k_a, i) * block.base_share[i]
}

/// The lobes of the layered point in lane `i`; `None` for a plain one.
fn point_lobes(block: &PointBlock, i: usize) -> Option<PointLobes> {
    let point = block.layered.get(i)?;
    Some(point.lobes(&LayerView {
        n: block.n_specular(i),
        v: block.v(i),
        layers: block.k.layers.get(i),
        alpha: block.lobe_alpha[i],
        alpha2_increase: block.alpha2_increase[i],
    }))
}

/// Adds I/r² times the light that the layers of a block's points reflect to their current light.
#[inline(always)]
pub(crate) fn add_layers(block: &mut PointBlock, light: &IncidentLight) {
    if block.highlights.points != 0 {
        add_highlights(block, light, &LobeWeights::ONE);
    }
    if block.layered.mask() != 0 {
        add_layered_light(block, light, false, &|_, _| [1.0; 2]);
    }
}

/// Computes the weights of the lobes of a point from its lane and from how they spawn rays.
pub(crate) type LayerWeights<'a> = &'a dyn Fn(usize, LobePdfs) -> [f32; 2];

/// Adds I/r² times the light that layered points reflect to their current light.
#[inline(never)]
pub(crate) fn add_layered_light(
    block: &mut PointBlock,
    light: &IncidentLight,
    has_exact_fresnel: bool,
    weights: LayerWeights,
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
        let ReflectedShares { facets, coat } = lobes.reflect(l, n_dot_l, has_exact_fresnel);
        let [of_facets, of_coat] = weights(i, lobes.pdfs(l));
        let limit = |share: Rgb| {
            let mean = share.element_sum() * (1.0 / 3.0);
            let max = block.highlights.max_share[i] * n_dot_l;
            if mean > max { share * (max / mean) } else { share }
        };
        let reflected = irradiance * (limit(facets) * of_facets + limit(coat) * of_coat);
        let before: Rgb = vec3(&block.current_light, i);
        set3(&mut block.current_light, i, (before + reflected).to_array());
    }
}
