//! From obvhs's binary tree to a wide one.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams, ploc::PlocSearchDistance};
use rayon::prelude::*;

use super::Preset;
use super::forest::{Child, Grown, Leaves, Part, cut};
use super::pages::Pages;
use super::wide::{Box3, LEAF, Node, WIDTH, Wide};

/// A tree over boxes and what is in each leaf: leaf i holds the next `ends[i] − ends[i − 1]` of
/// `members`, which are indices of boxes.
pub(super) struct Collapsed {
    pub wide: Wide,
    pub members: Vec<u32>,
    pub ends: Vec<u32>,
}

/// obvhs's parameters; `None` for no tree. One entry to a leaf: leaves are made here.
fn params(preset: Preset) -> Option<BvhBuildParams> {
    let one = |params: BvhBuildParams| BvhBuildParams { pre_split: false, max_prims_per_leaf: 1, ..params };
    match preset {
        Preset::Flat => None,
        Preset::Fast => Some(one(BvhBuildParams::fastest_build())),
        Preset::Medium => Some(one(BvhBuildParams {
            ploc_search_distance: PlocSearchDistance::Low,
            search_depth_threshold: 2,
            reinsertion_batch_ratio: 0.02,
            ..BvhBuildParams::fast_build()
        })),
        Preset::Slow => Some(one(BvhBuildParams::slow_build())),
    }
}

/// Parts that a tree is cut into, so that all threads can work on it. The tree does not depend on
/// how many threads there are.
const PARTS: usize = 64;

/// Builds a tree over `boxes`, box i holding `sizes(i)` entries, with leaves of at most `capacity`
/// entries, or of one box that holds more. Equal boxes should be one box: a great many of them
/// make the builder very slow.
pub(super) fn build<T: Boundable>(
    boxes: &[T],
    sizes: impl Fn(u32) -> u32 + Sync,
    capacity: u32,
    preset: Preset,
) -> Collapsed {
    let Some(params) = params(preset).filter(|_| boxes.len() > 1) else {
        let all = 0..boxes.len() as u32;
        let root = (!boxes.is_empty()).then_some(LEAF);
        let wide = Wide { root, bounds: around(boxes), ..Wide::default() };
        return Collapsed { wide, ends: root.map(|_| all.end).into_iter().collect(), members: all.collect() };
    };
    let built = build_bvh2(boxes, params, &mut std::time::Duration::default());
    collapse(&built, PARTS, &Leaves { sizes, capacity })
}

fn around<T: Boundable>(boxes: &[T]) -> Box3 {
    let one = |of: &T| {
        let aabb = of.aabb();
        (Vec3::from(aabb.min), Vec3::from(aabb.max))
    };
    boxes.par_iter().map(one).reduce(|| (Vec3::MAX, Vec3::MIN), |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn collapse(built: &Bvh2, parts: usize, leaves: &Leaves<impl Fn(u32) -> u32 + Sync>) -> Collapsed {
    let plan = |root: u32, below: &[(u32, Part)]| Part::plan(built, root, below, leaves);
    let parts: Vec<(u32, Part)> =
        cut(built, parts).into_par_iter().map(|root| (root, plan(root, &[]))).collect();
    let top = plan(0, &parts);
    let mut grown = vec![top.grow(built, 1, &parts, leaves.capacity)];
    let mut roots = vec![0; parts.len()];
    grown[0].asked.iter().for_each(|&(part, count)| roots[part as usize] = count);
    let grow = |((_, part), &roots): (&(u32, Part), &usize)| match roots {
        0 => Grown::none(),
        _ => part.grow(built, roots, &[], leaves.capacity),
    };
    grown.par_extend(parts.par_iter().zip(&roots).map(grow));
    drop(parts);
    let aabb = built.nodes[0].aabb();
    join(&grown, (aabb.min.into(), aabb.max.into()))
}

/// One tree of the top and the parts under it.
fn join(grown: &[Grown], bounds: Box3) -> Collapsed {
    // Where each part's nodes, leaves and members begin among all.
    let mut starts = vec![[0usize; 3]];
    for part in grown {
        let [nodes, leaves, members] = starts[starts.len() - 1];
        starts.push([nodes + part.nodes(), leaves + part.ends.len(), members + part.members.len()]);
    }
    let [nodes, leaves, members] = starts[grown.len()];
    let placed = |child: &Child, part: usize| match *child {
        Child::Leaf(bounds, leaf) => (bounds, LEAF | (starts[part][1] as u32 + leaf)),
        Child::Node(bounds, node) => (bounds, starts[part][0] as u32 + node),
        // A part has none of its own.
        Child::Part(_) => (bounds, LEAF),
    };
    let node = |i: usize| {
        let part = starts.partition_point(|start| start[0] <= i) - 1;
        let of = &grown[part];
        let own = i - starts[part][0];
        let mut children = [(bounds, LEAF); WIDTH];
        let mut count = 0;
        let mut add = |child: (Box3, u32)| {
            children[count] = child;
            count += 1;
        };
        for child in &of.children[of.starts[own]..of.starts[own + 1]] {
            match child {
                Child::Part(k) => {
                    let k = *k as usize + 1;
                    grown[k].roots.iter().for_each(|root| add(placed(root, k)));
                }
                own => add(placed(own, part)),
            }
        }
        Node::new(&children[..count])
    };
    let nodes = Pages::filled(nodes, node);
    let mut all = Vec::with_capacity(members);
    let mut ends = Vec::with_capacity(leaves);
    for (part, start) in grown.iter().zip(&starts) {
        all.extend_from_slice(&part.members);
        ends.extend(part.ends.iter().map(|end| start[2] as u32 + end));
    }
    let root = grown[0].roots.first().map(|root| placed(root, 0).1);
    Collapsed { wide: Wide { nodes, root, bounds }, members: all, ends }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;
    use obvhs::aabb::Aabb;

    use super::*;

    /// Boxes here and there, crowded in places.
    fn boxes(count: u32) -> Vec<Aabb> {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let one = |_| {
            let place = Vec3A::new(next(), next(), next());
            let min = place * place * 100.0;
            Aabb { min, max: min + Vec3A::new(next(), next(), next()) * 0.1 }
        };
        (0..count).map(one).collect()
    }

    fn made(built: &Bvh2, parts: usize, sizes: impl Fn(u32) -> u32 + Sync) -> Collapsed {
        collapse(built, parts, &Leaves { sizes, capacity: 4 })
    }

    /// What each wide node and each leaf has, in no order.
    fn rows(of: &Collapsed) -> (Vec<Vec<u32>>, Vec<Vec<u32>>) {
        let node = |node: &Node| -> Vec<u32> {
            let planes = |slot: usize| node.planes.as_flattened().iter().map(move |p| p[slot].to_bits());
            (0..node.count()).flat_map(planes).collect()
        };
        let mut nodes: Vec<Vec<u32>> = of.wide.nodes.iter().map(node).collect();
        let starts = std::iter::once(&0).chain(&of.ends);
        let mut leaves: Vec<Vec<u32>> =
            starts.zip(&of.ends).map(|(&a, &b)| of.members[a as usize..b as usize].to_vec()).collect();
        nodes.sort();
        leaves.sort();
        (nodes, leaves)
    }

    #[test]
    fn a_tree_in_parts_is_the_tree_as_a_whole() {
        let boxes = boxes(20_000);
        let built = build_bvh2(&boxes, params(Preset::Fast).unwrap(), &mut std::time::Duration::default());
        let sizes = |i: u32| if i.is_multiple_of(50) { 6 } else { 1 };
        let whole = rows(&made(&built, 1, sizes));
        for parts in [2, 7, 64, 150] {
            assert!(cut(&built, parts).len() >= parts);
            assert!(rows(&made(&built, parts, sizes)) == whole, "{parts} parts");
        }
    }

    #[test]
    fn parents_come_first_and_every_box_is_in_one_leaf_within_all_its_parents() {
        let boxes = boxes(20_000);
        let built = build_bvh2(&boxes, params(Preset::Medium).unwrap(), &mut std::time::Duration::default());
        let made = made(&built, PARTS, |_| 1);
        let mut seen = vec![0; boxes.len()];
        let mut todo = vec![(made.wide.root.unwrap(), made.wide.bounds)];
        let mut nodes = 0;
        while let Some((child, (lo, hi))) = todo.pop() {
            if child & LEAF != 0 {
                let leaf = (child & !LEAF) as usize;
                let start = if leaf == 0 { 0 } else { made.ends[leaf - 1] };
                for &member in &made.members[start as usize..made.ends[leaf] as usize] {
                    let Aabb { min, max } = boxes[member as usize];
                    assert!(lo.cmple(min.into()).all() && hi.cmpge(max.into()).all());
                    seen[member as usize] += 1;
                }
                continue;
            }
            nodes += 1;
            let node = &made.wide.nodes[child as usize];
            for slot in 0..node.count() {
                let corner = |end: usize| Vec3::from([0, 1, 2].map(|axis| node.planes[axis][end][slot]));
                let inside = (corner(0), corner(1));
                assert!(lo.cmple(inside.0).all() && hi.cmpge(inside.1).all());
                assert!(node.child[slot] & LEAF != 0 || node.child[slot] > child);
                todo.push((node.child[slot], inside));
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        assert_eq!(nodes, made.wide.nodes.len());
    }

    /// Costs that overflow still make a tree.
    #[test]
    fn huge_boxes_make_a_tree() {
        let huge = |i: u32| {
            let min = Vec3A::splat(-1e18 + i as f32 * 1e12);
            Aabb { min, max: Vec3A::splat(1e18) }
        };
        let boxes: Vec<Aabb> = (0..300).map(huge).collect();
        for preset in [Preset::Fast, Preset::Medium] {
            let made = build(&boxes, |_| 1, 4, preset);
            assert_eq!((made.members.len(), *made.ends.last().unwrap()), (300, 300));
        }
    }
}
