//! The tangent of a group of corners: the mean of the directions of u, weighted by the angles of the triangles.

use std::collections::HashMap;

use blinn_scene::Mesh;
use glam::Vec3;

use super::frames::{Frame, normalize};

/// Corners of a group that are compared pair by pair. Tangents of larger groups are not split.
const MAX_COMPARED: usize = 1024;

/// A corner of a group, with its triangle's frame in the plane of the normal.
pub(super) struct Member {
    pub corner: u32,
    u: Vec3,
    v: Vec3,
    /// Angle of the triangle in the plane of the normal, in radians.
    angle: f32,
    has_frame: bool,
}

impl Member {
    /// Projects a corner that contributes to the tangent.
    pub fn new(mesh: &Mesh, corner: u32, frame: &Frame) -> Member {
        let triangle = mesh.triangles[corner as usize / 3];
        let k = corner as usize % 3;
        let [own, next, previous] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| triangle[k] as usize);
        let normal = mesh.normals[own];
        let project = |x: Vec3| normalize(x - normal * normal.dot(x));
        let [p, to, from] = [own, next, previous].map(|v| mesh.positions[v]);
        let cosine = project(to - p).dot(project(from - p)).clamp(-1.0, 1.0);
        let angle = libm::acos(f64::from(cosine)) as f32;
        Member { corner, u: project(frame.u), v: project(frame.v), angle, has_frame: true }
    }

    /// Returns a corner of a triangle without a frame, which contributes nothing.
    pub fn without_frame(corner: u32) -> Member {
        Member { corner, u: Vec3::ZERO, v: Vec3::ZERO, angle: 0.0, has_frame: false }
    }

    /// Returns true unless the frames are opposed.
    fn agrees(&self, other: &Member) -> bool {
        let are_opposed = || !(self.u.dot(other.u) > -1.0 && self.v.dot(other.v) > -1.0);
        self.corner == other.corner || !self.has_frame || !other.has_frame || !are_opposed()
    }
}

/// Corners with the same tangent.
pub(super) struct Subgroup {
    pub tangent: Vec3,
    pub corners: Vec<u32>,
}

/// Returns the tangent of a group in order of its corners, or `None` if it must be split.
pub(super) fn common_tangent(members: &[Member]) -> Option<Vec3> {
    (members.len() > MAX_COMPARED || is_narrow(members)).then(|| mean(members))
}

/// Splits a group: each corner takes the mean over the members that agree with it.
pub(super) fn split_group(members: &[Member]) -> Vec<Subgroup> {
    let mut ids: HashMap<Vec<bool>, usize> = HashMap::new();
    let mut subgroups: Vec<Subgroup> = Vec::new();
    for member in members {
        let agreeing: Vec<bool> = members.iter().map(|other| member.agrees(other)).collect();
        let id = *ids.entry(agreeing).or_insert_with_key(|agreeing| {
            let chosen = members.iter().zip(agreeing).filter(|(_, agrees)| **agrees);
            let tangent = mean(chosen.map(|(member, _)| member));
            subgroups.push(Subgroup { tangent, corners: Vec::new() });
            subgroups.len() - 1
        });
        subgroups[id].corners.push(member.corner);
    }
    subgroups
}

/// Returns true if all frames are within 84° of the first, so that no two are opposed.
fn is_narrow(members: &[Member]) -> bool {
    let mut framed = members.iter().filter(|member| member.has_frame);
    let Some(first) = framed.next() else { return true };
    let is_unit = |x: Vec3| (x.length_squared() - 1.0).abs() < 1e-3;
    let is_near = |a: Vec3, b: Vec3| a.dot(b) > 0.1;
    is_unit(first.u)
        && is_unit(first.v)
        && framed.all(|m| is_unit(m.u) && is_unit(m.v) && is_near(first.u, m.u) && is_near(first.v, m.v))
}

/// Returns the weighted mean of the directions of u, of unit length or 0.
fn mean<'m>(members: impl IntoIterator<Item = &'m Member>) -> Vec3 {
    let framed = members.into_iter().filter(|member| member.has_frame);
    normalize(framed.fold(Vec3::ZERO, |sum, member| sum + member.u * member.angle))
}
