//! A tree over the triangles of glowing surfaces that picks one for a point, the likelier the more light it may send there
//! (Conty Estevez and Kulla, “Importance Sampling of Many Lights with Adaptive Tree Splitting”, HPG 2018).
//!
//! Each node bounds its triangles by a sphere and their front normals by a cone. A point goes down from the root, and at
//! each node takes a child with a probability in proportion to an estimate: power over squared distance, times the cosine
//! to the nearest normal. Most glowing meshes are closed, and their back sides hidden: those keep a small share.

use glam::Vec3;

/// Least factor of triangles that face away. Materials with two sides emit there too.
const LEAST_COSINE: f32 = 0.1;
/// The parent of the root, and the node of a triangle that does not glow.
const NONE: u32 = u32::MAX;

/// A glowing triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    /// Its number among all triangles.
    pub index: u32,
    pub corners: [Vec3; 3],
    /// Unit normal of its front; 0 if it has none.
    pub normal: Vec3,
    /// Area × radiance, in any unit.
    pub power: f32,
}

/// Bounds and power of some triangles.
#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius: f32,
    /// Axis of the cone of normals, and the cosine of its half angle: −1 for all directions.
    axis: Vec3,
    cos_half: f32,
    power: f32,
    parent: u32,
    /// The first of two children, which follow each other; or the number of the triangle.
    child: u32,
    is_leaf: bool,
}

/// The tree.
#[derive(Debug)]
pub(super) struct LightTree {
    /// The root first.
    nodes: Vec<Node>,
    /// The node of each triangle.
    leaves: Vec<u32>,
}

impl LightTree {
    /// Builds the tree of `emitters`, of `count` triangles in all; `None` if nothing glows.
    pub fn new(mut emitters: Vec<Emitter>, count: usize) -> Option<LightTree> {
        emitters.retain(|emitter| emitter.power > 0.0 && emitter.power.is_finite());
        if emitters.is_empty() {
            return None;
        }
        let mut tree = LightTree { nodes: Vec::with_capacity(2 * emitters.len()), leaves: vec![NONE; count] };
        tree.nodes.push(Node::new(&emitters, NONE));
        let mut open = vec![(0, 0..emitters.len())];
        while let Some((at, range)) = open.pop() {
            let of_node = &mut emitters[range.clone()];
            let first = tree.nodes.len() as u32;
            if let [only] = of_node {
                tree.nodes[at].is_leaf = true;
                tree.nodes[at].child = only.index;
                tree.leaves[only.index as usize] = at as u32;
                continue;
            }
            let middle = split(of_node);
            tree.nodes[at].child = first;
            for half in [&of_node[..middle], &of_node[middle..]] {
                tree.nodes.push(Node::new(half, at as u32));
            }
            let middle = range.start + middle;
            open.push((first as usize, range.start..middle));
            open.push((first as usize + 1, middle..range.end));
        }
        Some(tree)
    }

    /// Picks the triangle of a random number for a point. Returns its number and its probability.
    pub fn sample(&self, from: Vec3, mut choice: f32) -> (u32, f64) {
        let mut probability = 1.0;
        let mut node = &self.nodes[0];
        while !node.is_leaf {
            let left = self.probability_of_left(node.child, from);
            let goes_left = choice < left;
            let (share, start) = if goes_left { (left, 0.0) } else { (1.0 - left, left) };
            choice = ((choice - start) / share).clamp(0.0, 1.0 - f32::EPSILON);
            probability *= f64::from(share);
            node = &self.nodes[node.child as usize + usize::from(!goes_left)];
        }
        (node.child, probability)
    }

    /// Returns the probability with which a triangle is picked for a point; 0 if it does not glow.
    pub fn probability(&self, index: u32, from: Vec3) -> f64 {
        let mut at = self.leaves[index as usize];
        if at == NONE {
            return 0.0;
        }
        let mut probability = 1.0;
        while self.nodes[at as usize].parent != NONE {
            let parent = self.nodes[at as usize].parent;
            let first = self.nodes[parent as usize].child;
            let left = self.probability_of_left(first, from);
            probability *= f64::from(if at == first { left } else { 1.0 - left });
            at = parent;
        }
        probability
    }

    /// The probability of node `first` against the one that follows it.
    fn probability_of_left(&self, first: u32, from: Vec3) -> f32 {
        let [left, right] = [0, 1].map(|i| self.nodes[first as usize + i].importance(from));
        let share = left / (left + right);
        // Both are 0 or infinite only where numbers are out of range.
        if share.is_finite() { share } else { 0.5 }
    }
}

impl Node {
    fn new(emitters: &[Emitter], parent: u32) -> Node {
        let corners = || emitters.iter().flat_map(|emitter| emitter.corners);
        let low = corners().fold(Vec3::INFINITY, Vec3::min);
        let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        let center = low * 0.5 + high * 0.5;
        let radius = corners().map(|p| p.distance(center)).fold(0.0, f32::max);
        let power = emitters.iter().map(|emitter| f64::from(emitter.power)).sum::<f64>() as f32;
        let sum: Vec3 = emitters.iter().map(|emitter| emitter.normal).sum();
        let axis = sum.normalize_or_zero();
        let cosines = emitters.iter().map(|emitter| emitter.normal.dot(axis));
        let cos_half = if axis == Vec3::ZERO { -1.0 } else { cosines.fold(1.0, f32::min).max(-1.0) };
        Node { center, radius, axis, cos_half, power, parent, child: 0, is_leaf: false }
    }

    /// An estimate of the light at a point.
    fn importance(&self, from: Vec3) -> f32 {
        let offset = from - self.center;
        let d2 = offset.length_squared();
        let r2 = self.radius * self.radius;
        let by_distance = self.power / d2.max(r2).max(f32::MIN_POSITIVE);
        if d2 <= r2 || self.cos_half <= -1.0 {
            return by_distance;
        }
        // The least angle between a normal and a direction to the point is that to the axis, less the cone's half angle,
        // less the angle under which the sphere is seen.
        let cos = (offset.dot(self.axis) / d2.sqrt()).clamp(-1.0, 1.0);
        let sin_seen2 = r2 / d2;
        let (cos, sin) = subtract_angle((cos, sine(cos)), (self.cos_half, sine(self.cos_half)));
        let (cos, _) = subtract_angle((cos, sin), ((1.0 - sin_seen2).sqrt(), sin_seen2.sqrt()));
        by_distance * cos.max(LEAST_COSINE)
    }
}

fn sine(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

/// Cosine and sine of angle a − b between 0 and π, 0 where b is the larger.
fn subtract_angle((cos_a, sin_a): (f32, f32), (cos_b, sin_b): (f32, f32)) -> (f32, f32) {
    if cos_a > cos_b { (1.0, 0.0) } else { (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b) }
}

/// Sorts triangles into two halves along the longest side of the box of their centres. Returns where the second begins.
fn split(emitters: &mut [Emitter]) -> usize {
    let center = |emitter: &Emitter| emitter.corners.iter().sum::<Vec3>() / 3.0;
    let centers = || emitters.iter().map(center);
    let size = centers().fold(Vec3::NEG_INFINITY, Vec3::max) - centers().fold(Vec3::INFINITY, Vec3::min);
    let axis = size.max_position();
    let middle = emitters.len() / 2;
    emitters.select_nth_unstable_by(middle, |a, b| {
        center(a)[axis].total_cmp(&center(b)[axis]).then(a.index.cmp(&b.index))
    });
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lamps of 20 triangles each along a corridor, with a dark one between.
    fn corridor() -> LightTree {
        let mut emitters = Vec::new();
        for lamp in 0..8 {
            for i in 0..20 {
                let normal = Vec3::new((i as f32).cos(), (i as f32).sin(), (i % 3) as f32 - 1.0).normalize();
                let p = Vec3::new(0.0, 2.5, 1.5 * lamp as f32) + 0.1 * normal;
                let (x, y) = normal.any_orthonormal_pair();
                let corners = [p, p + 0.03 * x, p + 0.03 * y];
                let power = if lamp == 3 { 0.0 } else { 1.0 + (i % 4) as f32 };
                emitters.push(Emitter { index: emitters.len() as u32, corners, normal, power });
            }
        }
        LightTree::new(emitters, 160).unwrap()
    }

    const POINTS: [Vec3; 4] =
        [Vec3::ZERO, Vec3::new(0.3, 1.0, 6.0), Vec3::new(0.0, 2.5, 4.6), Vec3::new(90.0, -7.0, 3.0)];

    #[test]
    fn triangles_are_picked_with_their_probability() {
        let tree = corridor();
        for from in POINTS {
            let probabilities: Vec<f64> = (0..160).map(|i| tree.probability(i, from)).collect();
            assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-4);
            assert!(probabilities[60..80].iter().all(|p| *p == 0.0));
            let n = 40_000;
            let mut counts = [0.0; 160];
            for k in 0..n {
                let (index, probability) = tree.sample(from, (k as f32 + 0.5) / n as f32);
                assert!((probability - probabilities[index as usize]).abs() < 1e-5 * probability);
                counts[index as usize] += 1.0 / n as f64;
            }
            for (count, probability) in counts.iter().zip(probabilities) {
                assert!((count - probability).abs() < 2e-4, "{count} of {probability}");
            }
        }
    }

    #[test]
    fn near_lamps_and_their_near_sides_are_picked_more_often() {
        let tree = corridor();
        let from = Vec3::new(0.0, 1.5, 6.0);
        let lamp = |k: u32| (20 * k..20 * k + 20).map(|i| tree.probability(i, from)).sum::<f64>();
        assert!(lamp(4) > 0.35 && lamp(4) > 5.0 * lamp(0), "{} {}", lamp(4), lamp(0));
        // The triangle at an angle of 5 radians faces down, the one at 2 radians up.
        assert!(tree.probability(85, from) > 4.0 / 3.0 * tree.probability(82, from));
    }

    #[test]
    fn nothing_glows_without_power() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let dark = Emitter { index: 0, corners, normal: Vec3::Z, power: 0.0 };
        assert!(LightTree::new(vec![dark], 1).is_none());
        let lit = Emitter { power: 1.0, ..dark };
        let tree = LightTree::new(vec![lit], 1).unwrap();
        assert_eq!(tree.sample(Vec3::ONE, 0.7), (0, 1.0));
        assert_eq!(tree.probability(0, Vec3::ONE), 1.0);
    }
}
