//! Where the vertices of a mesh that bends can be at most, without a look at each: morph targets move a box of
//! them by a sum of boxes, a joint takes a box of those that follow it along, and skinning puts each vertex
//! between the places where its joints would have it.

use glam::DVec3;

use crate::geometry::Aabb;
use crate::scene::animation::deform::MeshDeformer;
use crate::scene::animation::pose_bounds::{CROWD, box_about, box_of};
use crate::scene::{Mesh, Skin};

/// Joints that a crowd follows, at most: with more, boxes take longer than a look at its vertices.
const MOST: usize = 16;
/// How far the weights of a vertex may be from summing to one: more than f32 rounds.
const SLACK: f64 = 1e-5;
/// What f32 rounds a sum's terms by, with room to spare.
const ROUNDING: f64 = 1e-6;
/// And where there is next to nothing to round.
const TINY: f64 = f32::MIN_POSITIVE as f64;
/// What lies farther out is soon beyond f32.
const FAR: f64 = 1e30;

/// The vertices of a mesh, in their order, in crowds of [`CROWD`].
pub(crate) struct SkinnedClusters {
    /// `None` where a box would not hold.
    crowds: Vec<Option<Cluster>>,
}

struct Cluster {
    /// Boxes of its vertices at rest: for each joint, of those that follow it. One of all without a skin.
    boxes: Vec<(u16, Aabb)>,
    /// How far each morph target moves them.
    moves: Vec<Aabb>,
}

impl SkinnedClusters {
    pub fn new(mesh: &Mesh, skin: Option<&Skin>) -> SkinnedClusters {
        let all = mesh.positions.len();
        let starts = (0..all).step_by(CROWD);
        SkinnedClusters {
            crowds: starts.map(|v| Cluster::new(mesh, skin, v, (v + CROWD).min(all))).collect(),
        }
    }

    /// A box that holds every vertex of a crowd once it is bent, whatever is rounded.
    pub fn around(&self, crowd: usize, bend: &MeshDeformer) -> Option<Aabb> {
        let Cluster { boxes, moves } = self.crowds[crowd].as_ref()?;
        let mut moved = Aabb { min: DVec3::ZERO, max: DVec3::ZERO };
        let mut terms = DVec3::ZERO;
        for (by, w) in moves.iter().zip(bend.weights).filter(|(_, w)| **w != 0.0) {
            let (a, b) = (by.min * f64::from(*w), by.max * f64::from(*w));
            moved = Aabb { min: moved.min + a.min(b), max: moved.max + a.max(b) };
            terms += a.abs().max(b.abs());
        }
        let mut around = Aabb::EMPTY;
        for (joint, own) in boxes {
            let terms = terms + own.min.abs().max(own.max.abs());
            let rounding = (1 + moves.len()) as f64 * (ROUNDING * terms + TINY);
            let morphed = Aabb { min: own.min + moved.min - rounding, max: own.max + moved.max + rounding };
            let placed = match &bend.joints {
                Some(joints) => box_about(joints.get(usize::from(*joint))?, &morphed),
                None => morphed,
            };
            // Also false of what is not a number.
            let near = |p: DVec3| p.abs().cmplt(DVec3::splat(FAR)).all();
            if !(near(terms) && near(placed.min) && near(placed.max)) {
                return None;
            }
            around.extend_box(&placed);
        }
        // Weights that sum to a little more or less than one take a vertex a little out of its joints' boxes.
        let more = 2.0 * SLACK * around.min.abs().max(around.max.abs()) + TINY;
        Some(Aabb { min: around.min - more, max: around.max + more })
    }
}

impl Cluster {
    /// Of the vertices from `first` up to `end`.
    fn new(mesh: &Mesh, skin: Option<&Skin>, first: usize, end: usize) -> Option<Cluster> {
        let finite = |points: &[glam::Vec3]| points.iter().all(|p| p.is_finite());
        let own = &mesh.positions[first..end];
        let boxes = match skin {
            _ if !finite(own) => return None,
            Some(skin) => by_joint(mesh, skin.joints.len(), first, end)?,
            None => vec![(0, box_of(own))],
        };
        // No target is there for no vertex: what moves some of a crowd leaves others where they are.
        let still = Aabb { min: DVec3::ZERO, max: DVec3::ZERO };
        let moves = mesh.morph_targets.iter().map(|target| {
            let moved = target.positions.get(first..).unwrap_or_default();
            let moved = &moved[..moved.len().min(end - first)];
            let mut by = still;
            by.extend_box(&box_of(moved));
            finite(moved).then_some(by)
        });
        Some(Cluster { boxes, moves: moves.collect::<Option<_>>()? })
    }
}

/// Boxes of vertices at rest by the joints that they follow, where their weights let them be between those.
fn by_joint(mesh: &Mesh, joints: usize, first: usize, end: usize) -> Option<Vec<(u16, Aabb)>> {
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
            if usize::from(joint) >= joints || w < 0.0 || boxes.len() > MOST {
                return None;
            }
        }
        // What is not a number is not near one either.
        let near = (sum - 1.0f64).abs() <= SLACK;
        near.then_some(())?;
    }
    Some(boxes)
}
