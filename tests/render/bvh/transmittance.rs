//! Transmittance: light through translucent surfaces.

use std::sync::atomic::{AtomicUsize, Ordering};

use blinn::accel::{Accel, AccelSettings, Coherence, HitFilter, Preset, ShadowRayBatch};
use blinn::geometry::HitId;
use blinn::integrator::MaterialHitFilter;
use blinn::scene::{ColorInput, Material, ScalarInput, Scene, SurfaceClass, Volume};
use glam::{DAffine3, DVec3, Vec3};

use super::{FLATTENED, layers};
use crate::common::scenes::{self, Rng};

/// Every surface transmits half of the light.
struct Halved;

impl HitFilter for Halved {
    fn accepts(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmittance(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::splat(0.5)
    }
}

/// [`Halved`], with a count of its calls.
#[derive(Default)]
struct Counted(AtomicUsize);

impl HitFilter for Counted {
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        Halved.accepts(id, o, d)
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Vec3 {
        self.0.fetch_add(1, Ordering::Relaxed);
        Halved.transmittance(id, o, d)
    }
}

/// Transmittance stops where no light is left: of a thousand panes that each halve it, only so many are
/// evaluated. A few panes transmit the product of their factors.
#[test]
fn transmittance_stops_where_no_light_is_left() {
    for (panes, left, most) in [(17, 0.5f32.powi(17), 17), (18, 0.0, 18), (1000, 0.0, 19)] {
        let mut scene = Scene::default();
        let placed: Vec<_> =
            (0..panes).map(|i| DAffine3::from_translation(DVec3::Z * 0.01 * f64::from(i))).collect();
        scenes::add(
            &mut scene,
            scenes::grid(1, 2),
            scenes::material(SurfaceClass::Translucent, true),
            &placed,
        );
        let posed = scenes::posed(&scene);
        let (near, far) = (DVec3::new(0.1, 0.2, -1.0), DVec3::new(0.1, 0.2, 11.0));
        let [light, far] = [near, far].map(|p| (p - posed.centre).as_vec3());
        for (simd, flatten) in scenes::simd_levels().flat_map(|simd| FLATTENED.map(|flatten| (simd, flatten)))
        {
            let settings = AccelSettings { preset: Preset::Medium, simd, flatten };
            let accel = Accel::build(&posed, &settings).0;
            for shared in [Coherence::None, Coherence::Origin(light), Coherence::Direction(-Vec3::Z)] {
                let mut segments = ShadowRayBatch { coherence: shared, ..ShadowRayBatch::default() };
                (0..40).for_each(|i| segments.push(far + Vec3::X * 0.01 * i as f32, light, HitId::NONE));
                let (asked, mut free) = (Counted::default(), Vec::new());
                accel.transmittance(&segments, &asked, &mut free);
                assert!(free.iter().all(|&free| free == Vec3::splat(left)), "{simd:?} {shared:?}: {free:?}");
                // Rays that leave a packet may evaluate one pane twice.
                let asked = asked.0.into_inner();
                assert!(asked <= 2 * 40 * most, "{panes} {simd:?} {flatten:?} {shared:?}: {asked}");
            }
        }
    }
}

/// A translucent sheet attenuates once, also on its edges and vertices: for any ray and winding, in the world
/// BVH and in a BLAS of its own.
#[test]
fn a_translucent_sheet_is_one_layer_also_at_edges() {
    let mut rng = Rng::new(5);
    let mut bumpy = scenes::grid(4, 2);
    for p in &mut bumpy.positions {
        p.z = rng.below(5) as f32 * 0.25;
    }
    let fan = scenes::fan(16, DVec3::Z, &mut rng);
    let turned = DAffine3::from_rotation_y(1.0) * DAffine3::from_rotation_x(0.5);
    let mut on_edges = 0;
    let here = DAffine3::IDENTITY;
    let sheets = [(scenes::grid(4, 2), here), (bumpy, here), (fan.clone(), here), (fan, turned)];
    for (mesh, placed) in sheets {
        let mut scene = Scene::default();
        let beside = DAffine3::from_translation(DVec3::X * 100.0) * placed;
        scenes::add(&mut scene, mesh, scenes::material(SurfaceClass::Translucent, true), &[placed, beside]);
        let posed = scenes::posed(&scene);
        // Vertices and midpoints of edges: those of one triangle only are on the sheet's border.
        let triangles = (0..posed.mesh(0).triangles.len() as u32)
            .map(|triangle| posed.world_triangle(HitId { instance: 0, triangle }))
            .collect::<Vec<_>>();
        let places: Vec<Vec3> =
            triangles.iter().flat_map(|v| [v[0], 0.5 * (v[0] + v[1]), 0.5 * (v[1] + v[2])]).collect();
        let middle = (placed.transform_point3(DVec3::ZERO) - posed.centre).as_vec3();
        let inside = |p: &&Vec3| (**p - middle).abs().max_element() < 0.6;
        let normal = placed.transform_vector3(DVec3::Z).as_vec3();
        let eye = middle + 4.0 * normal + Vec3::new(0.125, 0.25, 0.0);
        let through: Vec<&Vec3> = places.iter().filter(inside).collect();
        for flatten in FLATTENED {
            for simd in scenes::simd_levels() {
                let settings = AccelSettings { preset: Preset::Medium, simd, flatten };
                let accel = Accel::build(&posed, &settings).0;
                let from_eye: Vec<_> = through.iter().map(|&&p| (eye, p - eye)).collect();
                let along: Vec<_> = through.iter().map(|&&p| (p + 4.0 * normal, -normal)).collect();
                let all = [
                    (Coherence::Origin(eye), &from_eye),
                    (Coherence::None, &from_eye),
                    (Coherence::Direction(-normal), &along),
                    (Coherence::None, &along),
                ];
                for (shared, rays) in all {
                    for (found, ray) in layers(&accel, rays, false, shared).iter().zip(rays) {
                        assert_eq!(found.len(), 2, "{ray:?} {flatten:?} {simd:?} {shared:?}: {found:?}");
                        on_edges += 1;
                    }
                }
                let mut segments =
                    ShadowRayBatch { coherence: Coherence::Origin(eye), ..ShadowRayBatch::default() };
                from_eye.iter().for_each(|&(o, d)| segments.push(o + 2.0 * d, eye, HitId::NONE));
                let mut light = Vec::new();
                accel.transmittance(&segments, &Halved, &mut light);
                assert!(light.iter().all(|l| *l == Vec3::splat(0.5)), "{light:?}");
            }
        }
    }
    assert!(on_edges > 1000, "{on_edges}");
}

/// A body absorbs light by the distance that a shadow ray travels inside (Beer's law), whatever the direction of the ray and
/// also if its transform mirrors it.
#[test]
fn bodies_absorb_by_distance() {
    let attenuation_color = Vec3::new(0.25, 0.5, 1.0);
    let glass = Material {
        base_color: ColorInput::new(Vec3::ONE),
        transmission: ScalarInput::new(1.0),
        volume: Some(Volume { thickness: 1.0, attenuation_color, attenuation_distance: 2.0 }),
        double_sided: true,
        ..Material::default()
    };
    let mut scene = Scene::default();
    for scale in [DVec3::new(1.0, 1.0, 0.5), DVec3::new(-1.0, 1.0, 0.5)] {
        let aside = DAffine3::from_translation(DVec3::X * scale.x * 4.0);
        scenes::add(&mut scene, scenes::cube(2), glass.clone(), &[aside * DAffine3::from_scale(scale)]);
    }
    for i in 0..2 {
        let mesh = scene.instances[i].mesh as usize;
        scene.meshes[mesh].is_body = true;
    }
    let posed = scenes::posed(&scene);
    // (x, z) of both ends, and the distance inside.
    let segments = [
        ([4.1, 3.0], [4.1, -3.0], 1.0),
        ([-4.1, 3.0], [-4.1, -3.0], 1.0),
        ([-4.1, -3.0], [-4.1, 3.0], 1.0),
        ([4.1, 0.0], [4.1, 3.0], 0.5),
        ([4.1, 3.0], [4.1, 0.25], 0.25),
    ];
    for (simd, flatten) in scenes::simd_levels().flat_map(|simd| FLATTENED.map(|flatten| (simd, flatten))) {
        let settings = AccelSettings { preset: Preset::Medium, simd, flatten };
        let accel = Accel::build(&posed, &settings).0;
        for ([x0, z0], [x1, z1], distance) in segments {
            let at = |x: f64, z: f64| (DVec3::new(x, 0.2, z) - posed.centre).as_vec3();
            let (from, light) = (at(x0, z0), at(x1, z1));
            for coherence in [Coherence::None, Coherence::Origin(light)] {
                let mut segments = ShadowRayBatch { coherence, ..ShadowRayBatch::default() };
                (0..20).for_each(|_| segments.push(from, light, HitId::NONE));
                let mut left = Vec::new();
                accel.transmittance(&segments, &MaterialHitFilter(&posed), &mut left);
                let expected = attenuation_color.powf(distance / 2.0);
                assert!(
                    left.iter().all(|left| left.abs_diff_eq(expected, 1e-5)),
                    "{x0} {z0} {z1} {simd:?} {coherence:?}: {left:?}, not {expected}"
                );
            }
        }
    }
}
