//! The ground under objects, against known answers.

use blinn::geometry::{Aabb, Rgb, Rgba};
use blinn::integrator::Aov;
use blinn::render::render_aovs;
use blinn::scene::{Ground, GroundKind, PosedLight, Scene, View};
use glam::{DAffine3, DQuat, DVec3};

use super::{ALL, Shot, at};
use crate::common::scenes::{self, cube, grid};

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
