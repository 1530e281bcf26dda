//! Reflected and refracted rays: mirrors, and bodies of glass.

use blinn::accel::{Accel, AccelSettings, SimdLevel};
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    ColorInput, Dielectric, Environment, Lighting, Material, Mesh, PosedLight, Projection, Reflectance,
    Reflection, ScalarInput, Scene, View,
};
use glam::{DAffine3, DVec3};

use crate::common::scenes;

/// A smooth ball of unit radius.
fn ball() -> Mesh {
    scenes::ball(128, 64)
}

fn physical(color: Rgb, metallic: f32, roughness: f32, specular: f32) -> Material {
    Material {
        base_color: ColorInput::new(color),
        reflectance: Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(metallic),
            roughness: ScalarInput::new(roughness),
            dielectric: Dielectric { specular: ScalarInput::new(specular), ..Dielectric::default() },
        },
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    }
}

fn glass(roughness: f32) -> Material {
    Material { transmission: ScalarInput::new(1.0), ..physical(Rgb::ONE, 0.0, roughness, 1.0) }
}

fn light(color: f32) -> Material {
    Material { reflectance: Reflectance::Unlit, ..physical(Rgb::splat(color), 0.0, 1.0, 0.0) }
}

/// Where a picture is taken from, and what is around the scene.
struct Shot {
    view_point: DVec3,
    view_dir: DVec3,
    width: f64,
    environment: Option<Environment>,
    samples: u32,
    bounces: u8,
    has_sun: bool,
    ambient_occlusion: Option<AmbientOcclusion>,
}

const SIDE: u32 = 12;

impl Shot {
    fn along_z(width: f64) -> Shot {
        let (view_point, view_dir) = (DVec3::Z * 5.0, DVec3::NEG_Z);
        Shot {
            view_point,
            view_dir,
            width,
            environment: None,
            samples: 1,
            bounces: 4,
            has_sun: true,
            ambient_occlusion: None,
        }
    }

    fn take(&self, scene: &Scene) -> Vec<Rgba> {
        self.take_with(scene, AccelSettings::default(), 16)
    }

    fn take_with(&self, scene: &Scene, build: AccelSettings, tile: u32) -> Vec<Rgba> {
        let posed = scenes::posed(scene);
        let (accel, _) = Accel::build(&posed, &build);
        let view = View {
            view_point: Some(self.view_point),
            view_dir: Some(self.view_dir),
            projection: Some(Projection::Orthographic),
            view_width: Some(self.width),
            view_height: Some(self.width),
            ..View::default()
        };
        let (camera, _) = view.resolve(&posed, SIDE, SIDE).unwrap();
        let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
        let sun = PosedLight::sun(DVec3::new(0.6, -0.2, 0.75), Rgb::new(1.0, 0.9, 0.8));
        let frame = Frame {
            lights: if self.has_sun { vec![sun] } else { Vec::new() },
            ambient: Rgb::ZERO,
            environment: self.environment.clone(),
            bounces: self.bounces,
            shadows: false,
            ambient_occlusion: self.ambient_occlusion,
            ..Frame::new(&posed, &accel, camera, &lit)
        };
        let settings =
            RenderSettings { width: SIDE, height: SIDE, samples: self.samples, tile, ..Default::default() };
        render(&frame, &Phong::default(), &settings, &()).unwrap().colors
    }
}

fn at(x: f64, y: f64, z: f64, scale: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z)) * DAffine3::from_scale(DVec3::splat(scale))
}

/// A matte ball at (3, 0, 3), and a mirror in the plane z = 0.
fn mirror_scene(with_mirror: bool) -> Scene {
    let mut scene = Scene::default();
    scenes::add(
        &mut scene,
        ball(),
        physical(Rgb::new(0.8, 0.5, 0.3), 0.0, 1.0, 0.0),
        &[at(3.0, 0.0, 3.0, 2.0)],
    );
    if with_mirror {
        scenes::add(
            &mut scene,
            scenes::grid(1, 2),
            physical(Rgb::ONE, 1.0, 0.0, 1.0),
            &[at(0.0, 0.0, 0.0, 3.0)],
        );
    }
    scene
}

#[test]
fn a_plane_mirror_shows_what_a_mirrored_camera_sees() {
    let shot = Shot {
        view_point: DVec3::new(-2.0, 0.0, 2.0),
        view_dir: DVec3::new(1.0, 0.0, -1.0),
        ..Shot::along_z(1.2)
    };
    let seen = shot.take(&mirror_scene(true));
    let behind =
        Shot { view_point: DVec3::new(-2.0, 0.0, -2.0), view_dir: DVec3::new(1.0, 0.0, 1.0), ..shot };
    let mirrored = behind.take(&mirror_scene(false));
    assert!(mirrored.iter().all(|p| p.x > 0.05), "the ball is lit: {mirrored:?}");
    let side = SIDE as usize;
    for (i, p) in seen.iter().enumerate() {
        let q = mirrored[i / side * side + side - 1 - i % side];
        assert!(p.truncate().abs_diff_eq(q.truncate(), 1e-5), "{i}: {p} {q}");
    }
}

#[test]
fn without_bounces_nothing_is_reflected() {
    let shot = Shot {
        view_point: DVec3::new(-2.0, 0.0, 2.0),
        view_dir: DVec3::new(1.0, 0.0, -1.0),
        ..Shot::along_z(1.2)
    };
    let dark = Shot { bounces: 0, ..shot }.take(&mirror_scene(true));
    assert!(dark.iter().all(|p| p.truncate().max_element() < 0.01), "{dark:?}");
}

/// Between two mirrors that face each other, a path ends after the maximum number of reflections.
#[test]
fn facing_mirrors_end_at_the_limit() {
    let mut scene = Scene::default();
    let mirror = physical(Rgb::ONE, 1.0, 0.0, 1.0);
    let mirrors = [at(0.0, 0.0, 0.0, 3.0), at(0.0, 0.0, 9.0, 3.0)];
    scenes::add(&mut scene, scenes::grid(1, 2), mirror, &mirrors);
    for bounces in [1, u8::MAX] {
        let environment = Some(Environment::uniform(Rgb::ONE));
        let shot = Shot { environment, bounces, has_sun: false, ..Shot::along_z(1.0) };
        let pixels = shot.take(&scene);
        assert!(pixels.iter().all(|p| p.truncate().abs_diff_eq(Rgb::ONE, 1e-4)), "{bounces}: {pixels:?}");
    }
}

/// A ball of glass, solid or a thin shell, and a small light behind it, `distance` from its centre.
fn lens_scene(is_body: bool, distance: f64) -> Scene {
    let mut scene = Scene::default();
    scenes::add(&mut scene, ball(), glass(0.0), &[DAffine3::IDENTITY]);
    let mesh = scene.instances[0].mesh as usize;
    scene.meshes[mesh].is_body = is_body;
    scenes::add(&mut scene, scenes::grid(1, 2), light(1.0), &[at(0.0, 0.0, -distance, 0.025)]);
    scene
}

/// A ball of index n has the focal length n R / (2 (n − 1)), from its centre: 1.5 for glass of unit radius.
#[test]
fn a_ball_of_glass_focuses_at_its_focal_length() {
    let lit = |is_body: bool, distance: f64| {
        let pixels = Shot::along_z(0.3).take(&lens_scene(is_body, distance));
        pixels.iter().filter(|p| p.x > 0.9).count()
    };
    let all = (SIDE * SIDE) as usize;
    assert_eq!(lit(true, 1.5), all);
    assert!(lit(true, 1.95) < all / 2);
    assert!(lit(true, 1.1) < all / 2);
    assert!(lit(false, 1.5) < all / 8, "thin walls do not refract");
}

/// Under a white sky, glass that neither absorbs nor loses light is white.
#[test]
fn glass_in_a_white_furnace_is_white() {
    for roughness in [0.0, 0.2, 0.5, 1.0] {
        let mut scene = Scene::default();
        scenes::add(&mut scene, ball(), glass(roughness), &[DAffine3::IDENTITY]);
        let mesh = scene.instances[0].mesh as usize;
        scene.meshes[mesh].is_body = true;
        let environment = Some(Environment::uniform(Rgb::ONE));
        let shot = Shot { environment, samples: 16, has_sun: false, ..Shot::along_z(1.4) };
        let pixels = shot.take(&scene);
        let mean = pixels.iter().map(|p| p.truncate()).sum::<Rgb>() / pixels.len() as f32;
        assert!((mean - 1.0).abs().max_element() < 0.01, "roughness {roughness}: {mean}");
    }
}

#[test]
fn reflections_do_not_depend_on_threads_tiles_or_simd_levels() {
    let mut scene = mirror_scene(true);
    scenes::add(&mut scene, ball(), glass(0.3), &[at(0.0, 0.0, 1.0, 0.4)]);
    let mesh = scene.instances[2].mesh as usize;
    scene.meshes[mesh].is_body = true;
    let environment = Some(Environment::uniform(Rgb::new(0.2, 0.3, 0.4)));
    let shot = Shot { environment, samples: 4, view_dir: DVec3::new(0.2, 0.1, -1.0), ..Shot::along_z(2.5) };
    let bits = |simd: SimdLevel, tile: u32| {
        let pixels = shot.take_with(&scene, AccelSettings { simd, ..AccelSettings::default() }, tile);
        pixels.iter().flat_map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    let expected = bits(AccelSettings::default().simd, 16);
    for tile in [1, 5] {
        assert!(bits(AccelSettings::default().simd, tile) == expected, "tiles of {tile}");
    }
    for simd in scenes::simd_levels() {
        assert!(bits(simd, 16) == expected, "{simd:?}");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let pixels = pool.install(|| bits(AccelSettings::default().simd, 4));
        assert!(pixels == expected, "{threads} threads");
    }
}

/// A floor of black plastic under a black ceiling reflects nothing, though the sky around is white. Ambient occlusion shows
/// that also where a lobe is weak and wide.
#[test]
fn weak_lobes_are_occluded_with_ambient_occlusion() {
    let mut scene = Scene::default();
    let black = |specular| physical(Rgb::ZERO, 0.0, 0.6, specular);
    scenes::add(&mut scene, scenes::grid(1, 2), black(1.0), &[at(0.0, 0.0, 0.0, 1.0)]);
    scenes::add(&mut scene, scenes::grid(1, 2), black(0.0), &[at(0.0, 0.0, 1.0, 100.0)]);
    let environment = Some(Environment::uniform(Rgb::ONE));
    let open =
        Shot { view_point: DVec3::Z * 0.5, environment, samples: 16, has_sun: false, ..Shot::along_z(1.0) };
    let mean =
        |shot: &Shot, scene: &Scene| shot.take(scene).iter().map(|p| p.x).sum::<f32>() / (SIDE * SIDE) as f32;
    assert!((mean(&open, &scene) - 0.04).abs() < 0.01, "{}", mean(&open, &scene));
    let ambient_occlusion = Some(AmbientOcclusion { samples: 16, distance: f64::INFINITY });
    let occluded = Shot { ambient_occlusion, ..open };
    assert!(mean(&occluded, &scene) < 1e-4, "{}", mean(&occluded, &scene));
    scene.nodes[1].visible = false;
    assert!((mean(&occluded, &scene) - 0.04).abs() < 0.01, "{}", mean(&occluded, &scene));
}
