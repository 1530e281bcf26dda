//! Masks of objects, and tracks of surface points.

use blinn::accel::{Accel, AccelSettings};
use blinn::integrator::{Aov, Frame};
use blinn::render::{
    MaskRect, RenderSettings, count_hit_pixels, render_aovs, render_object_masks, trace_surface_tracks,
};
use blinn::scene::{Camera, ClipPlanes, Lighting, Orbit, PoseSettings, Scene, View, pose};
use glam::DVec2;

use crate::common::load_model;

fn settings() -> RenderSettings {
    RenderSettings { width: 80, height: 60, samples: 1, ..RenderSettings::default() }
}

fn camera(scene: &Scene, azimuth: f64) -> Camera {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let orbit = Some(Orbit { azimuth, elevation: 0.4, distance: None });
    View { orbit, ..View::default() }.resolve(&posed, 80, 60).unwrap().0
}

/// Calls `check` with the frame of a scene.
fn with_frame<T>(scene: &Scene, camera: Camera, check: impl FnOnce(&Frame) -> T) -> T {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let lit = Lighting::default().resolve(&posed, &camera);
    check(&Frame::new(&posed, &accel, camera, &lit))
}

/// An amodal mask is the visible mask of the object alone, also with alpha textures and beyond the picture.
#[test]
fn amodal_masks_are_those_of_objects_alone() {
    for name in ["assembly/assembly.glb", "alpha/alpha.glb", "cornell/cornell.glb"] {
        let scene = load_model(name);
        let camera = camera(&scene, 0.7);
        let window = MaskRect { x: -20, y: -10, width: 120, height: 80 };
        let masks = with_frame(&scene, camera, |f| render_object_masks(f, &settings(), window, &()).unwrap());
        let ids = with_frame(&scene, camera, |f| render_aovs(f, &[Aov::ObjectId], &settings(), &()).unwrap());
        let mut hidden = 0;
        for mask in &masks {
            let visible = mask.visible.to_bytes(80, 60);
            let expected = ids[0].values.iter().map(|&id| if id as u32 == mask.object { 255 } else { 0 });
            assert!(visible.iter().copied().eq(expected), "{name}: object {}", mask.object);
            let mut alone = scene.clone();
            alone.instances.retain(|instance| instance.object == mask.object);
            let alone =
                with_frame(&alone, camera, |f| render_object_masks(f, &settings(), window, &()).unwrap());
            assert_eq!(alone.len(), 1);
            assert_eq!(alone[0].amodal, mask.amodal, "{name}: object {}", mask.object);
            hidden += mask.amodal.area() - mask.visible.area();
        }
        assert!(masks.len() > 1 && hidden > 50, "{name}: {hidden}");
    }
}

/// Pixels with a hit are those of the mask, also with alpha textures and clip planes.
#[test]
fn counted_pixels_are_those_of_the_mask() {
    for name in ["assembly/assembly.glb", "alpha/alpha.glb", "textured/textured.glb"] {
        let scene = load_model(name);
        let whole = camera(&scene, 0.7);
        let depth = with_frame(&scene, whole, |f| render_aovs(f, &[Aov::Depth], &settings(), &()).unwrap());
        let nearest = depth[0].values.iter().copied().fold(f32::INFINITY, f32::min);
        let cut = ClipPlanes { near: 0.0, far: 1.1 * f64::from(nearest) };
        let [all, near] = [whole.clip, cut].map(|clip| {
            with_frame(&scene, Camera { clip, ..whole }, |f| {
                let mask = render_aovs(f, &[Aov::Mask], &settings(), &()).unwrap();
                let masked = mask[0].values.iter().filter(|&&mask| mask > 0.0).count() as u64;
                let count = |limit: u64| count_hit_pixels(f, &settings(), limit, &()).unwrap();
                assert_eq!([count(u64::MAX), count(7), count(0)], [masked, masked.min(7), 0], "{name}");
                masked
            })
        });
        assert!(0 < near && near < all && all < 80 * 60, "{name}: {near} of {all}");
    }
}

/// A track is seen exactly where its point projects, and where the depth of the picture is that of the point.
#[test]
fn tracks_lie_on_the_surface_that_pictures_show() {
    let scene = load_model("assembly/assembly.glb");
    let cameras = [0.0, 0.5, 1.0, 3.0].map(|azimuth| camera(&scene, azimuth));
    let tracks =
        with_frame(&scene, cameras[0], |f| trace_surface_tracks(f, &cameras, &settings(), 800, &()).unwrap());
    assert!(tracks.len() > 100, "{}", tracks.len());
    let depths = cameras.map(|camera| {
        with_frame(&scene, camera, |f| {
            render_aovs(f, &[Aov::Depth], &settings(), &()).unwrap().remove(0).values
        })
    });
    let mut own = 0;
    for track in &tracks {
        assert!(track.observations.len() > 1 && track.observations.is_sorted_by_key(|(view, _)| *view));
        for &(view, pixel) in &track.observations {
            let camera = &cameras[view as usize];
            let film = camera.project(track.position).unwrap();
            let size = DVec2::new(80.0, 60.0);
            assert!((DVec2::new(film.x, 1.0 - film.y) * size).abs_diff_eq(pixel, 1e-9));
            // In the picture that it was chosen in, the point is at the centre of a pixel.
            let centre = pixel.floor() + 0.5;
            if pixel.abs_diff_eq(centre, 1e-4) {
                own += 1;
                let depth = depths[view as usize][centre.y as usize * 80 + centre.x as usize];
                assert!((f64::from(depth) + camera.to_camera(track.position).z).abs() < 1e-4);
            }
        }
    }
    assert!(own >= tracks.len(), "{own}");
}
