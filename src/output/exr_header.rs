//! Attributes in the header of an OpenEXR file: sorting, lookup, and a check that the file is complete.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes before the first attribute.
const MAGIC_AND_VERSION: usize = 8;

/// Sorts the attributes of the header by name. The encoder's order of some of them changes from run to run, but an
/// image must always have the same bytes. The length of the header stays, so all offsets stay valid.
pub(super) fn sort_attributes(file: &mut [u8]) {
    let mut sorted: Vec<&[u8]> = attributes(file).collect();
    sorted.sort();
    let header = sorted.concat();
    if let Some(target) = file.get_mut(MAGIC_AND_VERSION..MAGIC_AND_VERSION + header.len()) {
        target.copy_from_slice(&header);
    }
}

/// The attributes of the header that `file` begins with.
fn attributes(file: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = file.get(MAGIC_AND_VERSION..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (first, after) = rest.split_at_checked(attribute_length(rest)?)?;
        rest = after;
        Some(first)
    })
}

/// The length of the attribute that `bytes` begin with: name, type, size and value. `None` at the end of the
/// header.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let string_length = |from: usize| bytes.get(from..)?.iter().position(|&b| b == 0);
    let name = string_length(0).filter(|&length| length > 0)?;
    let type_name = string_length(name + 1)?;
    let value = name + type_name + 2;
    let (size, rest) = bytes.get(value..)?.split_first_chunk::<4>()?;
    let size = u32::from_le_bytes(*size) as usize;
    (size <= rest.len()).then_some(value + 4 + size)
}

/// The value of the string attribute `name` in the header that `file` begins with.
pub(super) fn string_attribute<'f>(file: &'f [u8], name: &str) -> Option<&'f [u8]> {
    let value = |attribute: &'f [u8]| attribute.strip_prefix(name.as_bytes())?.strip_prefix(b"\0string\0");
    attributes(file).find_map(value)?.get(4..)
}

/// Returns true if the file at `path`, which begins with `head`, ends with its last chunk.
pub(super) fn is_complete(head: &[u8], path: &Path) -> bool {
    end_of_last_chunk(head, path).is_some_and(|end| path.metadata().is_ok_and(|m| m.len() == end))
}

/// The offset behind the last chunk. A zero ends the header; the table of chunk offsets follows, and then the
/// chunks.
fn end_of_last_chunk(head: &[u8], path: &Path) -> Option<u64> {
    let table = MAGIC_AND_VERSION + attributes(head).map(<[u8]>::len).sum::<usize>() + 1;
    let offset = |at: usize| Some(u64::from_le_bytes(*head.get(at..)?.first_chunk()?));
    let count = offset(table)?.checked_sub(table as u64)? / 8;
    let last_entry = usize::try_from(count).ok()?.checked_sub(1)?.checked_mul(8)?;
    let last = offset(table.checked_add(last_entry)?)?;

    // A chunk starts with its coordinates, four numbers for a tile and one for lines, and its size.
    let tiled = attributes(head).any(|attribute| attribute.starts_with(b"tiles\0"));
    let coordinates = if tiled { 16 } else { 4 };
    let mut file = File::open(path).ok()?;
    file.seek(SeekFrom::Start(last.checked_add(coordinates)?)).ok()?;
    let mut size = [0; 4];
    file.read_exact(&mut size).ok()?;
    last.checked_add(coordinates + 4)?.checked_add(u64::from(u32::from_le_bytes(size)))
}
