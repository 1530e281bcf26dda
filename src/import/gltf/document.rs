//! The file in memory: its typed JSON and its buffers.

use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use ::gltf::json::Root;
use serde_json::{Map, Value};

use super::container::Container;
use super::extensions;
use super::repair::{self, Json};
use crate::import::error::{LoadError, Warnings};
use crate::import::uri::Folder;
use crate::import::{Limits, LoadOptions};

/// Bytes that accessors without data may stand for, in all.
const ZERO_BYTES: u64 = 1 << 30;

/// A file taken apart, its buffers read.
pub(super) struct Document<'a> {
    pub json: Json,
    pub folder: &'a Folder,
    pub limits: &'a Limits,
    buffers: Vec<Cow<'a, [u8]>>,
    zero_bytes: AtomicU64,
}

/// A stretch of a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'d> {
    pub bytes: &'d [u8],
    pub stride: Option<usize>,
}

impl<'a> Document<'a> {
    /// Repairs and types the JSON, judges the extensions and reads the buffers.
    pub fn open(
        container: &Container<'a>,
        folder: &'a Folder,
        options: &'a LoadOptions,
        warnings: &mut Warnings,
    ) -> Result<Document<'a>, LoadError> {
        let json = repair::parse(container.json, warnings)?;
        extensions::judge(&json, warnings)?;
        let limits = &options.limits;
        let buffers = (0..json.root.buffers.len())
            .map(|i| buffer(&json.root, i, container.bin, folder, limits, warnings))
            .collect::<Result<_, _>>()?;
        Ok(Document { json, folder, limits, buffers, zero_bytes: AtomicU64::new(0) })
    }

    pub fn root(&self) -> &Root {
        &self.json.root
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<View<'_>, LoadError> {
        let place = || format!("bufferViews[{index}]");
        let view = self.root().buffer_views.get(index);
        let view = view.ok_or_else(|| LoadError::invalid(place(), "there is no such buffer view"))?;
        let others = view.extensions.as_ref().map(|e| &e.others);
        if let Some(name) = others.and_then(meshopt) {
            let what = format!("{}: its data is compressed with {name}, which is not read yet", place());
            return Err(LoadError::Unsupported(what));
        }
        let buffer = view.buffer.value();
        let whole: &[u8] = self.buffers.get(buffer).map_or(&[], |b| b);
        let (offset, length) = (view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
        let range = offset.checked_add(length).filter(|&end| end <= whole.len() as u64);
        let range = range.map(|end| offset as usize..end as usize).ok_or_else(|| {
            let has = whole.len();
            let rule =
                format!("{length} bytes from {offset} do not lie in buffers[{buffer}], which has {has}");
            LoadError::invalid(place(), rule)
        })?;
        Ok(View { bytes: &whole[range], stride: view.byte_stride.map(|s| s.0) })
    }

    /// Accounts for values that are zero without any bytes in the file: without a bound a few
    /// characters of JSON could ask for all memory.
    pub fn charge_zeros(&self, bytes: u64) -> Result<(), LoadError> {
        let before = self.zero_bytes.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        LoadError::check("bytes of accessors without data", before.saturating_add(bytes), ZERO_BYTES)
    }
}

/// The name of the meshopt extension among `others`.
fn meshopt(others: &Map<String, Value>) -> Option<&'static str> {
    ["EXT_meshopt_compression", "KHR_meshopt_compression"].into_iter().find(|n| others.contains_key(*n))
}

fn buffer<'a>(
    root: &Root,
    index: usize,
    bin: Option<&'a [u8]>,
    folder: &Folder,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Cow<'a, [u8]>, LoadError> {
    let place = format!("buffers[{index}]");
    let buffer = &root.buffers[index];
    let wanted = buffer.byte_length.0;
    let bytes = match (&buffer.uri, bin) {
        (Some(uri), _) => {
            let read = folder.read_uri(uri, limits.file_bytes);
            Cow::Owned(read.map_err(|e| LoadError::invalid(format_args!("{place}.uri"), e.text()))?)
        }
        (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
        // A placeholder for what meshopt decompresses into.
        (None, _) if buffer.extensions.as_ref().is_some_and(|e| meshopt(&e.others).is_some()) => {
            return Ok(Cow::default());
        }
        (None, _) if wanted == 0 => Cow::default(),
        (None, _) => {
            let rule = "has no uri, and the file has no binary chunk for it";
            return Err(LoadError::invalid(place, rule));
        }
    };
    if (bytes.len() as u64) < wanted {
        let has = bytes.len();
        warnings.add(place, format_args!("has {has} bytes where byteLength promises {wanted}"));
    }
    Ok(bytes)
}
