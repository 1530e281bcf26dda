//! A sheen of microfibres, as Cycles has it: a linearly transformed cosine (Zeltner, Burley and Chiang, “Practical
//! Multiple-Scattering Sheen Using Linearly Transformed Cosines”, 2022).
//!
//! The tables are fits to pictures of Cycles 5.0 (docs/decisions/material-layers.md). Light between fibres is part of them.

use glam::Vec3;

use crate::integrator::material::table_place::table_place;

/// Nodes by perceptual roughness, at k/10.
const ROWS: usize = 11;
/// Nodes by the cosine to the viewer, at (k/8)².
const COLUMNS: usize = 9;

/// A value at each node.
type Table = [[f32; COLUMNS]; ROWS];

/// R: the share of the light of all directions that white fibres reflect.
#[rustfmt::skip]
const ALBEDO: Table = [
    [1.0000, 0.8734, 0.4126, 0.0020, 0.0000, 0.0001, 0.0000, 0.0000, 0.0000],
    [1.0000, 0.9323, 0.4918, 0.0187, 0.0000, 0.0003, 0.0000, 0.0000, 0.0000],
    [1.0000, 0.9787, 0.6246, 0.2199, 0.0337, 0.0044, 0.0008, 0.0002, 0.0001],
    [1.0000, 0.9885, 0.6833, 0.3806, 0.1594, 0.0476, 0.0110, 0.0025, 0.0007],
    [1.0000, 0.9808, 0.7184, 0.4686, 0.2791, 0.1360, 0.0504, 0.0154, 0.0041],
    [1.0000, 0.9686, 0.7407, 0.5244, 0.3683, 0.2288, 0.1173, 0.0497, 0.0172],
    [1.0000, 0.9577, 0.7577, 0.5656, 0.4364, 0.3117, 0.1950, 0.1062, 0.0489],
    [1.0000, 0.9502, 0.7732, 0.6002, 0.4927, 0.3844, 0.2726, 0.1768, 0.1027],
    [1.0000, 0.9463, 0.7887, 0.6326, 0.5405, 0.4478, 0.3464, 0.2532, 0.1747],
    [1.0000, 0.9450, 0.8049, 0.6627, 0.5828, 0.5025, 0.4129, 0.3299, 0.2570],
    [1.0000, 0.9447, 0.8208, 0.6917, 0.6200, 0.5494, 0.4727, 0.4019, 0.3410],
];

/// a: the width of the lobe; 1 is that of matte surfaces, and small ones reflect light along the surface.
#[rustfmt::skip]
const WIDTH: Table = [
    [0.030, 0.030, 0.030, 0.030, 0.030, 0.030, 0.030, 0.053, 0.086],
    [0.030, 0.030, 0.030, 0.033, 0.055, 0.080, 0.112, 0.150, 0.190],
    [0.030, 0.042, 0.084, 0.125, 0.149, 0.170, 0.204, 0.246, 0.293],
    [0.077, 0.117, 0.158, 0.204, 0.250, 0.274, 0.298, 0.339, 0.393],
    [0.160, 0.196, 0.234, 0.276, 0.329, 0.365, 0.392, 0.427, 0.481],
    [0.250, 0.284, 0.319, 0.357, 0.408, 0.453, 0.483, 0.517, 0.563],
    [0.349, 0.382, 0.415, 0.450, 0.496, 0.546, 0.579, 0.611, 0.644],
    [0.454, 0.487, 0.520, 0.553, 0.592, 0.635, 0.668, 0.697, 0.723],
    [0.565, 0.595, 0.627, 0.657, 0.689, 0.723, 0.747, 0.768, 0.786],
    [0.682, 0.703, 0.725, 0.748, 0.770, 0.798, 0.814, 0.827, 0.837],
    [0.801, 0.810, 0.816, 0.817, 0.833, 0.855, 0.866, 0.875, 0.880],
];

/// b: how far the lobe leans, towards the viewer below 0 and away from it above.
#[rustfmt::skip]
const LEAN: Table = [
    [0.062, 0.034, 0.007, -0.014, -0.029, -0.040, -0.045, -0.046, -0.048],
    [0.052, 0.030, 0.007, -0.019, -0.035, -0.036, -0.036, -0.040, -0.046],
    [0.041, 0.025, 0.008, -0.018, -0.047, -0.027, -0.028, -0.036, -0.044],
    [0.028, 0.014, 0.003, -0.007, -0.043, -0.020, -0.027, -0.036, -0.041],
    [0.017, -0.004, -0.025, -0.050, -0.067, -0.030, -0.033, -0.037, -0.036],
    [0.007, -0.024, -0.057, -0.091, -0.107, -0.055, -0.045, -0.040, -0.028],
    [-0.002, -0.041, -0.079, -0.113, -0.123, -0.085, -0.064, -0.045, -0.023],
    [-0.010, -0.047, -0.083, -0.112, -0.117, -0.091, -0.074, -0.053, -0.021],
    [-0.016, -0.042, -0.067, -0.088, -0.093, -0.077, -0.065, -0.049, -0.017],
    [-0.020, -0.028, -0.036, -0.046, -0.054, -0.046, -0.041, -0.031, -0.011],
    [-0.022, -0.009, 0.003, 0.010, 0.000, 0.001, 0.000, 0.000, 0.000],
];

/// Sine between viewer and normal from which on the lobe leans by the table. Seen along the normal, fibres have no direction to
/// lean in.
const FULL_LEAN_SIN: f32 = 0.3;

/// Microfibres seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MicrofibreLobe {
    n: Vec3,
    width: f32,
    /// b along the viewer's tangent.
    lean: Vec3,
    /// Share of the light of all directions that white fibres reflect.
    pub albedo: f32,
}

impl MicrofibreLobe {
    /// The lobe of fibres of a perceptual roughness around the normal `n`, seen from the unit direction `v`.
    pub fn new(n: Vec3, v: Vec3, roughness: f32) -> MicrofibreLobe {
        let cos = n.dot(v);
        let place = Place::new(roughness, cos);
        let toward_viewer = v - n * cos;
        let lean = toward_viewer * (place.value(&LEAN) / toward_viewer.length().max(FULL_LEAN_SIN));
        MicrofibreLobe { n, width: place.value(&WIDTH), lean, albedo: place.value(&ALBEDO).clamp(0.0, 1.0) }
    }

    /// π f cos: the share of the lecture's irradiance from the unit direction `l` that white fibres reflect.
    ///
    /// R z a²/|(a x + b z, a y, z)|⁴ with x towards the viewer and z along the normal. Its integral over the directions is π R,
    /// as the transformed cosine has the same half space.
    pub fn reflect(&self, l: Vec3) -> f32 {
        let z = self.n.dot(l);
        if !(z > 0.0) {
            return 0.0;
        }
        let tangential = (l - self.n * z) * self.width + self.lean * z;
        let length2 = tangential.length_squared() + z * z;
        self.albedo * z * (self.width * self.width) / (length2 * length2)
    }
}

/// A place between the nodes of the tables.
#[derive(Clone, Copy, Debug)]
struct Place {
    row: usize,
    column: usize,
    /// From `row` to the next.
    y: f32,
    /// From `column` to the next.
    x: f32,
}

impl Place {
    fn new(roughness: f32, cos: f32) -> Place {
        let (row, y) = table_place(roughness, ROWS);
        let (column, x) = table_place(cos.max(0.0).sqrt(), COLUMNS);
        Place { row, column, y, x }
    }

    /// The value of a table, linear between its nodes.
    fn value(&self, table: &Table) -> f32 {
        let at = |row: usize| {
            let [from, to] = [table[row][self.column], table[row][self.column + 1]];
            from + (to - from) * self.x
        };
        let [upper, lower] = [at(self.row), at(self.row + 1)];
        upper + (lower - upper) * self.y
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A direction at a cosine to z, in the plane at an angle about it.
    fn at(cos: f64, turn: f64) -> Vec3 {
        let sin = (1.0 - cos * cos).sqrt();
        glam::DVec3::new(sin * turn.cos(), sin * turn.sin(), cos).as_vec3()
    }

    fn seen(cos: f64, roughness: f32) -> MicrofibreLobe {
        MicrofibreLobe::new(Vec3::Z, at(cos, 0.0), roughness)
    }

    /// The integral over all directions of π f cos, divided by π. Steps are even by the square root of the cosine.
    fn integral(lobe: &MicrofibreLobe) -> f64 {
        let steps = 100;
        let mut sum = 0.0;
        for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let [root, turn] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(steps));
            sum += f64::from(lobe.reflect(at(root * root, turn * TAU))) * 2.0 * root;
        }
        sum * 2.0 / f64::from(steps * steps)
    }

    #[test]
    fn fibres_reflect_their_albedo() {
        for roughness in [0.0, 0.1, 0.25, 0.5, 0.75, 1.0] {
            for cos in [0.02, 0.1, 0.4, 0.7, 0.96, 0.995, 1.0] {
                let lobe = seen(cos, roughness);
                let (albedo, sum) = (f64::from(lobe.albedo), integral(&lobe));
                assert!((sum - albedo).abs() <= 0.01 * albedo, "{roughness} {cos}: {sum} {albedo}");
            }
        }
    }

    /// The formula in f64, with the values of a node.
    #[test]
    fn lobes_at_nodes_have_the_values_of_the_tables() {
        for (row, column) in [(2, 1), (5, 3), (8, 6), (10, 7)] {
            let lobe = seen((column as f64 / 8.0).powi(2), row as f32 / 10.0);
            let [r, a, b] = [&ALBEDO, &WIDTH, &LEAN].map(|table: &Table| f64::from(table[row][column]));
            assert!((f64::from(lobe.albedo) - r).abs() < 1e-5, "{row} {column}");
            for (cos, turn) in [(0.2, 0.3), (0.6, 3.0), (0.95, 1.5)] {
                let l = at(cos, turn);
                let [x, y, z] = l.to_array().map(f64::from);
                let length2 = (a * x + b * z).powi(2) + (a * y).powi(2) + z * z;
                let expected = r * z * a * a / (length2 * length2);
                let found = f64::from(lobe.reflect(l));
                assert!((found - expected).abs() < 1e-4 * expected, "{row} {column}: {found} {expected}");
            }
        }
    }

    /// The albedo of Cycles, measured in a white world. Roughness 0.25 is between the fitted ones.
    #[test]
    fn albedos_are_those_of_cycles() {
        const MEASURED: [(f32, f64, f32); 7] = [
            (0.25, 0.2, 0.171),
            (0.25, 0.3, 0.063),
            (0.25, 0.5, 0.007),
            (0.5, 0.2, 0.426),
            (0.5, 0.5, 0.155),
            (0.7, 0.3, 0.454),
            (1.0, 0.8, 0.392),
        ];
        for (roughness, cos, measured) in MEASURED {
            let found = seen(cos, roughness).albedo;
            assert!((found - measured).abs() < 0.015, "{roughness} {cos}: {found} {measured}");
        }
    }

    /// Beside the normal, lobes of viewers on opposite sides differ little.
    #[test]
    fn lobes_have_no_seam_at_the_normal() {
        let l = at(0.7, 0.0);
        let [here, there] =
            [0.0, TAU / 2.0].map(|turn| MicrofibreLobe::new(Vec3::Z, at(1.0 - 1e-6, turn), 0.8).reflect(l));
        assert!((here / there - 1.0).abs() < 2e-3, "{here} {there}");
        assert!(seen(1.0, 0.8).reflect(l) > 0.1);
    }

    #[test]
    fn light_from_below_is_not_reflected() {
        assert_eq!(seen(0.5, 0.5).reflect(at(-0.3, 1.0)), 0.0);
        assert_eq!(seen(0.5, 0.5).reflect(Vec3::X), 0.0);
    }
}
