//! Textures: images, mip maps, filtering and sRGB.

pub(crate) mod anisotropic;
pub(crate) mod batch;
pub(crate) mod image;
pub(crate) mod min_mip;
pub(crate) mod mips;
pub(crate) mod sampling;
pub(crate) mod srgb;
