//! The lecture's coefficients of a material as a whole, for those who list materials.

use crate::integrator::material::coefficient_lanes::CoefficientLanes;
use crate::integrator::material::coefficients::{Coefficients, MaterialOverrides};
use crate::integrator::material::evaluator::{EvalMaterial, EvalSettings};
use crate::integrator::material::material_inputs::MaterialInputs;
use blinn_core::simd::AutovecKernel;
use blinn_scene::Material;

impl Coefficients {
    /// Returns the coefficients of a material's factors, with white textures and vertex colours, under constant ambient
    /// light and without reflections: where physical materials reflect, GGX lobes take the place of k_s and p.
    pub fn of_factors(material: &Material) -> Coefficients {
        let mut out = CoefficientLanes::ZERO;
        let settings = EvalSettings {
            overrides: &MaterialOverrides::default(),
            under_sky: false,
            reflections_enabled: false,
            unlit_scale: 1.0,
        };
        let inputs = MaterialInputs::new();
        let kernel = EvalMaterial { material, inputs: &inputs, has_color: false, settings, out: &mut out };
        AutovecKernel::run(kernel);
        out.get(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgb;
    use blinn_scene::{ColorInput, Dielectric, MtlReflectance, Reflectance, ScalarInput};

    fn material(base: Rgb, reflectance: Reflectance) -> Material {
        Material { base_color: ColorInput::new(base), reflectance, ..Material::default() }
    }

    /// Coefficients of MTL are literal; Ka stands in for Kd where a file has it.
    #[test]
    fn coefficients_of_mtl_are_those_of_the_file() {
        let [k_a, k_d, k_s] = [0.1, 0.5, 0.25].map(Rgb::splat);
        for ambient in [None, Some(ColorInput::new(k_a))] {
            let mtl = MtlReflectance { ambient, specular: ColorInput::new(k_s), shininess: 32.0, ior: 0.0 };
            let k = Coefficients::of_factors(&material(k_d, Reflectance::Mtl(mtl)));
            let expected = ambient.map_or(k_d, |_| k_a);
            assert_eq!((k.k_a, k.k_d, k.k_s, k.shininess), (expected, k_d, k_s, 32.0));
        }
    }

    /// Roughness 0.5 is α = 0.25 and p = 2/α² − 2 = 30; F0 of index 1.5 is 0.04.
    #[test]
    fn physical_materials_are_converted() {
        let reflectance = Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(0.5),
            dielectric: Dielectric::default(),
        };
        let k = Coefficients::of_factors(&material(Rgb::splat(0.5), reflectance));
        let is_near = |found: f32, expected: f32| (found / expected - 1.0).abs() < 1e-5;
        assert!(is_near(k.shininess, 30.0), "{k:?}");
        assert!(is_near(k.k_s.x, 0.04 * 0.75 * 32.0 / 8.0), "{k:?}");
        assert!(is_near(k.k_d.x, 0.5 * 0.96 + 0.35 * 0.04 * 0.25), "{k:?}");
        assert_eq!(k.k_a, Rgb::splat(0.5));
    }
}
