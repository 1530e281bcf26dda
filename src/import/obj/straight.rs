//! Corners in the middle of a polygon's straight edges. Triangles between such corners have no area, so
//! polygons are cut without them, and what lies along their edge is split at each afterwards.

use std::collections::HashMap;

use glam::DVec2;

/// True where a polygon goes straight on at `m`.
#[inline]
pub(super) fn is_straight([a, m, b]: [DVec2; 3]) -> bool {
    let (to, on) = (m - a, b - m);
    // Numbers with six digits turn a little along a straight edge.
    let (ahead, aside) = (to.dot(on), to.perp_dot(on));
    ahead > 0.0 && aside.abs() <= 1e-5 * ahead
}

/// The corners at which a polygon does not go straight on.
pub(super) fn turning(polygon: &[DVec2]) -> Vec<usize> {
    let n = polygon.len();
    (0..n).filter(|&i| !is_straight([(i + n - 1) % n, i, (i + 1) % n].map(|k| polygon[k]))).collect()
}

/// Splits the triangles of a counter-clockwise polygon at the corners that none of them has, where those
/// lie on an edge.
pub(super) fn split_edges(polygon: &[DVec2], triangles: &mut Vec<usize>) {
    let n = polygon.len();
    if triangles.len() == 3 * (n - 2) {
        return;
    }
    let mut used = vec![false; n];
    triangles.iter().for_each(|&i| used[i] = true);
    let Some(first) = used.iter().position(|used| *used).filter(|_| used.contains(&false)) else { return };
    let mut triangle_of: HashMap<[usize; 2], usize> = HashMap::new();
    for (t, &[a, b, c]) in triangles.as_chunks::<3>().0.iter().enumerate() {
        triangle_of.extend([([a, b], t), ([b, c], t), ([c, a], t)]);
    }
    let (mut last, mut next) = (first, first);
    for m in (first + 1..first + n).map(|i| i % n) {
        if used[m] {
            (last, next) = (m, m);
            continue;
        }
        if next == last {
            next = (m + 1..).map(|i| i % n).find(|&i| used[i]).unwrap_or(first);
        }
        let Some(&t) = triangle_of.get(&[last, next]) else { continue };
        let triangle = &mut triangles[3 * t..][..3];
        let Some(&tip) = triangle.iter().find(|&&i| i != last && i != next) else { continue };
        let [before, behind] = [[last, m, tip], [m, next, tip]];
        if [before, behind].iter().all(|&t| has_area(t.map(|i| polygon[i]))) {
            triangle.copy_from_slice(&before);
            let new = triangles.len() / 3;
            triangles.extend(behind);
            triangle_of.extend([([last, m], t), ([m, next], new), ([next, tip], new)]);
            last = m;
        }
    }
}

/// True where a triangle runs counter-clockwise.
fn has_area([a, b, c]: [DVec2; 3]) -> bool {
    (b - a).perp_dot(c - a) > 0.0
}
