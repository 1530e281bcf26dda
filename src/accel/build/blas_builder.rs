//! Builds a BLAS: filters the input triangles, builds the BVH over them and packs its leaves into blocks.

use crate::build::builder::{self, ClusterLeaves};
use crate::build::cluster_triangles::{ClusterTriangles, LeafTriangles};
use crate::build::input_triangles::{BuildTriangles, InputTriangle};
use crate::build::leaf_packing::LeafCapacity;
use crate::build::morton_clusters::MortonKey;
use crate::bvh::blas::Blas;
use crate::bvh::huge_pages::HugePageArray;
use crate::bvh::triangle4::Triangle4;
use crate::settings::Preset;
use blinn_core::cancellation::{CancelToken, Cancelled};

/// Builds a BLAS over the triangles `input(0..count)`. Its id map is empty.
pub(crate) fn build_blas(
    count: usize,
    input: impl Fn(usize) -> InputTriangle + Sync,
    preset: Preset,
    cancel: &CancelToken,
) -> Result<Blas, Cancelled> {
    cancel.check()?;
    let (triangles, keys, mut report) = BuildTriangles::new(count, input);
    let bounds = |i: usize| triangles.bounds(i as u32).into();
    let make_cluster = |keys: &[MortonKey]| ClusterTriangles::new(&triangles, keys);
    let (bvh, leaves) = builder::build(keys, bounds, make_cluster, LeafCapacity::BLOCKS, preset, cancel)?;
    report.coincident = leaves.iter().map(|leaves| leaves.contents.coincident_count).sum();
    let triangle_count = leaves.iter().map(|leaves| leaves.contents.len()).sum();
    // The index of each cluster's first set of coincident triangles.
    let mut next = 0;
    let with_first = |leaves: ClusterLeaves<LeafTriangles>| {
        let after = next + leaves.contents.coincident.len() as u32;
        (leaves, std::mem::replace(&mut next, after))
    };
    let mut parts: Vec<(ClusterLeaves<LeafTriangles>, u32)> = leaves.into_iter().map(with_first).collect();
    let block_count = |(leaves, _): &(ClusterLeaves<LeafTriangles>, u32)| leaves.end as usize;
    let blocks = HugePageArray::from_parts(
        &parts,
        block_count,
        |(leaves, first_coincident), blocks: &mut [Triangle4]| {
            leaves.contents.pack(&triangles, *first_coincident, blocks);
        },
    );
    let coincident =
        parts.iter_mut().flat_map(|(leaves, _)| std::mem::take(&mut leaves.contents.coincident)).collect();
    let mut blas =
        Blas { bvh, blocks, input_count: count, coincident, triangle_count, report, ..Blas::default() };
    blas.update_bounds();
    Ok(blas)
}
