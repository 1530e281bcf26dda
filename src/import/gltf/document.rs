//! The file in memory: its typed JSON and its buffers.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use ::gltf::json::Root;
use serde_json::Value;

use super::container::Container;
use super::extensions;
use super::meshopt;
use super::meshopt::{Filter, Mode};
use super::repair;
use super::repair::Json;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::{
    escape::printable,
    scene_folder::{ReferenceError, SceneFolder},
};
use crate::import::memory::MemoryBudget;
use crate::import::{Limits, LoadOptions};

/// Bytes that accessors without data may stand for, in all.
const ZERO_BYTES: u64 = 1 << 30;

/// A file taken apart, its buffers read.
pub(super) struct Document<'a> {
    pub json: Json,
    pub folder: &'a SceneFolder,
    pub limits: &'a Limits,
    pub budget: MemoryBudget,
    files: Vec<Cow<'a, [u8]>>,
    /// Those of them that could not be read: where they are named, and why.
    lost: HashMap<usize, (String, String)>,
    /// Which of them each buffer is: a file that is named a thousand times is read once.
    buffers: Vec<usize>,
    /// What compressed buffer views hold, decompressed when first asked for.
    plain: Vec<OnceLock<Result<Vec<u8>, String>>>,
    zero_bytes: AtomicU64,
}

/// A stretch of a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'d> {
    pub bytes: &'d [u8],
    pub stride: Option<usize>,
}

impl<'a> Document<'a> {
    /// Repairs and types the JSON, refuses what is required and not read, and reads the buffers.
    pub fn open(
        container: &Container<'a>,
        folder: &'a SceneFolder,
        options: &'a LoadOptions,
        warnings: &mut Warnings,
    ) -> Result<Document<'a>, LoadError> {
        let budget = MemoryBudget::new(options.limits.memory_bytes);
        budget.charge((container.json.len() + container.bin.map_or(0, <[u8]>::len)) as u64)?;
        budget.charge_json(container.json)?;
        let json = repair::parse(container.json, warnings)?;
        extensions::refuse(&json.root)?;
        let limits = &options.limits;
        let (mut files, mut buffers) = (Vec::new(), Vec::with_capacity(json.root.buffers.len()));
        let mut lost = HashMap::new();
        let mut known: HashMap<&str, usize> = HashMap::new();
        let mut left = limits.file_bytes;
        let needed: HashSet<u64> = json.root.buffer_views.iter().map(stored_in).collect();
        for (i, buffer) in json.root.buffers.iter().enumerate() {
            if is_fallback(buffer) && !needed.contains(&(i as u64)) {
                buffers.push(files.len());
                files.push(Cow::default());
                continue;
            }
            let again = buffer.uri.as_deref().and_then(|uri| known.get(uri).copied());
            let file = again.map_or_else(
                || -> Result<usize, LoadError> {
                    let bytes = match read(buffer, i, container.bin, folder, left) {
                        // Perhaps nothing that is drawn asks for it.
                        Err(LoadError::Invalid { location, message }) => {
                            warnings.add(&location, format_args!("{message}; what is in it is left out"));
                            lost.insert(files.len(), (location, message));
                            Cow::default()
                        }
                        read => read?,
                    };
                    if let Cow::Owned(read) = &bytes {
                        budget.charge(read.len() as u64)?;
                        // Together no more than one file may have: there is no end to names of one.
                        left = left.saturating_sub(read.len() as u64);
                    }
                    files.push(bytes);
                    Ok(files.len() - 1)
                },
                Ok,
            )?;
            known.extend(buffer.uri.as_deref().map(|uri| (uri, file)));
            let (has, wanted) = (files[file].len() as u64, buffer.byte_length.0);
            if has < wanted && !is_fallback(buffer) && !lost.contains_key(&file) {
                let what = format!("has {has} bytes where byteLength promises {wanted}");
                warnings.add(format_args!("buffers[{i}]"), what);
            }
            buffers.push(file);
        }
        let compressed = json.root.buffer_views.iter().filter_map(Compressed::of);
        let total = compressed.fold(0u64, |sum, c| sum.saturating_add(c.count.saturating_mul(c.stride)));
        LoadError::check_limit("bytes of decompressed buffer views", total, limits.decompressed_bytes)?;
        budget.charge(total)?;
        let plain = json.root.buffer_views.iter().map(|_| OnceLock::new()).collect();
        let zero_bytes = AtomicU64::new(0);
        Ok(Document { json, folder, limits, budget, files, lost, buffers, plain, zero_bytes })
    }

    pub fn root(&self) -> &Root {
        &self.json.root
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<View<'_>, LoadError> {
        let place = || format!("bufferViews[{index}]");
        let view = self.root().buffer_views.get(index);
        let view = view.ok_or_else(|| LoadError::invalid(place(), "there is no such buffer view"))?;
        if let Some((place, rule)) =
            self.buffers.get(stored_in(view) as usize).and_then(|file| self.lost.get(file))
        {
            return Err(LoadError::invalid(place, rule));
        }
        let stride = view.byte_stride.map(|s| s.0);
        let Some(compressed) = Compressed::of(view) else {
            let bytes =
                self.stretch(view.buffer.value(), view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
            return Ok(View { bytes: bytes.map_err(|rule| LoadError::invalid(place(), rule))?, stride });
        };
        let plain = self.plain[index].get_or_init(|| self.decompress(&compressed));
        let place = || format!("{}.extensions.{}", place(), compressed.name);
        let bytes = plain.as_ref().map_err(|rule| LoadError::invalid(place(), rule))?;
        let own = (compressed.mode == "ATTRIBUTES").then_some(compressed.stride as usize);
        Ok(View { bytes, stride: stride.or(own) })
    }

    /// Part of a buffer, or how it is none.
    fn stretch(&self, buffer: usize, offset: u64, length: u64) -> Result<&[u8], String> {
        let whole: &[u8] = self.buffers.get(buffer).map_or(&[], |&file| &self.files[file]);
        let end = offset.checked_add(length).filter(|&end| end <= whole.len() as u64);
        end.map(|end| &whole[offset as usize..end as usize]).ok_or_else(|| {
            let has = whole.len();
            format!("{length} bytes from {offset} do not lie in buffers[{buffer}], which has {has}")
        })
    }

    fn decompress(&self, view: &Compressed<'_>) -> Result<Vec<u8>, String> {
        let bytes = self.stretch(view.buffer as usize, view.offset, view.length)?;
        let mode = match view.mode {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return Err(format!("mode '{}' is not known", printable(other))),
        };
        let filter = match view.filter {
            "NONE" => Filter::None,
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            other => return Err(format!("filter '{}' is not known", printable(other))),
        };
        let number = |n: u64| usize::try_from(n).map_err(|_| "a number is too large".to_string());
        meshopt::decode(bytes, number(view.count)?, number(view.stride)?, mode, filter)
    }

    /// Accounts for values that are zero without any bytes in the file: without a bound a few
    /// characters of JSON could ask for all memory.
    pub fn charge_zeros(&self, bytes: u64) -> Result<(), LoadError> {
        let before = self.zero_bytes.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        LoadError::check_limit("bytes of accessors without data", before.saturating_add(bytes), ZERO_BYTES)
    }
}

/// What EXT_ or KHR_meshopt_compression says of a buffer view.
struct Compressed<'d> {
    name: &'static str,
    buffer: u64,
    offset: u64,
    length: u64,
    stride: u64,
    count: u64,
    mode: &'d str,
    filter: &'d str,
}

/// The names of the extension: Khronos's, and what it was before.
const MESHOPT: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

impl<'d> Compressed<'d> {
    fn of(view: &'d ::gltf::json::buffer::View) -> Option<Compressed<'d>> {
        let others = &view.extensions.as_ref()?.others;
        let (name, value) = MESHOPT.into_iter().find_map(|name| Some((name, others.get(name)?)))?;
        let number = |key: &str| value.get(key).and_then(Value::as_u64).unwrap_or(0);
        let word = |key: &str| value.get(key).and_then(Value::as_str);
        Some(Compressed {
            name,
            buffer: number("buffer"),
            offset: number("byteOffset"),
            length: number("byteLength"),
            stride: number("byteStride"),
            count: number("count"),
            mode: word("mode").unwrap_or(""),
            filter: word("filter").unwrap_or("NONE"),
        })
    }
}

/// The buffer that a view's bytes are in, compressed where they are.
fn stored_in(view: &::gltf::json::buffer::View) -> u64 {
    Compressed::of(view).map_or(view.buffer.value() as u64, |compressed| compressed.buffer)
}

/// Whether a buffer is what meshopt decompresses into: for readers that cannot, it may have a file.
fn is_fallback(buffer: &::gltf::json::Buffer) -> bool {
    buffer.extensions.as_ref().is_some_and(|e| MESHOPT.iter().any(|name| e.others.contains_key(*name)))
}

/// What a buffer holds, of at most `limit` bytes.
fn read<'a>(
    buffer: &::gltf::json::Buffer,
    index: usize,
    bin: Option<&'a [u8]>,
    folder: &SceneFolder,
    limit: u64,
) -> Result<Cow<'a, [u8]>, LoadError> {
    let place = format!("buffers[{index}]");
    Ok(match (&buffer.uri, bin) {
        (Some(uri), _) => {
            let wrong = |e: ReferenceError| {
                let invalid = || LoadError::invalid(format_args!("{place}.uri"), e.message());
                e.limit_error(limit).unwrap_or_else(invalid)
            };
            Cow::Owned(folder.read_uri(uri, limit).map_err(wrong)?)
        }
        (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
        // A placeholder for what meshopt decompresses into.
        (None, _) if is_fallback(buffer) || buffer.byte_length.0 == 0 => Cow::default(),
        (None, _) => {
            let rule = "has no uri, and the file has no binary chunk for it";
            return Err(LoadError::invalid(place, rule));
        }
    })
}
