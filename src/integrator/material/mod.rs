//! The lecture's k_a, k_d, k_s and shininess of each material, and the alpha filter of hits.

pub(crate) mod coefficients;
pub(crate) mod hit_filter;
