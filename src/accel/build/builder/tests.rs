use glam::{Vec3, Vec3A};

use super::*;
use crate::bvh::sah::sah_cost;

const CAPACITY: LeafCapacity = LeafCapacity::BLOCKS;

/// Boxes by their indices; every fiftieth needs a second block.
struct TestCluster {
    boxes: Vec<ObvhsAabb>,
    indices: Vec<u32>,
}

fn entry_count(i: u32) -> u32 {
    if i.is_multiple_of(50) { 6 } else { 1 }
}

impl Cluster for TestCluster {
    type Leaves = Vec<Vec<u32>>;

    fn boxes(&self) -> &[ObvhsAabb] {
        &self.boxes
    }

    fn entry_count(&self, i: u32) -> u32 {
        entry_count(self.indices[i as usize])
    }

    fn into_leaves<'a>(self, leaves: impl Iterator<Item = &'a [u32]>) -> ClusterLeaves<Self::Leaves> {
        let contents: Vec<Vec<u32>> =
            leaves.map(|leaf| leaf.iter().map(|&i| self.indices[i as usize]).collect()).collect();
        let end = contents.len() as u32;
        let occlusion_costs = contents.iter().map(|leaf| occlusion_cost(leaf)).collect();
        ClusterLeaves { contents, numbers: (0..end).collect(), end, occlusion_costs }
    }
}

/// Some leaves occlude much, some little, some nothing.
fn occlusion_cost(leaf: &[u32]) -> OcclusionCost {
    let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    OcclusionCost::of_leaf(bounds, f64::from(leaf[0] % 7) / 2.0, 1 + leaf.len() as u32 / 3)
}

/// Builds a tree and returns it with the boxes in its leaves.
fn built(boxes: &[ObvhsAabb], params: Option<BuildParams>) -> (Bvh8, Vec<Vec<u32>>) {
    let make_cluster = |keys: &[MortonKey]| {
        let indices: Vec<u32> = keys.iter().map(|key| key.index() as u32).collect();
        TestCluster { boxes: indices.iter().map(|&i| boxes[i as usize]).collect(), indices }
    };
    let keys = (0..boxes.len()).map(MortonKey::new).collect();
    let clusters =
        MortonClusters::new(keys, |i| boxes[i], params.map_or(usize::MAX, |params| params.max_cluster_size));
    let (bvh, leaves) =
        build_clusters(clusters, make_cluster, CAPACITY, params, &CancelToken::default()).unwrap();
    (bvh, leaves.into_iter().flat_map(|leaves| leaves.contents).collect())
}

/// Small boxes at random places, denser towards a corner.
fn random_boxes(count: u32) -> Vec<ObvhsAabb> {
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let random_box = |_| {
        let p = Vec3A::new(next(), next(), next());
        let min = p * p * 100.0;
        ObvhsAabb { min, max: min + Vec3A::new(next(), next(), next()) * 0.1 }
    };
    (0..count).map(random_box).collect()
}

/// Asserts that every box is in one leaf and inside all boxes above it, and that no leaf is over capacity.
fn check(boxes: &[ObvhsAabb], (bvh, leaves): &(Bvh8, Vec<Vec<u32>>)) {
    let mut times_found = vec![0; boxes.len()];
    let mut stack: Vec<(u32, Aabb)> = bvh.root.map(|root| (root, bvh.bounds)).into_iter().collect();
    let mut nodes = 0;
    while let Some((child, bounds)) = stack.pop() {
        if child & LEAF_BIT != 0 {
            let leaf = &leaves[(child & !LEAF_BIT) as usize];
            assert!(
                leaf.len() == 1
                    || leaf.iter().map(|&i| entry_count(i)).sum::<u32>() <= CAPACITY.entries_per_leaf
            );
            for &i in leaf {
                assert!(bounds.contains(boxes[i as usize].into()));
                times_found[i as usize] += 1;
            }
            continue;
        }
        nodes += 1;
        let node = &bvh.nodes[child as usize];
        for slot in 0..node.count() {
            assert!(bounds.contains(node.bounds(slot)));
            assert!(
                node.child[slot] & LEAF_BIT != 0 || node.child[slot] > child,
                "a child before its parent"
            );
            stack.push((node.child[slot], node.bounds(slot)));
        }
    }
    assert!(times_found.iter().all(|&times| times == 1));
    assert_eq!(nodes, bvh.nodes.len());
}

#[test]
fn parents_come_first_and_every_box_is_in_one_leaf_inside_all_its_parents() {
    let boxes = random_boxes(20_000);
    for preset in [Preset::Fast, Preset::Medium, Preset::Slow] {
        for count in [1, 2, 5, 300, CLUSTER_SIZE, CLUSTER_SIZE + 1, boxes.len()] {
            check(&boxes[..count], &built(&boxes[..count], BuildParams::new(preset, CAPACITY)));
        }
    }
    let (empty, leaves) = built(&[], BuildParams::new(Preset::Medium, CAPACITY));
    assert!(empty.root.is_none() && leaves.is_empty());
}

#[test]
fn children_are_sorted_by_occlusion_priority() {
    let boxes = random_boxes(20_000);
    for preset in [Preset::Medium, Preset::Slow] {
        let (bvh, leaves) = built(&boxes, BuildParams::new(preset, CAPACITY));
        let mut node_costs = vec![OcclusionCost::default(); bvh.nodes.len()];
        for (i, node) in bvh.nodes.iter().enumerate().rev() {
            let cost = |slot: usize| match node.child[slot] {
                child if child & LEAF_BIT != 0 => occlusion_cost(&leaves[(child & !LEAF_BIT) as usize]),
                child => node_costs[child as usize],
            };
            let children: Vec<(Aabb, OcclusionCost)> =
                (0..node.count()).map(|slot| (node.bounds(slot), cost(slot))).collect();
            let sorted = children.windows(2).all(|pair| pair[0].1.priority() >= pair[1].1.priority());
            assert!(sorted, "{children:?}");
            node_costs[i] = OcclusionCost::of_node(node.union_of_children(), children.into_iter());
        }
        assert_eq!(node_costs[0], bvh.occlusion_cost);
    }
}

#[test]
fn a_tree_does_not_depend_on_the_number_of_threads() {
    let boxes = random_boxes(20_000);
    let built_by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (bvh, leaves) = pool.install(|| built(&boxes, BuildParams::new(Preset::Medium, CAPACITY)));
        (bytemuck::cast_slice::<Bvh8Node, u8>(&bvh.nodes).to_vec(), bvh.root, leaves)
    };
    assert!(built_by(1) == built_by(3));
}

/// A tree of clusters costs lines less than 10 % more than a single one, with walls across clusters or without.
/// Clusters here have a quarter of the usual size; with a sixteenth, the cost is 14 % higher.
#[test]
fn clusters_cost_rays_little() {
    let mut boxes = random_boxes(20_000);
    for walls in [0, 100] {
        for (i, wall) in boxes.iter_mut().take(walls).enumerate() {
            let y = i as f32;
            *wall = ObvhsAabb { min: Vec3A::new(0.0, y, 0.0), max: Vec3A::new(100.0, y, 100.0) };
        }
        let cost = |max_cluster_size: usize| {
            let params = BuildParams::new(Preset::Medium, CAPACITY);
            let params = params.map(|params| BuildParams { max_cluster_size, ..params });
            let (bvh, leaves) = built(&boxes, params);
            sah_cost(&bvh, |leaf| leaves[leaf as usize].len() as f64)
        };
        let clusters = cost(1024);
        let single = cost(usize::MAX);
        assert!(clusters < 1.1 * single, "{walls} walls: {clusters} {single}");
    }
}

#[test]
fn boxes_whose_costs_overflow_make_a_tree() {
    let huge = |i: u32| {
        let min = Vec3A::splat(-1e18 + i as f32 * 1e12);
        ObvhsAabb { min, max: Vec3A::splat(1e18) }
    };
    let boxes: Vec<ObvhsAabb> = (0..300).map(huge).collect();
    for preset in [Preset::Fast, Preset::Medium, Preset::Slow] {
        check(&boxes, &built(&boxes, BuildParams::new(preset, CAPACITY)));
    }
}
