//! The shadow terminator offset: moves the origins of shadow rays, and of reflected rays, from a triangle to the smooth
//! surface that its vertex normals describe (Hanika, “Hacking the Shadow Terminator”, Ray Tracing Gems II, chapter 4).

use glam::{DVec3, Vec3};

/// Offsets from a triangle to its smooth surface. A point moves up to the tangent plane of each corner that it lies
/// below; the barycentrics weight the three offsets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TerminatorOffset {
    /// Normals of the corners, unit length or 0.
    n: [DVec3; 3],
    /// For each corner: heights of the next corner and of the one after it above its tangent plane.
    heights: [[f64; 2]; 3],
}

impl TerminatorOffset {
    /// For corners `v` with normals `n`, 0 for a mesh without normals. Normals that are not `normalized` yet may have any
    /// length.
    #[inline(always)]
    pub fn new(v: &[DVec3; 3], n: &[DVec3; 3], normalized: bool) -> TerminatorOffset {
        let n = if normalized { *n } else { n.map(DVec3::normalize_or_zero) };
        let height = |i: usize, other: usize| (v[(i + other) % 3] - v[i]).dot(n[i]);
        TerminatorOffset { n, heights: [0, 1, 2].map(|i| [height(i, 1), height(i, 2)]) }
    }

    /// The offset at barycentrics `b`, on the other side of the normals with `flip`.
    #[inline(always)]
    pub fn at(&self, b: [f64; 3], flip: bool) -> Vec3 {
        let side = if flip { -1.0 } else { 1.0 };
        let weight = |i: usize| {
            let height = self.heights[i][0] * b[(i + 1) % 3] + self.heights[i][1] * b[(i + 2) % 3];
            let depth = -height * side;
            side * b[i] * if depth > 0.0 { depth } else { 0.0 }
        };
        let offset = self.n[0] * weight(0) + self.n[1] * weight(1) + self.n[2] * weight(2);
        DVec3::new(or_zero(offset.x), or_zero(offset.y), or_zero(offset.z)).as_vec3()
    }
}

/// Returns the height of the smooth surface above the triangle with corners `v` and unit vertex normals `n`, on the side of the
/// normals, at barycentrics `b`: the distance along the normal by which shadow rays start above the triangle.
///
/// It is the lowest of three planes, each tangent at a corner, or raised above the other corners where the surface is concave,
/// and at least half of the parabolic patch that has these normals: the surface of Cycles, where a coarse smooth mesh casts no
/// shadows on itself.
#[inline(always)]
pub(crate) fn envelope_height(v: &[DVec3; 3], n: &[DVec3; 3], b: [f64; 3]) -> f64 {
    let p = v[0] * b[0] + v[1] * b[1] + v[2] * b[2];
    let mut lowest = f64::INFINITY;
    let mut patch = 0.0;
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let raised = (v[j] - v[i]).dot(n[i]).max((v[k] - v[i]).dot(n[i])).max(0.0);
        lowest = lowest.min(((v[i] - p).dot(n[i]) + raised).max(0.0));
        // The normals of an edge's ends lean by their difference along the edge.
        patch += (n[j] - n[i]).dot(v[j] - v[i]) * b[i] * b[j];
    }
    lowest.max(0.5 * patch)
}

/// Returns `x`, or 0 where it is far less than any ray origin's distance from its surface. Normals of flat triangles that
/// are off by rounding have such offsets, which as f32 would be subnormal, and slow to compute with.
#[inline(always)]
fn or_zero(x: f64) -> f64 {
    const NEGLIGIBLE: f64 = 1.0 / (1u128 << 100) as f64;
    if x.abs() < NEGLIGIBLE { 0.0 } else { x }
}

/// Share of the offset, 0…1, for light at angle `cos` to the geometric normal. Only grazing light is offset: otherwise
/// coarse meshes would lose the contact shadows of objects that stand on them.
#[inline(always)]
fn grazing_weight(cos: f64) -> f32 {
    /// 1 over the cosine at which light starts to graze; Cycles' default is 0.1.
    const INV_GRAZING_COS: f64 = 10.0;
    (1.0 - cos * INV_GRAZING_COS).clamp(0.0, 1.0) as f32
}

/// Origin of a ray that leaves a surface at angle `cos` to the geometric normal, from `origin`, which is clear of the
/// triangle.
#[inline(always)]
pub(crate) fn offset_to_smooth_surface(origin: Vec3, offset: Vec3, cos: f64) -> Vec3 {
    origin + offset * grazing_weight(cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of a sphere: no point is higher above it than the sphere's tangent planes, and corners stay.
    #[test]
    fn the_envelope_of_a_sphere_lies_outside_it() {
        let n = [DVec3::new(0.3, 0.1, 1.0), DVec3::new(-0.2, 0.3, 1.0), DVec3::new(0.0, -0.4, 1.0)];
        let n = n.map(DVec3::normalize);
        for b in [[1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.2, 0.3, 0.5]] {
            let p = n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
            let height = envelope_height(&n, &n, b);
            let outside = (p + p.normalize() * height).length();
            assert!(b.contains(&1.0) == (height < 1e-12), "{height}");
            let depth = 1.0 - p.length();
            assert!((1.0 - 1e-12..1.0 + 2.0 * depth + 1e-12).contains(&outside), "{b:?}: {outside}");
        }
    }

    /// The wall of a vase that widens to its rim: the foot is as far below the rim's tangent plane as that leans.
    #[test]
    fn concave_walls_rise_to_the_tangent_plane_of_the_rim() {
        let v = [DVec3::new(0.0, 0.42, 0.04), DVec3::new(-0.02, 0.0, 0.0), DVec3::new(0.02, 0.0, 0.0)];
        let lean = |y: f64| DVec3::new(0.0, y, 1.0).normalize();
        let n = [lean(0.25), lean(0.5), lean(0.5)];
        let height = envelope_height(&v, &n, [0.0, 0.5, 0.5]);
        assert!((height - (v[0] - v[1]).dot(n[0])).abs() < 1e-12, "{height}");
    }

    #[test]
    fn offsets_of_flat_triangles_with_rounded_normals_are_not_subnormal() {
        let v = [DVec3::ZERO, DVec3::X, DVec3::Y];
        // The first normal leans by 1e-22: the offset is about 1e-22 along z and 1e-44 along x.
        let n = [DVec3::new(-1e-22, 0.0, 1.0), DVec3::Z, DVec3::Z];
        let flat = TerminatorOffset::new(&v, &n, true).at([0.4, 0.3, 0.3], false);
        assert_eq!(flat.x, 0.0);
        assert!(flat.z > 1e-24, "{flat}");
        let round = [DVec3::new(-0.6, 0.0, 0.8), DVec3::Z, DVec3::Z];
        let offset = TerminatorOffset::new(&v, &round, true).at([0.4, 0.3, 0.3], false);
        assert!(offset.x < 0.0 && offset.z > 0.0, "{offset}");
    }
}
