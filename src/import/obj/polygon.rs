//! Polygons to triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3, Vec3};

/// Triangles of a polygon, as indices into its corners, wound as it is. Convex ones and quads that
/// are convex are a fan from the first corner; concave ones are cut ear by ear on their plane.
pub(super) fn triangulate(corners: &[Vec3], out: &mut Vec<[usize; 3]>) {
    let n = corners.len();
    if n < 3 {
        return;
    }
    let flat = (n > 3).then(|| flatten(corners)).flatten();
    if let Some(flat) = flat.filter(|flat| !is_convex(flat)) {
        let mut indices: Vec<usize> = Vec::new();
        Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut indices);
        if !indices.is_empty() {
            for t in indices.as_chunks::<3>().0 {
                let [a, b, c] = t.map(|i| flat[i]);
                // The plane is laid so that the polygon runs counter-clockwise.
                let clockwise = (b - a).perp_dot(c - a) < 0.0;
                out.push(if clockwise { [t[0], t[2], t[1]] } else { *t });
            }
            return;
        }
    }
    out.extend((1..n - 1).map(|i| [0, i, i + 1]));
}

/// The polygon on its own plane (Newell's), counter-clockwise. `None` without area.
fn flatten(corners: &[Vec3]) -> Option<Vec<DVec2>> {
    let p: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() - corners[0].as_dvec3()).collect();
    let normal: DVec3 = (0..p.len()).map(|i| p[i].cross(p[(i + 1) % p.len()])).sum();
    let n = normal.try_normalize()?;
    let (x, y) = crate::geometry::coordinate_system(n);
    Some(p.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect())
}

/// True where a counter-clockwise polygon turns left at every corner, once around.
fn is_convex(p: &[DVec2]) -> bool {
    let n = p.len();
    let size = p.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let least = -1e-9 * size * size;
    let edge = |i: usize| p[(i + 1) % n] - p[i % n];
    let turns_left = (0..n).all(|i| edge(i).perp_dot(edge(i + 1)) >= least);
    // A star turns left everywhere too, but goes around more than once: then x changes its
    // direction more than twice.
    let mut changes = 0;
    let mut last = 0.0;
    for i in 0..=n {
        let x = edge(i).x;
        if x != 0.0 {
            changes += u32::from(last != 0.0 && (x > 0.0) != (last > 0.0));
            last = x;
        }
    }
    turns_left && changes <= 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3]) -> (usize, f32, f32) {
        let mut triangles = Vec::new();
        triangulate(corners, &mut triangles);
        let double = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| corners[i]);
            (b - a).cross(c - a)
        };
        let signed: Vec3 = triangles.iter().map(double).sum();
        let total: f32 = triangles.iter().map(|t| double(t).length()).sum();
        (triangles.len(), signed.z / 2.0, total / 2.0)
    }

    fn on_plane(points: &[(f32, f32)]) -> Vec<Vec3> {
        points.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn convex_polygons_are_fans_from_the_first_corner() {
        let mut out = Vec::new();
        triangulate(&on_plane(&[(0.0, 0.0), (1.0, 0.0), (1.5, 1.0), (0.5, 2.0), (-0.5, 1.0)]), &mut out);
        assert_eq!(out, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn concave_polygons_cover_their_area_once_either_way_round() {
        // An L, an arrow whose first corner a fan would fold at, and a comb.
        let shapes: [(&[(f32, f32)], f32); 3] = [
            (&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)], 3.0),
            (&[(2.0, 1.0), (0.0, 2.0), (1.0, 1.0), (0.0, 0.0)], 1.0),
            (
                &[
                    (0.0, 0.0),
                    (5.0, 0.0),
                    (5.0, 2.0),
                    (4.0, 2.0),
                    (4.0, 1.0),
                    (1.0, 1.0),
                    (1.0, 2.0),
                    (0.0, 2.0),
                ],
                7.0,
            ),
        ];
        for (points, expected) in shapes {
            let mut corners = on_plane(points);
            for _ in 0..points.len() {
                let (count, signed, total) = area(&corners);
                assert_eq!(count, points.len() - 2);
                assert!((signed - expected).abs() < 1e-5 && (total - expected).abs() < 1e-5);
                corners.rotate_left(1);
            }
            corners.reverse();
            let (_, signed, total) = area(&corners);
            assert!((signed + expected).abs() < 1e-5 && (total - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn degenerate_polygons_do_no_harm() {
        for points in [
            vec![(0.0, 0.0); 5],
            vec![(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)],
            vec![(f32::NAN, 0.0); 4],
        ] {
            let mut out = Vec::new();
            triangulate(&on_plane(&points), &mut out);
            assert!(out.iter().flatten().all(|&i| i < points.len()));
        }
    }
}
