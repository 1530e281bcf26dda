//! Encodes rendered pixels to image and animation files.
//!
//! Files are written atomically: a file appears under its name complete, or not at all.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod accents;
#[cfg(feature = "animation")]
mod animation;
mod atomic;
mod bit_string;
mod canvas;
mod checksum;
pub mod compare;
mod cryptomatte;
pub mod datasets;
mod display_colors;
mod escape;
mod exr;
mod exr_header;
mod fingerprint;
mod format;
mod id_image;
mod jpeg;
mod layer_folder;
mod page;
mod picture;
mod png;
mod png_chunks;
mod png_data;
mod png_filter;
mod preview;
mod riff;
mod save;
mod shard;
mod stroke_font;
mod thumbnail;
mod webp;
mod write_target;

#[cfg(feature = "animation")]
pub use animation::{ANIMATION_QUALITY, AnimationFile, AnimationFormat, AnimationSettings};
pub use atomic::{Overwrite, block_writes, unnamed_temp_file, write_atomically, write_atomically_with};
pub use canvas::{Anchor, Canvas, TextStyle};
pub use escape::escape_html;
pub use fingerprint::read_fingerprint;
pub use format::{BitDepth, ImageFormat, JPEG_QUALITY};
pub use layer_folder::{LayerFolder, sample_file};
pub use page::PAGE_STYLE;
pub use picture::{CropWindow, IdNames, Picture};
pub use png::{encode_mask, encode_png};
pub use preview::{heat_color, heat_map_max, preview_layer, preview_matte, quantize_depth};
pub use save::{
    EncodedFile, SaveError, check_overwrite, check_writable, encode_files, save, save_with_layers,
};
pub use shard::{ShardMember, ShardPart, ShardWriter, read_shard};
pub use thumbnail::encode_thumbnail;
pub use write_target::canonical_path;
