//! Textures: images, mip maps, filtering and sRGB.

pub(super) mod anisotropic;
pub(super) mod batch;
mod downsample;
pub(super) mod image;
mod interpolated_light;
mod max_mip;
mod min_mip;
pub(super) mod mips;
pub(super) mod sampling;
pub(super) mod srgb;
pub(super) mod texels;
pub(super) mod uv_transform;
pub(super) mod wrap;
