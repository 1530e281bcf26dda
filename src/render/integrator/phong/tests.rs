use super::*;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::surface::soa::vec3;

/// All points of the block see the light in one direction; every second one faces away.
#[test]
fn points_that_face_away_from_a_light_get_none_of_it_however_strong() {
    let mut points = PointsSoa::default();
    let (block, _) = points.append(LANES);
    for i in 0..LANES {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        block.n_v[2][i] = side;
        block.n[2][i] = side;
    }
    let k = Coefficients { k_a: Rgb::ZERO, ..Coefficients::matte(Rgb::ONE, 1.0) };
    for (intensity, lights) in [(1.0, true), (f32::INFINITY, true), (0.0, false), (-1.0, false)] {
        let light = PosedLight::sun(DVec3::NEG_Z, Rgb::splat(intensity));
        for (block, _) in points.blocks_mut() {
            for i in 0..LANES {
                block.set_material(i, block.n(i), &k, Rgb::ZERO);
            }
        }
        let mut shadow_rays = Vec::new();
        DirectLightKernel {
            points: &mut points,
            light: &light,
            index: 0,
            choice: &LightChoice::ALL,
            has_specular: false,
            has_shadow_catcher: false,
            separates_specular: false,
            shadow_rays: &mut shadow_rays,
        }
        .run();
        points.blocks_mut().for_each(|(block, _)| block.accumulate());
        let lit: Vec<usize> = (0..LANES).step_by(2).filter(|_| lights).collect();
        assert_eq!(shadow_rays.iter().map(|ray| ray.point).collect::<Vec<_>>(), lit, "{intensity}");
        for i in 0..LANES {
            let expected = if lit.contains(&i) { intensity } else { 0.0 };
            let (block, lane) = points.lane(i);
            assert_eq!(vec3(&block.radiance, lane), Rgb::splat(expected), "{intensity} {i}");
        }
    }
}
