use glam::Vec3;

use super::*;
use crate::build::blas_builder::build_blas;
use crate::settings::Preset;
use blinn_core::cancellation::CancelToken;

const SIDE: usize = 40;

/// A height field over the unit square, two triangles for each cell, and one more triangle without area.
fn height_field(height: impl Fn(f32, f32) -> f32 + Sync) -> impl Fn(usize) -> InputTriangle + Sync {
    move |i| {
        let cell = i / 2;
        let is_second = i % 2 == 1;
        let corner = |dx: usize, dy: usize| {
            let x = (cell % SIDE + dx) as f32 / SIDE as f32;
            let y = (cell / SIDE + dy) as f32 / SIDE as f32;
            Vec3::new(x, y, height(x, y))
        };
        let vertices = match (cell < SIDE * SIDE, is_second) {
            (false, _) => [Vec3::ZERO; 3],
            (_, false) => [corner(0, 0), corner(1, 0), corner(0, 1)],
            (_, true) => [corner(1, 0), corner(1, 1), corner(0, 1)],
        };
        InputTriangle { vertices, flags: SurfaceFlags::default() }
    }
}

fn wave(amplitude: f32) -> impl Fn(usize) -> InputTriangle + Sync {
    height_field(move |x, y| amplitude * 0.3 * (3.0 * x + 2.0 * y).sin())
}

fn built() -> Blas {
    build_blas(2 * SIDE * SIDE + 1, wave(1.0), Preset::Medium, &CancelToken::default()).unwrap()
}

/// Returns true if every triangle is inside all boxes above it.
fn encloses(blas: &Blas) -> bool {
    let mut stack = vec![(blas.bvh.root.unwrap(), blas.bounds.unwrap())];
    while let Some((child, bounds)) = stack.pop() {
        let contents = match child & LEAF_BIT {
            0 => {
                let node = &blas.bvh.nodes[child as usize];
                stack.extend((0..node.count()).map(|slot| (node.child[slot], node.bounds(slot))));
                node.union_of_children()
            }
            _ => leaf_bounds(&blas.blocks[(child & !LEAF_BIT) as usize..]),
        };
        if !bounds.contains(contents) {
            return false;
        }
    }
    true
}

#[test]
fn boxes_follow_deforming_triangles() {
    let mut blas = built();
    for step in 1..5 {
        let amplitude = 1.0 + 0.1 * step as f32;
        assert!(blas.refit(wave(amplitude)), "{step}");
        assert!(encloses(&blas));
        // Boxes are as tight as those of a new build.
        let new =
            build_blas(blas.input_count, wave(amplitude), Preset::Fast, &CancelToken::default()).unwrap();
        assert_eq!(blas.bounds, new.bounds);
        assert_eq!((blas.centre, blas.radius), (new.centre, new.radius));
    }
}

#[test]
fn a_rebuild_is_needed_where_triangles_scatter_degenerate_or_coincide() {
    let scattered = height_field(|x, y| ((x * 12.9898 + y * 78.233).sin() * 43758.547).fract());
    assert!(!built().refit(scattered), "boxes grew");
    let rest = wave(1.0);
    let changed = |which: usize, to: InputTriangle| built().refit(|i| if i == which { to } else { rest(i) });
    let last = 2 * SIDE * SIDE;
    assert!(changed(last, rest(last)), "nothing changed");
    assert!(!changed(7, rest(last)), "one lost its area");
    assert!(!changed(7, InputTriangle { vertices: [Vec3::NAN; 3], ..rest(7) }), "one is not finite");
    let valid = [Vec3::X, Vec3::Y, Vec3::Z];
    assert!(!changed(last, InputTriangle { vertices: valid, ..rest(7) }), "the rejected one became valid");
    let [a, b, c] = rest(100).vertices;
    assert!(!changed(7, InputTriangle { vertices: [c, b, a], ..rest(7) }), "two are coincident");
}

#[test]
fn coincident_triangles_move_together_or_need_a_rebuild() {
    let rest = wave(1.0);
    let count = 2 * SIDE * SIDE;
    let twice = |i: usize| rest(i % count);
    let deformed = wave(1.1);
    let mut blas = build_blas(2 * count, twice, Preset::Medium, &CancelToken::default()).unwrap();
    assert_eq!(blas.report.coincident, count as u64);
    assert!(blas.refit(|i| deformed(i % count)) && encloses(&blas));
    assert!(!blas.refit(|i| if i < count { deformed(i) } else { rest(i - count) }));
}
