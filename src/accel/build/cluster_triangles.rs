//! The triangles of a cluster, merged into fewer boxes for the builder.
//!
//! - Coincident triangles, of either winding, share one leaf entry that lists them all.
//! - Entries with equal boxes share one box. Thousands of equal boxes would make the builder take minutes, for a
//!   tree as deep as they are many. Equal boxes lie in one Morton cell, and hardly any other triangles do.
//! - Neighbours along the curve whose boxes mostly overlap, such as the two halves of a rectangle, share one box: that
//!   halves the builder's work, and it would put them into one leaf anyway.

use obvhs::aabb::Aabb as ObvhsAabb;

use crate::build::builder::{Cluster, ClusterLeaves};
use crate::build::input_triangles::{BuildTriangles, InputTriangle};
use crate::build::morton_clusters::MortonKey;
use crate::bvh::aabb::Aabb;
use crate::bvh::build_triangle::BuildTriangle;
use crate::bvh::coincident::{CoincidentGroup, group_by_flags};
use crate::bvh::occlusion_order::{OcclusionCost, occluding_fraction};
use crate::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};

/// Two triangles share a box where its area is at most this fraction of the sum of theirs.
const PAIR_AREA_RATIO: f32 = 0.95;

/// Cells of up to this many triangles are searched for equal boxes by comparing all pairs.
const SMALL_CELL: usize = 8;

/// Returns true if two triangles of a small cell have equal bounds.
fn has_equal_bounds(cell: &[u32], bounds: impl Fn(&u32) -> [[u32; 3]; 2]) -> bool {
    let mut all = [[[0; 3]; 2]; SMALL_CELL];
    all.iter_mut().zip(cell).for_each(|(to, i)| *to = bounds(i));
    (1..cell.len()).any(|i| all[..i].contains(&all[i]))
}

/// The area of a triangle that counts as an occluder.
fn occluding_area(triangle: &BuildTriangle) -> f64 {
    triangle.triangle.area() * occluding_fraction(triangle.flags.class)
}

/// The contents of a box.
#[derive(Clone, Copy)]
enum BoxContents {
    /// The index of a triangle in the input.
    One(u32),
    Two([u32; 2]),
    /// An index of [`ClusterTriangles::equal_boxes`].
    Many(u32),
}

/// The triangles of a cluster.
#[derive(Default)]
pub(crate) struct ClusterTriangles {
    boxes: Vec<ObvhsAabb>,
    /// The contents of each box.
    box_contents: Vec<BoxContents>,
    /// The occluding area in each box.
    areas: Vec<f64>,
    /// Lists of entries with equal boxes. The index of an entry is a triangle's, or [`COINCIDENT`] and an index of
    /// `coincident`.
    equal_boxes: Vec<Vec<BuildTriangle>>,
    coincident: Vec<Vec<CoincidentGroup>>,
    /// Number of triangles that are coincident with one of a lower index.
    coincident_count: u64,
}

impl ClusterTriangles {
    /// Makes the cluster of some triangles of `all`, by their keys sorted by cell.
    pub fn new<I: Fn(usize) -> InputTriangle + Sync>(
        all: &BuildTriangles<I>,
        keys: &[MortonKey],
    ) -> ClusterTriangles {
        let mut cluster = ClusterTriangles {
            boxes: Vec::with_capacity(keys.len()),
            box_contents: Vec::with_capacity(keys.len()),
            areas: Vec::with_capacity(keys.len()),
            ..ClusterTriangles::default()
        };
        for cell in keys.chunk_by(|a, b| a.cell() == b.cell()) {
            match cell {
                [key] => cluster.add_one(all, key.index() as u32),
                _ => cluster.add_cell(all, cell.iter().map(|key| key.index() as u32).collect()),
            }
        }
        cluster.merge_pairs();
        cluster
    }

    fn add(&mut self, bounds: ObvhsAabb, box_contents: BoxContents, area: f64) {
        self.boxes.push(bounds);
        self.box_contents.push(box_contents);
        self.areas.push(area);
    }

    /// Adds triangle `i` in a box of its own.
    fn add_one<I: Fn(usize) -> InputTriangle + Sync>(&mut self, all: &BuildTriangles<I>, i: u32) {
        let triangle = all.get(i);
        self.add(triangle.triangle.bounds().into(), BoxContents::One(i), occluding_area(&triangle));
    }

    /// Adds the triangles of a cell, those with equal boxes together.
    fn add_cell<I: Fn(usize) -> InputTriangle + Sync>(
        &mut self,
        all: &BuildTriangles<I>,
        mut cell: Vec<u32>,
    ) {
        let triangle = |&i: &u32| all.get(i).triangle;
        let bounds = |&i: &u32| all.bounds(i).to_bits();
        if cell.len() <= SMALL_CELL && !has_equal_bounds(&cell, bounds) {
            cell.iter().for_each(|&i| self.add_one(all, i));
            return;
        }
        cell.sort_by_cached_key(|i| (bounds(i), triangle(i).to_bits(), *i));
        for equal in cell.chunk_by(|a, b| bounds(a) == bounds(b)) {
            if let [only] = equal {
                self.add_one(all, *only);
                continue;
            }
            let coincident = equal.chunk_by(|a, b| triangle(a).to_bits() == triangle(b).to_bits());
            let entries: Vec<BuildTriangle> =
                coincident.map(|triangles| self.entry(all, triangles)).collect();
            let area = entries.iter().map(occluding_area).sum();
            self.add(
                entries[0].triangle.bounds().into(),
                BoxContents::Many(self.equal_boxes.len() as u32),
                area,
            );
            self.equal_boxes.push(entries);
        }
    }

    /// Makes one entry of coincident triangles.
    fn entry<I: Fn(usize) -> InputTriangle + Sync>(
        &mut self,
        all: &BuildTriangles<I>,
        coincident: &[u32],
    ) -> BuildTriangle {
        let first = all.get(coincident[0]);
        if coincident.len() == 1 {
            return first;
        }
        self.coincident_count += coincident.len() as u64 - 1;
        let triangles = coincident.iter().map(|&i| all.get(i));
        self.coincident.push(group_by_flags(triangles.map(|triangle| (triangle.index, triangle.flags))));
        BuildTriangle { index: COINCIDENT | (self.coincident.len() - 1) as u32, ..first }
    }

    /// Puts a triangle and the next one along the curve into one box where that reduces the area, and where the
    /// second would not gain more with its successor.
    fn merge_pairs(&mut self) {
        let mut next_gain = self.pair_gain(0);
        let mut from = 0;
        let mut to = 0;
        while from < self.box_contents.len() {
            let gain = next_gain;
            next_gain = self.pair_gain(from + 1);
            let mut bounds = self.boxes[from];
            let mut box_contents = self.box_contents[from];
            let mut area = self.areas[from];
            if gain > 0.0
                && gain >= next_gain
                && let (BoxContents::One(a), BoxContents::One(b)) =
                    (box_contents, self.box_contents[from + 1])
            {
                from += 1;
                bounds = bounds.union(&self.boxes[from]);
                box_contents = BoxContents::Two([a, b]);
                area += self.areas[from];
                next_gain = self.pair_gain(from + 1);
            }
            self.boxes[to] = bounds;
            self.box_contents[to] = box_contents;
            self.areas[to] = area;
            from += 1;
            to += 1;
        }
        self.boxes.truncate(to);
        self.box_contents.truncate(to);
        self.areas.truncate(to);
    }

    /// Returns by how much a box around boxes `i` and `i + 1` is smaller than [`PAIR_AREA_RATIO`] of both; 0 where
    /// either does not hold a single triangle.
    fn pair_gain(&self, i: usize) -> f32 {
        match (self.box_contents.get(i..i + 2), self.boxes.get(i..i + 2)) {
            (Some([BoxContents::One(_), BoxContents::One(_)]), Some([a, b])) => {
                PAIR_AREA_RATIO * (a.half_area() + b.half_area()) - a.union(b).half_area()
            }
            _ => 0.0,
        }
    }
}

impl Cluster for ClusterTriangles {
    type Leaves = LeafTriangles;

    fn boxes(&self) -> &[ObvhsAabb] {
        &self.boxes
    }

    fn entry_count(&self, i: u32) -> u32 {
        match self.box_contents[i as usize] {
            BoxContents::One(_) => 1,
            BoxContents::Two(_) => 2,
            BoxContents::Many(i) => self.equal_boxes[i as usize].len() as u32,
        }
    }

    fn into_leaves<'a>(self, leaves: impl Iterator<Item = &'a [u32]>) -> ClusterLeaves<LeafTriangles> {
        let ClusterTriangles { boxes, box_contents, areas, equal_boxes, coincident, coincident_count } = self;
        let mut contents = LeafTriangles {
            // Most boxes hold two triangles.
            entries: Vec::with_capacity(2 * boxes.len()),
            leaf_ends: Vec::new(),
            others: Vec::new(),
            coincident,
            coincident_count,
        };
        let mut numbers = Vec::new();
        let mut occlusion_costs = Vec::new();
        let mut end = 0;
        for leaf in leaves {
            let first_entry = contents.entries.len();
            for &i in leaf {
                match box_contents[i as usize] {
                    BoxContents::One(triangle) => contents.entries.push(triangle),
                    BoxContents::Two(triangles) => contents.entries.extend(triangles),
                    BoxContents::Many(i) => contents.add_others(&equal_boxes[i as usize]),
                }
            }
            let last_entry = contents.entries.len();
            contents.leaf_ends.push(last_entry as u32);
            let blocks = (last_entry - first_entry).div_ceil(TRIANGLE_LANES) as u32;
            numbers.push(end);
            end += blocks;
            let bounds = Aabb::union_of(leaf.iter().map(|&i| boxes[i as usize].into()));
            let area = leaf.iter().map(|&i| areas[i as usize]).sum();
            occlusion_costs.push(OcclusionCost::of_leaf(bounds, area, blocks));
        }
        ClusterLeaves { contents, numbers, end, occlusion_costs }
    }
}

/// The triangles in the leaves of a cluster.
pub(crate) struct LeafTriangles {
    /// Index of a triangle in the input, or [`COINCIDENT`] and an index of `others`.
    entries: Vec<u32>,
    /// End of each leaf's range in `entries`.
    leaf_ends: Vec<u32>,
    /// Entries that share a box.
    others: Vec<BuildTriangle>,
    pub coincident: Vec<Vec<CoincidentGroup>>,
    pub coincident_count: u64,
}

impl LeafTriangles {
    fn add_others(&mut self, entries: &[BuildTriangle]) {
        for &entry in entries {
            self.entries.push(COINCIDENT | self.others.len() as u32);
            self.others.push(entry);
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Packs the triangles of `all` into blocks. `first_coincident` is the number of sets of coincident triangles in
    /// earlier clusters.
    pub fn pack<I: Fn(usize) -> InputTriangle + Sync>(
        &self,
        all: &BuildTriangles<I>,
        first_coincident: u32,
        blocks: &mut [Triangle4],
    ) {
        let entry = |&entry: &u32| match entry & COINCIDENT {
            0 => all.get(entry),
            _ => {
                let other = self.others[(entry & !COINCIDENT) as usize];
                let index =
                    if other.index & COINCIDENT == 0 { other.index } else { other.index + first_coincident };
                BuildTriangle { index, ..other }
            }
        };
        let mut start = 0;
        let mut blocks = blocks.iter_mut();
        for &end in &self.leaf_ends {
            let leaf = &self.entries[start..end as usize];
            start = end as usize;
            for (nth, (entries, block)) in leaf.chunks(TRIANGLE_LANES).zip(&mut blocks).enumerate() {
                let mut triangles = [BuildTriangle::REJECTED; TRIANGLE_LANES];
                triangles.iter_mut().zip(entries).for_each(|(to, from)| *to = entry(from));
                let is_last = (nth + 1) * TRIANGLE_LANES >= leaf.len();
                *block = Triangle4::new(&triangles[..entries.len()], is_last);
            }
        }
    }
}

#[cfg(test)]
mod tests;
