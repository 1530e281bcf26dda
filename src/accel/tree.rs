//! A binary tree of boxes and the way rays go through it. It knows boxes alone: what is in its
//! leaves is its users' affair.

use glam::{Vec3, Vec3A, Vec4, Vec4Swizzles};
use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2};

use super::Preset;
use crate::geometry::EPSILON;

/// A box: its lowest and its highest corner.
pub(super) type Box3 = (Vec3, Vec3);

/// A node: a leaf's entries, or (with no entries) the index of the pair of its children.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    first: u32,
    count: u32,
}

/// Two sibling nodes and their boxes, on one cache line. Each axis holds
/// (min₀, min₁, max₀, max₁), so that both children are tested by the same few vector operations.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Pair {
    planes: [Vec4; 3],
    children: [Node; 2],
}

/// A tree over boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    root: Node,
    pairs: Vec<Pair>,
}

/// Nodes that a ray has yet to visit, with where it enters them. One for each batch, reused ray
/// after ray; a growing vector, so that no tree is too deep.
#[derive(Clone, Debug, Default)]
pub(super) struct Stack(Vec<(Node, f32)>);

/// obvhs's parameters; `None` for no tree.
fn params(preset: Preset) -> Option<BvhBuildParams> {
    match preset {
        Preset::Flat => None,
        Preset::Fast => Some(BvhBuildParams::very_fast_build()),
        Preset::Medium => Some(BvhBuildParams::medium_build()),
        Preset::Slow => Some(BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() }),
    }
}

impl Tree {
    /// A tree over `boxes`, and the order of its entries: leaves hold ranges of that order.
    /// Equal boxes should be one box: a great many of them make the builder very slow.
    pub fn build(boxes: &[Box3], preset: Preset) -> (Tree, Vec<u32>) {
        let Some(params) = params(preset).filter(|_| boxes.len() > 1) else {
            let root = Node { first: 0, count: boxes.len() as u32 };
            return (Tree { root, pairs: Vec::new() }, (0..boxes.len() as u32).collect());
        };
        let boxes: Vec<obvhs::aabb::Aabb> = boxes
            .iter()
            .map(|&(min, max)| obvhs::aabb::Aabb { min: Vec3A::from(min), max: Vec3A::from(max) })
            .collect();
        let built = build_bvh2(&boxes, params, &mut std::time::Duration::default());
        let mut tree = Tree { root: Node::default(), pairs: Vec::with_capacity(built.nodes.len() / 2) };
        // (the inner node to convert, where its index goes)
        let mut todo: Vec<(u32, Option<(usize, usize)>)> = Vec::new();
        if built.nodes[0].is_leaf() {
            tree.root = Node { first: built.nodes[0].first_index, count: built.nodes[0].prim_count };
        } else {
            todo.push((0, None));
        }
        while let Some((index, parent)) = todo.pop() {
            let here = tree.pairs.len();
            if let Some((pair, side)) = parent {
                tree.pairs[pair].children[side].first = here as u32;
            }
            let first = built.nodes[index as usize].first_index;
            let [a, b] = [first, first + 1].map(|i| &built.nodes[i as usize]);
            let planes = [0, 1, 2].map(|k| {
                let (a, b) = (a.aabb(), b.aabb());
                Vec4::new(a.min[k], b.min[k], a.max[k], b.max[k])
            });
            let children = [a, b].map(|n| match n.is_leaf() {
                true => Node { first: n.first_index, count: n.prim_count },
                false => Node::default(),
            });
            tree.pairs.push(Pair { planes, children });
            for side in [1, 0] {
                if children[side].count == 0 {
                    todo.push((first + side as u32, Some((here, side))));
                }
            }
        }
        (tree, built.primitive_indices)
    }

    /// Replaces each entry by a run of `sizes[entry]` entries, in the same order.
    pub fn widen(&mut self, sizes: &[u32]) {
        let mut starts = Vec::with_capacity(sizes.len() + 1);
        let mut sum = 0;
        starts.push(0);
        for size in sizes {
            sum += size;
            starts.push(sum);
        }
        let nodes = self.pairs.iter_mut().flat_map(|p| &mut p.children).chain([&mut self.root]);
        for node in nodes.filter(|n| n.count > 0) {
            let (start, end) = (starts[node.first as usize], starts[(node.first + node.count) as usize]);
            *node = Node { first: start, count: end - start };
        }
    }

    /// Number of inner nodes.
    pub fn nodes(&self) -> usize {
        self.pairs.len()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.pairs.capacity() * size_of::<Pair>()
    }

    /// Leads a ray through the tree, near children first. `leaf` gets the range of entries of each
    /// leaf that the ray meets no farther than `limit`, and says the limit from there on, or
    /// `None` to stop. False where it was stopped.
    #[inline(always)]
    pub fn walk(
        &self,
        ray: &BoxRay,
        stack: &mut Stack,
        mut limit: f32,
        mut leaf: impl FnMut(std::ops::Range<usize>, &mut Stack) -> Option<f32>,
    ) -> bool {
        let base = stack.0.len();
        let mut node = self.root;
        if node.count == 0 && self.pairs.is_empty() {
            return true;
        }
        loop {
            let mut next = None;
            if node.count > 0 {
                let range = node.first as usize..node.first as usize + node.count as usize;
                match leaf(range, stack) {
                    Some(to) => limit = to,
                    None => {
                        stack.0.truncate(base);
                        return false;
                    }
                }
            } else {
                let pair = &self.pairs[node.first as usize];
                let (near, far) = ray.enters(&pair.planes);
                let meets = |side: usize| far[side] >= ray.start && near[side] <= far[side].min(limit);
                next = match (meets(0), meets(1)) {
                    (true, true) => {
                        let first = usize::from(near[1] < near[0]);
                        stack.0.push((pair.children[1 - first], near[1 - first]));
                        Some(pair.children[first])
                    }
                    (true, false) => Some(pair.children[0]),
                    (false, true) => Some(pair.children[1]),
                    (false, false) => None,
                };
            }
            node = match next {
                Some(node) => node,
                None => loop {
                    if stack.0.len() == base {
                        return true;
                    }
                    match stack.0.pop() {
                        Some((node, near)) if near <= limit => break node,
                        Some(_) => {}
                        None => return true,
                    }
                },
            };
        }
    }
}

/// A ray prepared for boxes.
///
/// A plane is met at (b − o)·(1/d). Each of the three roundings is relative to its result, so
/// the near side is right to 3 half-ulps and the far side, grown by 8ε, never short: the test is
/// conservative wherever the ray comes from, which b·(1/d) − o·(1/d) is not.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxRay {
    /// For each axis the origin as the planes are laid out, moved outwards by the padding.
    origin: [Vec4; 3],
    /// 1/d, never infinite, so that nothing below is NaN.
    reciprocal: Vec3,
    /// Boxes that end before this are behind the ray.
    start: f32,
}

const GROW: f32 = 1.0 + 8.0 * EPSILON;
const SHRINK: f32 = 1.0 - 8.0 * EPSILON;

impl BoxRay {
    /// Boxes count as wider by `pad` on every side.
    pub fn new(o: Vec3, d: Vec3, pad: f32, start: f32) -> BoxRay {
        let origin = [0, 1, 2].map(|k| {
            let (low, high) = (o[k] + pad, o[k] - pad);
            Vec4::new(low, low, high, high)
        });
        let reciprocal = (1.0 / d).clamp(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX));
        BoxRay { origin, reciprocal, start: start * SHRINK }
    }

    /// The limit for a t, with slack for the rounding of the boxes' near sides.
    pub fn limit(t: f32) -> f32 {
        t * GROW
    }

    /// Where the ray enters and leaves the two boxes (the first two lanes of each).
    #[inline(always)]
    fn enters(&self, planes: &[Vec4; 3]) -> (Vec4, Vec4) {
        let axis = |k: usize| {
            let t = (planes[k] - self.origin[k]) * self.reciprocal[k];
            let other = t.zwxy();
            (t.min(other), t.max(other))
        };
        let ((x0, x1), (y0, y1), (z0, z1)) = (axis(0), axis(1), axis(2));
        (x0.max(y0).max(z0), x1.min(y1).min(z1) * GROW)
    }
}
