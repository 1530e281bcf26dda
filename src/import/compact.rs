//! Removes vertices that no line uses.

/// Renumbers the vertices of lines without those that no line uses. Returns the old numbers of the used vertices.
pub(crate) fn compact(lines: &mut [[u32; 2]]) -> Vec<u32> {
    let mut used: Vec<u32> = lines.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for end in lines.as_flattened_mut() {
        *end = used.partition_point(|u| u < end) as u32;
    }
    used
}
