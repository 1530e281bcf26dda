//! Positions of meshes far from the origin, parsed relative to their own centre.

use glam::{DVec3, Vec3};

/// Parses three plain numbers in f64 and makes them relative to `origin`.
#[cold]
pub(super) fn parse_relative<'t>(words: impl IntoIterator<Item = &'t str>, origin: DVec3) -> Vec3 {
    let mut position = [f64::NAN; 3];
    for (value, word) in position.iter_mut().zip(words) {
        *value = word.parse().unwrap_or(f64::NAN);
    }
    (DVec3::from(position) - origin).as_vec3()
}
