//! Ambient occlusion, against known answers.

use blinn::geometry::Rgba;
use blinn::integrator::AmbientOcclusion;
use blinn::scene::{Mesh, Scene, SurfaceClass, View};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::{ALL, Shot, at, down, floor, mean, scale, white};
use crate::common::scenes::{self, add, cube, grid, material};

fn octahedron() -> Mesh {
    let corners = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    scenes::mesh(corners, faces.to_vec())
}

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
