//! Meshes far from the origin, as surveyors and cities have them: millions of metres away, f32 tells
//! no two places within half a metre apart. They are read relative to their own middle.

use glam::{DVec3, Vec3};

use crate::geometry::Aabb;
use crate::import::obj::parsed::Parsed;

/// How many diagonals away a mesh is far: f32's step there is a millionth of the diagonal.
const FAR: f64 = 16.0;

/// The middle of all faces, where all of them are far from the origin.
pub(crate) fn middle(parsed: &Parsed) -> Option<DVec3> {
    let mut bounds = Aabb::EMPTY;
    let mut corners = parsed.triangles.iter().flatten().map(|c| parsed.positions[c.v as usize]);
    // Of most meshes the first few faces say that they are not.
    let far = corners.all(|p| {
        bounds.extend(p.as_dvec3());
        let nearest = || DVec3::ZERO.clamp(bounds.min, bounds.max);
        bounds.is_empty() || nearest().length_squared() > FAR * FAR * bounds.extent().length_squared()
    });
    (far && !bounds.is_empty()).then(|| bounds.centre())
}

/// What the first three numbers of `text` are relative to `origin`. `read` is what they are as f32, which
/// counts for those that are written in some odd way.
#[cold]
pub(crate) fn relative(text: &str, read: Vec3, origin: DVec3) -> Vec3 {
    let mut place = read.as_dvec3().to_array();
    for (value, word) in place.iter_mut().zip(text.split_whitespace()) {
        *value = word.parse().unwrap_or(*value);
    }
    (DVec3::from(place) - origin).as_vec3()
}
