//! Materials: the lecture's coefficients k_a, k_d, k_s and p, opacity, and the hit filter of `Accel`.

pub(crate) mod coefficient_lanes;
pub(crate) mod coefficients;
pub(crate) mod constant_coefficients;
pub(crate) mod directional_albedo;
pub(crate) mod evaluator;
pub(crate) mod facet_view;
pub(crate) mod fresnel;
pub(crate) mod ggx;
pub(crate) mod ggx_lobe;
pub(crate) mod glass_albedo;
pub(crate) mod highlight_lobe;
pub(crate) mod hit_filter;
pub(crate) mod layer_lanes;
pub(crate) mod lobe_integrals;
pub(crate) mod lobe_lookups;
pub(crate) mod lobe_moments;
pub(crate) mod material_inputs;
pub(crate) mod opacity;
pub(crate) mod specular_antialiasing;
pub(crate) mod specular_layers;
pub(crate) mod table_place;
