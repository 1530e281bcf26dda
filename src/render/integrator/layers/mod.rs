//! Layers over the lecture's sum, which few materials have, and the one place where they are put together.
//!
//! Plain materials have the sum, microfacets and a smooth coat, computed in blocks. The points of other materials are
//! [`LayeredPoint`](layered_point::LayeredPoint)s, computed one by one: they pay for their layers themselves.
//!
//! A layer is a file with the light that it reflects from a direction and its share of the light of all directions.
//! [`layer_inputs`] makes it from a material, and [`layered_point`] puts it above or below the others.

pub(crate) mod block_layers;
pub(crate) mod coat;
pub(crate) mod dielectric_boundary;
pub(crate) mod facets;
pub(crate) mod layer_inputs;
pub(crate) mod layered_point;
pub(crate) mod layered_points;
pub(crate) mod microfibres;
pub(crate) mod sheen;
pub(crate) mod thin_film;
