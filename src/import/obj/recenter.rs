//! Recentring of meshes far from the origin, such as survey data and city models. Millions of metres away,
//! f32 resolves only half a metre, so their positions are parsed relative to their own centre.

use glam::{DVec3, Vec3};

use crate::obj::geometry::ObjGeometry;
use blinn_core::geometry::Aabb;

/// Distance from the origin, in diagonals of the mesh, beyond which it is recentred: the spacing of f32
/// there is a millionth of the diagonal.
const FAR: f64 = 16.0;

/// Returns the centre of all faces if all of them are far from the origin.
pub(super) fn far_centre(geometry: &ObjGeometry) -> Option<DVec3> {
    let mut bounds = Aabb::EMPTY;
    let mut corners = geometry.triangles.iter().flatten().map(|c| geometry.positions[c.v as usize]);
    // For most meshes this stops at the first few faces.
    let far = corners.all(|p| {
        bounds.extend(p.as_dvec3());
        let nearest = || DVec3::ZERO.clamp(bounds.min, bounds.max);
        bounds.is_empty() || nearest().length_squared() > FAR * FAR * bounds.extent().length_squared()
    });
    (far && !bounds.is_empty()).then(|| bounds.centre())
}

/// Parses three plain numbers in f64 and makes them relative to `origin`.
#[cold]
pub(super) fn parse_relative<'t>(words: impl IntoIterator<Item = &'t str>, origin: DVec3) -> Vec3 {
    let mut position = [f64::NAN; 3];
    for (value, word) in position.iter_mut().zip(words) {
        *value = word.parse().unwrap_or(f64::NAN);
    }
    (DVec3::from(position) - origin).as_vec3()
}
