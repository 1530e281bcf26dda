//! tobj's models to meshes: triangles, welded vertices, normals.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};

use super::normalise::{Corner, Parsed, Run};
use super::polygon::triangulate;
use crate::scene::Mesh;

/// A run as tobj read it: its corners by tobj's indices.
pub(super) struct Model {
    pub mesh: tobj::Mesh,
    pub run: usize,
}

/// Normals of smoothing groups, by vertex and group.
type Smooth = HashMap<(u32, u32), DVec3>;

/// A mesh for each model, materials and objects left to the caller. The count is of triangles left
/// out because two of their corners are one vertex.
pub(super) fn meshes(parsed: &Parsed, models: &[Model]) -> (Vec<Mesh>, u64) {
    let mut left_out = 0;
    let triangles: Vec<Vec<[usize; 3]>> = models
        .iter()
        .map(|model| {
            let (triangles, degenerate) = triangles(parsed, &parsed.runs[model.run]);
            left_out += degenerate;
            triangles
        })
        .collect();
    let mut smooth = Smooth::new();
    for (model, triangles) in models.iter().zip(&triangles) {
        add_smooth(parsed, &parsed.runs[model.run], triangles, &mut smooth);
    }
    let meshes = models.iter().zip(&triangles).map(|(m, t)| weld(parsed, m, t, &smooth)).collect();
    (meshes, left_out)
}

/// The triangles of a run, as indices into its corners.
fn triangles(parsed: &Parsed, run: &Run) -> (Vec<[usize; 3]>, u64) {
    let mut out = Vec::new();
    let mut start = 0;
    let mut of_face = Vec::new();
    let mut degenerate = 0;
    for &arity in &run.arities {
        let corners = &run.corners[start..start + arity as usize];
        of_face.clear();
        if arity == 3 {
            of_face.push([0, 1, 2]);
        } else {
            let positions: Vec<Vec3> = corners.iter().map(|c| parsed.positions[c.v as usize]).collect();
            triangulate(&positions, &mut of_face);
        }
        for t in &of_face {
            let [a, b, c] = t.map(|i| corners[i].v);
            if a == b || b == c || c == a {
                degenerate += 1;
            } else {
                out.push(t.map(|i| start + i));
            }
        }
        start += arity as usize;
    }
    (out, degenerate)
}

/// Adds each triangle's normal, weighted by its angle, to its corners' smoothing group.
fn add_smooth(parsed: &Parsed, run: &Run, triangles: &[[usize; 3]], smooth: &mut Smooth) {
    if run.key.smoothing == 0 {
        return;
    }
    for t in triangles {
        let v = t.map(|i| run.corners[i].v);
        let p = v.map(|v| parsed.positions[v as usize].as_dvec3());
        let Some(n) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else { continue };
        for k in 0..3 {
            let to = |other: usize| (p[other % 3] - p[k]).normalize_or_zero();
            let angle = libm::acos(to(k + 1).dot(to(k + 2)).clamp(-1.0, 1.0));
            *smooth.entry((v[k], run.key.smoothing)).or_default() += n * angle;
        }
    }
}

/// Vertices that agree in position, texture coordinate and normal become one.
fn weld(parsed: &Parsed, model: &Model, triangles: &[[usize; 3]], smooth: &Smooth) -> Mesh {
    let run = &parsed.runs[model.run];
    let key = run.key;
    let from = &model.mesh;
    let mut mesh = Mesh { name: parsed.objects[key.object as usize].clone(), ..Default::default() };
    if key.has_uv {
        mesh.uvs.push(Vec::new());
    }
    let at = |values: &[f32], i: u32| {
        let i = 3 * i as usize;
        Vec3::new(values[i], values[i + 1], values[i + 2])
    };
    let mut welded: HashMap<(u32, u32, u32), u32> = HashMap::new();
    for t in triangles {
        let triangle = t.map(|i| {
            let corner: Corner = run.corners[i];
            *welded.entry((corner.v, corner.vt, corner.vn)).or_insert_with(|| {
                mesh.positions.push(at(&from.positions, from.indices[i]));
                if key.has_uv {
                    let k = 2 * from.texcoord_indices[i] as usize;
                    // OBJ's v runs up, the scene's runs down.
                    mesh.uvs[0].push(Vec2::new(from.texcoords[k], 1.0 - from.texcoords[k + 1]));
                }
                if key.has_normal {
                    mesh.normals.push(at(&from.normals, from.normal_indices[i]).normalize_or_zero());
                } else if key.smoothing > 0 {
                    let n = smooth.get(&(corner.v, key.smoothing)).copied().unwrap_or_default();
                    mesh.normals.push(n.normalize_or_zero().as_vec3());
                }
                if !parsed.colors.is_empty() {
                    mesh.colors.push(parsed.colors[corner.v as usize]);
                }
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.push(triangle);
    }
    mesh
}
