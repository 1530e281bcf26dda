//! Reads the buffers of a glTF: the GLB binary chunk, data URIs and files.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use ::gltf::json::{Buffer, Root};

use super::meshopt_extension::{buffer_of, is_fallback};
use crate::error::{LoadError, Warnings};
use crate::files::scene_folder::{ReferenceError, SceneFolder};
use crate::memory::MemoryBudget;

/// The contents of all buffers. Buffers with the same URI share their content, which is read once.
pub(super) struct Buffers<'a> {
    contents: Vec<Cow<'a, [u8]>>,
    /// Contents that could not be read.
    unreadable: HashMap<usize, UnreadableBuffer>,
    /// Index of each buffer's content.
    content_of: Vec<usize>,
}

struct UnreadableBuffer {
    location: String,
    message: String,
}

/// Where buffers are read from, and what they may hold.
pub(super) struct BufferSource<'a, 's> {
    /// The GLB binary chunk.
    pub bin: Option<&'a [u8]>,
    pub folder: &'s SceneFolder,
    /// Limit on the bytes of all files together: a file may have any number of different names.
    pub file_bytes: u64,
    pub budget: &'s MemoryBudget,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers. An unreadable buffer is a warning here, and an error when its content is used.
    pub fn read(
        root: &Root,
        mut source: BufferSource<'a, '_>,
        warnings: &mut Warnings,
    ) -> Result<Buffers<'a>, LoadError> {
        let mut out = Buffers {
            contents: Vec::new(),
            unreadable: HashMap::new(),
            content_of: Vec::with_capacity(root.buffers.len()),
        };
        let mut by_uri: HashMap<&str, usize> = HashMap::new();
        let used: HashSet<u64> = root.buffer_views.iter().map(buffer_of).collect();
        for (i, buffer) in root.buffers.iter().enumerate() {
            if is_fallback(buffer) && !used.contains(&(i as u64)) {
                out.content_of.push(out.contents.len());
                out.contents.push(Cow::default());
                continue;
            }
            let content = match buffer.uri.as_deref().and_then(|uri| by_uri.get(uri)) {
                Some(&content) => content,
                None => out.read_content(buffer, i, &mut source, warnings)?,
            };
            by_uri.extend(buffer.uri.as_deref().map(|uri| (uri, content)));
            let has = out.contents[content].len() as u64;
            let wanted = buffer.byte_length.0;
            if has < wanted && !is_fallback(buffer) && !out.unreadable.contains_key(&content) {
                warnings.add(
                    format_args!("buffers[{i}]"),
                    format!("has {has} bytes, but byteLength is {wanted}"),
                );
            }
            out.content_of.push(content);
        }
        Ok(out)
    }

    /// Reads a buffer's content and returns its index.
    fn read_content(
        &mut self,
        buffer: &Buffer,
        index: usize,
        source: &mut BufferSource<'a, '_>,
        warnings: &mut Warnings,
    ) -> Result<usize, LoadError> {
        let content = match source.read(buffer, index) {
            // The buffer may not be needed.
            Err(LoadError::Invalid { location, message }) => {
                warnings.add(&location, format_args!("{message}; ignored everything stored in the buffer"));
                self.unreadable.insert(self.contents.len(), UnreadableBuffer { location, message });
                Cow::default()
            }
            content => content?,
        };
        if let Cow::Owned(bytes) = &content {
            source.budget.charge(bytes.len() as u64)?;
            source.file_bytes = source.file_bytes.saturating_sub(bytes.len() as u64);
        }
        self.contents.push(content);
        Ok(self.contents.len() - 1)
    }

    /// Fails if the content of a buffer could not be read.
    pub fn check_readable(&self, buffer: usize) -> Result<(), LoadError> {
        let content = self.content_of.get(buffer);
        match content.and_then(|content| self.unreadable.get(content)) {
            Some(buffer) => Err(LoadError::invalid(&buffer.location, &buffer.message)),
            None => Ok(()),
        }
    }

    /// Number of a buffer's bytes.
    pub fn length(&self, buffer: usize) -> u64 {
        self.content_of.get(buffer).map_or(0, |&content| self.contents[content].len() as u64)
    }

    /// Returns a range of a buffer's bytes.
    pub fn slice(&self, buffer: usize, offset: u64, length: u64) -> Result<&[u8], String> {
        let bytes: &[u8] = self.content_of.get(buffer).map_or(&[], |&content| &self.contents[content]);
        let end = offset.checked_add(length).filter(|&end| end <= bytes.len() as u64);
        end.map(|end| &bytes[offset as usize..end as usize]).ok_or_else(|| {
            let has = bytes.len();
            format!("{length} bytes from byte {offset} exceed buffers[{buffer}], which has {has} bytes")
        })
    }
}

impl<'a> BufferSource<'a, '_> {
    /// Reads a buffer's content within the limit that is left.
    fn read(&self, buffer: &Buffer, index: usize) -> Result<Cow<'a, [u8]>, LoadError> {
        let location = format!("buffers[{index}]");
        Ok(match (&buffer.uri, self.bin) {
            (Some(uri), _) => {
                let error = |e: ReferenceError| {
                    let invalid = || LoadError::invalid(format_args!("{location}.uri"), e.message());
                    e.limit_error(self.file_bytes).unwrap_or_else(invalid)
                };
                Cow::Owned(self.folder.read_uri(uri, self.file_bytes).map_err(error)?)
            }
            (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
            (None, _) if is_fallback(buffer) || buffer.byte_length.0 == 0 => Cow::default(),
            (None, _) => {
                return Err(LoadError::invalid(location, "has neither a uri nor a GLB binary chunk"));
            }
        })
    }
}
