//! Directions of the rays that lobes spawn, one for each of sixteen lobes, with the light of the environment from there. The
//! loops over the lobes are vectorised.

use glam::DVec3;

use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::layers::facets::{AnisotropicFacets, schlick};
use crate::integrator::material::directional_albedo::single_scattering_albedos;
use crate::integrator::material::ggx_lobe::{LOBE_LANES, Lobe, Lobe16, LobeBasis};
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use blinn_core::geometry::{Rgb, cos_sin_of_turns};
use blinn_core::simd::AutovecKernel;
use blinn_scene::Environment;

/// Lobes and the triangles that they are on.
#[derive(Clone, Copy)]
pub(crate) struct SampledLobes {
    lobes: Lobe16,
    /// Geometric normals.
    n_g: [[f64; LOBE_LANES]; 3],
}

impl SampledLobes {
    pub const ZERO: SampledLobes = SampledLobes { lobes: Lobe16::ZERO, n_g: [[0.0; LOBE_LANES]; 3] };

    /// Sets lobe `i`, on a triangle with geometric normal `n_g`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, lobe: &Lobe, n_g: DVec3) {
        self.lobes.set(i, lobe);
        set3(&mut self.n_g, i, n_g.to_array());
    }

    /// Lobe `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Lobe {
        self.lobes.get(i)
    }
}

/// A direction that each of the lobes reflects.
#[derive(Clone)]
pub(crate) struct LobeSamples {
    /// Unit directions on the side of the geometric normal.
    direction: [[f64; LOBE_LANES]; 3],
    /// The mean of weight × radiance over all samples is the radiance averaged over the lobe. 0 below the horizon.
    pub weight: [f32; LOBE_LANES],
    /// True for directions that the triangle hides, and not the microfacets.
    is_cut: [bool; LOBE_LANES],
    /// Solid angles in steradians that the samples stand for.
    pub solid_angle: [f32; LOBE_LANES],
    /// The light of the environment, looked up over a share of the solid angle ([`LOOKUP_SHARE`]). 0 without an environment.
    pub sharp_light: [Rgb; LOBE_LANES],
    /// The light looked up over all of the solid angle; 0 unless it was requested.
    pub filtered_light: [Rgb; LOBE_LANES],
}

impl LobeSamples {
    pub const ZERO: LobeSamples = LobeSamples {
        direction: [[0.0; LOBE_LANES]; 3],
        weight: [0.0; LOBE_LANES],
        is_cut: [false; LOBE_LANES],
        solid_angle: [0.0; LOBE_LANES],
        sharp_light: [Rgb::ZERO; LOBE_LANES],
        filtered_light: [Rgb::ZERO; LOBE_LANES],
    };

    /// The direction of sample `i`.
    #[inline(always)]
    pub fn direction(&self, i: usize) -> DVec3 {
        dvec3(&self.direction, i)
    }

    /// Sample `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> LobeSample {
        LobeSample {
            direction: self.direction(i),
            weight: self.weight[i],
            is_cut: self.is_cut[i],
            solid_angle: self.solid_angle[i],
            sharp_light: self.sharp_light[i],
            filtered_light: self.filtered_light[i],
        }
    }
}

/// One of [`LobeSamples`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeSample {
    pub direction: DVec3,
    pub weight: f32,
    /// True if the triangle hides the direction, and not the microfacets.
    pub is_cut: bool,
    pub solid_angle: f32,
    pub sharp_light: Rgb,
    pub filtered_light: Rgb,
}

/// Settings of [`LobeSample::of_facets`], as those of [`SampleLobes`].
pub(crate) struct SampleSettings<'a> {
    pub count: u32,
    pub environment: Option<&'a Environment>,
    pub ends_at_triangle: bool,
}

impl LobeSample {
    /// Samples a direction of anisotropic facets of reflectance `f0` at normal incidence, on a triangle with geometric normal
    /// `n_g`, for a point `u` of the unit square.
    pub fn of_facets(
        facets: &AnisotropicFacets,
        f0: f32,
        n_g: DVec3,
        u: [f32; 2],
        settings: &SampleSettings,
    ) -> LobeSample {
        let sampled = facets.sample(u);
        let expected = facets.single_scattering_albedo(f0);
        let weight = sampled.shadowing as f32 * schlick(f0, sampled.v_h);
        let is_cut = settings.ends_at_triangle && sampled.l.dot(n_g) <= 0.0;
        let direction = mirrored_to_side(sampled.l, n_g);
        let solid_angle = sampled.solid_angle(settings.count);
        let light = |solid_angle: f32| {
            settings.environment.map_or(Rgb::ZERO, |e| e.radiance(direction.as_vec3(), solid_angle))
        };
        LobeSample {
            direction,
            weight: if is_cut || !(expected > 0.0) { 0.0 } else { weight / expected },
            is_cut: is_cut && weight > 0.0,
            solid_angle,
            sharp_light: light(solid_angle * LOOKUP_SHARE as f32),
            filtered_light: light(solid_angle),
        }
    }
}

/// Computes [`LobeSamples`].
pub(crate) struct SampleLobes<'a> {
    pub lobes: &'a SampledLobes,
    /// The points of the unit square that directions are made from.
    pub u: &'a [[f32; LOBE_LANES]; 2],
    /// Samples of a lobe in all.
    pub count: u32,
    pub environment: Option<&'a Environment>,
    /// True if directions below the triangle count nothing; else they are mirrored.
    pub ends_at_triangle: bool,
    /// True if [`LobeSamples::filtered_light`] is wanted.
    pub has_filtered_light: bool,
    pub samples: &'a mut LobeSamples,
}

impl AutovecKernel for SampleLobes<'_> {
    #[inline(always)]
    fn run(self) {
        let SampleLobes { lobes, u, count, environment, ends_at_triangle, has_filtered_light, samples } =
            self;
        // Copies cannot alias what the loops write.
        let (lobes, u, count) = (*lobes, *u, count.max(1) as f32);
        let mut around = [[0.0; LOBE_LANES]; 2];
        for i in 0..LOBE_LANES {
            [around[0][i], around[1][i]] = cos_sin_of_turns(f64::from(u[0][i])).map(|x| x as f32);
        }
        let [alpha, f0] = [lobes.lobes.alpha(), lobes.lobes.f0()];
        let [mut cos, mut weight, mut solid_angle] = [[0.0; LOBE_LANES]; 3];
        let mut reflected = [[0.0; LOBE_LANES]; 3];
        for i in 0..LOBE_LANES {
            let view = lobes.lobes.facet_view(i);
            let sample = view.sample([around[0][i], around[1][i]], u[1][i], f0[i]);
            cos[i] = view.cos();
            set3(&mut reflected, i, sample.l.to_array());
            weight[i] = sample.weight;
            solid_angle[i] = sample.solid_angle(count);
        }
        let expected = single_scattering_albedos(&cos, &alpha, &f0);
        let mut directions = [[0.0; LOBE_LANES]; 3];
        let mut is_cut = [false; LOBE_LANES];
        for i in 0..LOBE_LANES {
            let lobe = lobes.get(i);
            let basis = LobeBasis::new(lobe.n, lobe.v);
            // The images in mirrors are exact.
            let mirrored = basis.to_world(basis.mirrored());
            let is_mirror = lobe.is_mirror();
            let l = if is_mirror { mirrored } else { vec3(&reflected, i).as_dvec3() };
            let n_g = dvec3(&lobes.n_g, i);
            set3(&mut directions, i, mirrored_to_side(l, n_g).to_array());
            let sampled = if is_mirror { 1.0 } else { weight[i] / expected[i] };
            let ends = ends_at_triangle & (l.dot(n_g) <= 0.0);
            is_cut[i] = ends & (sampled > 0.0);
            weight[i] = if ends { 0.0 } else { sampled };
            solid_angle[i] = if is_mirror { lobe.mirror_solid_angle() as f32 } else { solid_angle[i] };
        }
        let mut l = [[0.0; LOBE_LANES]; 3];
        let mut lookup_angle = [0.0; LOBE_LANES];
        for i in 0..LOBE_LANES {
            set3(&mut l, i, dvec3(&directions, i).as_vec3().to_array());
            lookup_angle[i] = solid_angle[i] * LOOKUP_SHARE as f32;
        }
        (samples.direction, samples.weight, samples.solid_angle) = (directions, weight, solid_angle);
        samples.is_cut = is_cut;
        if let Some(environment) = environment {
            samples.sharp_light = environment.radiance_of_lanes(&l, &lookup_angle);
            if has_filtered_light {
                samples.filtered_light = environment.radiance_of_lanes(&l, &solid_angle);
            }
        }
    }
}

/// `direction`, mirrored to the side that `n` points to: a tilted normal or a wide lobe may point below the triangle.
#[inline(always)]
pub(crate) fn mirrored_to_side(direction: DVec3, n: DVec3) -> DVec3 {
    let below = direction.dot(n).min(0.0);
    let mirrored = (direction - n * (2.0 * below)).normalize_or(n);
    if below < 0.0 { mirrored } else { direction }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use blinn_core::simd::SimdLevel;

    fn lobe(i: usize) -> Lobe {
        let alpha = [0.0, 0.001, 0.02, 0.3, 1.0][i % 5];
        let angle = 0.1 * i as f64;
        let v = DVec3::new(angle.sin(), angle.cos(), 0.0);
        Lobe { n: DVec3::Y, v, alpha, f0: [0.04, 0.9][i % 2] }
    }

    fn sample(simd: SimdLevel, environment: &Environment, u: [f32; 2]) -> LobeSamples {
        let mut lobes = SampledLobes::ZERO;
        // The last triangles lean away from their normals.
        (0..LOBE_LANES).for_each(|i| {
            let tilt = if i < 12 { 0.0 } else { 1.2 };
            lobes.set(i, &lobe(i), DVec3::new(tilt, 1.0, 0.1 * tilt).normalize());
        });
        let mut samples = LobeSamples::ZERO;
        simd.run(SampleLobes {
            lobes: &lobes,
            u: &[[u[0]; LOBE_LANES], [u[1]; LOBE_LANES]],
            count: 4,
            environment: Some(environment),
            ends_at_triangle: false,
            has_filtered_light: true,
            samples: &mut samples,
        });
        samples
    }

    #[test]
    fn samples_are_the_same_at_all_simd_levels() {
        let environment = Environment::from_function(32, 1, |d| d + Vec3::splat(1.5));
        let bits = |simd: SimdLevel| {
            let s = sample(simd, &environment, [0.3, 0.7]);
            format!("{:?}", (s.direction, s.weight, s.solid_angle, s.sharp_light, s.filtered_light))
        };
        for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported()) {
            assert_eq!(bits(simd), bits(SimdLevel::Portable), "{simd:?}");
        }
    }

    /// Rough facets reflect some light below the horizon, where they hide it. The triangle hides what they do not.
    #[test]
    fn triangles_cut_what_facets_let_pass() {
        let mut lobes = SampledLobes::ZERO;
        (0..LOBE_LANES).for_each(|i| {
            // The triangles of the second half are edge-on.
            let n_g = if i < LOBE_LANES / 2 { DVec3::Y } else { DVec3::NEG_X };
            let v = DVec3::new(-0.6, 0.8, 0.0);
            lobes.set(i, &Lobe { n: DVec3::Y, v, alpha: 1.0, f0: 0.9 }, n_g);
        });
        let mut samples = LobeSamples::ZERO;
        let spread: [f32; LOBE_LANES] = std::array::from_fn(|i| (i % 8) as f32 / 8.0 + 0.06);
        SimdLevel::Portable.run(SampleLobes {
            lobes: &lobes,
            u: &[[0.25; LOBE_LANES], spread],
            count: 4,
            environment: None,
            ends_at_triangle: true,
            has_filtered_light: false,
            samples: &mut samples,
        });
        let (level, edge_on) = samples.is_cut.split_at(LOBE_LANES / 2);
        assert!(level.iter().all(|is_cut| !is_cut), "{level:?}");
        assert!(edge_on.iter().any(|&is_cut| is_cut), "{edge_on:?}");
    }

    #[test]
    fn rays_leave_on_the_side_of_the_triangle() {
        for u in [[0.1, 0.2], [0.5, 0.9], [0.8, 0.99]] {
            let samples = sample(SimdLevel::Portable, &Environment::uniform(Rgb::ONE), u);
            for i in 0..LOBE_LANES {
                let d = samples.direction(i);
                assert!((d.length() - 1.0).abs() < 1e-6, "{i}: {d}");
                let tilt = if i < 12 { 0.0 } else { 1.2 };
                assert!(d.dot(DVec3::new(tilt, 1.0, 0.1 * tilt)) >= -1e-6, "{i}: {d}");
                if lobe(i).is_mirror() && i < 12 {
                    let Lobe { n, v, .. } = lobe(i);
                    assert!(d.distance(n * (2.0 * n.dot(v)) - v) < 1e-12 && samples.weight[i] == 1.0);
                }
            }
        }
    }

    /// The mean weight is 1: a white environment gives white.
    #[test]
    fn weights_have_a_mean_of_1() {
        let mut mean = [0.0; LOBE_LANES];
        let n = 64;
        for k in 0..n * n {
            let u = [k % n, k / n].map(|k| (k as f32 + 0.5) / n as f32);
            let samples = sample(SimdLevel::Portable, &Environment::uniform(Rgb::ONE), u);
            for (mean, weight) in mean.iter_mut().zip(samples.weight) {
                *mean += weight / (n * n) as f32;
            }
        }
        // At more grazing angles, the tables of albedo are interpolated.
        assert!(mean[..12].iter().all(|mean| (mean - 1.0).abs() < 0.01), "{mean:?}");
    }
}
