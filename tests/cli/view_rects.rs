//! Off-centre view rectangles: `--view-rect`, `--intrinsics` and `--shift`, against projections written here.

use blinn::accel::{Accel, AccelSettings};
use blinn::integrator::{Aov, Frame};
use blinn::render::{PixelRect, RenderSettings, render_aovs};
use blinn::scene::{
    Camera, Intrinsics, Lighting, Orbit, PoseSettings, Projection, Scene, View, ViewRect, pose,
};
use glam::{DVec2, DVec3};

use crate::common::load_model;
use crate::common::program::*;

const SIZE: (u32, u32) = (64, 48);

/// A layer with `channels` numbers a pixel, and the camera.
fn layer(scene: &Scene, view: &View, aov: Aov, crop: Option<PixelRect>) -> (Vec<f32>, Camera) {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: SIZE.0, height: SIZE.1, crop, ..Default::default() };
    let (camera, _) = view.resolve(&posed, SIZE.0, SIZE.1).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    (render_aovs(&frame, &[aov], &settings, &()).unwrap().remove(0).values, camera)
}

/// The largest distance in pixels between pixel centres and the projections of their points; at least `least` pixels
/// see something.
fn farthest(scene: &Scene, view: &View, least: usize, project: impl Fn(&Camera, DVec3) -> DVec2) -> f64 {
    let (positions, camera) = layer(scene, view, Aov::Position, None);
    let (mask, _) = layer(scene, view, Aov::Mask, None);
    let mut count = 0;
    let mut worst = 0.0f64;
    for (i, _) in mask.iter().enumerate().filter(|(_, mask)| **mask > 0.0) {
        let p = DVec3::from_array(std::array::from_fn(|k| f64::from(positions[3 * i + k])));
        let centre = DVec2::new((i % SIZE.0 as usize) as f64 + 0.5, (i / SIZE.0 as usize) as f64 + 0.5);
        worst = worst.max(project(&camera, p).distance(centre));
        count += 1;
    }
    assert!(count >= least, "{count} pixels see something");
    worst
}

/// Coordinates along u and v and the depth along −w.
fn in_camera(camera: &Camera, p: DVec3) -> DVec3 {
    let d = p - camera.view_point;
    DVec3::new(d.dot(camera.basis.u), d.dot(camera.basis.v), -d.dot(camera.basis.w))
}

/// Numbers in 0…1 from a linear congruential generator.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 53) as f64
}

#[test]
fn points_of_random_intrinsics_project_to_their_pixel_centres() {
    let scene = load_model("tests/cube.obj");
    let mut state = 45;
    for _ in 0..20 {
        let mut next = |low: f64, high: f64| low + (high - low) * random(&mut state);
        let k = Intrinsics {
            fx: next(30.0, 150.0),
            fy: next(30.0, 150.0),
            cx: next(-30.0, 94.0),
            cy: next(-20.0, 68.0),
        };
        let orbit = Orbit { azimuth: next(0.0, 6.2), elevation: next(-1.5, 1.5), distance: None };
        let view = View { intrinsics: Some(k), orbit: Some(orbit), ..View::default() };
        let project = |camera: &Camera, p: DVec3| {
            let c = in_camera(camera, p);
            DVec2::new(k.cx + k.fx * c.x / c.z, k.cy - k.fy * c.y / c.z)
        };
        let worst = farthest(&scene, &view, 100, project);
        assert!(worst < 1e-3, "{k:?}: {worst} pixels");
    }
}

#[test]
fn view_rectangles_hold_for_both_projections_and_any_distance() {
    let scene = load_model("tests/cube.obj");
    let rect = ViewRect { left: -0.4, right: 1.2, bottom: -0.9, top: 0.3 };
    for (projection, d) in [(Projection::Perspective, 2.5), (Projection::Orthographic, 1.0)] {
        let view = View {
            view_rect: Some(rect),
            view_point: Some(DVec3::new(2.0, 3.0, 4.0)),
            look_at: Some(DVec3::new(0.1, 0.0, 0.2)),
            proj_distance: Some(d),
            projection: Some(projection),
            ..View::default()
        };
        let project = |camera: &Camera, p: DVec3| {
            let c = in_camera(camera, p);
            let on_plane = if projection == Projection::Perspective { c * (d / c.z) } else { c };
            let x = (on_plane.x - rect.left) / (rect.right - rect.left);
            let y = (rect.top - on_plane.y) / (rect.top - rect.bottom);
            DVec2::new(x * f64::from(SIZE.0), y * f64::from(SIZE.1))
        };
        let worst = farthest(&scene, &view, 50, project);
        assert!(worst < 1e-3, "{projection:?}: {worst} pixels");
    }
}

/// As in Blender: a shift of 1 moves the picture by its larger side; positive shifts move the view to the right and up.
#[test]
fn a_shift_moves_the_view_in_units_of_the_larger_side() {
    let scene = load_model("tests/cube.obj");
    let stand = View {
        view_point: Some(DVec3::new(2.0, 3.0, 4.0)),
        look_at: Some(DVec3::ZERO),
        proj_distance: Some(5.4),
        view_height: Some(3.0),
        ..View::default()
    };
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let plain = View { projection: Some(projection), ..stand.clone() };
        let shifted = View { shift: Some(DVec2::new(0.125, -0.0625)), ..plain.clone() };
        let (mask, camera) = layer(&scene, &plain, Aov::Mask, None);
        let (moved, other) = layer(&scene, &shifted, Aov::Mask, None);
        assert_eq!((camera.view_point, camera.view_width), (other.view_point, other.view_width));
        // 64 pixels · ⅛ to the right, 64 · 1/16 down.
        let at = |mask: &[f32], i: usize, j: usize| mask[j * 64 + i];
        for j in 4..48 {
            for i in 8..64 {
                assert_eq!(at(&moved, i - 8, j - 4), at(&mask, i, j), "{projection:?} {i} {j}");
            }
        }
        assert!(mask.contains(&1.0) && mask.contains(&0.0) && mask != moved);
    }
}

/// A crop shows the same points as a camera whose rectangle is the cropped part.
#[test]
fn crops_of_off_centre_views_are_parts_of_them() {
    let scene = load_model("tests/cube.obj");
    let k = Intrinsics { fx: 70.0, fy: 60.0, cx: 20.0, cy: 31.0 };
    let orbit = Some(Orbit { azimuth: 0.5, elevation: 0.4, distance: Some(4.0) });
    let view = View { intrinsics: Some(k), orbit, ..View::default() };
    let (whole, _) = layer(&scene, &view, Aov::Position, None);
    let crop = PixelRect { x: 7, y: 11, width: 30, height: 21 };
    let (part, _) = layer(&scene, &view, Aov::Position, Some(crop));
    for j in 0..21 {
        let row = 3 * ((j + 11) * 64 + 7);
        assert!(part[3 * j * 30..3 * (j + 1) * 30] == whole[row..row + 90], "row {j}");
    }
    assert!(part.iter().any(|v| *v != 0.0));
}

/// The framed scene is in the middle of the picture, whole.
#[test]
fn framed_scenes_are_in_the_middle_of_off_centre_views() {
    let scene = load_model("tests/cube.obj");
    for projection in [Projection::Perspective, Projection::Orthographic] {
        for shift in [DVec2::new(0.3, 0.0), DVec2::new(-0.8, 0.5), DVec2::new(0.0, -0.2)] {
            for orbit in [None, Some(Orbit { azimuth: 2.0, elevation: 0.3, distance: None })] {
                let view =
                    View { shift: Some(shift), orbit, projection: Some(projection), ..View::default() };
                let (mask, _) = layer(&scene, &view, Aov::Mask, None);
                let hits: Vec<DVec2> = (0..mask.len())
                    .filter(|&i| mask[i] > 0.0)
                    .map(|i| DVec2::new((i % 64) as f64, (i / 64) as f64))
                    .collect();
                let low = hits.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
                let high = hits.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
                assert!(low.min_element() > 0.0 && high.x < 63.0 && high.y < 47.0, "{shift}: {low} {high}");
                let middle = 0.5 * (low + high + 1.0);
                assert!(middle.distance(DVec2::new(32.0, 24.0)) < 9.0, "{projection:?} {shift}: {middle}");
            }
        }
    }
}

/// Lens flags work for turntables, and datasets record them.
#[test]
fn datasets_record_the_principal_point() {
    let (_dir, at) = folder();
    std::fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    let flags = "--size 48x36 -s 1 --intrinsics 50,51,20,19.5 --crop 3,2,40,30";
    runs(&at, &format!("turntable cube.obj --views 2 {flags} -q -o ds/#.png"));
    let text = std::fs::read_to_string(at.join("ds/transforms.json")).unwrap();
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (key, value) in [("fl_x", 50.0), ("fl_y", 51.0), ("cx", 17.0), ("cy", 17.5), ("w", 40.0), ("h", 30.0)]
    {
        let found = all[key].as_f64().unwrap();
        assert!((found - value).abs() < 1e-9, "{key}: {found}");
    }
}

#[test]
fn contradictory_lenses_are_refused() {
    let (_dir, at) = folder();
    std::fs::copy(model("tests/cube.obj"), at.join("cube.obj")).unwrap();
    for (flags, message) in [
        ("--view-rect 1,-1,-1,1", "L < R and B < T"),
        ("--view-rect 1,2,3", "L,R,B,T"),
        ("--view-rect=-1,1,-1,1 --yfov 40", "--yfov"),
        ("--view-rect=-1,1,-1,1 --view-width 2", "--view-width"),
        ("--view-rect=-1,1,-1,1 --shift .1,0", "--shift"),
        ("--intrinsics 50,50,20,20", "--size"),
        ("--size 40x40 --intrinsics 0,50,20,20", "FX and FY must be greater than zero"),
        ("--size 40x40 --intrinsics=-50,50,20,20", "FX and FY must be greater than zero"),
        ("--size 40x40 --intrinsics nan,50,20,20", "'nan' is not a number"),
        ("--size 40x40 --intrinsics 50,50,20,20 --yfov 40", "--yfov"),
        ("--size 40x40 --intrinsics 50,50,20,20 --proj-distance 2", "--proj-distance"),
        (
            "--size 40x40 --intrinsics 50,50,20,20 --projection orthographic",
            "remove the orthographic projection",
        ),
        ("--shift 1", "X,Y"),
    ] {
        refused(&at, &format!("render cube.obj {flags}"), message);
    }
}

/// The file's camera decides the projection only when the file is read.
#[test]
fn intrinsics_need_a_perspective_camera() {
    let mut scene = load_model("lecture/lecture.glb");
    scene.cameras[0].projection = blinn::scene::FileProjection::Orthographic { xmag: 1.0, ymag: 1.0 };
    let k = Intrinsics { fx: 50.0, fy: 50.0, cx: 32.0, cy: 24.0 };
    let view = View { intrinsics: Some(k), ..View::default() };
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let error = view.resolve(&posed, 64, 48).unwrap_err().to_string();
    assert!(error.contains("is orthographic; add `projection perspective`"), "{error}");
    let perspective = View { projection: Some(Projection::Perspective), ..view };
    assert!(perspective.resolve(&posed, 64, 48).is_ok());
}
