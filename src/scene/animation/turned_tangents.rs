//! Tangents that follow their texture coordinates: below an animated transform of the texture whose axes they have, and where
//! morph targets displace the coordinates.

use glam::{DVec2, DVec3, Vec3};

use crate::{DeformedMesh, GeneratedFrames, Mesh, TangentAxes, UvTransform, uvs_at};

/// Tangent axes whose transform or texture coordinates are others than at rest.
pub(super) struct TurnedMap {
    uv_set: u32,
    rest: UvTransform,
    now: UvTransform,
}

impl TurnedMap {
    /// Compares the axes of a mesh's material with those at rest; `displaces` is true if morph targets displace texture
    /// coordinates. Returns `None` if its tangents are right as they are: those of the file do not follow a transform that
    /// stands, either.
    pub fn of(mesh: &Mesh, rest: TangentAxes, now: TangentAxes, displaces: bool) -> Option<TurnedMap> {
        let displaces = displaces && mesh.morphs_uvs(now.uv_set);
        let axes = |of: &TangentAxes| (of.transform.rotation(), of.transform.scale());
        let is_generated = mesh.generated_frames != GeneratedFrames::None && !mesh.tangents.is_empty();
        let is_regular = |of: &TangentAxes| {
            let determinant = of.transform.determinant();
            determinant.is_finite() && determinant != 0.0
        };
        let is_turned = (displaces || axes(&rest) != axes(&now)) && is_regular(&rest) && is_regular(&now);
        (is_generated && is_turned).then_some(TurnedMap {
            uv_set: now.uv_set,
            rest: rest.transform,
            now: now.transform,
        })
    }

    /// Turns the tangents of `shape`, the mesh at this time, from the axes at rest to those of this time: each by the
    /// mean angle of its triangles, in the plane of its normal.
    pub fn turn(&self, mesh: &Mesh, shape: &mut DeformedMesh) {
        let mut turns = vec![Turn::default(); shape.tangents.len()];
        for &corners in &mesh.triangles {
            let positions = corners.map(|v| shape.positions[v as usize]);
            let uvs_now = if shape.uvs.is_empty() { &mesh.uvs } else { &shape.uvs };
            let [rest, now] = [(&mesh.uvs, &self.rest), (uvs_now, &self.now)]
                .map(|(sets, axes)| uvs_at(sets, corners, self.uv_set).map(|uv| axes.apply(uv).as_dvec2()));
            let mirrors = signed_area(rest) * signed_area(now) < 0.0;
            let Some((rest, now)) = direction_of_u(positions, rest).zip(direction_of_u(positions, now))
            else {
                continue;
            };
            for v in corners.map(|v| v as usize) {
                if let Some((turn, normal)) = turns.get_mut(v).zip(shape.normals.get(v)) {
                    let sine = rest.cross(now);
                    let side = if sine.dot(normal.as_dvec3()) < 0.0 { -1.0 } else { 1.0 };
                    turn.sum += DVec2::new(rest.dot(now), sine.length() * side);
                    turn.mirrored += if mirrors { 1 } else { -1 };
                }
            }
        }
        for ((tangent, turn), normal) in shape.tangents.iter_mut().zip(turns).zip(&shape.normals) {
            // Where all triangles are degenerate, the tangent stays.
            let Turn { sum, mirrored } = turn;
            let Some(turn) = sum.try_normalize() else { continue };
            let (t, n) = (tangent.truncate().as_dvec3(), normal.as_dvec3());
            let turned = t * turn.x + n.cross(t) * turn.y;
            let w = if mirrored > 0 { -tangent.w } else { tangent.w };
            *tangent = turned.normalize_or(t).as_vec3().extend(w);
        }
    }
}

/// The turn of a vertex's tangent.
#[derive(Clone, Copy, Debug, Default)]
struct Turn {
    /// Sum of cosine and sine over the triangles of the vertex.
    sum: DVec2,
    /// The number of triangles whose coordinates are mirrored, less that of the others.
    mirrored: i64,
}

/// Returns the direction in which u increases on a triangle.
fn direction_of_u(positions: [Vec3; 3], uvs: [DVec2; 3]) -> Option<DVec3> {
    let [a, b, c] = positions.map(|p| p.as_dvec3());
    let [ta, tb, tc] = uvs;
    let along = (b - a) * (tc - ta).y - (c - a) * (tb - ta).y;
    (along * signed_area(uvs).signum()).try_normalize()
}

/// Returns twice the area of a triangle of texture coordinates, negative if they run clockwise.
fn signed_area([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_6};

    use glam::{Vec2, Vec4};

    use super::*;
    use crate::MorphTarget;

    fn axes(rotation: f32, scale: Vec2) -> TangentAxes {
        TangentAxes { uv_set: 0, transform: UvTransform::khr(Vec2::ZERO, rotation, scale) }
    }

    /// An upright image on a square in z = 0, whose tangents are generated for a standing transform.
    fn square(frames: GeneratedFrames) -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        Mesh {
            uvs: vec![positions.iter().map(|p| Vec2::new(p.x, 1.0 - p.y)).collect()],
            positions,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            normals: vec![Vec3::Z; 4],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
            generated_frames: frames,
            ..Mesh::default()
        }
    }

    fn turned(rotation: f32, scale: Vec2, frames: GeneratedFrames) -> Option<Vec4> {
        let mesh = square(frames);
        let map = TurnedMap::of(&mesh, axes(0.0, Vec2::ONE), axes(rotation, scale), false)?;
        let mut shape = mesh.rest_shape();
        map.turn(&mesh, &mut shape);
        assert!(
            shape.tangents.iter().all(|t| t.abs_diff_eq(shape.tangents[0], 1e-6)),
            "{:?}",
            shape.tangents
        );
        Some(shape.tangents[0])
    }

    /// The tangent is the direction in which the transformed u grows, as MikkTSpace has it for a standing transform.
    #[test]
    fn tangents_follow_the_transformed_coordinates() {
        for (rotation, scale, expected) in [
            (FRAC_PI_2, Vec2::ONE, Vec4::new(0.0, -1.0, 0.0, 1.0)),
            (FRAC_PI_6, Vec2::splat(3.0), Vec4::new(0.75f32.sqrt(), -0.5, 0.0, 1.0)),
            (0.0, Vec2::new(-1.0, 1.0), Vec4::new(-1.0, 0.0, 0.0, -1.0)),
            (0.0, Vec2::new(1.0, -2.0), Vec4::new(1.0, 0.0, 0.0, -1.0)),
            (0.0, Vec2::NEG_ONE, Vec4::new(-1.0, 0.0, 0.0, 1.0)),
        ] {
            let tangent = turned(rotation, scale, GeneratedFrames::Tangents).unwrap();
            assert!(tangent.abs_diff_eq(expected, 1e-6), "{rotation} {scale}: {tangent}");
        }
    }

    /// As they do an equal transform.
    #[test]
    fn tangents_follow_displaced_coordinates() {
        for (displace, expected) in [
            ((|uv| Vec2::new(-uv.y, uv.x)) as fn(Vec2) -> Vec2, Vec4::new(0.0, 1.0, 0.0, 1.0)),
            (|uv| Vec2::new(1.0 - uv.x, uv.y), Vec4::new(-1.0, 0.0, 0.0, -1.0)),
            (|uv| uv * 2.0, Vec4::new(1.0, 0.0, 0.0, 1.0)),
        ] {
            let mut mesh = square(GeneratedFrames::Tangents);
            let displacements: Vec<Vec2> = mesh.uvs[0].iter().map(|&uv| displace(uv) - uv).collect();
            mesh.morph_targets = vec![MorphTarget { uvs: vec![displacements], ..MorphTarget::default() }];
            let standing = axes(0.0, Vec2::ONE);
            let mut shape = mesh.rest_shape();
            shape.uvs = vec![mesh.uvs[0].iter().map(|&uv| displace(uv)).collect()];
            TurnedMap::of(&mesh, standing, standing, true).unwrap().turn(&mesh, &mut shape);
            let is_expected = |t: &Vec4| t.abs_diff_eq(expected, 1e-6);
            assert!(shape.tangents.iter().all(is_expected), "{expected}: {:?}", shape.tangents);
        }
    }

    #[test]
    fn tangents_of_the_file_and_singular_transforms_keep_them() {
        assert_eq!(turned(FRAC_PI_2, Vec2::ONE, GeneratedFrames::None), None);
        assert_eq!(turned(0.0, Vec2::ONE, GeneratedFrames::Tangents), None);
        for scale in [Vec2::ZERO, Vec2::new(0.0, 1.0), Vec2::NAN, Vec2::INFINITY] {
            assert_eq!(turned(1.0, scale, GeneratedFrames::Tangents), None, "{scale}");
        }
    }
}
