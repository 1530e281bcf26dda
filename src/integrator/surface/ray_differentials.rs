//! How much of a surface a sample stands for: the step from an eye ray to its neighbours, followed to
//! the plane of the triangle (Igehy, “Tracing Ray Differentials”, 1999).

use glam::{DVec3, Vec2};

use crate::geometry::RayDifferential;

/// A step to the next sample, to the right and upward, on the triangle that was hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    /// What barycentrics 1 and 2 change by; not finite where the triangle is seen edge on.
    b: [Vec2; 2],
    /// |∂n|² over both steps, of the normal interpolated from the corners.
    turn: f32,
}

/// What barycentrics 1 and 2 of a triangle change by along a step in its plane: the step's product
/// with these. From the first corner, where both are 0, they are the barycentrics themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps {
    b: [DVec3; 2],
}

impl Steps {
    /// For a triangle with edges `e1` and `e2` and unit normal `n`. Not finite where it has no area.
    pub fn new([e1, e2]: [DVec3; 2], n: DVec3) -> Steps {
        let per_area = 1.0 / e1.cross(e2).dot(n);
        Steps { b: [e2.cross(n) * per_area, n.cross(e1) * per_area] }
    }

    /// What barycentrics 1 and 2 change by along `step`.
    #[inline(always)]
    pub fn of(&self, step: DVec3) -> [f64; 2] {
        [step.dot(self.b[0]), step.dot(self.b[1])]
    }

    /// The same to the neighbour that is `beside` at the same t, brought back to the plane along `d`.
    #[inline(always)]
    fn along(&self, beside: DVec3, d: DVec3, (n, per_facing): (DVec3, f64)) -> Vec2 {
        let [u, v] = self.of(beside - d * (beside.dot(n) * per_facing));
        Vec2::new(u as f32, v as f32)
    }
}

/// What of |∂n|² is added to α², twice the variance of a place in the footprint, and at most how much
/// in all: Tokuyoshi and Kaplanyan, “Improved Geometric Specular Antialiasing”, 2019.
const PER_TURN: f32 = 2.0 / 12.0;
const MOST: f32 = 0.18;

impl Spread {
    /// A sample that stands for nothing but its point.
    pub const POINT: Spread = Spread { b: [Vec2::ZERO; 2], turn: 0.0 };

    /// Of a ray along `d` that has come as far as `t`, on a triangle of unit normal `n`, with 1/(d·n).
    #[inline(always)]
    pub fn over(
        differential: &RayDifferential,
        (t, d): (f64, DVec3),
        steps: &Steps,
        (n, per_facing): (DVec3, f64),
    ) -> Spread {
        let RayDifferential { o: [o0, o1], d: [d0, d1] } = *differential;
        let (right, up) = (o0 + d0 * t, o1 + d1 * t);
        Spread { b: [steps.along(right, d, (n, per_facing)), steps.along(up, d, (n, per_facing))], turn: 0.0 }
    }

    /// How many numbers say all about it.
    pub const NUMBERS: usize = 5;

    /// Those numbers.
    #[inline(always)]
    pub fn numbers(&self) -> [f32; Spread::NUMBERS] {
        [self.b[0].x, self.b[0].y, self.b[1].x, self.b[1].y, self.turn]
    }

    /// From those numbers.
    #[inline(always)]
    pub fn of_numbers([a, b, c, d, turn]: [f32; Spread::NUMBERS]) -> Spread {
        Spread { b: [Vec2::new(a, b), Vec2::new(c, d)], turn }
    }

    #[inline(always)]
    pub fn is_point(&self) -> bool {
        *self == Spread::POINT
    }

    /// Takes the turn of the normals `n` at the corners into account, where `middle` is their mean
    /// by barycentrics, which was multiplied by `per_length` to be of unit length; `fits`: it could be.
    #[inline(always)]
    pub fn bend(&mut self, n: [DVec3; 3], middle: DVec3, per_length: f64, fits: bool) {
        let edges = [n[1] - n[0], n[2] - n[0]];
        let mut turn = 0.0;
        for step in self.b {
            let by = edges[0] * f64::from(step.x) + edges[1] * f64::from(step.y);
            turn += ((by - middle * middle.dot(by)) * per_length).length_squared();
        }
        self.turn = if fits { turn as f32 } else { self.turn };
    }

    /// The two steps in texture coordinates, of which these are the corners'.
    #[inline(always)]
    pub fn of_uv(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        self.b.map(|step| (b - a) * step.x + (c - a) * step.y)
    }

    /// What the turn of the smooth surface adds to a highlight's α².
    pub fn roughening(&self) -> f32 {
        roughening(self.turn)
    }
}

/// The same by the turn, which is the last of a spread's numbers.
#[inline(always)]
pub(crate) fn roughening(turn: f32) -> f32 {
    // Edge on, or where normals cancel, the turn is no number.
    if turn.is_nan() { MOST } else { (PER_TURN * turn).min(MOST) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Steps {
        Steps::new([DVec3::X, DVec3::Y], DVec3::Z)
    }

    fn bent(mut s: Spread, n: [DVec3; 3], b: [f64; 3]) -> Spread {
        let sum = n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
        let per_length = sum.length_recip();
        s.bend(n, sum * per_length, per_length, true);
        s
    }

    /// Looking down at the square (0, 0)…(1, 1) from `way` above its corner, a step of `x` and `y`.
    fn spread(way: DVec3, o: [DVec3; 2], d: [DVec3; 2]) -> Spread {
        Spread::over(&RayDifferential { o, d }, (1.0, way), &square(), (DVec3::Z, 1.0 / way.z))
    }

    const STEPS: [DVec3; 2] = [DVec3::new(0.01, 0.0, 0.0), DVec3::new(0.0, 0.02, 0.0)];

    #[test]
    fn an_eye_ray_spreads_with_its_way_and_a_parallel_one_does_not() {
        // t = 1 at the end of the way.
        let down = DVec3::new(0.0, 0.0, -8.0);
        let still = [DVec3::ZERO; 2];
        for s in [spread(down, still, STEPS), spread(down, STEPS, still)] {
            assert_eq!(s.b, [Vec2::new(0.01, 0.0), Vec2::new(0.0, 0.02)]);
        }
        let far = Spread::over(
            &RayDifferential { o: still, d: STEPS },
            (4.0, down / 4.0),
            &square(),
            (DVec3::Z, 4.0 / down.z),
        );
        assert_eq!(far.b, [Vec2::new(0.04, 0.0), Vec2::new(0.0, 0.08)]);
    }

    #[test]
    fn the_step_is_the_difference_of_neighbouring_hits() {
        let way = DVec3::new(1.0, 2.0, -0.7);
        let h = 1e-6;
        let d = [DVec3::new(0.3, -0.2, 0.1), DVec3::new(0.1, 0.4, 0.5)];
        let s = spread(way, [DVec3::ZERO; 2], d);
        for (step, d) in s.b.iter().zip(d) {
            // Where z = 0 from (0, 0, 0.7) along the neighbour.
            let near = way + d * h;
            let hit = near * (way.z / near.z) - way;
            let expected = Vec2::new((hit.x / h) as f32, (hit.y / h) as f32);
            assert!(step.abs_diff_eq(expected, 1e-4), "{step} {expected}");
        }
    }

    #[test]
    fn a_sphere_turns_by_the_step_over_its_radius() {
        let s = spread(DVec3::new(0.0, 0.0, -8.0), STEPS, [DVec3::ZERO; 2]);
        let r = 50.0;
        let n = [DVec3::new(0.0, 0.0, r), DVec3::new(1.0, 0.0, r), DVec3::new(0.0, 1.0, r)];
        let s = bent(s, n.map(DVec3::normalize), [1.0, 0.0, 0.0]);
        let expected = (0.01 * 0.01 + 0.02 * 0.02) / (r * r) as f32;
        assert!((s.turn / expected - 1.0).abs() < 1e-2, "{} {expected}", s.turn);
    }

    #[test]
    fn edge_on_and_cancelling_normals_are_limited() {
        let s = spread(DVec3::X, [DVec3::ZERO; 2], STEPS);
        let s = bent(s, [DVec3::Z, DVec3::X, -DVec3::Z], [0.5, 0.0, 0.5]);
        assert_eq!(s.roughening(), MOST);
        assert_eq!(Spread::POINT.roughening(), 0.0);
    }
}
