//! Views and parts of a scene: `--orbit`, `--zoom`, f3d's camera flags, `--hide` and `--only-objects`, by the
//! library behind them.

use std::fs;

use blinn::accel::{Accel, AccelSettings};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{
    AnimationChoice, Camera, ClipPlanes, Glob, Lighting, Orbit, OrbitAngles, PoseSettings, Projection, Scene,
    Selection, View, pose,
};
use glam::DVec3;

use crate::common::load_model;
use crate::common::program::*;

fn camera(scene: &Scene, view: &View) -> Camera {
    view.resolve(&pose(scene, &PoseSettings::default()).unwrap(), 64, 48).unwrap().0
}

/// One layer of a picture of 64 by 48 pixels.
fn layer(scene: &Scene, view: &View, time: f64, aov: Aov) -> Vec<f32> {
    let settings = PoseSettings { time, animation: AnimationChoice::Default, centre: None };
    let posed = pose(scene, &settings).unwrap();
    let settings = RenderSettings { width: 64, height: 48, ..Default::default() };
    let (camera, _) = view.resolve(&posed, 64, 48).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    render_aovs(&frame, &[aov], &settings, &()).unwrap().remove(0).values
}

#[track_caller]
fn near(a: DVec3, b: DVec3) {
    assert!(a.abs_diff_eq(b, 1e-9), "{a} is not {b}");
}

fn orbit(azimuth: f64, elevation: f64, distance: Option<f64>) -> Option<Orbit> {
    Some(Orbit { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), distance })
}

/// `-v` prints the camera: a scene may have many, or none.
#[test]
fn views_are_described_for_verbose() {
    let (textured, cube) = (load_model("textured/textured.gltf"), load_model("tests/cube.obj"));
    let from = |scene: &Scene, view: View| {
        view.resolve(&pose(scene, &PoseSettings::default()).unwrap(), 64, 48).unwrap().1.description
    };
    let name = &textured.nodes[textured.cameras[0].node as usize].name;
    assert_eq!(from(&textured, View::default()), format!("the file's camera 0 '{name}'"));
    let around = View { orbit: orbit(30.0, 20.0, None), ..View::default() };
    assert_eq!(from(&textured, around), "the whole scene, framed, from `orbit`");
    assert_eq!(from(&cube, View::default()), "the whole scene, framed");
    let stand = View { view_point: Some(DVec3::splat(3.0)), look_at: Some(DVec3::ZERO), ..View::default() };
    assert_eq!(from(&textured, stand), "from the given view point");
}

/// Clip bounds need every vertex at many times.
#[test]
fn clip_bounds_are_computed_once_and_only_for_framed_views() {
    let figure = load_model("figure/figure.glb");
    let posed = || pose(&figure, &PoseSettings::default()).unwrap();
    let stand = View { view_point: Some(DVec3::ONE), look_at: Some(DVec3::ZERO), ..View::default() };
    let around = View { orbit: orbit(30.0, 20.0, Some(5.0)), look_at: Some(DVec3::Y), ..View::default() };
    let ortho = Some(Projection::Orthographic);
    let upright = View { projection: ortho, view_height: Some(2.0), ..stand.clone() };
    let turned =
        View { orbit_by: OrbitAngles { azimuth: 0.3, elevation: 0.1 }, zoom: Some(2.0), ..stand.clone() };
    for view in [&stand, &upright, &turned, &around] {
        let posed = posed();
        view.resolve(&posed, 64, 48).unwrap();
        assert_eq!(posed.clip_sample_count(), None, "{view:?}");
    }
    let wide = View { projection: ortho, ..stand };
    let framed = View { orbit: orbit(30.0, 20.0, None), ..View::default() };
    let far = View { projection: ortho, ..around };
    for view in [&wide, &framed, &far] {
        let posed = posed();
        view.resolve(&posed, 64, 48).unwrap();
        assert!(posed.clip_sample_count() > Some(1), "{view:?}");
    }
    // The result is shared, whichever time asks first.
    let (start, later) = (posed(), posed().at_time(0.5));
    assert_eq!((start.clip_sample_count(), later.clip_sample_count()), (None, None));
    let later = start.at_time(0.5);
    framed.resolve(&later, 64, 48).unwrap();
    assert!(later.clip_sample_count() > Some(1) && start.clip_sample_count() == later.clip_sample_count());
}

#[test]
fn an_orbit_is_measured_from_the_front_to_the_right_and_up() {
    let scene = load_model("tests/cube.obj");
    let at = DVec3::new(1.0, 2.0, 3.0);
    for (azimuth, elevation, from, up) in [
        (0.0, 0.0, DVec3::Z, DVec3::Y),
        (90.0, 0.0, DVec3::X, DVec3::Y),
        (180.0, 0.0, DVec3::NEG_Z, DVec3::Y),
        (-90.0, 0.0, DVec3::NEG_X, DVec3::Y),
        (0.0, 90.0, DVec3::Y, DVec3::NEG_Z),
        (90.0, 90.0, DVec3::Y, DVec3::NEG_X),
        (0.0, -90.0, DVec3::NEG_Y, DVec3::Z),
        (
            0.0,
            45.0,
            DVec3::new(0.0, 0.5f64.sqrt(), 0.5f64.sqrt()),
            DVec3::new(0.0, 0.5f64.sqrt(), -0.5f64.sqrt()),
        ),
    ] {
        let view = View { look_at: Some(at), orbit: orbit(azimuth, elevation, Some(5.0)), ..View::default() };
        let c = camera(&scene, &view);
        near(c.view_point, at + from * 5.0);
        near(c.basis.w, from);
        near(c.basis.v, up);
        near(c.basis.u, up.cross(from));
    }
}

/// From any direction, the whole scene is visible and fills the picture.
#[test]
fn an_orbit_without_a_distance_frames_the_scene() {
    for name in ["assembly/assembly.glb", "tests/cube.obj"] {
        let scene = load_model(name);
        for (azimuth, elevation) in [(0.0, 15.0), (37.0, 20.0), (200.0, -60.0), (10.0, 90.0)] {
            for projection in [Projection::Perspective, Projection::Orthographic] {
                let orbit = orbit(azimuth, elevation, None);
                let view = View { orbit, projection: Some(projection), ..View::default() };
                let mask = layer(&scene, &view, 0.0, Aov::Mask);
                let hit = |x: usize, y: usize| mask[y * 64 + x] > 0.0;
                let border =
                    (0..64).any(|x| hit(x, 0) || hit(x, 47)) || (0..48).any(|y| hit(0, y) || hit(63, y));
                let rows = (0..48).filter(|&y| (0..64).any(|x| hit(x, y))).count();
                let columns = (0..64).filter(|&x| (0..48).any(|y| hit(x, y))).count();
                assert!(!border, "{name} from {azimuth}, {elevation} is cut off");
                assert!(rows.max(columns) > 24, "{name} from {azimuth}, {elevation} is small");
            }
        }
    }
}

/// Around any centre.
#[test]
fn an_orbit_around_another_point_frames_the_scene() {
    let scene = load_model("tests/cube.obj");
    for at in [DVec3::new(0.0, -3.0, 0.0), DVec3::new(0.4, 0.0, 0.0), DVec3::new(50.0, 20.0, -30.0)] {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let orbit = orbit(30.0, 20.0, None);
            let view = View { orbit, look_at: Some(at), projection: Some(projection), ..View::default() };
            let camera = camera(&scene, &view);
            let posed = pose(&scene, &PoseSettings::default()).unwrap();
            let middle = posed.bounding_sphere();
            near((camera.view_point - at).normalize(), camera.basis.w);
            // The bounding sphere crosses no plane of the view frustum's sides.
            let to = middle.centre - camera.view_point;
            let (x, y, depth) = (to.dot(camera.basis.u), to.dot(camera.basis.v), -to.dot(camera.basis.w));
            assert!(depth > middle.radius);
            for (across, extent) in [(x, camera.view_width), (y, camera.view_height)] {
                let half = 0.5 * extent / camera.proj_distance;
                let room = match projection {
                    Projection::Perspective => (half * depth - across.abs()) / (1.0 + half * half).sqrt(),
                    Projection::Orthographic => 0.5 * extent - across.abs(),
                };
                assert!(room > middle.radius, "{projection:?} about {at}: {room} for {}", middle.radius);
            }
        }
    }
}

/// Without a camera in the file, `--look-at` is the centre of the framing, and `--view-point` looks at the
/// scene's centre.
#[test]
fn a_single_point_is_looked_at_or_from() {
    let scene = load_model("tests/cube.obj");
    let framed = camera(&scene, &View::default());
    let middle = pose(&scene, &PoseSettings::default()).unwrap().bounding_sphere();
    let at = middle.centre + DVec3::new(0.0, -3.0, 0.0);
    let about = camera(&scene, &View { look_at: Some(at), ..View::default() });
    assert_eq!(about.basis, framed.basis);
    near((about.view_point - at).normalize(), framed.basis.w);
    let distance = framed.view_point.distance(middle.centre) * (1.0 + 3.0 / middle.radius);
    assert!((about.view_point.distance(at) / distance - 1.0).abs() < 1e-9);

    for eye in [DVec3::new(-4.0, 1.0, -3.0), DVec3::new(0.0, 9.0, 0.0)] {
        let from = camera(&scene, &View { view_point: Some(eye), ..View::default() });
        assert_eq!(from.view_point, eye);
        near(from.basis.w, (eye - middle.centre).normalize());
    }
    // At the centre itself, the default direction is used.
    let inside = camera(&scene, &View { view_point: Some(middle.centre), ..View::default() });
    near(inside.basis.w, framed.basis.w);
}

/// The file camera's clip planes apply to its own position only.
#[test]
fn an_orbit_does_not_cut_at_the_planes_of_the_files_camera() {
    let mut scene = load_model("lecture/lecture.glb");
    (scene.cameras[0].znear, scene.cameras[0].zfar) = (1e-3, 2e-3);
    let there = View { camera: Some("0".into()), ..View::default() };
    assert_eq!(camera(&scene, &there).clip, ClipPlanes { near: 1e-3, far: 2e-3 });
    let around = View { orbit: orbit(30.0, 20.0, None), ..there };
    assert_eq!(camera(&scene, &around).clip, ClipPlanes::OFF);
    assert!(layer(&scene, &around, 0.0, Aov::Mask).contains(&1.0));
    let clip = ClipPlanes { near: 0.5, far: 9.0 };
    assert_eq!(camera(&scene, &View { clip: Some(clip), ..around }).clip, clip);
}

#[test]
fn f3d_angles_rotate_around_the_focal_point() {
    let scene = load_model("tests/cube.obj");
    let turned = |turn: (f64, f64)| {
        let view = View {
            view_point: Some(DVec3::new(0.0, 0.0, 4.0)),
            look_at: Some(DVec3::ZERO),
            orbit_by: OrbitAngles { azimuth: turn.0.to_radians(), elevation: turn.1.to_radians() },
            ..View::default()
        };
        camera(&scene, &view)
    };
    let right = turned((90.0, 0.0));
    near(right.view_point, DVec3::X * 4.0);
    near(right.basis.w, DVec3::X);
    near(right.basis.v, DVec3::Y);
    let up = turned((0.0, 30.0));
    near(up.view_point, DVec3::new(0.0, 2.0, 12f64.sqrt()));
    near(up.basis.u, DVec3::X);
    let both = turned((90.0, 30.0));
    near(both.view_point, DVec3::new(12f64.sqrt(), 2.0, 0.0));
    // Without `--look-at`, rotations are around the point in the middle of the picture, at the distance of
    // the scene's centre.
    let view = View { orbit_by: OrbitAngles { azimuth: 0.4, elevation: 0.3 }, ..View::default() };
    let (framed, turned) = (camera(&scene, &View::default()), camera(&scene, &view));
    let middle = pose(&scene, &PoseSettings::default()).unwrap().bounding_sphere().centre;
    assert!((framed.view_point.distance(middle) - turned.view_point.distance(middle)).abs() < 1e-9);
    near((turned.view_point - middle).normalize(), turned.basis.w);
}

#[test]
fn zoom_divides_the_view_rectangle() {
    let scene = load_model("lecture/lecture.glb");
    let zoomed = camera(&scene, &View { zoom: Some(2.5), ..View::default() });
    let plain = camera(&scene, &View::default());
    assert_eq!(zoomed.view_point, plain.view_point);
    assert!((zoomed.view_height * 2.5 - plain.view_height).abs() < 1e-12);
    assert!((zoomed.view_width * 2.5 - plain.view_width).abs() < 1e-12);
}

/// Remaining objects keep their ids and pixels; hidden ones reveal what is behind them.
#[test]
fn hiding_objects_does_not_change_the_others() {
    let whole = load_model("still-life/still-life.glb");
    let view = View { clip: Some(ClipPlanes::OFF), ..View::default() };
    let all = layer(&whole, &view, 0.0, Aov::ObjectId);
    let name = &whole.objects[all[40 * 64 + 32] as usize - 1];
    let select = |only: &[&str], hide: &[&str]| {
        let mut part = whole.clone();
        let globs = |list: &[&str]| list.iter().map(|g| Glob::new(g).unwrap()).collect();
        part.select(&Selection { only: globs(only), hide: globs(hide) }).unwrap();
        layer(&part, &view, 0.0, Aov::ObjectId)
    };
    let hidden = select(&[], &[name]);
    let called = |id: f32| id > 0.0 && whole.objects[id as usize - 1] == *name;
    assert!(all.iter().any(|&id| called(id)) && !hidden.iter().any(|&id| called(id)));
    for (before, after) in all.iter().zip(&hidden) {
        assert!(called(*before) || before == after, "{before} became {after}");
    }
    let alone = select(&[name], &[]);
    assert!(alone.iter().any(|&id| called(id)) && alone.iter().all(|&id| id == 0.0 || called(id)));
}

/// A scene without a camera is framed for its whole animation: the view is constant, and everything stays
/// inside it.
#[test]
fn a_framed_view_stands_still_while_things_move() {
    let mut figure = load_model("figure/figure.glb");
    figure.cameras.clear();
    let seconds = figure.animations.iter().map(|a| f64::from(a.duration())).fold(0.0, f64::max);
    assert!(seconds > 0.5);
    let view = View::default();
    let mut first = None;
    for step in 0..=6 {
        let time = seconds * f64::from(step) / 6.0;
        let settings = PoseSettings { time, ..Default::default() };
        let (camera, _) = view.resolve(&pose(&figure, &settings).unwrap(), 64, 48).unwrap();
        let same = *first.get_or_insert(camera);
        assert!(camera.view_point.abs_diff_eq(same.view_point, 1e-5), "it moved at {time}");
        let mask = layer(&figure, &view, time, Aov::Mask);
        let edge = |i: usize| i.is_multiple_of(64) || i % 64 == 63 || !(64..47 * 64).contains(&i);
        assert!((0..mask.len()).all(|i| mask[i] == 0.0 || !edge(i)), "cut off at {time}");
    }
}

/// The order of cameras may differ between two exports of a scene: Blender sorts nodes by name from version 5.2 on.
#[test]
fn the_first_of_several_cameras_is_named_unless_one_is_chosen() {
    let mut scene = load_model("lecture/lecture.glb");
    let hints = |scene: &Scene, view: View| {
        let posed = pose(scene, &PoseSettings::default()).unwrap();
        view.resolve(&posed, 64, 36).unwrap().1.hints
    };
    let expected = "the file has 2 cameras: 0 'view-1', 1 'view-2'; used the first; select one with `camera`";
    assert_eq!(hints(&scene, View::default()), [expected]);
    assert!(hints(&scene, View { orbit: orbit(30.0, 20.0, None), ..View::default() }).is_empty());
    assert!(hints(&scene, View { camera: Some("1".into()), ..View::default() }).is_empty());
    let own =
        View { view_point: Some(DVec3::splat(9.0)), view_dir: Some(DVec3::splat(-1.0)), ..View::default() };
    assert!(hints(&scene, own).is_empty());
    scene.settings.camera = Some(1);
    assert!(hints(&scene, View::default()).is_empty());
    scene.settings.camera = None;
    scene.cameras.truncate(1);
    assert!(hints(&scene, View::default()).is_empty());
}

/// Directions have names.
#[test]
fn orbits_may_be_named() {
    let (_dir, at) = folder();
    let scene = model("tests/cube.obj");
    let picture = |orbit: &str| {
        runs(&at, &format!("render {scene} --size 24x16 -s 1 -q --orbit {orbit} -o a.png"));
        fs::read(at.join("a.png")).unwrap()
    };
    let pixels = |bytes: Vec<u8>| image::load_from_memory(&bytes).unwrap().to_rgb8();
    assert!(pixels(picture("left")) == pixels(picture("270,0")));
    assert!(pixels(picture("top")) == pixels(picture("0,90")));
    fails(
        &at,
        &["render", scene.as_str(), "--orbit", "side"],
        2,
        "or one of front, right, back, left, top, bottom, isometric",
    );
    fails(&at, &["render", scene.as_str(), "--view", "front"], 2, "use --orbit front to choose the camera");
    fails(
        &at,
        &["render", scene.as_str(), "-o", "a.svg"],
        2,
        "drawings of vectors are not written; write a large .png",
    );
}

#[test]
fn frames_of_webp_name_the_command_that_joins_them() {
    let (_dir, at) = folder();
    let line = format!("turntable {} --count 2 --size 8x8 -s 1", model("tests/cube.obj"));
    let hint = "each frame is a .webp of its own; blinn assemble joins them";
    assert!(runs(&at, &format!("{line} -o a.webp")).contains(hint));
    assert!(!runs(&at, &format!("{line} -o a.png")).contains(hint));
}
