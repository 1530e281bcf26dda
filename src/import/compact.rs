//! Removes vertices that no primitive uses.

/// Renumbers the vertices of lines (N = 2) or triangles (N = 3) without those that none uses. Returns the old numbers of
/// the used vertices.
pub(crate) fn compact<const N: usize>(primitives: &mut [[u32; N]]) -> Vec<u32> {
    let mut used: Vec<u32> = primitives.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for corner in primitives.as_flattened_mut() {
        *corner = used.partition_point(|u| u < corner) as u32;
    }
    used
}
