//! Polygon triangulation: quads by a diagonal, larger polygons by ear clipping, others as fans.

use glam::{DVec2, DVec3, Vec3};

use super::ear_clipping::EarClipper;

/// Polygons up to this many corners are always clipped, whatever the budget.
const FREE_CORNERS: usize = 10_000;

/// Work allowed for all larger polygons of a file, as the sum of their squared corner counts. The test for
/// self-intersection and ear clipping are quadratic in the worst case: one to three seconds for 100,000 corners.
pub(crate) const WORK_BUDGET: u64 = 100 * 100_000 * 100_000;

/// Subtracts the work of a polygon from `budget`. Returns false, and leaves the budget, if it is too small.
pub(crate) fn spend_work(budget: &mut u64, corners: usize) -> bool {
    let n = corners as u64;
    let work = if corners > FREE_CORNERS { n.saturating_mul(n) } else { 0 };
    let rest = budget.checked_sub(work);
    *budget = rest.unwrap_or(*budget);
    rest.is_some()
}

/// Self-intersecting polygons up to this many corners are clipped. They have no correct triangulation, and the
/// search for ears that do not exist takes a hundred times as long as finding those that do.
const MAX_SELF_INTERSECTING: usize = 64;

/// Triangulates polygons one after the other and reuses its buffers.
#[derive(Default)]
pub(crate) struct Triangulator {
    /// Remaining part of [`WORK_BUDGET`].
    budget: u64,
    /// Number of concave polygons that exceeded the budget.
    pub too_large: u64,
    /// Number of self-intersecting polygons with too many corners.
    pub self_intersecting: u64,
    corners: Vec<DVec3>,
    projected: Vec<DVec2>,
    clipper: EarClipper,
    out: Vec<usize>,
}

impl Triangulator {
    /// Creates a triangulator with `budget` left of [`WORK_BUDGET`].
    pub fn with_budget(budget: u64) -> Triangulator {
        Triangulator { budget, ..Triangulator::default() }
    }

    /// Returns the triangles of a polygon as triples of indices into its corners, with the polygon's winding.
    /// It cuts as Blender does: by ear clipping on the polygon's plane, or else as a fan from the first corner.
    pub fn triangulate(&mut self, corners: impl Iterator<Item = Vec3>) -> impl Iterator<Item = usize> {
        self.corners.clear();
        self.corners.extend(corners.map(|p| p.as_dvec3()));
        self.out.clear();
        // Convex polygons count too, so that the budget depends on corner counts alone.
        let affordable = spend_work(&mut self.budget, self.corners.len());
        if let [a, b, c, d] = self.corners[..] {
            self.out.extend(if needs_other_diagonal([b, c, d].map(|p| p - a)) {
                [0, 1, 3, 1, 2, 3]
            } else {
                [0, 1, 2, 0, 2, 3]
            });
        } else if self.corners.len() > 4 && self.project() {
            let convex = self.clipper.start(&self.projected);
            if !convex && !affordable {
                self.too_large += 1;
            } else if !convex
                && self.projected.len() > MAX_SELF_INTERSECTING
                && self_intersects(&self.projected)
            {
                self.self_intersecting += 1;
            } else {
                self.clipper.clip(&self.projected, &mut self.out);
            }
        }
        if self.out.is_empty() {
            self.out.extend((2..self.corners.len()).flat_map(|i| [0, i - 1, i]));
        }
        self.out.iter().copied()
    }

    /// Projects the polygon onto its plane by Newell's normal, counter-clockwise. Returns false if it has no area.
    fn project(&mut self) -> bool {
        let p = &mut self.corners;
        let origin = p[0];
        p.iter_mut().for_each(|p| *p -= origin);
        let normal: DVec3 = (0..p.len()).map(|i| p[i].cross(p[(i + 1) % p.len()])).sum();
        let Some(n) = normal.try_normalize() else { return false };
        let (x, y) = blinn_core::geometry::coordinate_system(n);
        self.projected.clear();
        self.projected.extend(p.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))));
        true
    }
}

/// Returns true if the diagonal from the first to the third corner of a quad would fold it or cut off a triangle
/// without area. Corners are relative to the first one.
fn needs_other_diagonal([b, c, d]: [DVec3; 3]) -> bool {
    let areas = [b.cross(c), d.cross(c)];
    // Rounding to six digits bends a straight edge by this much.
    let tolerance = |side: DVec3| 1e-12 * side.length_squared() * c.length_squared();
    areas[0].dot(areas[1]) > 0.0
        || areas[0].length_squared() <= tolerance(b)
        || areas[1].length_squared() <= tolerance(d)
}

/// Returns true if two edges of a polygon cross. Edges that touch, or nearly touch, do not.
fn self_intersects(p: &[DVec2]) -> bool {
    let (lo, hi) = p.iter().fold((p[0], p[0]), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    // Sweep along the longer side of the bounds, where fewer edges overlap.
    let swap_axes = hi.x - lo.x < hi.y - lo.y;
    let at = |i: usize| if swap_axes { p[i % p.len()].perp() } else { p[i % p.len()] };
    let mut edges: Vec<[DVec2; 2]> = (0..p.len())
        .map(|i| if at(i).x <= at(i + 1).x { [at(i), at(i + 1)] } else { [at(i + 1), at(i)] })
        .collect();
    edges.sort_unstable_by(|a, b| a[0].x.total_cmp(&b[0].x));
    edges.iter().enumerate().any(|(i, a)| {
        let overlapping = edges[i + 1..].iter().take_while(|b| b[0].x < a[1].x);
        overlapping
            .filter(|b| a[0].y.min(a[1].y) < b[0].y.max(b[1].y) && b[0].y.min(b[1].y) < a[0].y.max(a[1].y))
            .any(|b| separates(a, b) && separates(b, a))
    })
}

/// Returns true if the ends of `b` lie clearly on opposite sides of the line through `a`.
fn separates(a: &[DVec2; 2], b: &[DVec2; 2]) -> bool {
    let along = a[1] - a[0];
    let [start, end] = b.map(|end| {
        let to = end - a[0];
        let side = along.perp_dot(to);
        if side.abs() > 1e-9 * (along.length_squared() * to.length_squared()).sqrt() { side } else { 0.0 }
    });
    start * end < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangulate(corners: &[Vec3]) -> Vec<[usize; 3]> {
        let flat: Vec<usize> = Triangulator::default().triangulate(corners.iter().copied()).collect();
        flat.as_chunks::<3>().0.to_vec()
    }

    fn area(corners: &[Vec3]) -> (usize, f32, f32) {
        let triangles = triangulate(corners);
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

    /// Most triangles of a fan would cross the middle of the lid.
    #[test]
    fn few_triangles_of_a_round_lid_overlap_any_point_by_their_bounds() {
        for n in [33usize, 34, 100, 1000, 10_000] {
            let angle = |i: usize| i as f64 / n as f64 * std::f64::consts::TAU;
            let corners: Vec<Vec3> =
                (0..n).map(|i| DVec2::from_angle(angle(i)).extend(0.0).as_vec3()).collect();
            let triangles = triangulate(&corners);
            let (count, signed, total) = area(&corners);
            let right = 0.5 * n as f32 * angle(1).sin() as f32;
            assert_eq!(count, n - 2);
            assert!(
                (signed / right - 1.0).abs() < 1e-4 && (total / right - 1.0).abs() < 1e-4,
                "{n}: {total}"
            );
            for at in [DVec2::ZERO, DVec2::new(0.3, -0.2), DVec2::new(-0.5, 0.7)] {
                let holds = |t: &&[usize; 3]| {
                    let t = t.map(|i| corners[i].truncate().as_dvec2());
                    let (lo, hi) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
                    lo.cmple(at).all() && hi.cmpge(at).all()
                };
                let boxes = triangles.iter().filter(holds).count();
                assert!(boxes < 12, "{n}: {boxes} boxes at {at}");
            }
        }
    }

    /// A stadium outline with extra corners on its straight sides.
    #[test]
    fn collinear_corners_are_used() {
        let half = |by: f64| {
            let round = (0..=40).map(move |i| DVec2::from_angle(f64::from(i) / 40.0 * std::f64::consts::PI));
            let side = (1..20).map(|i| DVec2::new(-1.0, -0.1 * f64::from(i)));
            round.chain(side).map(move |p| DVec2::from_angle(by).rotate(p + DVec2::Y))
        };
        let corners: Vec<Vec3> =
            half(0.0).chain(half(std::f64::consts::PI)).map(|p| p.extend(0.0).as_vec3()).collect();
        let triangles = triangulate(&corners);
        let (count, signed, total) = area(&corners);
        let right = 4.0 + 40.0 * (std::f32::consts::PI / 40.0).sin();
        assert_eq!(count, corners.len() - 2);
        assert!((signed - right).abs() < 1e-4 && (total - right).abs() < 1e-4, "{signed} {total} {right}");
        assert!((0..corners.len()).all(|i| triangles.as_flattened().contains(&i)));
    }

    /// Concave polygons do not fold.
    #[test]
    fn concave_polygons_cover_their_area_once_in_both_windings() {
        // An L, an arrow that folds as a fan from its first corner, and a comb.
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

    /// Without a triangle that has no area, and without leaving out the corners between.
    #[test]
    fn corners_on_straight_edges_are_corners_of_triangles() {
        let square = [(0, 0), (1, 0), (3, 0), (4, 0), (4, 1), (4, 4), (2, 4), (1, 4), (0, 4), (0, 3), (0, 2)];
        let triangle = [(0, 0), (1, 0), (2, 0), (3, 0), (0, 3)];
        let ell = [(0, 0), (1, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2), (0, 1)];
        for (points, expected) in [(&square[..], 16.0), (&triangle, 4.5), (&ell, 4.0)] {
            for turn in [0.0, 0.7f32] {
                let at =
                    |&(x, y): &(i32, i32)| glam::Vec2::from_angle(turn).rotate(glam::ivec2(x, y).as_vec2());
                let mut corners: Vec<Vec3> = points.iter().map(|p| at(p).extend(0.0)).collect();
                for _ in 0..points.len() {
                    let triangles = triangulate(&corners);
                    let (count, signed, total) = area(&corners);
                    assert_eq!(count, points.len() - 2);
                    assert!((signed - expected).abs() < 1e-4 && (total - expected).abs() < 1e-4);
                    assert!((0..points.len()).all(|i| triangles.as_flattened().contains(&i)));
                    let double = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).z;
                    assert!(triangles.iter().all(|t| double(t.map(|i| corners[i])) > 0.5), "{triangles:?}");
                    corners.rotate_left(1);
                }
            }
        }
    }

    #[test]
    fn a_small_notch_in_a_large_polygon_is_cut_out() {
        let (w, d) = (1000.0, 0.01);
        let corners = on_plane(&[
            (0.0, 0.0),
            (w, 0.0),
            (w, w),
            (w / 2.0 + d, w),
            (w / 2.0, w - d),
            (w / 2.0 - d, w),
            (0.0, w),
        ]);
        let (_, signed, total) = area(&corners);
        assert!((signed - total).abs() < 1e-6 * total, "{signed} {total}");
        let fan: f32 = (2..7).map(|i| (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]).z).sum();
        assert!((fan / 2.0 - signed).abs() < 1.0);
    }

    #[test]
    fn degenerate_polygons_do_no_harm() {
        for points in [
            vec![(0.0, 0.0); 5],
            vec![(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)],
            vec![(f32::NAN, 0.0); 4],
        ] {
            let out = triangulate(&on_plane(&points));
            assert!(out.iter().flatten().all(|&i| i < points.len()));
        }
    }

    #[test]
    fn a_hole_reached_by_a_bridge_stays_open() {
        // A square of side 4 with a hole of side 2, joined by an edge that is run through twice.
        let points = [
            (0., 0.),
            (4., 0.),
            (4., 4.),
            (0., 4.),
            (0., 0.),
            (1., 1.),
            (1., 3.),
            (3., 3.),
            (3., 1.),
            (1., 1.),
        ];
        let (count, signed, total) = area(&on_plane(&points));
        assert_eq!(count, 8);
        assert!((signed - 12.0).abs() < 1e-5 && (total - 12.0).abs() < 1e-5, "{signed} {total}");
    }

    /// Stars of thousands of corners, in the hundreds, took minutes.
    #[test]
    fn polygons_that_cross_themselves_are_cut_without_ado() {
        let star = |corners: usize| -> Vec<Vec3> {
            let at = |i: usize| {
                let angle = i as f32;
                Vec3::new(angle.cos() * (1 + i % 7) as f32, angle.sin() * (1 + i % 5) as f32, 0.0)
            };
            (0..corners).map(at).collect()
        };
        let mut triangulator = Triangulator::default();
        let start = std::time::Instant::now();
        for _ in 0..300 {
            assert_eq!(triangulator.triangulate(star(3000).into_iter()).count(), 3 * 2998);
        }
        assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
        assert_eq!((triangulator.self_intersecting, triangulator.too_large), (300, 0));
        // Polygons with few corners are clipped.
        triangulator.triangulate(star(MAX_SELF_INTERSECTING).into_iter()).count();
        assert_eq!(triangulator.self_intersecting, 300);
    }

    /// Gears, upright and lying combs, a spiral, and a gear with a bridged hole, all rotated off their axes.
    #[test]
    fn simple_polygons_are_not_reported_as_self_intersecting() {
        let around = |n: usize, r: &dyn Fn(usize) -> f64| -> Vec<DVec2> {
            (0..n).map(|i| DVec2::from_angle(i as f64 / n as f64 * std::f64::consts::TAU) * r(i)).collect()
        };
        let gear = around(500, &|i| if i % 2 == 0 { 1.0 } else { 0.5 });
        let comb: Vec<DVec2> = (0..500)
            .map(|i| DVec2::new(f64::from(i), if i % 2 == 0 { 1.0 } else { 5000.0 }))
            .chain([DVec2::new(500.0, -1.0), DVec2::new(0.0, -1.0)])
            .collect();
        let arm = |by: f64| {
            (0..500).map(move |i| DVec2::from_angle(f64::from(i) * 0.1) * (by + f64::from(i) * 0.1))
        };
        let spiral: Vec<DVec2> = arm(1.0).chain(arm(1.3).collect::<Vec<_>>().into_iter().rev()).collect();
        let hole = around(101, &|_| 0.2);
        let bridged: Vec<DVec2> = [&gear[..], &gear[..1], &hole, &hole[..1]].concat();
        let lying = comb.iter().map(|p| p.perp()).collect();
        for (i, mut shape) in [gear, comb, lying, spiral, bridged].into_iter().enumerate() {
            for turn in [0.0, 0.3, 1.1] {
                let turned: Vec<DVec2> = shape.iter().map(|p| DVec2::from_angle(turn).rotate(*p)).collect();
                assert!(!self_intersects(&turned), "shape {i} turned by {turn}");
            }
            shape.swap(100, 300);
            assert!(self_intersects(&shape), "shape {i}");
        }
    }

    #[test]
    fn polygons_beyond_the_work_budget_become_fans() {
        // A comb: every second corner is concave.
        let comb = |teeth: usize| -> Vec<Vec3> {
            let up = (0..teeth).map(|i| Vec3::new(i as f32, if i % 2 == 0 { 1.0 } else { 5.0 }, 0.0));
            let down = [Vec3::new(teeth as f32, -1.0, 0.0), Vec3::new(0.0, -1.0, 0.0)];
            up.chain(down).collect()
        };
        assert_eq!(triangulate(&comb(3000)).len(), 3000);
        let mut triangulator = Triangulator::with_budget(WORK_BUDGET);
        assert_eq!(triangulator.triangulate(comb(1_000_000).into_iter()).count(), 3_000_000);
        assert_eq!(triangulator.too_large, 1);
    }

    /// A coastline of 60,000 corners is clipped, a second one exceeds the budget, a small one is clipped again.
    #[test]
    fn large_outlines_are_clipped_within_the_work_budget() {
        let coast = |n: usize| -> Vec<Vec3> {
            let at = |i: usize| {
                let angle = i as f32 / n as f32 * std::f32::consts::TAU;
                let r = (0..12).map(|k| 0.3 * 0.55f32.powi(k) * (angle * 1.9f32.powi(k).round() * 3.0).sin());
                let r = 2.0 + r.sum::<f32>();
                Vec3::new(r * angle.cos(), r * angle.sin(), 0.0)
            };
            (0..n).map(at).collect()
        };
        let over = |corners: &[Vec3], triangles: &[usize]| -> f64 {
            let double = |t: &[usize; 3]| {
                let [a, b, c] = t.map(|i| corners[i].as_dvec3());
                (b - a).cross(c - a).length()
            };
            triangles.as_chunks::<3>().0.iter().map(double).sum()
        };
        let own = |corners: &[Vec3]| -> f64 {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).map(|(a, b)| a.as_dvec3().cross(b.as_dvec3()).z).sum()
        };
        let mut triangulator = Triangulator::with_budget(2 * 60_000 * 60_000 - 1);
        for (n, right) in [(60_000, true), (60_000, false), (9_000, true)] {
            let corners = coast(n);
            let triangles: Vec<usize> = triangulator.triangulate(corners.iter().copied()).collect();
            let more = over(&corners, &triangles) / own(&corners) - 1.0;
            assert_eq!(more.abs() < 1e-9, right, "{n}: {more}");
        }
        assert_eq!((triangulator.too_large, triangulator.self_intersecting), (1, 0));
    }
}
