//! Conservative bounds of clusters of deformed vertices, without deforming them.
//!
//! Morph targets move the bounding box of a cluster by a weighted sum of boxes. Each joint transforms the
//! box of the vertices that it influences. Linear blend skinning puts every vertex into the convex hull of
//! its joints' positions, so the union of the joints' boxes contains it.

use glam::{DVec3, Vec3};

use crate::animation::deform::MeshDeformer;
use crate::animation::vertex_clusters::{CLUSTER_SIZE, bounds_of, transformed_bounds};
use crate::{Mesh, Skin};
use blinn_core::geometry::Aabb;

/// Most joints of a cluster. With more, its boxes cost more than deforming its vertices.
const MAX_JOINTS: usize = 16;
/// Largest difference of the sum of a vertex's weights from 1: more than f32 rounding.
const WEIGHT_TOLERANCE: f64 = 1e-5;
/// Relative rounding error of a sum's terms in f32, rounded up.
const ROUNDING: f64 = 1e-6;
/// Absolute rounding error near 0.
const TINY: f64 = f32::MIN_POSITIVE as f64;
/// Coordinates beyond this may overflow f32.
const MAX_COORDINATE: f64 = 1e30;

/// The vertices of a mesh, in their order, in clusters of [`CLUSTER_SIZE`].
pub(super) struct SkinnedClusters {
    /// `None` where bounds would not be conservative.
    clusters: Vec<Option<Cluster>>,
}

struct Cluster {
    /// Rest-pose bounds of the vertices that each joint influences. Without a skin, one box of all vertices.
    joint_boxes: Vec<(u16, Aabb)>,
    /// Bounds of the displacements of each morph target.
    displacements: Vec<Aabb>,
}

impl SkinnedClusters {
    pub fn new(mesh: &Mesh, skin: Option<&Skin>) -> SkinnedClusters {
        let count = mesh.positions.len();
        let clusters = (0..count)
            .step_by(CLUSTER_SIZE)
            .map(|first| Cluster::new(mesh, skin, first, (first + CLUSTER_SIZE).min(count)));
        SkinnedClusters { clusters: clusters.collect() }
    }

    /// Returns a box that contains every deformed vertex of a cluster, including rounding errors.
    pub fn bounds(&self, cluster: usize, deformer: &MeshDeformer) -> Option<Aabb> {
        let Cluster { joint_boxes, displacements } = self.clusters[cluster].as_ref()?;
        let mut displacement = Aabb { min: DVec3::ZERO, max: DVec3::ZERO };
        let mut terms = DVec3::ZERO;
        for (by, w) in displacements.iter().zip(deformer.weights).filter(|(_, w)| **w != 0.0) {
            let a = by.min * f64::from(*w);
            let b = by.max * f64::from(*w);
            displacement = Aabb { min: displacement.min + a.min(b), max: displacement.max + a.max(b) };
            terms += a.abs().max(b.abs());
        }
        let mut bounds = Aabb::EMPTY;
        for (joint, rest) in joint_boxes {
            let terms = terms + rest.min.abs().max(rest.max.abs());
            let rounding = (1 + displacements.len()) as f64 * (ROUNDING * terms + TINY);
            let morphed = Aabb {
                min: rest.min + displacement.min - rounding,
                max: rest.max + displacement.max + rounding,
            };
            let skinned = match &deformer.joints {
                Some(joints) => transformed_bounds(joints.get(usize::from(*joint))?, &morphed),
                None => morphed,
            };
            // Also false for NaN.
            let in_range = |p: DVec3| p.abs().cmplt(DVec3::splat(MAX_COORDINATE)).all();
            if !(in_range(terms) && in_range(skinned.min) && in_range(skinned.max)) {
                return None;
            }
            bounds.extend_box(&skinned);
        }
        // Weights that do not sum exactly to 1 move vertices slightly out of the boxes.
        let slack = 2.0 * WEIGHT_TOLERANCE * bounds.min.abs().max(bounds.max.abs()) + TINY;
        Some(Aabb { min: bounds.min - slack, max: bounds.max + slack })
    }
}

impl Cluster {
    /// Bounds the vertices `first..end`.
    fn new(mesh: &Mesh, skin: Option<&Skin>, first: usize, end: usize) -> Option<Cluster> {
        let are_finite = |points: &[Vec3]| points.iter().all(|p| p.is_finite());
        let positions = &mesh.positions[first..end];
        let joint_boxes = match skin {
            _ if !are_finite(positions) => return None,
            Some(skin) => boxes_by_joint(mesh, skin.joints.len(), first, end)?,
            None => vec![(0, bounds_of(positions))],
        };
        let displacements = mesh.morph_targets.iter().map(|target| {
            let moved = target.positions.get(first..).unwrap_or_default();
            let moved = &moved[..moved.len().min(end - first)];
            // Contains 0, because targets may be shorter than the mesh.
            let mut bounds = Aabb { min: DVec3::ZERO, max: DVec3::ZERO };
            bounds.extend_box(&bounds_of(moved));
            are_finite(moved).then_some(bounds)
        });
        Some(Cluster { joint_boxes, displacements: displacements.collect::<Option<_>>()? })
    }
}

/// Returns the rest-pose bounds of the vertices that each joint influences. `None` if a vertex may leave
/// the convex hull of its joints, or if there are too many joints.
fn boxes_by_joint(mesh: &Mesh, joints: usize, first: usize, end: usize) -> Option<Vec<(u16, Aabb)>> {
    let n = mesh.influences.per_vertex;
    let mut boxes: Vec<(u16, Aabb)> = Vec::new();
    for (v, p) in (first..end).zip(&mesh.positions[first..end]) {
        let pairs = (v * n..(v + 1) * n).map(|i| (mesh.influences.joints[i], mesh.influences.weights[i]));
        let mut sum = 0.0;
        for (joint, w) in pairs.filter(|&(_, w)| w != 0.0) {
            let at = boxes.iter().position(|b| b.0 == joint).unwrap_or_else(|| {
                boxes.push((joint, Aabb::EMPTY));
                boxes.len() - 1
            });
            boxes[at].1.extend(p.as_dvec3());
            sum += f64::from(w);
            if usize::from(joint) >= joints || w < 0.0 || boxes.len() > MAX_JOINTS {
                return None;
            }
        }
        // Also false for NaN.
        let sums_to_one = (sum - 1.0f64).abs() <= WEIGHT_TOLERANCE;
        sums_to_one.then_some(())?;
    }
    Some(boxes)
}
