//! Frames of triangles: the directions in which their texture coordinates grow.

use blinn_scene::Mesh;
use glam::{Vec2, Vec3};

use super::welding::SKIPPED;

/// The directions of growing u and v on a triangle, of unit length or 0.
#[derive(Clone, Copy, Default)]
pub(super) struct Frame {
    pub u: Vec3,
    pub v: Vec3,
}

/// The side of the texture that a triangle shows, which is the sign of the bitangent.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Orientation {
    Preserved,
    Mirrored,
}

/// How the texture lies on a triangle.
#[derive(Clone, Copy, Default)]
pub(super) struct Mapping {
    /// True if the triangle has a frame, with which it contributes to tangents. Others join any group.
    pub has_frame: bool,
    /// `None` for a triangle without a frame until it joins its first group.
    pub orientation: Option<Orientation>,
}

/// Computes the frames of all triangles along coordinates whose v points up.
pub(super) fn triangle_frames(mesh: &Mesh, uvs: &[Vec2], welded: &[[u32; 3]]) -> (Vec<Frame>, Vec<Mapping>) {
    let of_triangle = |(corners, ids): (&[u32; 3], &[u32; 3])| {
        if ids[0] == SKIPPED {
            return (Frame::default(), Mapping::default());
        }
        let positions = corners.map(|v| mesh.positions[v as usize]);
        triangle_frame(positions, corners.map(|v| uvs[v as usize]))
    };
    mesh.triangles.iter().zip(welded).map(of_triangle).unzip()
}

/// Solves for the derivatives of the position by u and v.
fn triangle_frame([a, b, c]: [Vec3; 3], [ta, tb, tc]: [Vec2; 3]) -> (Frame, Mapping) {
    let [e1, e2] = [b - a, c - a];
    let [d1, d2] = [tb - ta, tc - ta];
    let area = d1.x * d2.y - d1.y * d2.x;
    let along_u = e1 * d2.y - e2 * d1.y;
    let along_v = e1 * -d2.x + e2 * d1.x;
    let is_usable = |x: f32| x > f32::MIN_POSITIVE;
    let has_frame = is_usable(area.abs())
        && is_usable(along_u.length() / area.abs())
        && is_usable(along_v.length() / area.abs());
    if !has_frame {
        return (Frame::default(), Mapping::default());
    }
    let is_preserved = area > 0.0;
    let sign = if is_preserved { 1.0 } else { -1.0 };
    let orientation = if is_preserved { Orientation::Preserved } else { Orientation::Mirrored };
    let frame = Frame { u: normalize(along_u) * sign, v: normalize(along_v) * sign };
    (frame, Mapping { has_frame, orientation: Some(orientation) })
}

/// Scales to unit length, except vectors with numbers so small that they count as 0.
#[inline]
pub(super) fn normalize(v: Vec3) -> Vec3 {
    if v.abs().max_element() > f32::MIN_POSITIVE { v * v.length().recip() } else { v }
}
