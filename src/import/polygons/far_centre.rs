//! The centre of meshes far from the origin, such as survey data and city models. Millions of metres away, f32 resolves
//! only half a metre, so their positions are parsed relative to their own centre.

use glam::{DVec3, Vec3};

use blinn_core::geometry::Aabb;

/// Distance from the origin, in diagonals of the mesh, beyond which it is recentred: the spacing of f32
/// there is a millionth of the diagonal.
const FAR: f64 = 16.0;

/// Returns the centre of all corners of faces if all of them are far from the origin.
pub(crate) fn far_centre(mut corners: impl Iterator<Item = Vec3>) -> Option<DVec3> {
    let mut bounds = Aabb::EMPTY;
    // For most meshes this stops at the first few faces.
    let far = corners.all(|p| {
        bounds.extend(p.as_dvec3());
        let nearest = || DVec3::ZERO.clamp(bounds.min, bounds.max);
        bounds.is_empty() || nearest().length_squared() > FAR * FAR * bounds.extent().length_squared()
    });
    (far && !bounds.is_empty()).then(|| bounds.centre())
}
