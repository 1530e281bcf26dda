//! The JSON of EXT_meshopt_compression and KHR_meshopt_compression.

use ::gltf::json::{Buffer, buffer};
use serde_json::Value;

use super::meshopt::{self, Filter, Mode};
use crate::files::escape::printable;

/// Names of the extension: ratified, and by its former vendor prefix.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// A compressed buffer view.
pub(super) struct CompressedView<'d> {
    /// Name of the extension in the file.
    pub name: &'static str,
    pub buffer: u64,
    pub offset: u64,
    pub length: u64,
    /// Bytes per element after decompression.
    pub stride: u64,
    /// Number of elements after decompression.
    pub count: u64,
    mode: &'d str,
    filter: &'d str,
}

impl<'d> CompressedView<'d> {
    /// The extension of a buffer view, if it has it. Missing properties read as 0.
    pub fn of(view: &'d buffer::View) -> Option<CompressedView<'d>> {
        let others = &view.extensions.as_ref()?.others;
        let (name, value) = NAMES.into_iter().find_map(|name| Some((name, others.get(name)?)))?;
        let number = |key: &str| value.get(key).and_then(Value::as_u64).unwrap_or(0);
        let text = |key: &str| value.get(key).and_then(Value::as_str);
        Some(CompressedView {
            name,
            buffer: number("buffer"),
            offset: number("byteOffset"),
            length: number("byteLength"),
            stride: number("byteStride"),
            count: number("count"),
            mode: text("mode").unwrap_or(""),
            filter: text("filter").unwrap_or("NONE"),
        })
    }

    /// Bytes after decompression.
    pub fn decompressed_size(&self) -> u64 {
        self.count.saturating_mul(self.stride)
    }

    /// The stride of vertex attributes; `None` for indices.
    pub fn attribute_stride(&self) -> Option<usize> {
        (self.mode == "ATTRIBUTES").then_some(self.stride as usize)
    }

    /// The stride of elements that the filter packs, whatever the strides in the file.
    pub fn packed_stride(&self) -> Option<usize> {
        self.filter().ok().and_then(meshopt::packed_stride)
    }

    /// Decompresses the view from its bytes.
    pub fn decompress(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let mode = match self.mode {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return Err(format!("unknown mode '{}'", printable(other))),
        };
        let number = |n: u64| usize::try_from(n).map_err(|_| format!("{n} is too large"));
        meshopt::decode(bytes, number(self.count)?, number(self.stride)?, mode, self.filter()?)
    }

    fn filter(&self) -> Result<Filter, String> {
        Ok(match self.filter {
            "NONE" => Filter::None,
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            other => return Err(format!("unknown filter '{}'", printable(other))),
        })
    }
}

/// The buffer that holds a view's bytes, compressed or not.
pub(super) fn buffer_of(view: &buffer::View) -> u64 {
    CompressedView::of(view).map_or(view.buffer.value() as u64, |compressed| compressed.buffer)
}

/// Returns true for a fallback buffer: it holds the decompressed data for readers without the extension, and
/// may have no content.
pub(super) fn is_fallback(buffer: &Buffer) -> bool {
    buffer.extensions.as_ref().is_some_and(|e| NAMES.iter().any(|name| e.others.contains_key(*name)))
}
