//! Textures: images, mip maps, filtering and sRGB.

pub(super) mod anisotropic;
pub(super) mod batch;
mod byte_quads;
mod downsample;
mod first_level;
pub(super) mod image;
mod interpolated_light;
mod level_encoding;
mod level_group;
mod max_mip;
mod min_mip;
#[cfg(test)]
mod mip_reference;
pub(super) mod mips;
mod normal_quads;
pub(super) mod sampling;
pub(super) mod srgb;
pub(super) mod texels;
pub(super) mod uv_transform;
pub(super) mod wrap;
