//! Places between the nodes of tables.

/// The node before `x`, which is 0…1, of `count` nodes at even distances, and the way from it to the next.
#[inline(always)]
pub(crate) fn table_place(x: f32, count: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (count - 1) as f32;
    // NaN becomes index 0.
    let i = (x as usize).min(count - 2);
    (i, x - i as f32)
}
