//! Attributes in the header of an OpenEXR file: sorting and lookup.

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
