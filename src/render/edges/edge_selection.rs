//! Selects the edges of a picture and projects them.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::mesh_edges::{EdgeMark, MeshEdge, MeshEdges, OtherSide};
use super::projection::{Projector, Segment};
use super::{EdgeCache, EdgeKinds, EdgeStyle, HiddenEdges, dashes};
use crate::integrator::Frame;
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{HitId, Rgb};
use blinn_scene::PosedScene;

/// Edges that one task selects.
const EDGES_PER_TASK: usize = 1 << 14;

/// An edge in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScreenEdge {
    pub segment: Segment,
    /// The triangles beside it, which do not hide it.
    pub beside: [HitId; 2],
    /// Pixels along the line of edges before this one, where hidden edges are dashed.
    pub start: f64,
}

/// The edges of a picture.
pub(super) struct ScreenEdges {
    pub edges: Vec<ScreenEdge>,
    pub projector: Projector,
    pub colors: EdgeColors,
}

/// The colours of edges.
pub(super) struct EdgeColors {
    /// Linear RGBA, not premultiplied; the first is that of edges without a colour of their own.
    pub palette: Vec<Vec4>,
    /// For each edge the index of its colour. Empty if all have the first.
    pub of_edges: Vec<u32>,
}

impl EdgeColors {
    /// Adds the colours of an object's edges, which are given by their numbers in it, behind `first` others.
    fn add(&mut self, topology: &MeshEdges, first: usize, edges: impl Iterator<Item = usize>) {
        self.of_edges.resize(first, 0);
        let mut numbers: HashMap<u32, u32> = HashMap::from([(0, 0)]);
        for edge in edges {
            let color = topology.colors[edge];
            let number = *numbers.entry(color).or_insert_with(|| {
                let color = topology.palette[color as usize - 1];
                let known = self.palette[1..].iter().position(|known| *known == color);
                known.map_or_else(
                    || {
                        self.palette.push(color);
                        self.palette.len() - 1
                    },
                    |known| known + 1,
                ) as u32
            });
            self.of_edges.push(number);
        }
    }
}

/// Selects the edges that the camera may see.
pub(super) fn select_edges(
    frame: &Frame,
    style: &EdgeStyle,
    cache: &EdgeCache,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<ScreenEdges, Cancelled> {
    let posed = frame.posed;
    let projector = Projector::new(&frame.camera, posed.centre, style.width, settings);
    let least_cos = style.angle.to_radians().cos();
    let mut edges = Vec::new();
    let own_color = style.color.unwrap_or(Rgb::ZERO).extend(1.0);
    let mut colors = EdgeColors { palette: vec![own_color], of_edges: Vec::new() };
    for instances in objects(posed) {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let meshes: Vec<u32> = instances.iter().map(|&i| posed.scene.instances[i as usize].mesh).collect();
        let topology = cache.get(posed.scene, &meshes);
        let mut object = ObjectEdges {
            posed,
            topology: &topology,
            instances: &instances,
            projector: &projector,
            kinds: style.kinds,
            least_cos,
            normals: Vec::new(),
        };
        if style.kinds.feature && !style.kinds.all {
            object.normals = object.face_normals(&meshes);
        }
        let select = |task: usize| {
            let range = task * EDGES_PER_TASK..((task + 1) * EDGES_PER_TASK).min(topology.edges.len());
            range.filter_map(|edge| Some((edge, object.select(edge)?))).collect::<Vec<_>>()
        };
        let tasks = topology.edges.len().div_ceil(EDGES_PER_TASK);
        let selected: Vec<Vec<(usize, ScreenEdge)>> = (0..tasks).into_par_iter().map(select).collect();
        let first = edges.len();
        let ends: Vec<[u32; 2]> = if style.hidden == HiddenEdges::Dashed {
            selected.iter().flatten().map(|(edge, _)| topology.edges[*edge].ends).collect()
        } else {
            Vec::new()
        };
        edges.reserve(selected.iter().map(Vec::len).sum());
        if style.color.is_none() && !topology.colors.is_empty() {
            colors.add(&topology, first, selected.iter().flatten().map(|(edge, _)| *edge));
        }
        // Each list is freed before the next one is copied.
        selected.into_iter().for_each(|list| edges.extend(list.iter().map(|(_, edge)| *edge)));
        if !ends.is_empty() {
            dashes::add_starts(&ends, &mut edges[first..]);
        }
    }
    if !colors.of_edges.is_empty() {
        colors.of_edges.resize(edges.len(), 0);
    }
    Ok(ScreenEdges { edges, projector, colors })
}

/// Returns the visible instances of triangles by object: those that stand at the same node and belong together.
fn objects(posed: &PosedScene) -> Vec<Vec<u32>> {
    let mut objects: Vec<Vec<u32>> = Vec::new();
    let mut of_key: HashMap<(u32, u32, [u32; 10]), usize> = HashMap::new();
    for (i, instance) in posed.scene.instances.iter().enumerate() {
        let i = i as u32;
        if !posed.instances[i as usize].visible || posed.mesh(i).triangles.is_empty() {
            continue;
        }
        let trs = instance.trs.map_or([0; 10], |trs| {
            let [x, y, z] = trs.translation.to_array();
            let [a, b, c, d] = trs.rotation;
            let [s, t, u] = trs.scale.to_array();
            [x, y, z, a, b, c, d, s, t, u].map(f32::to_bits)
        });
        let new = objects.len();
        let object = *of_key.entry((instance.node, instance.object, trs)).or_insert(new);
        if object == new {
            objects.push(Vec::new());
        }
        // A mesh that is there twice has no borders with itself.
        let meshes = &posed.scene.instances;
        if !objects[object].iter().any(|&other| meshes[other as usize].mesh == instance.mesh) {
            objects[object].push(i);
        }
    }
    objects
}

/// The edges of an object, which may have several meshes.
struct ObjectEdges<'a> {
    posed: &'a PosedScene<'a>,
    topology: &'a MeshEdges,
    /// The instances of the meshes.
    instances: &'a [u32],
    projector: &'a Projector,
    kinds: EdgeKinds,
    /// Cosine of the angle above which an edge is sharp.
    least_cos: f64,
    /// The normal of each triangle, of any length. Empty unless sharp edges are drawn: three edges share a triangle.
    normals: Vec<DVec3>,
}

impl ObjectEdges<'_> {
    /// Returns an edge if it is drawn and lies in the picture.
    fn select(&self, index: usize) -> Option<ScreenEdge> {
        let edge = &self.topology.edges[index];
        let mark = self.topology.marks.get(index).copied().unwrap_or(EdgeMark::None);
        if !self.is_drawn(index, mark) {
            return None;
        }
        let [a, b] = edge.ends.map(|end| self.position(end));
        let segment = self.projector.project(a, b)?;
        let other = match edge.other_side() {
            OtherSide::Triangle { triangle, .. } => self.hit_id(triangle),
            OtherSide::None | OtherSide::Many => HitId::NONE,
        };
        Some(ScreenEdge { segment, beside: [self.hit_id(edge.triangle), other], start: 0.0 })
    }

    fn is_drawn(&self, index: usize, mark: EdgeMark) -> bool {
        let edge = &self.topology.edges[index];
        let EdgeKinds { all, feature, silhouette, boundary } = self.kinds;
        let is_border = edge.other_side() != (OtherSide::Many) && self.is_border(edge);
        match mark {
            EdgeMark::Hidden => return false,
            EdgeMark::Hard => {
                return all || feature || (boundary && is_border) || (silhouette && self.is_silhouette(edge));
            }
            EdgeMark::Diagonal => return silhouette && self.is_silhouette(edge),
            EdgeMark::Silhouette => return all || (silhouette && self.is_silhouette_of_file(index)),
            EdgeMark::None => {}
        }
        all || (is_border && (boundary || feature || silhouette))
            || (feature && self.is_sharp(edge))
            || (silhouette && self.is_silhouette(edge))
    }

    fn is_border(&self, edge: &MeshEdge) -> bool {
        edge.other_side() == OtherSide::None
    }

    /// Returns true if the surface turns by more than the angle, or if more than two triangles meet.
    fn is_sharp(&self, edge: &MeshEdge) -> bool {
        match edge.other_side() {
            OtherSide::None => true,
            OtherSide::Many => true,
            OtherSide::Triangle { triangle, is_turned } => {
                let [n, m] = [edge.triangle, triangle].map(|triangle| self.normals[triangle as usize]);
                let cos = n.dot(m) / (n.length_squared() * m.length_squared()).sqrt();
                // Triangles without area have no normal: false for NaN.
                (if is_turned { -cos } else { cos }) < self.least_cos
            }
        }
    }

    /// Returns true if the camera sees one face beside an edge from the front and the other one from the back, by the normals of
    /// the file if it has some and the shape is not deformed.
    fn is_silhouette_of_file(&self, index: usize) -> bool {
        let edge = &self.topology.edges[index];
        let normals = || {
            let normals = self.topology.silhouette_normals(index)?;
            let instance = &self.posed.instances[self.hit_id(edge.triangle).instance as usize];
            instance.deformed.is_none().then(|| normals.map(|n: Vec3| instance.transform.normal(n)))
        };
        let Some(normals) = normals() else { return self.is_silhouette(edge) };
        let [a, b] = edge.ends.map(|end| self.position(end));
        let [first, second] = normals.map(|n| self.projector.sees_front(0.5 * (a + b), n));
        first != second
    }

    /// Returns true if the camera sees one triangle from the front and the other one from the back.
    fn is_silhouette(&self, edge: &MeshEdge) -> bool {
        match edge.other_side() {
            OtherSide::None => true,
            OtherSide::Many => false,
            OtherSide::Triangle { triangle, is_turned } => {
                let front = |triangle: u32| {
                    let (p, n) = self.plane(triangle);
                    self.projector.sees_front(p, n)
                };
                (front(edge.triangle) != front(triangle)) != is_turned
            }
        }
    }

    /// Returns a corner of a triangle, and its normal of any length.
    fn plane(&self, triangle: u32) -> (DVec3, DVec3) {
        plane(self.posed, self.hit_id(triangle))
    }

    /// Returns the normals of the triangles of all `meshes`, which are those of the instances.
    fn face_normals(&self, meshes: &[u32]) -> Vec<DVec3> {
        let mut normals = Vec::new();
        for (&instance, &mesh) in self.instances.iter().zip(meshes) {
            let count = self.posed.scene.meshes[mesh as usize].triangles.len() as u32;
            let normal = |triangle: u32| plane(self.posed, HitId { instance, triangle }).1;
            normals.par_extend((0..count).into_par_iter().map(normal));
        }
        normals
    }

    fn hit_id(&self, triangle: u32) -> HitId {
        let (mesh, triangle) = self.topology.triangle(triangle);
        HitId { instance: self.instances[mesh], triangle }
    }

    fn position(&self, vertex: u32) -> DVec3 {
        let (mesh, vertex) = self.topology.vertex(vertex);
        let instance = self.instances[mesh];
        let p = self.posed.positions(instance)[vertex as usize];
        self.posed.instances[instance as usize].transform.point(p).as_dvec3()
    }
}

/// Returns a corner of a triangle, and its normal of any length.
fn plane(posed: &PosedScene, id: HitId) -> (DVec3, DVec3) {
    let [a, b, c] = posed.world_triangle(id).map(|p| p.as_dvec3());
    (a, (b - a).cross(c - a))
}
