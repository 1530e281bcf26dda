//! Tangents below an animated transform of the texture whose axes they have: they follow the transformed texture coordinates.

use glam::{DVec2, DVec3, Vec3};

use crate::{DeformedMesh, GeneratedFrames, Material, Mesh, TangentAxes, UvTransform};

/// Tangent axes whose transform is another than at rest.
pub(super) struct TurnedMap {
    uv_set: u32,
    rest: UvTransform,
    now: UvTransform,
}

impl TurnedMap {
    /// Compares a mesh's material with itself at rest. Returns `None` if its tangents are right as they are: those of
    /// the file do not follow a transform that stands, either.
    pub fn of(mesh: &Mesh, rest: &Material, now: &Material) -> Option<TurnedMap> {
        let (rest, now) = rest.tangent_axes().zip(now.tangent_axes())?;
        let axes = |of: &TangentAxes| (of.transform.rotation(), of.transform.scale());
        let is_generated = mesh.generated_frames != GeneratedFrames::None && !mesh.tangents.is_empty();
        let is_regular = |of: &TangentAxes| {
            let determinant = of.transform.determinant();
            determinant.is_finite() && determinant != 0.0
        };
        let is_turned = axes(&rest) != axes(&now) && is_regular(&rest) && is_regular(&now);
        (is_generated && is_turned).then_some(TurnedMap {
            uv_set: now.uv_set,
            rest: rest.transform,
            now: now.transform,
        })
    }

    /// Turns the tangents of `shape`, the mesh at this time, from the axes at rest to those of this time: each by the
    /// mean angle of its triangles, in the plane of its normal.
    pub fn turn(&self, mesh: &Mesh, shape: &mut DeformedMesh) {
        let mut turns = vec![DVec2::ZERO; shape.tangents.len()];
        for &corners in &mesh.triangles {
            let positions = corners.map(|v| shape.positions[v as usize]);
            let uvs = mesh.uvs_at(corners, self.uv_set);
            let direction =
                |axes: &UvTransform| direction_of_u(positions, uvs.map(|uv| axes.apply(uv).as_dvec2()));
            let Some((rest, now)) = direction(&self.rest).zip(direction(&self.now)) else { continue };
            for v in corners.map(|v| v as usize) {
                if let Some((turn, normal)) = turns.get_mut(v).zip(shape.normals.get(v)) {
                    let sine = rest.cross(now);
                    let side = if sine.dot(normal.as_dvec3()) < 0.0 { -1.0 } else { 1.0 };
                    *turn += DVec2::new(rest.dot(now), sine.length() * side);
                }
            }
        }
        let mirrors = self.rest.determinant() * self.now.determinant() < 0.0;
        for ((tangent, turn), normal) in shape.tangents.iter_mut().zip(turns).zip(&shape.normals) {
            // Where all triangles are degenerate, the tangent stays.
            let Some(turn) = turn.try_normalize() else { continue };
            let (t, n) = (tangent.truncate().as_dvec3(), normal.as_dvec3());
            let turned = t * turn.x + n.cross(t) * turn.y;
            let w = if mirrors { -tangent.w } else { tangent.w };
            *tangent = turned.normalize_or(t).as_vec3().extend(w);
        }
    }
}

/// Returns the direction in which u increases on a triangle.
fn direction_of_u(positions: [Vec3; 3], [ta, tb, tc]: [DVec2; 3]) -> Option<DVec3> {
    let [a, b, c] = positions.map(|p| p.as_dvec3());
    let (d1, d2) = (tb - ta, tc - ta);
    let along = (b - a) * d2.y - (c - a) * d1.y;
    (along * d1.perp_dot(d2).signum()).try_normalize()
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_6};

    use glam::{Vec2, Vec4};

    use super::*;
    use crate::NormalMap;
    use crate::TextureRef;

    fn material(rotation: f32, scale: Vec2) -> Material {
        let transform = UvTransform::khr(Vec2::ZERO, rotation, scale);
        let texture = TextureRef { texture: 0, uv_set: 0, transform };
        Material {
            normal: Some(NormalMap { texture, scale: 1.0, scale_is_strength: false }),
            ..Material::default()
        }
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
        let map = TurnedMap::of(&mesh, &material(0.0, Vec2::ONE), &material(rotation, scale))?;
        let mut shape = DeformedMesh {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            tangents: mesh.tangents.clone(),
        };
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

    #[test]
    fn tangents_of_the_file_and_singular_transforms_keep_them() {
        assert_eq!(turned(FRAC_PI_2, Vec2::ONE, GeneratedFrames::None), None);
        assert_eq!(turned(0.0, Vec2::ONE, GeneratedFrames::Tangents), None);
        for scale in [Vec2::ZERO, Vec2::new(0.0, 1.0), Vec2::NAN, Vec2::INFINITY] {
            assert_eq!(turned(1.0, scale, GeneratedFrames::Tangents), None, "{scale}");
        }
    }
}
