//! A sheen of fibres (KHR_materials_sheen): the “Charlie” distribution of Estevez and Kulla, “Production Friendly Microfacet
//! Sheen BRDF”, 2017, or the microfibres of Cycles.

use std::f32::consts::{PI, TAU};
use std::sync::OnceLock;

use glam::Vec3;

use crate::integrator::layers::microfibres::MicrofibreLobe;
use crate::integrator::material::table_place::table_place;
use blinn_core::geometry::Rgb;
use blinn_scene::SheenModel;

/// Nodes of the table of albedos, by roughness and by the square root of the cosine to the viewer.
const NODES: usize = 24;
/// Steps of the integration of an albedo, by the square root of the cosine to the light and by the angle between light and viewer.
const STEPS: u32 = 48;
/// Smallest cosine to viewer and light.
const MIN_COS: f32 = 1e-3;
/// Smallest perceptual roughness. Fibres along the normal reflect light at grazing angles only.
const MIN_ROUGHNESS: f32 = 0.07;

/// A sheen at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheen {
    pub color: Rgb,
    /// Perceptual roughness.
    pub roughness: f32,
    pub model: SheenModel,
}

/// A sheen seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SheenLobe {
    color: Rgb,
    fibres: FibreLobe,
    /// Share of the light that is reflected, by colour.
    pub albedo: Rgb,
    /// Share of the light that reaches the layers below.
    pub below: f32,
}

impl Sheen {
    /// The lobe around the normal `n`, seen from the unit direction `v`.
    pub fn lobe(&self, n: Vec3, v: Vec3) -> SheenLobe {
        let (of_white, fibres) = match self.model {
            SheenModel::Charlie => {
                let fibres = Fibres::new(self.roughness);
                (albedo(n.dot(v), self.roughness), FibreLobe::Charlie { n, v, fibres })
            }
            SheenModel::Microfibres => {
                let lobe = MicrofibreLobe::new(n, v, self.roughness);
                (lobe.albedo, FibreLobe::Microfibres(lobe))
            }
        };
        let albedo = self.color * of_white;
        // The same share of all colours: what is left would have the inverse colour.
        let below = (1.0 - albedo.max_element()).max(0.0);
        SheenLobe { color: self.color, fibres, albedo, below }
    }
}

impl SheenLobe {
    /// π f cos: the share of the lecture's irradiance from direction `l` that the fibres reflect.
    pub fn reflect(&self, l: Vec3) -> Rgb {
        self.color * self.fibres.reflect(l)
    }
}

/// White fibres seen from a direction.
#[derive(Clone, Copy, Debug)]
enum FibreLobe {
    Charlie { n: Vec3, v: Vec3, fibres: Fibres },
    Microfibres(MicrofibreLobe),
}

impl FibreLobe {
    /// π f cos for the direction `l` of light.
    fn reflect(&self, l: Vec3) -> f32 {
        match self {
            FibreLobe::Charlie { n, v, fibres } => {
                let h = l + *v;
                let (n_l, h2) = (n.dot(l), h.length_squared());
                if !(n_l > 0.0 && h2 > 0.0) {
                    return 0.0;
                }
                let sin2 = (n.cross(h).length_squared() / h2).min(1.0);
                fibres.reflect(sin2, n_l, n.dot(*v))
            }
            FibreLobe::Microfibres(lobe) => lobe.reflect(l),
        }
    }
}

/// The Charlie distribution of fibres.
#[derive(Clone, Copy, Debug)]
struct Fibres {
    inverse_alpha: f32,
    /// a to e of Λ.
    lambda: [f32; 5],
}

impl Fibres {
    fn new(roughness: f32) -> Fibres {
        let roughness = roughness.clamp(MIN_ROUGHNESS, 1.0);
        let alpha = roughness * roughness;
        let t = (1.0 - alpha) * (1.0 - alpha);
        let mix = |rough: f32, smooth: f32| rough + (smooth - rough) * t;
        let lambda = [
            mix(21.5473, 25.3245),
            mix(3.82987, 3.32435),
            mix(0.19823, 0.16801),
            mix(-1.97760, -1.27393),
            mix(-4.32054, -4.85967),
        ];
        Fibres { inverse_alpha: 1.0 / alpha, lambda }
    }

    /// Λ of the shadowing for a direction at cosine `cos` to the normal.
    fn shadowing(&self, cos: f32) -> f32 {
        let [a, b, c, d, e] = self.lambda;
        let l = |x: f32| a / (1.0 + b * libm::powf(x, c)) + d * x + e;
        libm::expf(if cos < 0.5 { l(cos) } else { 2.0 * l(0.5) - l(1.0 - cos) })
    }

    /// π D G / (4 n·v), given the sine² of the half vector.
    fn reflect(&self, sin2_h: f32, n_l: f32, n_v: f32) -> f32 {
        let [n_l, n_v] = [n_l, n_v].map(|cos| cos.clamp(MIN_COS, 1.0));
        self.reflect_shadowed(sin2_h, n_v, 1.0 + self.shadowing(n_v) + self.shadowing(n_l))
    }

    fn reflect_shadowed(&self, sin2_h: f32, n_v: f32, shadowing: f32) -> f32 {
        let pi_d = 0.5 * (2.0 + self.inverse_alpha) * libm::powf(sin2_h, 0.5 * self.inverse_alpha);
        pi_d / (4.0 * n_v * shadowing)
    }

    /// The share of light from all directions that is reflected to a viewer at cosine `n_v`.
    fn albedo(&self, n_v: f32) -> f32 {
        let n_v = n_v.clamp(MIN_COS, 1.0);
        let of_view = 1.0 + self.shadowing(n_v);
        let sin_v = (1.0 - n_v * n_v).sqrt();
        let mut sum = 0.0;
        for i in 0..STEPS {
            let root = (i as f32 + 0.5) / STEPS as f32;
            let n_l = root * root;
            let sin_l = (1.0 - n_l * n_l).sqrt();
            let shadowing = of_view + self.shadowing(n_l.max(MIN_COS));
            for j in 0..STEPS {
                let (_, cos_turn) = libm::sincosf((j as f32 + 0.5) / STEPS as f32 * PI);
                let h_z = n_l + n_v;
                let h2 = 2.0 + 2.0 * (n_l * n_v + sin_l * sin_v * cos_turn);
                let sin2 = (1.0 - h_z * h_z / h2).clamp(0.0, 1.0);
                // Both sides of the plane of the viewer, and d(n·l) = 2 √(n·l) d√(n·l).
                sum += self.reflect_shadowed(sin2, n_v, shadowing) * 2.0 * root;
            }
        }
        sum * TAU / PI / (STEPS * STEPS) as f32
    }
}

/// The albedo E of white Charlie fibres of a perceptual roughness, seen at cosine `cos`: linear between the nodes of a table.
fn albedo(cos: f32, roughness: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let node = |i: usize| i as f32 / (NODES - 1) as f32;
    let table = TABLE.get_or_init(|| {
        (0..NODES * NODES).map(|k| Fibres::new(node(k / NODES)).albedo(node(k % NODES).powi(2))).collect()
    });
    let (row, y) = table_place(roughness, NODES);
    let (column, x) = table_place(cos.max(0.0).sqrt(), NODES);
    let at = |row: usize| {
        let nodes = &table[row * NODES + column..][..2];
        nodes[0] + (nodes[1] - nodes[0]) * x
    };
    let [upper, lower] = [at(row), at(row + 1)];
    (upper + (lower - upper) * y).clamp(0.0, 1.0)
}
