//! Textures: images, mip maps, filtering and sRGB.

pub(super) mod anisotropic;
pub(super) mod batch;
mod byte_quads;
mod downsample;
mod first_level;
pub(super) mod image;
mod interpolated_light;
mod max_mip;
mod min_mip;
pub(super) mod mips;
mod normal_quads;
pub(super) mod sampling;
pub(super) mod srgb;
pub(super) mod texels;
pub(super) mod uv_transform;
pub(super) mod wrap;
