//! A glTF in memory: its typed JSON and its buffers.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use ::gltf::json::Root;

use super::buffers::{BufferSource, Buffers};
use super::container::Container;
use super::extensions;
use super::meshopt_extension::{CompressedView, buffer_of};
use super::parse;
use super::parse::ParsedGltf;
use crate::Limits;
use crate::error::{LoadError, Warnings};
use crate::files::scene_folder::SceneFolder;
use crate::memory::MemoryBudget;
use crate::options::LoadOptions;

/// Limit on the bytes of all accessors without data, which take no space in the file.
const MAX_ZERO_BYTES: u64 = 1 << 30;

/// A parsed glTF with the contents of its buffers.
pub(super) struct Document<'a> {
    pub json: ParsedGltf,
    pub folder: &'a SceneFolder,
    pub limits: &'a Limits,
    pub budget: MemoryBudget,
    is_truncated: bool,
    buffers: Buffers<'a>,
    /// Contents of compressed buffer views, decompressed on first use.
    decompressed: Vec<OnceLock<Result<Vec<u8>, String>>>,
    zero_bytes: AtomicU64,
}

/// The bytes of a buffer view.
#[derive(Clone, Copy, Debug)]
pub(super) struct BufferView<'d> {
    pub bytes: &'d [u8],
    pub stride: Option<usize>,
}

impl<'a> Document<'a> {
    /// Parses the JSON, rejects unsupported required extensions, and reads the buffers.
    pub fn open(
        container: &Container<'a>,
        folder: &'a SceneFolder,
        options: &'a LoadOptions,
        warnings: &mut Warnings,
    ) -> Result<Document<'a>, LoadError> {
        let limits = &options.limits;
        let budget = MemoryBudget::of_import(options);
        budget.charge((container.json.len() + container.bin.map_or(0, <[u8]>::len)) as u64)?;
        budget.charge_json(container.json)?;
        let json = parse::parse(container.json, warnings)?;
        extensions::check_required(&json.root)?;
        let source =
            BufferSource { bin: container.bin, folder, file_bytes: limits.file_bytes, budget: &budget };
        let buffers = Buffers::read(&json.root, source, warnings)?;
        let compressed = json.root.buffer_views.iter().filter_map(CompressedView::of);
        let total = compressed.fold(0u64, |sum, view| sum.saturating_add(view.decompressed_size()));
        LoadError::check_limit("bytes of decompressed buffer views", total, limits.decompressed_bytes)?;
        budget.charge(total)?;
        let decompressed = json.root.buffer_views.iter().map(|_| OnceLock::new()).collect();
        let zero_bytes = AtomicU64::new(0);
        let is_truncated = container.is_truncated;
        Ok(Document { json, folder, limits, budget, is_truncated, buffers, decompressed, zero_bytes })
    }

    pub fn root(&self) -> &Root {
        &self.json.root
    }

    /// Returns the bytes of a buffer view, decompressed if necessary. In a truncated file, some or all of them may be
    /// missing.
    pub fn buffer_view(&self, index: usize) -> Result<BufferView<'_>, LoadError> {
        let location = || format!("bufferViews[{index}]");
        let view = self.root().buffer_views.get(index);
        let view = view.ok_or_else(|| LoadError::invalid(location(), "buffer view does not exist"))?;
        self.buffers.check_readable(buffer_of(view) as usize)?;
        let stride = view.byte_stride.map(|s| s.0);
        let Some(compressed) = CompressedView::of(view) else {
            let offset = view.byte_offset.map_or(0, |o| o.0);
            let mut length = view.byte_length.0;
            if self.is_truncated {
                length = length.min(self.buffers.length(view.buffer.value()).saturating_sub(offset));
            }
            let offset = if length == 0 { 0 } else { offset };
            let bytes = self.buffers.slice(view.buffer.value(), offset, length);
            let bytes = bytes.map_err(|message| LoadError::invalid(location(), message))?;
            return Ok(BufferView { bytes, stride });
        };
        let decompressed = self.decompressed[index].get_or_init(|| {
            let bytes =
                self.buffers.slice(compressed.buffer as usize, compressed.offset, compressed.length)?;
            compressed.decompress(bytes)
        });
        let location = || format!("{}.extensions.{}", location(), compressed.name);
        let bytes = decompressed.as_ref().map_err(|message| LoadError::invalid(location(), message))?;
        let stride = compressed.packed_stride().or(stride).or(compressed.attribute_stride());
        Ok(BufferView { bytes, stride })
    }

    /// Returns true if the end of the binary chunk is missing.
    pub fn is_truncated(&self) -> bool {
        self.is_truncated
    }

    /// Replaces an error by a warning and `None` if it may be due to the missing end of a truncated file.
    pub fn tolerate_truncation<T>(
        &self,
        result: Result<T, LoadError>,
        warnings: &mut Warnings,
    ) -> Result<Option<T>, LoadError> {
        match result {
            Err(LoadError::Invalid { location, message }) if self.is_truncated => {
                warnings.add(location, format_args!("{message}; ignored what needs it"));
                Ok(None)
            }
            result => result.map(Some),
        }
    }

    /// Charges zeros of an accessor without data. Without a limit, a few characters of JSON could request all
    /// memory.
    pub fn charge_zeros(&self, bytes: u64) -> Result<(), LoadError> {
        let before = self.zero_bytes.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        let total = before.saturating_add(bytes);
        LoadError::check_limit("bytes of accessors without data", total, MAX_ZERO_BYTES)
    }
}
