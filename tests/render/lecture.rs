//! Every formula of the lecture, with known answers.

use blinn::accel::{Accel, AccelSettings, RoundSizes};
use blinn::geometry::Rgb;
use blinn::integrator::{Frame, MaterialOverrides, Phong, Stage};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Camera, ColorInput, Instance, LightProfile, LocalTransform, Material, Mesh, MtlReflectance, Node,
    Photometry, PoseSettings, PosedLight, PosedLightKind, Projection, Reflectance, Scene, SkyIrradiance,
    View, pose,
};
use glam::{DQuat, DVec3, Vec3};

/// A material with the lecture's own coefficients.
fn material(k_a: Rgb, k_d: Rgb, k_s: Rgb, p: f32) -> Material {
    Material {
        base_color: ColorInput::new(k_d),
        reflectance: Reflectance::Mtl(MtlReflectance {
            ambient: Some(ColorInput::new(k_a)),
            specular: ColorInput::new(k_s),
            shininess: p,
            ior: 0.0,
        }),
        double_sided: true,
        ..Default::default()
    }
}

/// A square of side 2 in the xy plane, facing +z.
fn square() -> Mesh {
    Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

/// Squares at these translations and rotations, all of one material.
fn squares(at: &[(DVec3, DQuat)], material: Material) -> Scene {
    let mut scene = Scene { materials: vec![material], meshes: vec![square()], ..Default::default() };
    for (i, &(translation, rotation)) in at.iter().enumerate() {
        let local = LocalTransform::Trs { translation, rotation, scale: DVec3::ONE };
        scene.nodes.push(Node { local, visible: true, ..Default::default() });
        let object = i as u32 + 1;
        scene.instances.push(Instance { node: i as u32, mesh: 0, object, ..Instance::default() });
    }
    scene
}

const FLAT: (DVec3, DQuat) = (DVec3::ZERO, DQuat::IDENTITY);

/// The radiance L at the origin, seen from `eye` slightly off the square's diagonal.
fn radiance(scene: &Scene, eye: DVec3, lights: &[PosedLight], ambient: Rgb, stage: Stage) -> Vec3 {
    radiance_under_sky(scene, eye, lights, ambient, None, stage)
}

/// The radiance under an environment map.
fn radiance_under_sky(
    scene: &Scene,
    eye: DVec3,
    lights: &[PosedLight],
    ambient: Rgb,
    sky: Option<SkyIrradiance>,
    stage: Stage,
) -> Vec3 {
    let settings = PoseSettings { centre: Some(DVec3::ZERO), ..Default::default() };
    let posed = pose(scene, &settings).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let view =
        View { view_point: Some(eye), look_at: Some(DVec3::ZERO), yfov: Some(0.1), ..Default::default() };
    let (camera, _) = view.resolve(&posed, 1, 1).unwrap();
    let frame = Frame {
        posed: &posed,
        accel: &accel,
        camera,
        lights: lights.to_vec(),
        area_lights: Vec::new(),
        rounds: RoundSizes::NONE,
        emitters: None,
        ambient,
        sky,
        overrides: MaterialOverrides::default(),
        cull_back_faces: true,
        shadows: true,
        unlit_scale: 1.0,
        ambient_occlusion: None,
        ground: None,
        environment: None,
        background: None,
        bounces: 0,
        indirect: 0,
        caustics: false,
        scene_to_world: glam::DAffine3::IDENTITY,
    };
    let settings = RenderSettings { width: 1, height: 1, samples: 1, ..Default::default() };
    let pixels = render(&frame, &Phong { stage }, &settings, &()).unwrap();
    assert_eq!(pixels.colors[0].w, 1.0, "the square covers the pixel");
    pixels.colors[0].truncate()
}

fn white() -> Material {
    material(Rgb::ZERO, Rgb::ONE, Rgb::ZERO, 1.0)
}

fn point(position: DVec3, i: f32) -> PosedLight {
    PosedLight::point(position.as_vec3(), Rgb::splat(i))
}

#[track_caller]
fn close(actual: f32, expected: f64, tolerance: f64) {
    let error = (f64::from(actual) / expected - 1.0).abs();
    assert!(error <= tolerance, "{actual} is not {expected}: relative error {error:e}");
}

const EYE: DVec3 = DVec3::new(0.0, 0.0, 5.0);

/// k_a weighs I_a, the lecture's constant ambient light. An environment map is reflected by k_d instead,
/// since many exporters write no Ka.
#[test]
fn a_sky_is_reflected_by_the_diffuse_colour() {
    let k_a = Rgb::new(0.0, 0.2, 0.2);
    let k_d = Rgb::new(0.5, 0.25, 0.125);
    let light = Rgb::new(2.0, 1.0, 4.0);
    let scene = squares(&[FLAT], material(k_a, k_d, Rgb::ZERO, 1.0));
    let lit = radiance(&scene, EYE, &[], light, Stage::Phong);
    assert!(lit.abs_diff_eq(k_a * light, 1e-6), "{lit}");
    let sky = SkyIrradiance::from_equirectangular(64, 32, |_, _| light);
    let under = radiance_under_sky(&scene, EYE, &[], Rgb::ZERO, Some(sky), Stage::Phong);
    assert!(under.abs_diff_eq(k_d * light, 1e-2), "{under}");
}

fn lecture_view(proj_distance: f64) -> View {
    View {
        view_point: Some(DVec3::new(10.0, 4.2, 6.0)),
        view_dir: Some(DVec3::new(-5.0, -2.1, -3.0)),
        view_up: Some(DVec3::Y),
        proj_distance: Some(proj_distance),
        view_width: Some(4.0),
        view_height: Some(2.25),
        ..Default::default()
    }
}

fn camera(view: &View, n_x: u32, n_y: u32) -> Camera {
    let scene = squares(&[FLAT], white());
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let (camera, notes) = view.resolve(&posed, n_x, n_y).unwrap();
    assert!(notes.warnings.is_empty(), "{notes:?}");
    camera
}

/// The ray through the centre of pixel (i, j) of n_x × n_y, j upward.
fn ray(camera: &Camera, (i, j): (u32, u32), (n_x, n_y): (u32, u32)) -> (Vec3, Vec3) {
    let (x, y) = ((f64::from(i) + 0.5) / f64::from(n_x), (f64::from(j) + 0.5) / f64::from(n_y));
    let ray = camera.eye_ray(x, y, DVec3::ZERO);
    (ray.o, ray.d)
}

#[test]
fn perspective_eye_rays_are_those_computed_by_hand() {
    // e = (1, 2, 3), looking along −x with up +y: w = +x, u = up × w = −z, v = +y.
    let view = View {
        view_point: Some(DVec3::new(1.0, 2.0, 3.0)),
        view_dir: Some(DVec3::new(-2.0, 0.0, 0.0)),
        view_up: Some(DVec3::Y),
        proj_distance: Some(2.0),
        view_width: Some(4.0),
        view_height: Some(3.0),
        ..Default::default()
    };
    let camera = camera(&view, 8, 6);
    // Pixel (0, 0): u = −2 + 4·½/8 = −1.75, v = −1.5 + 3·½/6 = −1.25; s − e = u·u + v·v − d·w.
    assert_eq!(ray(&camera, (0, 0), (8, 6)), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, -1.25, 1.75)));
    // Pixel (7, 5) is its mirror image; pixel (4, 3): u = .25, v = .25.
    assert_eq!(ray(&camera, (7, 5), (8, 6)).1, Vec3::new(-2.0, 1.25, -1.75));
    assert_eq!(ray(&camera, (4, 3), (8, 6)).1, Vec3::new(-2.0, 0.25, -0.25));
}

#[test]
fn orthographic_eye_rays_are_those_computed_by_hand() {
    let view = View {
        view_point: Some(DVec3::new(1.0, 2.0, 3.0)),
        view_dir: Some(DVec3::new(0.0, 0.0, -4.0)),
        view_up: Some(DVec3::Y),
        projection: Some(Projection::Orthographic),
        view_width: Some(4.0),
        view_height: Some(3.0),
        ..Default::default()
    };
    let camera = camera(&view, 8, 6);
    // u = +x, v = +y, w = +z: the origin moves over the view plane, the direction is −w.
    assert_eq!(ray(&camera, (0, 0), (8, 6)), (Vec3::new(-0.75, 0.75, 3.0), Vec3::NEG_Z));
    assert_eq!(ray(&camera, (7, 5), (8, 6)), (Vec3::new(2.75, 3.25, 3.0), Vec3::NEG_Z));
}

#[test]
fn the_second_of_the_lectures_views_is_exactly_twice_as_wide() {
    let (far, near) = (camera(&lecture_view(6.0), 1280, 720), camera(&lecture_view(3.0), 1280, 720));
    assert_eq!(far.basis, near.basis);
    for pixel in [(0, 0), (1279, 0), (640, 719), (17, 400)] {
        // The intersection of the ray with the plane at distance 1: (u, v)/d.
        let on_plane = |camera: &Camera| {
            let x = (f64::from(pixel.0) + 0.5) / 1280.0;
            let y = (f64::from(pixel.1) + 0.5) / 720.0;
            (
                (x - 0.5) * camera.view_width / camera.proj_distance,
                (y - 0.5) * camera.view_height / camera.proj_distance,
            )
        };
        let (a, b) = (on_plane(&far), on_plane(&near));
        assert_eq!((2.0 * a.0, 2.0 * a.1), b);
        // The rays agree to their last two bits.
        let direction = |c: &Camera| ray(c, pixel, (1280, 720)).1.as_dvec3();
        let tangent = |c: &Camera, axis: DVec3| direction(c).dot(axis) / -direction(c).dot(c.basis.w);
        for axis in [far.basis.u, far.basis.v] {
            assert!((tangent(&near, axis) - 2.0 * tangent(&far, axis)).abs() < 1e-6);
        }
    }
}

#[test]
fn the_central_ray_of_the_lectures_view_is_its_view_direction() {
    let camera = camera(&lecture_view(6.0), 1280, 720);
    let centre = camera.eye_ray(0.5, 0.5, DVec3::ZERO).d.as_dvec3().normalize();
    assert!(centre.abs_diff_eq(DVec3::new(-5.0, -2.1, -3.0).normalize(), 1e-7));
}

#[test]
fn a_surface_rotated_by_60_degrees_receives_half_the_light() {
    let rotation = DQuat::from_rotation_y(60f64.to_radians());
    let sun = [PosedLight::sun(DVec3::NEG_Z, Rgb::splat(0.7))];
    let facing = radiance(&squares(&[FLAT], white()), EYE, &sun, Rgb::ZERO, Stage::Diffuse);
    let half = radiance(&squares(&[(DVec3::ZERO, rotation)], white()), EYE, &sun, Rgb::ZERO, Stage::Diffuse);
    close(facing.x, 0.7, 1e-6);
    close(half.x, 0.35, 1e-6);
}

#[test]
fn lamberts_shading_does_not_depend_on_the_view() {
    let scene = squares(&[FLAT], white());
    let light = [point(DVec3::new(0.3, 0.2, 2.0), 5.0)];
    let l = radiance(&scene, EYE, &light, Rgb::ZERO, Stage::Phong).x;
    for eye in [DVec3::new(4.0, 0.0, 1.0), DVec3::new(-1.0, 3.0, 0.5)] {
        close(radiance(&scene, eye, &light, Rgb::ZERO, Stage::Phong).x, f64::from(l), 1e-5);
    }
}

#[test]
fn light_falls_off_with_the_square_of_the_distance() {
    let scene = squares(&[FLAT], white());
    for r in [0.5, 1.0, 2.0, 40.0] {
        let l = radiance(&scene, EYE, &[point(DVec3::new(0.0, 0.0, r), 3.0)], Rgb::ZERO, Stage::Diffuse);
        close(l.x, 3.0 / (r * r), 1e-6);
    }
}

#[test]
fn a_blocked_light_leaves_only_ambient_light() {
    let m = material(Rgb::splat(0.5), Rgb::ONE, Rgb::ONE, 10.0);
    let blocker = (DVec3::new(3.0, 0.0, 3.0), DQuat::IDENTITY);
    let light = [point(DVec3::new(6.0, 0.0, 6.0), 100.0)];
    let ambient = Rgb::splat(0.1);
    let unblocked = radiance(&squares(&[FLAT], m.clone()), EYE, &light, ambient, Stage::Phong);
    let blocked = radiance(&squares(&[FLAT, blocker], m.clone()), EYE, &light, ambient, Stage::Phong);
    assert!(unblocked.x > 0.5);
    close(blocked.x, 0.05, 1e-6);
    // The diffuse stage ignores the blocker, the shadow stage has no ambient light.
    let stage = |stage| radiance(&squares(&[FLAT, blocker], m.clone()), EYE, &light, ambient, stage).x;
    assert!(stage(Stage::Diffuse) > 0.5);
    assert_eq!(stage(Stage::Shadow), 0.0);
}

#[test]
fn a_blocker_beyond_the_light_casts_no_shadow() {
    let behind = (DVec3::new(0.0, 0.0, 3.0), DQuat::from_rotation_y(0.3));
    let eye = DVec3::new(3.0, 0.0, 1.0);
    let light = [point(DVec3::new(0.0, 0.0, 2.0), 4.0)];
    close(radiance(&squares(&[FLAT, behind], white()), eye, &light, Rgb::ZERO, Stage::Shadow).x, 1.0, 1e-6);
}

#[test]
fn lights_add_up() {
    let scene = squares(&[FLAT], material(Rgb::ZERO, Rgb::splat(0.6), Rgb::splat(0.3), 20.0));
    let one = point(DVec3::new(1.0, 1.0, 2.0), 3.0);
    let two = PosedLight::sun(DVec3::new(0.4, 0.1, -1.0), Rgb::new(0.2, 0.5, 0.9));
    let l = |lights: &[PosedLight]| radiance(&scene, EYE, lights, Rgb::ZERO, Stage::Phong);
    let lights = [one, two];
    let (a, b, both) = (l(&lights[..1]), l(&lights[1..]), l(&lights));
    assert!((a + b).abs_diff_eq(both, 1e-6) && a.x > 0.0 && b.z > 0.0);
}

#[test]
fn the_highlight_is_the_cosine_to_the_power_p() {
    // Light at angle a and eye at angle b on either side of the normal: the half vector is at (a − b)/2.
    let mut checked = 0;
    for p in [10.0f32, 100.0, 1000.0] {
        let scene = squares(&[FLAT], material(Rgb::ZERO, Rgb::ZERO, Rgb::ONE, p));
        for tilt in [0.0f64, 0.5, 1.0, 2.0, 4.0, 6.0, 10.0, 20.0, 30.0] {
            let (a, b) = (35f64.to_radians() + 2.0 * tilt.to_radians(), 35f64.to_radians());
            if a.cos() <= 0.05 {
                continue;
            }
            let light = [point(DVec3::new(2.0 * a.sin(), 0.0, 2.0 * a.cos()), 4.0)];
            let eye = DVec3::new(-5.0 * b.sin(), 0.0, 5.0 * b.cos());
            let l = radiance(&scene, eye, &light, Rgb::ZERO, Stage::Phong).x;
            let lobe = tilt.to_radians().cos().powf(f64::from(p));
            if lobe > 1e-3 {
                close(l, lobe, 1e-5);
                checked += 1;
            } else {
                assert!(l < 1e-3);
            }
        }
    }
    assert!(checked > 15, "{checked} angles had a lobe to check");
}

#[test]
fn the_sum_is_the_lectures_last_slide() {
    let k_a = Rgb::new(0.1, 0.2, 0.3);
    let k_d = Rgb::new(0.5, 0.4, 0.3);
    let k_s = Rgb::splat(0.25);
    let p = 12.0f32;
    let scene = squares(&[FLAT], material(k_a, k_d, k_s, p));
    let ambient = Rgb::new(0.5, 1.0, 0.25);
    let eye = DVec3::new(1.0, 2.0, 4.0);
    let lights = [
        (DVec3::new(1.0, -1.0, 2.0), 3.0),
        (DVec3::new(-2.0, 0.5, 1.5), 7.0),
        (DVec3::new(0.0, 0.0, -3.0), 9.0),
    ];
    let posed: Vec<_> = lights.iter().map(|&(at, i)| point(at, i as f32)).collect();
    let actual = radiance(&scene, eye, &posed, ambient, Stage::Phong);

    let (n, v) = (DVec3::Z, eye.normalize());
    let mut expected = (k_a * ambient).as_dvec3();
    for (at, i) in lights {
        let (r, l) = (at.length(), at.normalize());
        let h = (v + l).normalize();
        if n.dot(l) > 0.0 {
            expected += k_d.as_dvec3() * (i / (r * r) * n.dot(l));
            expected += k_s.as_dvec3() * (i / (r * r) * n.dot(h).powf(f64::from(p)));
        }
    }
    for c in 0..3 {
        close(actual[c], expected[c], 1e-5);
    }
}

#[test]
fn the_colour_stage_shows_the_surfaces_colour() {
    let scene = squares(&[FLAT], material(Rgb::ONE, Rgb::new(0.2, 0.4, 0.6), Rgb::ONE, 5.0));
    let l = radiance(&scene, EYE, &[point(DVec3::Z, 9.0)], Rgb::ONE, Stage::Color);
    assert_eq!(l, Vec3::new(0.2, 0.4, 0.6));
}

/// A lamp of I·cos θ at a height h above a plane, r away, gives E = I·(h/r)·(h/r)/r².
#[test]
fn a_measured_lamp_lights_a_plane_by_its_profile() {
    let vertical: Vec<f64> = (0..=90).map(f64::from).collect();
    let candela: Vec<f32> = vertical.iter().map(|v| 50.0 * v.to_radians().cos() as f32).collect();
    let profile = LightProfile::new(Photometry::TypeC, vertical, vec![0.0], &candela).unwrap();
    let profile = std::sync::Arc::new(profile);
    let scene = squares(&[FLAT], white());
    let lamp = |position: DVec3, turn: DQuat| PosedLight {
        kind: PosedLightKind::Photometric {
            position: position.as_vec3(),
            world_to_light: glam::DMat3::from_quat(turn.inverse()),
            profile: profile.clone(),
        },
        ..point(position, 50.0)
    };
    let lit =
        |light: PosedLight| radiance(&scene, DVec3::new(0.1, 0.2, 3.0), &[light], Rgb::ZERO, Stage::Phong).x;
    for position in [DVec3::new(0.0, 0.0, 2.0), DVec3::new(1.5, 0.0, 2.0), DVec3::new(-2.0, 3.0, 1.0)] {
        let (h, r) = (position.z, position.length());
        let expected = 50.0 * h * h / r.powi(4);
        let found = f64::from(lit(lamp(position, DQuat::IDENTITY)));
        assert!((found - expected).abs() < 1e-3 * expected, "{position}: {found} and {expected}");
        // Turned to the origin, the lamp is as bright as its peak there.
        let aimed = DQuat::from_rotation_arc(DVec3::NEG_Z, -position.normalize());
        let expected = 50.0 * h / r.powi(3);
        let found = f64::from(lit(lamp(position, aimed)));
        assert!((found - expected).abs() < 1e-3 * expected, "{position}: {found} and {expected}");
        let away = DQuat::from_rotation_arc(DVec3::NEG_Z, position.normalize());
        assert_eq!(lit(lamp(position, away)), 0.0);
    }
}
