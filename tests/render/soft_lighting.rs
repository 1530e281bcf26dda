//! Lights with a radius, ambient occlusion and the ground, against known answers.

use std::f64::consts::PI;

use blinn::accel::Accel;
use blinn::geometry::{Aabb, Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Aov, Frame, Phong, Stage};
use blinn::render::{RenderSettings, render, render_aovs};
use blinn::scene::{
    Ground, GroundKind, Material, Mesh, PosedLight, PosedLightKind, PosedScene, Projection, ResolvedLighting,
    Rig, Scene, SpotCone, SurfaceClass, View,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::common::scenes::{self, add, cube, grid, material};

/// A picture of a scene without lights of its own.
#[derive(Clone)]
struct Shot {
    view: View,
    size: (u32, u32),
    samples: u32,
    lights: Vec<PosedLight>,
    ambient: f32,
    shadows: bool,
    ambient_occlusion: Option<AmbientOcclusion>,
    ground: Option<Ground>,
    stage: Stage,
}

impl Shot {
    fn of(view: View) -> Shot {
        Shot {
            view,
            size: (32, 32),
            samples: 1,
            lights: Vec::new(),
            ambient: 0.0,
            shadows: true,
            ambient_occlusion: None,
            ground: None,
            stage: Stage::Phong,
        }
    }

    fn frame<'a>(&self, posed: &'a PosedScene, accel: &'a Accel) -> Frame<'a> {
        let rig = Rig {
            lights: self.lights.clone(),
            area_lights: Vec::new(),
            ambient: Rgb::splat(self.ambient),
            ..Rig::default()
        };
        let lit = ResolvedLighting {
            rig,
            sets: Vec::new(),
            uses_file_lights: false,
            uses_file_environment: false,
            assumes_blender_world: false,
            description: String::new(),
        };
        let (camera, _) = self.view.resolve(posed, self.size.0, self.size.1).unwrap();
        let mut frame = Frame {
            shadows: self.shadows,
            ambient_occlusion: self.ambient_occlusion,
            ground: self.ground,
            ..Frame::new(posed, accel, camera, &lit)
        };
        frame.overrides.k_d = Some(Rgb::ONE);
        frame.overrides.k_s = Some(Rgb::ZERO);
        frame
    }

    fn settings(&self) -> RenderSettings {
        RenderSettings {
            width: self.size.0,
            height: self.size.1,
            samples: self.samples,
            filter: blinn::render::PixelFilter::Box,
            ..Default::default()
        }
    }

    /// Renders; rows from the top. Light positions are relative to the scene's centre.
    fn render(&self, scene: &Scene) -> Vec<Rgba> {
        let posed = scenes::posed(scene);
        let accel = scenes::build(&posed);
        let phong = Phong { stage: self.stage };
        render(&self.frame(&posed, &accel), &phong, &self.settings(), &()).unwrap().colors
    }
}

fn white() -> Material {
    material(SurfaceClass::Opaque, true)
}

fn scale(mesh: Mesh, by: f32) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| p * by).collect(), ..mesh }
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A horizontal floor at y = 0 around the origin.
fn floor(half: f32) -> Scene {
    scenes::scene(scale(grid(1, 1), half), &[DAffine3::IDENTITY])
}

/// A view straight down from `from`, `width` wide.
fn down(from: DVec3, width: f64, size: (u32, u32)) -> View {
    View {
        view_point: Some(from),
        view_dir: Some(DVec3::NEG_Y),
        view_up: Some(DVec3::NEG_Z),
        view_width: Some(width),
        view_height: Some(width * f64::from(size.1) / f64::from(size.0)),
        projection: Some(Projection::Orthographic),
        ..View::default()
    }
}

fn point_light(position: Vec3, radius: f32) -> PosedLight {
    PosedLight { radius, ..PosedLight::point(position, Rgb::splat(20.0)) }
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut n, mut sum) = (0.0, 0.0);
    for v in values {
        (n, sum) = (n + 1.0, sum + v);
    }
    assert!(n > 0.0);
    sum / n
}

/// The share of a disc's area beyond a chord at `s` radii from its centre.
fn segment(s: f64) -> f64 {
    let s = s.clamp(-1.0, 1.0);
    (s.acos() - s * (1.0 - s * s).sqrt()) / PI
}

const SIZE: (u32, u32) = (64, 16);
const EDGE_HEIGHT: f64 = 1.0;
const LIGHT_HEIGHT: f64 = 3.0;
const WIDTH: f64 = 1.6;

/// The share of a light of `radius` visible from each pixel of a floor, past the edge of a sheet at height 1
/// that covers x < 0. The light is at height 3 above the edge; or a sun is there.
fn penumbra(radius: f32, samples: u32, sun: bool) -> Vec<f64> {
    let mut scene = floor(50.0);
    add(&mut scene, scale(grid(1, 1), 50.0), white(), &[at(-50.0, EDGE_HEIGHT, 0.0)]);
    let light = if sun {
        PosedLight { radius, ..PosedLight::sun(DVec3::NEG_Y, Rgb::ONE) }
    } else {
        let centre = scenes::posed(&scene).centre;
        point_light((DVec3::new(0.0, LIGHT_HEIGHT, 0.0) - centre).as_vec3(), radius)
    };
    let view = down(DVec3::new(0.0, 0.5, 0.0), WIDTH, SIZE);
    let shot = Shot { size: SIZE, samples, lights: vec![light], ..Shot::of(view) };
    let all = Shot { shadows: false, ..shot.clone() }.render(&scene);
    shot.render(&scene).iter().zip(all).map(|(lit, all)| f64::from(lit.x / all.x)).collect()
}

fn x_of(column: usize) -> f64 {
    WIDTH * ((column as f64 + 0.5) / f64::from(SIZE.0) - 0.5)
}

/// The visible share by geometry: the disc faces the point, and the plane through the point and the edge cuts it along
/// a chord.
fn penumbra_at(x: f64, radius: f64) -> f64 {
    let l = DVec3::new(-x, LIGHT_HEIGHT, 0.0).normalize();
    let across = DVec3::new(l.y, -l.x, 0.0);
    let to_edge = DVec3::new(-x, EDGE_HEIGHT, 0.0);
    // Extends `to_edge` to the plane of the disc.
    let r = x.hypot(LIGHT_HEIGHT);
    let chord = (to_edge * (r / to_edge.dot(l)) - l * r).dot(across);
    segment(chord / radius)
}

#[test]
fn the_penumbra_of_an_edge_is_that_of_a_disc_light() {
    let radius = 0.3;
    for (samples, most) in [(1, 0.45), (4, 0.13), (16, 0.05), (64, 0.02), (256, 0.01)] {
        let measured = penumbra(radius as f32, samples, false);
        let mut square = Vec::new();
        for (i, &v) in measured.iter().enumerate() {
            let expected = penumbra_at(x_of(i % 64), radius);
            square.push((v - expected).powi(2));
            // Pixels have a width.
            let (a, b) = (x_of(i % 64) - 0.5 * WIDTH / 64.0, x_of(i % 64) + 0.5 * WIDTH / 64.0);
            if penumbra_at(a, radius) == penumbra_at(b, radius) {
                assert_eq!(v, expected, "{samples} samples, pixel {i}");
            }
        }
        let inside = (0..64).filter(|&i| (0.001..0.999).contains(&penumbra_at(x_of(i), radius))).count();
        let error = (square.iter().sum::<f64>() / (inside * 16) as f64).sqrt();
        println!("{samples} samples: error {error:.4} in a penumbra of {inside} pixels");
        assert!(error < most, "{samples} samples: {error}");
    }
    // The penumbra's width: 2 R h/(H − h) for a light at height H and an edge at height h.
    let measured = penumbra(radius as f32, 64, false);
    let partly = (0..64).filter(|&i| measured[i] > 0.0 && measured[i] < 1.0).count() as f64 * WIDTH / 64.0;
    let width = 2.0 * radius * EDGE_HEIGHT / (LIGHT_HEIGHT - EDGE_HEIGHT);
    assert!((partly - width).abs() < 3.0 * WIDTH / 64.0, "{partly} for {width}");
}

#[test]
fn a_sun_is_a_disc_at_a_distance_of_one_metre() {
    // The edge is at a height of 1 m, so the penumbra extends by the radius to both sides.
    let radius = 0.25;
    for (i, column) in penumbra(radius as f32, 256, true).chunks(64).next().unwrap().iter().enumerate() {
        let expected = segment(-x_of(i) / radius);
        assert!((column - expected).abs() < 0.04, "{i}: {column} for {expected}");
    }
}

#[test]
fn a_tiny_radius_equals_a_point_light() {
    let sharp = penumbra(0.0, 4, false);
    assert!(sharp.contains(&0.0) && sharp.contains(&1.0));
    let nearly = penumbra(1e-6, 4, false);
    let other = sharp.iter().zip(&nearly).filter(|(a, b)| a != b).count();
    // Only the column of pixels at the edge.
    assert!(other <= 16, "{other} pixels differ");
}

#[test]
fn a_light_wider_than_its_housing_does_not_leak() {
    let kinds = |position: Vec3| {
        let cone = SpotCone::new(1.0, 1.5);
        [
            PosedLightKind::Point { position },
            PosedLightKind::Spot { position, direction: Vec3::NEG_Y, cone, world_to_cone: None },
        ]
    };
    let view = down(DVec3::new(0.0, 0.5, 0.0), 8.0, (32, 32));
    for housed in [true, false] {
        let mut scene = floor(20.0);
        let transform = at(0.0, 3.0, 0.0);
        if housed {
            add(&mut scene, scale(cube(1), 0.25), white(), &[transform]);
        }
        let centre = scenes::posed(&scene).centre.as_vec3();
        for kind in kinds(Vec3::new(0.01, 3.02, -0.03) - centre) {
            let light = PosedLight { kind: kind.clone(), ..point_light(Vec3::ZERO, 1.5) };
            let lit = Shot { samples: 16, lights: vec![light], ..Shot::of(view.clone()) }.render(&scene);
            let bright = lit.iter().filter(|c| c.x > 0.0).count();
            assert_eq!(bright, if housed { 0 } else { 1024 }, "{kind:?}");
        }
    }
}

#[test]
fn faces_away_from_a_wide_light_stay_dark() {
    let mut mesh = scenes::sphere(8);
    mesh.positions.iter_mut().for_each(|p| *p = p.normalize());
    mesh.normals = mesh.positions.clone();
    let scene = scenes::scene(mesh, &[DAffine3::IDENTITY]);
    let view = View { view_point: Some(DVec3::Z * 5.0), look_at: Some(DVec3::ZERO), ..View::default() };
    for light in [
        point_light(Vec3::new(0.0, 0.0, -3.0), 1.0),
        PosedLight { radius: 0.8, ..PosedLight::sun(DVec3::Z, Rgb::ONE) },
    ] {
        let shot = Shot { samples: 16, lights: vec![light], ..Shot::of(view.clone()) };
        assert!(shot.render(&scene).iter().all(|c| c.x == 0.0));
    }
}

fn octahedron() -> Mesh {
    let corners = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    scenes::mesh(corners, faces.to_vec())
}

const ALL: Option<AmbientOcclusion> = Some(AmbientOcclusion { samples: 64, distance: f64::INFINITY });

#[test]
fn an_unoccluded_surface_receives_all_ambient_light() {
    // Shading normals far from the geometric normals lose no light.
    let mut sphere = octahedron();
    sphere.normals = sphere.positions.clone();
    for mesh in [sphere, cube(2), scale(grid(3, 1), 1e3)] {
        let scene = scenes::scene(mesh, &[at(1e4, 0.0, 0.0)]);
        let shot = Shot { ambient: 0.7, ..Shot::of(View::default()) };
        let unoccluded = shot.render(&scene);
        assert!(unoccluded.iter().filter(|c| c.x > 0.0).count() > 100);
        assert!(Shot { ambient_occlusion: ALL, ..shot }.render(&scene) == unoccluded);
    }
}

#[test]
fn no_ambient_light_reaches_the_inside_of_a_box() {
    let scene = scenes::scene(cube(3), &[at(0.0, 0.0, 1e3)]);
    let eye = DVec3::new(0.2, -0.3, 1000.1);
    let view =
        View { view_point: Some(eye), look_at: Some(eye - DVec3::new(0.3, 0.4, 1.0)), ..View::default() };
    let pixels = Shot { ambient: 1.0, ambient_occlusion: ALL, ..Shot::of(view) }.render(&scene);
    assert!(pixels.iter().all(|c| *c == Rgba::new(0.0, 0.0, 0.0, 1.0)));
}

/// A floor with a wall at x = 0 of this height and great length.
fn walled(height: f64) -> Scene {
    let mut scene = floor(1e4);
    let upright = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 0.5 * height, 1e4),
        DQuat::IDENTITY,
        DVec3::new(0.0, 0.5 * height, 0.0),
    );
    add(&mut scene, grid(1, 0), white(), &[upright]);
    scene
}

#[test]
fn a_wall_occludes_the_solid_angle_that_it_covers() {
    let size = (16, 16);
    let over = |x: f64| down(DVec3::new(x, 0.5, 0.0), 0.02, size);
    for (height, x) in [(1e4, 0.05), (1e4, 2.0), (2.0, 0.05), (2.0, 1.0), (2.0, 5.0)] {
        let shot = Shot { size, samples: 4, ambient: 1.0, ambient_occlusion: ALL, ..Shot::of(over(x)) };
        let visible = mean(shot.render(&walled(height)).iter().map(|c| f64::from(c.x)));
        let expected = 0.5 + 0.5 * x / x.hypot(height);
        assert!((visible - expected).abs() < 0.003, "{height} {x}: {visible} for {expected}");
    }
    // Surfaces beyond the distance do not occlude.
    let near = Some(AmbientOcclusion { samples: 64, distance: 0.9 });
    let shot = Shot { size, ambient: 1.0, ambient_occlusion: near, ..Shot::of(over(1.0)) };
    assert!(shot.render(&walled(2.0)).iter().all(|c| c.x == 1.0));
}

#[test]
fn few_occlusion_rays_converge_to_many() {
    let size = (64, 64);
    let view = down(DVec3::new(2.0, 0.5, 0.0), 4.0, size);
    let render_rays = |rays, samples| {
        let ambient_occlusion = Some(AmbientOcclusion { samples: rays, distance: f64::INFINITY });
        let shot = Shot { size, samples, ambient: 1.0, ambient_occlusion, ..Shot::of(view.clone()) };
        shot.render(&walled(2.0)).iter().map(|c| f64::from(c.x)).collect::<Vec<_>>()
    };
    let expected = render_rays(1024, 4);
    // Uncorrelated samples would have about √(A(1 − A)/n): 0.1 at 16.
    for (rays, samples, most) in [(4, 1, 0.14), (16, 1, 0.05), (16, 4, 0.05), (64, 4, 0.018), (256, 4, 0.007)]
    {
        let actual = render_rays(rays, samples);
        let error = mean(actual.iter().zip(&expected).map(|(a, b)| (a - b).powi(2))).sqrt();
        let bias = mean(actual.iter().zip(&expected).map(|(a, b)| a - b));
        println!("{rays} rays, {samples} samples: error {error:.4}, bias {bias:.5}");
        assert!(error < most && bias.abs() < 0.003, "{rays} rays: {error}, bias {bias}");
    }
}

#[test]
fn ambient_light_passes_translucent_surfaces_and_holes() {
    let size = (8, 8);
    let view = down(DVec3::new(0.0, 0.5, 0.0), 0.1, size);
    for (class, alpha, expected) in [
        (SurfaceClass::Translucent, 0.25, 0.75),
        (SurfaceClass::Cutout, 0.25, 1.0),
        (SurfaceClass::Cutout, 0.75, 0.0),
        (SurfaceClass::Opaque, 0.25, 0.0),
    ] {
        let mut scene = floor(1.0);
        let mut lid = material(class, true);
        lid.alpha.factor = alpha;
        add(&mut scene, scale(grid(1, 1), 1e5), lid, &[at(0.0, 1.0, 0.0)]);
        let shot = Shot { size, ambient: 1.0, ambient_occlusion: ALL, ..Shot::of(view.clone()) };
        for c in shot.render(&scene) {
            assert!((c.x - expected).abs() < 1e-3, "{class:?}: {}", c.x);
        }
    }
}

/// A box of side 2 above the origin, lit by a sun from straight above, over a ground of this kind.
fn boxed(kind: GroundKind) -> (Scene, Shot) {
    let scene = scenes::scene(cube(1), &[at(0.0, 1.0 + 0.5, 0.0)]);
    let ground =
        Ground::under(&Aabb { min: DVec3::new(-1.0, 0.0, -1.0), max: DVec3::new(1.0, 2.5, 1.0) }, kind);
    let view = View {
        view_point: Some(DVec3::new(0.0, 1.2, 6.0)),
        look_at: Some(DVec3::new(0.0, 0.2, 0.0)),
        ..View::default()
    };
    let sun = PosedLight::sun(DVec3::NEG_Y, Rgb::splat(0.6));
    let shot =
        Shot { size: (96, 72), lights: vec![sun], ambient: 0.2, ground: Some(ground), ..Shot::of(view) };
    (scene, shot)
}

#[test]
fn a_shadow_catcher_shows_only_shadows() {
    let (scene, shot) = boxed(GroundKind::ShadowCatcher);
    let bare = Shot { ground: None, ..shot.clone() }.render(&scene);
    let caught = shot.render(&scene);
    let mut shadow = 0;
    let mut none = 0;
    for (bare, caught) in bare.iter().zip(&caught) {
        if bare.w > 0.0 {
            assert_eq!(bare, caught, "the scene is as it was");
        } else if caught.w > 0.0 {
            // The ambient light is left.
            assert_eq!(caught.truncate(), Rgb::ZERO);
            assert!((caught.w - 0.75).abs() < 1e-5, "{caught}");
            shadow += 1;
        } else {
            none += 1;
        }
    }
    assert!(shadow > 50 && none > 500, "{shadow} pixels in shadow, {none} not");
    let nothing = Shot { shadows: false, ..shot.clone() }.render(&scene);
    assert!(nothing == bare);
    // Occlusion darkens the ground around the box, outside the sun's shadow.
    let occluded = Shot { shadows: false, ambient_occlusion: ALL, ..shot }.render(&scene);
    let soft = occluded.iter().zip(&bare).filter(|(a, b)| b.w == 0.0 && a.w > 0.01 && a.w < 0.24).count();
    assert!(soft > 500, "{soft}");
}

#[test]
fn a_ground_plane_is_grey_and_receives_and_casts_shadows() {
    let (scene, shot) = boxed(GroundKind::Plane);
    let bare = Shot { ground: None, ..shot.clone() }.render(&scene);
    let pixels = shot.render(&scene);
    let is = |c: &Rgba, l: f32| (c.x - l).abs() < 1e-5 && c.w == 1.0;
    let ground = || pixels.iter().zip(&bare).filter(|(_, b)| b.w == 0.0).map(|(c, _)| c);
    let (lit, dark) = (ground().filter(|c| is(c, 0.4)).count(), ground().filter(|c| is(c, 0.1)).count());
    assert!(lit > 500 && dark > 50, "{lit} lit, {dark} in shadow");
    // The plane fades out evenly: premultiplied grey below its full value.
    assert!(ground().any(|c| c.w > 0.2 && c.w < 0.8 && (c.x / c.w - 0.4).abs() < 1e-4));
    assert!(ground().any(|c| c.w == 0.0));
    // A plane blocks light from below, so the box's bottom is dark; a catcher casts no shadow.
    let below = PosedLight::sun(DVec3::Y, Rgb::ONE);
    let up = View {
        view_point: Some(DVec3::new(0.0, 0.1, 3.0)),
        look_at: Some(DVec3::Y * 0.5),
        ..View::default()
    };
    for (kind, lit) in [(GroundKind::Plane, false), (GroundKind::ShadowCatcher, true)] {
        for radius in [0.0, 0.05] {
            let light = PosedLight { radius, ..below.clone() };
            let ground = shot.ground.map(|g| Ground { kind, ..g });
            let shot = Shot { view: up.clone(), lights: vec![light], ambient: 0.0, ground, ..shot.clone() };
            assert_eq!(shot.render(&scene).iter().any(|c| c.x > 0.0), lit, "{kind:?}");
        }
    }
}

#[test]
fn aovs_ignore_the_ground() {
    let (scene, shot) = boxed(GroundKind::Plane);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let layers = |ground| {
        let frame = Shot { ground, ..shot.clone() }.frame(&posed, &accel);
        render_aovs(&frame, &Aov::ALL, &shot.settings(), &()).unwrap()
    };
    assert!(layers(shot.ground) == layers(None));
}

#[test]
fn a_floor_at_ground_height_hides_the_ground() {
    // The lowest surface is a floor itself, seen from near and far, at steep and grazing angles.
    for (far, offset) in [(0.0, 0.0), (1e5, 0.0), (0.0, 1e5)] {
        let transform = DAffine3::from_translation(DVec3::new(far, offset, -far));
        let scene = scenes::scene(grid(40, 1), &[transform]);
        let bounds = scenes::posed(&scene).bounds();
        for (kind, distance, height) in
            [GroundKind::Plane, GroundKind::ShadowCatcher].into_iter().flat_map(|kind| {
                [(3.0, 0.05), (3.0, 2.0), (300.0, 3.0), (300.0, 300.0)].map(|(d, h)| (kind, d, h))
            })
        {
            let eye = transform.translation + DVec3::new(0.3 * distance, height, distance);
            let yfov = Some(match (distance > 10.0, height < 10.0) {
                (true, true) => 0.0002,
                (true, false) => 0.006,
                _ => 0.6,
            });
            let view =
                View { view_point: Some(eye), look_at: Some(transform.translation), yfov, ..View::default() };
            let sun = PosedLight::sun(DVec3::new(0.2, -1.0, 0.1), Rgb::ONE);
            let bare = Shot { size: (64, 64), lights: vec![sun], ..Shot::of(view) };
            let shot = Shot { ground: Some(Ground::under(&bounds, kind)), ..bare.clone() };
            let (with, without) = (shot.render(&scene), bare.render(&scene));
            let floor = without.iter().filter(|c| c.w == 1.0).count();
            let other = with.iter().zip(&without).filter(|(a, b)| b.w == 1.0 && a != b).count();
            assert!(floor > 60, "{floor} pixels of floor");
            assert_eq!(other, 0, "{kind:?} shows through {far} {offset}, at {distance} from {height}");
        }
    }
}

#[test]
fn objects_on_the_ground_touch_their_shadows() {
    // A box on the ground, lit from behind: the shadow begins at its front edge.
    for scale in [1e-3, 1.0, 1e3] {
        let transform = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            DQuat::IDENTITY,
            DVec3::new(0.0, scale, 0.0),
        );
        let scene = scenes::scene(cube(4), &[transform]);
        let bounds = scenes::posed(&scene).bounds();
        let view = View {
            view_point: Some(DVec3::new(0.0, 1.5, 4.0) * scale),
            look_at: Some(DVec3::new(0.0, 0.0, 1.0) * scale),
            yfov: Some(0.2),
            ..View::default()
        };
        let sun = PosedLight::sun(DVec3::new(0.0, -1.0, 1.0), Rgb::ONE);
        let bare = Shot { size: (48, 96), lights: vec![sun], ..Shot::of(view) };
        let shot = Shot { ground: Some(Ground::under(&bounds, GroundKind::ShadowCatcher)), ..bare.clone() };
        let (with, without) = (shot.render(&scene), bare.render(&scene));
        let mut shadowed = 0;
        for column in 4..44 {
            let ends = (0..96).rev().find(|row| without[row * 48 + column].w == 1.0).unwrap();
            for below in 1..6 {
                assert_eq!(with[(ends + below) * 48 + column].w, 1.0, "scale {scale}, column {column}");
                shadowed += 1;
            }
        }
        assert_eq!(shadowed, 200);
    }
}
