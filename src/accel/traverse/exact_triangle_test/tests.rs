//! The exact hit test against integer arithmetic, and its independence of vertex order.

use super::*;
use crate::bvh::canonical_triangle::{CanonicalTriangle, Degeneracy};

/// Random integers.
struct IntegerRng(u64);

impl IntegerRng {
    /// Returns an integer from −`n` to `n`.
    fn next(&mut self, n: i64) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as i64 % (2 * n + 1) - n
    }

    fn point(&mut self, n: i64) -> [i64; 3] {
        [self.next(n), self.next(n), self.next(n)]
    }
}

fn to_vec3(p: [i64; 3]) -> Vec3 {
    Vec3::from(p.map(|x| x as f32))
}

fn sub(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns a·(b×c), exactly.
fn triple_product(a: [i64; 3], b: [i64; 3], c: [i64; 3]) -> i64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Small integer coordinates put many rays exactly on edges and vertices, and the exact answers are known.
#[test]
fn the_hit_test_is_exact() {
    let mut rng = IntegerRng(1);
    let mut hits = 0;
    let mut hits_on_edges = 0;
    for i in 0..1_000_000 {
        let n = if i % 2 == 0 { 4 } else { 1000 };
        let v = [rng.point(n), rng.point(n), rng.point(n)];
        let o = rng.point(n);
        let d = if i % 3 == 0 { rng.point(n) } else { sub(v[i % 2], o) };
        let Ok((triangle, _)) = CanonicalTriangle::new(v.map(to_vec3)) else { continue };
        let [a, b, c] = v.map(|p| sub(p, o));
        let edge_functions = [triple_product(d, a, b), triple_product(d, b, c), triple_product(d, c, a)];
        let inside = edge_functions.iter().all(|&s| s >= 0) || edge_functions.iter().all(|&s| s <= 0);
        let det = edge_functions.iter().sum::<i64>();
        let depth = triple_product(a, b, c);
        let expected = (inside && det != 0 && depth.signum() * det.signum() > 0)
            .then(|| (depth as f64 / det as f64) as f32);
        let ray = LocalRay {
            o: to_vec3(o).as_dvec3(),
            d: to_vec3(d).as_dvec3(),
            t_scale: 1.0,
            inv_t_scale: 1.0,
            from_light: false,
        };
        let hit = ray.intersect_f64(triangle.vertices());
        assert_eq!(hit.map(|hit| hit.t), expected, "{v:?} {o:?} {d:?}");
        hits += usize::from(hit.is_some());
        hits_on_edges += usize::from(hit.is_some() && edge_functions.contains(&0));
    }
    assert!(hits > 200_000 && hits_on_edges > 100_000, "{hits} {hits_on_edges}");
}

/// Any order of the vertices gives the same hit, and the winding follows the order.
#[test]
fn hits_do_not_depend_on_vertex_order() {
    let v = [Vec3::new(0.1, -0.0, 0.3), Vec3::new(1.7, 0.2, 0.1), Vec3::new(0.3, 1.1, -0.4)];
    let o = DVec3::new(0.5, 0.3, 7.3);
    let d = DVec3::new(0.01, 0.02, -1.3);
    let ray = LocalRay { o, d, t_scale: 1.0, inv_t_scale: 1.0, from_light: false };
    let (triangle, flipped) = CanonicalTriangle::new(v).unwrap();
    let hit = ray.intersect_f64(triangle.vertices()).unwrap();
    for (order, odd) in [([1, 2, 0], false), ([2, 0, 1], false), ([1, 0, 2], true), ([2, 1, 0], true)] {
        let (reordered, reordered_flipped) = CanonicalTriangle::new(order.map(|i| v[i])).unwrap();
        assert_eq!(reordered.to_bits(), triangle.to_bits());
        assert_eq!(reordered_flipped, flipped ^ odd);
        assert_eq!(ray.intersect_f64(reordered.vertices()), Some(hit));
    }
    assert_eq!(CanonicalTriangle::new([v[0], v[0], v[1]]).unwrap_err(), Degeneracy::ZeroArea);
    assert_eq!(CanonicalTriangle::new([v[0], v[2], v[1] * f32::NAN]).unwrap_err(), Degeneracy::NonFinite);
    assert_eq!(CanonicalTriangle::new([v[0], v[2], v[1] * 1e19]).unwrap_err(), Degeneracy::NonFinite);
}
