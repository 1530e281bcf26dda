//! Optical flow: where the points of a picture are in the frames before and after, and whether those see them.
//!
//! A point keeps its triangle and its barycentric coordinates while the scene moves. Its positions in both frames are
//! computed alike, so that the flow of what stands still is exactly 0. The surfaces of points and lines move with the nearest
//! point of their axes.

use glam::DVec2;

use crate::integrator::first_hit::{FirstHit, Flow};
use crate::integrator::frame::Frame;
use crate::integrator::scratch::Scratch;
use crate::integrator::visibility::{SurfaceTarget, point_at, sees};

/// The frames before and after a frame, of the same scene. The flow to a frame that is missing is 0, and nothing is
/// visible there.
#[derive(Clone, Copy, Debug, Default)]
pub struct NeighbourFrames<'a> {
    /// The frame before.
    pub previous: Option<&'a Frame<'a>>,
    /// The frame after.
    pub next: Option<&'a Frame<'a>>,
}

/// Computes the flow of first hits of `frame`, in a picture of `size` pixels.
pub fn add_flow(
    frame: &Frame,
    neighbours: &NeighbourFrames,
    size: (u32, u32),
    first: &mut [FirstHit],
    scratch: &mut Scratch,
) {
    if let Some(next) = neighbours.next {
        let flow = flow_to(frame, next, size, first, scratch);
        first.iter_mut().zip(flow).for_each(|(first, forward)| first.flow = Flow { forward, ..first.flow });
    }
    if let Some(previous) = neighbours.previous {
        let flow = flow_to(frame, previous, size, first, scratch);
        first.iter_mut().zip(flow).for_each(|(first, backward)| first.flow = Flow { backward, ..first.flow });
    }
}

/// The flow of each first hit of `frame` to the frame `other`.
fn flow_to(
    frame: &Frame,
    other: &Frame,
    (width, height): (u32, u32),
    first: &[FirstHit],
    scratch: &mut Scratch,
) -> Vec<[f32; 3]> {
    let pixels = DVec2::new(f64::from(width), -f64::from(height));
    let mut flow = vec![[0.0; 3]; first.len()];
    let mut indices = Vec::new();
    let mut targets = Vec::new();
    for (index, first) in first.iter().enumerate() {
        let Some((_, surface)) = &first.surface else { continue };
        let here = point_at(frame.posed, surface);
        let p = point_at(other.posed, surface);
        let from = frame.camera.project(here + frame.posed.centre);
        let to = other.camera.project(p + other.posed.centre);
        let (Some(from), Some(to)) = (from, to) else { continue };
        let step = ((to - from) * pixels).as_vec2();
        if !step.is_finite() {
            continue;
        }
        flow[index] = [step.x, step.y, 0.0];
        // Where the point is, counted from the centre of its pixel.
        let film = DVec2::new(first.sample.x, first.sample.y) + (to - from);
        if !(film.cmpge(DVec2::ZERO).all() && film.cmple(DVec2::ONE).all()) {
            continue;
        }
        let target = SurfaceTarget { id: surface.id, front: surface.front, p, film: to };
        indices.push(index);
        targets.push(target);
        // A sphere whose centre is covered by its neighbours sticks out elsewhere.
        if frame.posed.mesh(surface.id.instance).has_rounds() {
            indices.push(index);
            targets.push(SurfaceTarget { film, ..target });
        }
    }
    let visible = indices.into_iter().zip(sees(other, &targets, scratch));
    visible.filter(|(_, is_visible)| *is_visible).for_each(|(index, _)| flow[index][2] = 1.0);
    flow
}
