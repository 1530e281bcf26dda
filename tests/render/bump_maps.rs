//! Bump maps of MTL against closed forms: a ramp of heights tilts a plane by a known angle.

use blinn::import::{LoadOptions, load};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{Lighting, View};
use glam::{Vec2, Vec3};

use crate::common::scenes;

/// Texels of a side.
const SIDE: u32 = 64;

/// The normals of a square in z = 0, seen from the front, whose bump map rises from black to white along `uphill` in the
/// picture. `corner` gives the texture coordinates at x and y, −1 to 1.
fn normals(statement: &str, uphill: Vec2, corner: impl Fn(f32, f32) -> Vec2) -> Vec<Vec3> {
    let folder = tempfile::tempdir().unwrap();
    let heights = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(SIDE, SIDE, |x, y| {
        let (u, v) = ((x as f32 + 0.5) / SIDE as f32, 1.0 - (y as f32 + 0.5) / SIDE as f32);
        let h = Vec2::new(u - 0.5, v - 0.5).dot(uphill) + 0.5;
        image::Luma([(h * 65535.0) as u16])
    });
    heights.save(folder.path().join("h.png")).unwrap();
    std::fs::write(folder.path().join("a.mtl"), format!("newmtl m\n{statement} h.png\n")).unwrap();
    let mut obj = "mtllib a.mtl\nusemtl m\n".to_string();
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let uv = corner(x, y);
        obj += &format!("v {x} {y} 0\nvt {} {}\n", uv.x, uv.y);
    }
    let path = folder.path().join("a.obj");
    std::fs::write(&path, obj + "f 1/1 2/2 3/3 4/4\n").unwrap();
    let (scene, warnings) = load(&path, &LoadOptions::default()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let view = View { view_width: Some(0.5), view_height: Some(0.5), ..scenes::front_view() };
    let (camera, _) = view.resolve(&posed, 4, 4).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let settings = RenderSettings { width: 4, height: 4, ..Default::default() };
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let normals = render_aovs(&frame, &[Aov::Normal], &settings, &()).unwrap().remove(0).values;
    normals.as_chunks::<3>().0.iter().map(|&n| Vec3::from(n)).collect()
}

fn upright(x: f32, y: f32) -> Vec2 {
    Vec2::new(x + 1.0, y + 1.0) * 0.5
}

/// White is a hundredth of the image's width above black: with a multiplier of 100, the ramp rises by 45 degrees.
#[test]
fn ramps_tilt_a_plane_by_their_slope() {
    let half = 0.5f32.sqrt();
    let turned = |x: f32, y: f32| Vec2::new(y + 1.0, 1.0 - x) * 0.5;
    let mirrored = |x: f32, y: f32| Vec2::new(1.0 - x, y + 1.0) * 0.5;
    let tiled = |x: f32, y: f32| upright(x, y) * 2.0 - 0.5;
    type Corner = fn(f32, f32) -> Vec2;
    let cases: [(&str, Vec2, Corner, Vec3); 8] = [
        ("bump -clamp on -bm 100", Vec2::X, upright, Vec3::new(-half, 0.0, half)),
        ("bump -clamp on -bm 100", Vec2::Y, upright, Vec3::new(0.0, -half, half)),
        ("bump -clamp on -bm -100", Vec2::X, upright, Vec3::new(half, 0.0, half)),
        ("map_bump -bm 100", Vec2::X * 0.5, upright, Vec3::new(-0.5, 0.0, 1.0).normalize()),
        ("bump -bm 100 -mm 0.25 0.5", Vec2::X, upright, Vec3::new(-0.5, 0.0, 1.0).normalize()),
        // u grows upward: so does the height.
        ("bump -bm 100", Vec2::X, turned, Vec3::new(0.0, -half, half)),
        ("bump -bm 100", Vec2::X, mirrored, Vec3::new(half, 0.0, half)),
        // The relief is as steep in a smaller picture of it.
        ("bump -bm 100", Vec2::Y, tiled, Vec3::new(0.0, -half, half)),
    ];
    for (statement, uphill, corner, expected) in cases {
        for n in normals(statement, uphill, corner) {
            assert!(n.abs_diff_eq(expected, 2e-3), "{statement} {uphill}: {n} {expected}");
        }
    }
}
